"""Joins fine pieces of a body where its motion does not notice: fewer pieces, with as little false contact as can be.

A join by volume spends pieces where nothing ever comes near. Here two pieces are joined whose hull adds least false
contact on the frames of a session, and of joins that add none those that add least volume.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cdcore.bounding.hull import hull_of
from cdcore.detectors.detector_table import create_detector
from cdcore.mesh import TriangleMesh
from cdcore.numerics import BoolArray, FloatArray, IntArray
from cdcore.protocol import Body, Motion, Solids, counts_as_contact
from replay.cutting.convex_solids import facing_outward, manifold_of, volume_of
from replay.cutting.planes import cut_in_two
from replay.prepare.assembly import Assembly

MOST_FRAMES: Final = 400
"""Frames that are asked about, spread evenly over those at which the hull of the body reports false contact."""

AT_ONCE: Final = 16
"""Pieces that are asked about together: of more a search asks needlessly, of fewer each takes longer."""

MOST_PIECES: Final = 160
"""Pieces that a body is cut into at most before they are joined."""

PATIENCE: Final = 2
"""Cuts of a piece in a row that take away no false contact, after which it is cut no further."""

NEAR: Final = 1e-4
"""Metres between the boxes of two pieces that may be joined, at most."""


class FalseContacts:
    """Tells at which frames a piece of a body reports false contact with the other bodies."""

    def __init__(self, assembly: Assembly, name: str, false_contact: BoolArray) -> None:
        """``false_contact`` (T, P): where the hull of the body reports contact and there is none."""
        body = assembly.names.index(name)
        columns = np.flatnonzero((assembly.pairs == body).any(axis=1) & false_contact.any(axis=0))
        frames = np.flatnonzero(false_contact[:, columns].any(axis=1))
        if len(frames) > MOST_FRAMES:
            frames = frames[np.linspace(0, len(frames) - 1, MOST_FRAMES).round().astype(np.int64)]
        other_bodies = np.where(
            assembly.pairs[columns, 0] == body, assembly.pairs[columns, 1], assembly.pairs[columns, 0]
        )
        self._at_risk = false_contact[np.ix_(frames, columns)]
        self._body, self._others = assembly.bodies[body], [assembly.bodies[k] for k in other_bodies.tolist()]
        motion = assembly.motion
        self._numbers: IntArray = np.array([*other_bodies.tolist(), body], dtype=np.int64)
        self._times, self._translations = motion.times[frames], motion.translations[frames]
        self._rotations, self._valid = motion.rotations[frames], motion.valid[frames]

    def of(self, pieces: Sequence[TriangleMesh]) -> BoolArray:
        """Whether each piece reports false contact at each moment, (K, M)."""
        rows = [self._block(pieces[start : start + AT_ONCE]) for start in range(0, len(pieces), AT_ONCE)]
        return np.concatenate(rows) if rows else np.zeros((0, int(self._at_risk.sum())), dtype=np.bool_)

    def _block(self, pieces: Sequence[TriangleMesh]) -> BoolArray:
        count, others = len(pieces), len(self._others)
        if not others:
            return np.zeros((count, 0), dtype=np.bool_)
        columns = np.concatenate([self._numbers[:-1], np.repeat(self._numbers[-1], count)])
        bodies = [replace(body, name=f"other {k}") for k, body in enumerate(self._others)]
        bodies += [Body(f"piece {k}", piece, colliders=Solids((piece,), piece)) for k, piece in enumerate(pieces)]
        pairs = [(other, others + piece) for piece in range(count) for other in range(others)]
        motion = Motion(
            self._times,
            self._translations[:, columns],
            self._rotations[:, columns],
            self._valid[:, columns],
            copy=False,
        )
        detector = create_detector("collider", bodies, pairs=np.array(pairs), shape="shipped")
        contact = counts_as_contact(detector.detect(motion).verdict).reshape(len(self._times), count, others)
        return np.asarray(np.moveaxis(contact, 1, 0)[:, self._at_risk])


def refined_by_motion(
    pieces: Sequence[TriangleMesh], mesh: TriangleMesh, false_contacts: FalseContacts, check: Callable[[], None]
) -> list[TriangleMesh]:
    """The pieces of a closed mesh, those cut further that report false contact, the worst first.

    ``check`` is called before each cut; what it raises ends the cutting.
    """
    solid = manifold_of(facing_outward(mesh))
    if solid is None:
        return list(pieces)
    joined_pieces: list[TriangleMesh] = []
    counts = false_contacts.of(pieces).sum(axis=1).tolist()
    left = [(count, PATIENCE, piece) for count, piece in zip(counts, pieces, strict=True)]
    while left and len(joined_pieces) + len(left) < MOST_PIECES:
        check()
        worst = max(range(len(left)), key=lambda k: left[k][0])
        count, patience, piece = left.pop(worst)
        halves = cut_in_two(piece, solid) if count else []
        if not halves:
            joined_pieces.append(piece)
            continue
        touches = false_contacts.of(halves)
        patience = PATIENCE if touches.any(axis=0).sum() < count else patience - 1
        for half, row in zip(halves, touches, strict=True):
            if patience and row.any():
                left.append((int(row.sum()), patience, half))
            else:
                joined_pieces.append(half)
    return [*joined_pieces, *(piece for _, _, piece in left)]


def joined_by_motion(
    pieces: Sequence[TriangleMesh], false_contacts: FalseContacts, check: Callable[[], None]
) -> dict[int, list[TriangleMesh]]:
    """Number of pieces -> the pieces, from all of them down to as few as there can be.

    They have any number of triangles, as hulls do. ``check`` is called before each join; what it raises ends the
    joining.
    """
    joins = _Joins(pieces, false_contacts)
    levels = {len(pieces): joins.pieces}
    while joins.join_next(check):
        levels[len(joins.pieces)] = joins.pieces
    return levels


@dataclass(eq=False)
class _Join:
    """Two pieces that may become one.

    ``touches`` (M,): where their hull reports false contact, at least; once it ``was_tested``, exactly.
    """

    numbers: tuple[int, int]
    hull: TriangleMesh
    added: float
    touches: BoolArray
    was_tested: bool = False


class _Joins:
    """Pieces of a body, and the pairs of them that may be joined.

    The hull of two pieces touches what both touch. So most joins are never tested: another one adds no false contact
    and less volume.
    """

    def __init__(self, pieces: Sequence[TriangleMesh], false_contacts: FalseContacts) -> None:
        self._false_contacts = false_contacts
        self._made = [*pieces]
        self._boxes = [piece.bounds for piece in pieces]
        self._volumes = [volume_of(piece) for piece in pieces]
        self._touches = list(false_contacts.of(self._made))
        self._current = list(range(len(pieces)))
        self._joins = self._joins_of([(a, b) for k, a in enumerate(self._current) for b in self._current[k + 1 :]])

    @property
    def pieces(self) -> list[TriangleMesh]:
        """The pieces that are left."""
        return [self._made[number] for number in self._current]

    def join_next(self, check: Callable[[], None]) -> bool:
        """Join two pieces with least false contact of all pieces, of equal joins that with least volume.

        False: no two can be joined. ``check`` is called before; what it raises is raised here.
        """
        if not self._joins:
            return False
        check()
        join = self._best_join()
        first, second = join.numbers
        number = len(self._made)
        self._made.append(join.hull)
        self._boxes.append(join.hull.bounds)
        self._volumes.append(volume_of(join.hull))
        self._touches.append(join.touches)
        gone = [other for other in self._joins if set(other.numbers) & {first, second}]
        self._current = [other for other in self._current if other not in (first, second)]
        new_joins = self._joins_of([(other, number) for other in self._current])
        # The joined piece with a neighbour holds what each of both had held with it.
        for joined in new_joins:
            neighbour = joined.numbers[0]
            for other in gone:
                if neighbour in other.numbers:
                    joined.touches = joined.touches | other.touches
        self._joins = [other for other in self._joins if not set(other.numbers) & {first, second}] + new_joins
        self._current.append(number)
        return True

    def _best_join(self) -> _Join:
        """The join to be taken; joins are tested until no other one can be better."""
        touches = np.array(self._touches, dtype=np.int16)
        first, second = np.array([join.numbers for join in self._joins]).T
        other_touches = touches[self._current].sum(axis=0) - touches[first] - touches[second]
        added = np.array([join.added for join in self._joins])
        false = ((other_touches + np.array([join.touches for join in self._joins])) > 0).sum(axis=1)
        while True:
            order = np.lexsort((added, false)).tolist()
            if self._joins[order[0]].was_tested:
                return self._joins[order[0]]
            untested = [number for number in order if not self._joins[number].was_tested][:AT_ONCE]
            for number, exact in zip(untested, self._false_contact_of_joins(untested), strict=True):
                false[number] = ((other_touches[number] + exact) > 0).sum()

    def _false_contact_of_joins(self, numbers: Sequence[int]) -> BoolArray:
        """Return where the hulls of joins report false contact, (k, M); the joins keep it."""
        touches = self._false_contacts.of([self._joins[number].hull for number in numbers])
        for number, row in zip(numbers, touches, strict=True):
            self._joins[number].touches, self._joins[number].was_tested = row, True
        return touches

    def _joins_of(self, pairs: Sequence[tuple[int, int]]) -> list[_Join]:
        """The joins of those pairs of pieces that have no gap between them."""
        boxes: FloatArray = np.array(self._boxes)
        joins = []
        for a, b in pairs:
            if (boxes[a, 0] > boxes[b, 1] + NEAR).any() or (boxes[b, 0] > boxes[a, 1] + NEAR).any():
                continue
            hull = hull_of(np.concatenate([self._made[a].vertices, self._made[b].vertices]))
            if hull is not None:
                separate = self._volumes[a] + self._volumes[b]
                added = (volume_of(hull) - separate) / separate
                joins.append(_Join((a, b), hull, added, self._touches[a] | self._touches[b]))
        return joins
