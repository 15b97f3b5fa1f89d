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
from replay.cutting.convex_solids import enclosed_solid, volume_of
from replay.cutting.planes import cut_in_two
from replay.prepare.assembly import Assembly

MOST_FRAMES: Final = 400
"""Frames that are asked about, spread evenly over those at which the hull of the body reports false contact."""

PIECES_AT_ONCE: Final = 16
"""Pieces that are asked about together: of more a search asks needlessly, of fewer each takes longer."""

MOST_PIECES: Final = 160
"""Pieces that a body is cut into at most before they are joined."""

MOST_USELESS_CUTS: Final = 2
"""Cuts of a piece in a row that take away no false contact, after which it is cut no further."""

JOINABLE_GAP_M: Final = 1e-4
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
        contact_blocks = [
            self._block(pieces[start : start + PIECES_AT_ONCE]) for start in range(0, len(pieces), PIECES_AT_ONCE)
        ]
        return (
            np.concatenate(contact_blocks)
            if contact_blocks
            else np.zeros((0, int(self._at_risk.sum())), dtype=np.bool_)
        )

    def _block(self, pieces: Sequence[TriangleMesh]) -> BoolArray:
        piece_count, other_count = len(pieces), len(self._others)
        if not other_count:
            return np.zeros((piece_count, 0), dtype=np.bool_)
        columns = np.concatenate([self._numbers[:-1], np.repeat(self._numbers[-1], piece_count)])
        bodies = [replace(body, name=f"other {k}") for k, body in enumerate(self._others)]
        bodies += [Body(f"piece {k}", piece, colliders=Solids((piece,), piece)) for k, piece in enumerate(pieces)]
        pairs = [(other, other_count + piece) for piece in range(piece_count) for other in range(other_count)]
        motion = Motion(
            self._times,
            self._translations[:, columns],
            self._rotations[:, columns],
            self._valid[:, columns],
            copy=False,
        )
        detector = create_detector("collider", bodies, pairs=np.array(pairs), shape="shipped")
        contact = counts_as_contact(detector.detect(motion).verdict).reshape(len(self._times), piece_count, other_count)
        return np.asarray(np.moveaxis(contact, 1, 0)[:, self._at_risk])


def refined_by_motion(
    pieces: Sequence[TriangleMesh], mesh: TriangleMesh, false_contacts: FalseContacts, check_time: Callable[[], None]
) -> list[TriangleMesh]:
    """The pieces of a closed mesh, those cut further that report false contact, the worst first.

    ``check_time`` is called before each cut; what it raises ends the cutting.
    """
    solid = enclosed_solid(mesh)
    if solid is None:
        return list(pieces)
    joined_pieces: list[TriangleMesh] = []
    false_counts = false_contacts.of(pieces).sum(axis=1).tolist()
    waiting_pieces = [(count, MOST_USELESS_CUTS, piece) for count, piece in zip(false_counts, pieces, strict=True)]
    while waiting_pieces and len(joined_pieces) + len(waiting_pieces) < MOST_PIECES:
        check_time()
        worst = max(range(len(waiting_pieces)), key=lambda k: waiting_pieces[k][0])
        count, patience, piece = waiting_pieces.pop(worst)
        halves = cut_in_two(piece, solid) if count else []
        if not halves:
            joined_pieces.append(piece)
            continue
        touches = false_contacts.of(halves)
        patience = MOST_USELESS_CUTS if touches.any(axis=0).sum() < count else patience - 1
        for half, row in zip(halves, touches, strict=True):
            if patience and row.any():
                waiting_pieces.append((int(row.sum()), patience, half))
            else:
                joined_pieces.append(half)
    return [*joined_pieces, *(piece for _, _, piece in waiting_pieces)]


