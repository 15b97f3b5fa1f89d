"""Joins fine pieces of a body where its motion does not notice: fewer pieces, with as little false contact as can be.

A join by volume spends pieces where nothing ever comes near. Here two pieces are joined whose hull adds least false
contact on the frames of a session, and of joins that add none those that add least volume.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from cdcore.bounding.hull import hull_of
from cdcore.detectors import create_detector
from cdcore.mesh import TriangleMesh
from cdcore.numerics import BoolArray, FloatArray, IntArray
from cdcore.protocol import Body, Motion, Solids, counts_as_contact
from replay.cutting.convex_solids import manifold_of, volume_of, within_triangles
from replay.cutting.planes import cut_in_two
from replay.prepare.assembly import Assembly

MOST_FRAMES: Final = 400
"""Frames that are asked about, spread evenly over those at which the hull of the body reports false contact."""

AT_ONCE: Final = 64
"""Pieces that are asked about together."""

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
        others = np.where(assembly.pairs[columns, 0] == body, assembly.pairs[columns, 1], assembly.pairs[columns, 0])
        self._at_risk = false_contact[np.ix_(frames, columns)]
        self._body, self._others = assembly.bodies[body], [assembly.bodies[k] for k in others.tolist()]
        motion = assembly.motion
        self._numbers: IntArray = np.array([*others.tolist(), body], dtype=np.int64)
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
    solid = manifold_of(mesh)
    if solid is None:
        return list(pieces)
    done: list[TriangleMesh] = []
    counts = false_contacts.of(pieces).sum(axis=1).tolist()
    left = [(count, PATIENCE, piece) for count, piece in zip(counts, pieces, strict=True)]
    while left and len(done) + len(left) < MOST_PIECES:
        check()
        worst = max(range(len(left)), key=lambda k: left[k][0])
        count, patience, piece = left.pop(worst)
        halves = cut_in_two(piece, solid) if count else []
        if not halves:
            done.append(piece)
            continue
        touches = false_contacts.of(halves)
        patience = PATIENCE if touches.any(axis=0).sum() < count else patience - 1
        for half, row in zip(halves, touches, strict=True):
            if patience and row.any():
                left.append((int(row.sum()), patience, half))
            else:
                done.append(half)
    return [*done, *(piece for _, _, piece in left)]


def joined_by_motion(
    pieces: Sequence[TriangleMesh], false_contacts: FalseContacts, check: Callable[[], None]
) -> dict[int, list[TriangleMesh]]:
    """Number of pieces -> the pieces, from all of them down to as few as there can be.

    ``check`` is called before each join; what it raises ends the joining.
    """
    made = [*pieces]
    touches = list(false_contacts.of(made))
    levels = {len(made): [*made]}
    current = list(range(len(made)))
    joins = _joins_of(made, [(a, b) for k, a in enumerate(current) for b in current[k + 1 :]], false_contacts)
    while len(current) > 1 and joins.pairs:
        check()
        best = joins.best(touches, current)
        if best is None:
            break
        a, b = joins.pairs[best]
        made.append(joins.hulls[best])
        touches.append(joins.touches[best])
        current = [number for number in current if number not in (a, b)]
        joins = joins.without(a, b).plus(_joins_of(made, [(k, len(made) - 1) for k in current], false_contacts))
        current.append(len(made) - 1)
        levels[len(current)] = [made[number] for number in current]
    return {count: [within_triangles(piece) for piece in level] for count, level in levels.items()}


class _Joins:
    """Pairs of pieces that may be joined: their hull, the fraction of volume that it adds, its false contacts."""

    def __init__(
        self,
        pairs: Sequence[tuple[int, int]],
        hulls: Sequence[TriangleMesh],
        added: Sequence[float],
        touches: Sequence[BoolArray],
    ) -> None:
        self.pairs, self.hulls, self.added, self.touches = list(pairs), list(hulls), list(added), list(touches)

    def best(self, touches: Sequence[BoolArray], current: Sequence[int]) -> int | None:
        """The join with least false contact of all pieces, of equal ones that with least volume."""
        if not self.pairs:
            return None
        pieces = np.array(touches, dtype=np.int16)
        counts = pieces[current].sum(axis=0)
        first, second = np.array(self.pairs).T
        after = counts - pieces[first] - pieces[second] + np.array(self.touches)
        false = (after > 0).sum(axis=1)
        return int(np.lexsort((self.added, false))[0])

    def without(self, *numbers: int) -> _Joins:
        """Those of no piece of these numbers."""
        return self._kept([k for k, pair in enumerate(self.pairs) if not set(pair) & set(numbers)])

    def plus(self, other: _Joins) -> _Joins:
        """Both."""
        return _Joins(
            self.pairs + other.pairs, self.hulls + other.hulls, self.added + other.added, self.touches + other.touches
        )

    def _kept(self, rows: Sequence[int]) -> _Joins:
        return _Joins(
            [self.pairs[k] for k in rows],
            [self.hulls[k] for k in rows],
            [self.added[k] for k in rows],
            [self.touches[k] for k in rows],
        )


def _joins_of(made: Sequence[TriangleMesh], pairs: Sequence[tuple[int, int]], false_contacts: FalseContacts) -> _Joins:
    """The joins of these pairs of pieces that have no gap between them."""
    boxes: FloatArray = np.array([[piece.vertices.min(axis=0), piece.vertices.max(axis=0)] for piece in made])
    kept, hulls, added = [], [], []
    for a, b in pairs:
        if (boxes[a, 0] > boxes[b, 1] + NEAR).any() or (boxes[b, 0] > boxes[a, 1] + NEAR).any():
            continue
        hull = hull_of(np.concatenate([made[a].vertices, made[b].vertices]))
        if hull is not None:
            separate = volume_of(made[a]) + volume_of(made[b])
            kept.append((a, b))
            hulls.append(hull)
            added.append((volume_of(hull) - separate) / separate)
    return _Joins(kept, hulls, added, list(false_contacts.of(hulls)))