def joined_by_motion(
    pieces: Sequence[TriangleMesh], false_contacts: FalseContacts, check_time: Callable[[], None]
) -> dict[int, list[TriangleMesh]]:
    """Number of pieces -> the pieces, from all of them down to as few as there can be.

    They have any number of triangles, as hulls do. ``check_time`` is called before each join; what it raises ends the
    joining.
    """
    joins = Joins(pieces, false_contacts)
    levels = {len(pieces): joins.pieces}
    while joins.join_next(check_time):
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


class Joins:
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
        self.candidates = self._joins_of([(a, b) for k, a in enumerate(self._current) for b in self._current[k + 1 :]])

    @property
    def pieces(self) -> list[TriangleMesh]:
        """The pieces that are left."""
        return [self._made[number] for number in self._current]

    def join_next(self, check_time: Callable[[], None]) -> bool:
        """Join two pieces with least false contact of all pieces, of equal joins that with least volume.

        False: no two can be joined. ``check_time`` is called before; what it raises is raised here.
        """
        if not self.candidates:
            return False
        check_time()
        join = self.best_join()
        first, second = join.numbers
        new_number = len(self._made)
        self._made.append(join.hull)
        self._boxes.append(join.hull.bounds)
        self._volumes.append(volume_of(join.hull))
        self._touches.append(join.touches)
        replaced_joins = [other for other in self.candidates if set(other.numbers) & {first, second}]
        self._current = [other for other in self._current if other not in (first, second)]
        new_joins = self._joins_of([(other, new_number) for other in self._current])
        # The joined piece with a neighbour holds what each of both had held with it.
        for new_join in new_joins:
            neighbour = new_join.numbers[0]
            for other in replaced_joins:
                if neighbour in other.numbers:
                    new_join.touches = new_join.touches | other.touches
        self.candidates = [other for other in self.candidates if not set(other.numbers) & {first, second}] + new_joins
        self._current.append(new_number)
        return True

    def best_join(self) -> _Join:
        """The join to be taken; joins are tested until no other one can be better."""
        # What two pieces touch their hull touches too, so that they need not be left out here.
        is_touched = np.array([self._touches[number] for number in self._current]).any(axis=0)
        added_volumes = np.array([join.added for join in self.candidates])
        false_counts = (is_touched | np.array([join.touches for join in self.candidates])).sum(axis=1)
        while True:
            join_order = np.lexsort((added_volumes, false_counts)).tolist()
            if self.candidates[join_order[0]].was_tested:
                return self.candidates[join_order[0]]
            untested_numbers = [number for number in join_order if not self.candidates[number].was_tested][
                :PIECES_AT_ONCE
            ]
            for number, exact_touches in zip(
                untested_numbers, self.false_contact_of_joins(untested_numbers), strict=True
            ):
                false_counts[number] = (is_touched | exact_touches).sum()

    def false_contact_of_joins(self, numbers: Sequence[int]) -> BoolArray:
        """Return where the hulls of joins report false contact, (k, M); the joins keep it."""
        touches = self._false_contacts.of([self.candidates[number].hull for number in numbers])
        for number, row in zip(numbers, touches, strict=True):
            self.candidates[number].touches, self.candidates[number].was_tested = row, True
        return touches

    def _joins_of(self, pairs: Sequence[tuple[int, int]]) -> list[_Join]:
        """The joins of those pairs of pieces that have no gap between them."""
        boxes: FloatArray = np.array(self._boxes)
        joins = []
        for a, b in pairs:
            if (boxes[a, 0] > boxes[b, 1] + JOINABLE_GAP_M).any() or (boxes[b, 0] > boxes[a, 1] + JOINABLE_GAP_M).any():
                continue
            hull = hull_of(np.concatenate([self._made[a].vertices, self._made[b].vertices]))
            if hull is not None:
                separate_volume = self._volumes[a] + self._volumes[b]
                added_fraction = (volume_of(hull) - separate_volume) / separate_volume
                joins.append(_Join((a, b), hull, added_fraction, self._touches[a] | self._touches[b]))
        return joins
