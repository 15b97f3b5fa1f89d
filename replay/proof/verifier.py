"""Checks every claim of a proof against meshes and poses; trusts no number in it.

It shares no code with what made the proof, and goes other ways. Faces are placed by the formula of the reference
vertices; a contact is two faces that meet exactly; a clear frame is a walk through two trees whose every end is a
separating axis, found here, or faces asked one by one; what lies inside is told by the parity of a ray. Triangles and
rays are decided exactly for the doubles given: triangles by a float filter where it is certain, else by integers.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import product
from typing import Final

import numpy as np

from replay.proof.claims import KINDS, Flags, Floats, Kind, Mesh, Poses, Proof, Rows, WrongRecord
from replay.proof.geometry import LARGEST, SKEW, CheckedBody, inside, meeting, placed, skew

DECIDED: Final = "decided"
NOT_ASKED: Final = "refused: containment=False"
BOXES_APART: Final = b"X"
PAD: Final = 2.0**-38
"""What boxes must keep, as a share of both bodies' reach and distance from the origin together. Rounding of placed
corners, of boxes, of their axes and of the tests is below 2^-44 of that; rotations and axes of boxes that are off
orthonormal by ``SKEW`` add at most 24 times as much: together less than 2^-39."""
ITEMS: Final = 20_000
"""Boxes or faces tested at once; bounds the memory."""


def verify(proof: Proof, meshes: Sequence[Mesh], poses: Poses) -> Counter[str]:
    """How many pair-frames of each kind were proven, and by what; ``WrongRecord``: the first that is not.

    ``meshes`` and the columns of ``poses`` are of the bodies, the rows of the frames that the proof speaks of.
    """
    _check_poses(poses)
    bodies = [
        CheckedBody(name, *mesh, *(proof[f"{table}/{k}"] for table in ("faces", "nodes", "axes")))
        for k, (name, mesh) in enumerate(zip(proof.header["bodies"], meshes, strict=True))
    ]
    if not np.isin(proof["claims"][:, 0], np.arange(len(proof.header["pairs"]))).all():
        raise WrongRecord("a claim names a pair that there is not")
    pairs = (_Pair(bodies, poses, proof, number) for number in range(len(proof.header["pairs"])))
    return sum((pair.checked() for pair in pairs), Counter[str]())


def _check_poses(poses: Poses) -> None:
    """Refuse what is no rotation: a box test would not hold there."""
    turn, place = poses.rotation[poses.valid], poses.translation[poses.valid]
    with np.errstate(invalid="ignore", over="ignore"):
        wrong = ~((skew(turn) <= SKEW) & (np.abs(place).max(axis=1, initial=0.0) <= LARGEST))
    if wrong.any():
        frame, body = (int(one[wrong][0]) for one in np.nonzero(poses.valid))
        raise WrongRecord(f"frame {frame}, body {body}: the pose is no rotation and translation")


class _Pair:
    """The claims of one pair."""

    def __init__(self, bodies: Sequence[CheckedBody], poses: Poses, proof: Proof, number: int) -> None:
        *self._columns, self._word = proof.header["pairs"][number]
        self._bodies, self._poses, self._proof = [bodies[k] for k in self._columns], poses, proof
        self._name = "-".join(one.name for one in self._bodies)
        claims = proof["claims"][proof["claims"][:, 0] == number].astype(np.int64)
        self._rows = claims[np.argsort(claims[:, 1], kind="stable")]
        self._told: Counter[str] = Counter()

    def checked(self) -> Counter[str]:
        """Count what was proven."""
        rows, frames = self._rows, len(self._poses.valid)
        begins, follows = np.append(rows[:, 1], frames), np.append(0, rows[:, 2] + 1)
        if (begins != follows).any() or (rows[:, 2] < rows[:, 1]).any():
            gap = int(np.flatnonzero(begins != follows)[:1].sum())
            raise WrongRecord(f"pair {self._name}: frame {int(follows[gap])} is not claimed, or more than once")
        row = np.repeat(np.arange(len(rows)), rows[:, 2] - rows[:, 1] + 1)
        kind = rows[row, 3]
        there = self._poses.valid[:, self._columns].all(axis=1)
        self._refuse(~np.isin(kind, list(KINDS)), row, "there is no such verdict")
        self._refuse((kind == Kind.NO_POSE) & there, row, "both bodies have a pose")
        self._refuse((kind != Kind.NO_POSE) & ~there, row, "a body has no pose")
        self._check_word()
        # Frames that repeat claim and poses of the one before, to the last bit, need no check of their own.
        fresh = np.insert(row[1:] != row[:-1], 0, True)
        for values in self._poses:
            own = values[:, self._columns].reshape(frames, -1)
            fresh[1:] |= (own[1:] != own[:-1]).any(axis=1)
        for check, kinds in (
            (self._check_contacts, [Kind.CONTACT]), (self._check_fronts, [Kind.CLEAR, Kind.CONTAINED]),
            (self._check_inside, [Kind.CONTAINED]), (self._check_outside, [Kind.CLEAR]),
        ):  # fmt: skip
            frame = np.flatnonzero(fresh & np.isin(kind, kinds))
            check(row[frame], frame)
        self._told.update({KINDS[one]: count for one, count in Counter(kind.tolist()).items()})
        return self._told

    def _wrong(self, row: int, why: str) -> WrongRecord:
        _, first, last, kind = self._rows[row, :4].tolist()
        return WrongRecord(f"pair {self._name}, frames {first} to {last}, {KINDS.get(kind, kind)}: {why}")

    def _refuse(self, bad: Flags, row: Rows, why: str) -> None:
        if bad.any():
            raise self._wrong(int(row[bad].min()), why)

    def _pose(self, side: int, frame: Rows | int) -> tuple[Floats, Floats]:
        """Rotations and translations of a body in some frames."""
        return self._poses.rotation[frame, self._columns[side]], self._poses.translation[frame, self._columns[side]]

    def _check_word(self) -> None:
        """Containment is decided of closed meshes without doubled faces; of those of several parts it may not be."""
        if self._word != NOT_ASKED:
            refused = self._word.startswith("refused: ") and any(len(one.parts) > 1 for one in self._bodies)
            solid = all(one.closed and not one.doubled for one in self._bodies)
            if solid != (self._word == DECIDED) and not refused:
                raise WrongRecord(f"pair {self._name}: containment is not {self._word!r} of these meshes")

    def _check_contacts(self, row: Rows, frame: Rows) -> None:
        faces = self._rows[row][:, 5:7]
        most = [len(one.order) for one in self._bodies]
        self._refuse(np.any((faces < 0) | (faces >= most), axis=1), row, "there is no such face")
        self._refuse(self._faces_apart(frame, faces), row, "these two faces do not meet")

    def _check_fronts(self, row: Rows, frame: Rows) -> None:
        number = self._rows[row, 4]
        fronts = {k: self._walked(k, int(row[at])) for k, at in zip(*np.unique(number, return_index=True), strict=True)}
        for end, apart, why in (
            (0, self._boxes_apart, "no axis of two boxes separates them"), (1, self._faces_apart, "two faces meet"),
        ):  # fmt: skip
            pairs = [fronts[k][end] for k in number]
            counts = np.array([len(some) for some in pairs], dtype=np.int64)
            for some in np.split(np.arange(len(row)), np.flatnonzero(np.diff(np.cumsum(counts) // ITEMS)) + 1):
                if counts[some].any():
                    at = np.repeat(some, counts[some])
                    self._refuse(~apart(frame[at], np.concatenate([pairs[k] for k in some])), row[at], why)

    def _walk(self, number: int) -> bytes:
        ends = self._proof["front_ends"]
        return self._proof["fronts"][ends[number - 1] if number else 0 : ends[number]].tobytes()

    def _walked(self, number: int, row: int) -> tuple[Rows, Rows]:
        """Where a walk from both roots, named by claim ``row``, ends: nodes (k, 2) to be apart, faces (k, 2) to ask."""
        if not 0 <= number < len(self._proof["front_ends"]):
            raise self._wrong(row, "there is no such front")
        boxes, faces, todo = list[tuple[int, int]](), list[tuple[int, ...]](), [(0, 0)]
        for letter in self._walk(number):
            if not todo:
                raise self._wrong(row, "the walk goes on after its end")
            a, b = todo.pop()
            firsts, counts, children = zip(self._bodies[0].nodes[a], self._bodies[1].nodes[b], strict=True)
            side = b"ABXF".find(letter)
            if side == 2:
                boxes.append((a, b))
            elif side == 3:
                below = zip(self._bodies, firsts, counts, strict=True)
                faces += product(*(one.order[first : first + count] for one, first, count in below))
            elif side < 0 or children[side] < 0:
                raise self._wrong(row, "the walk opens what cannot be opened")
            else:
                child = children[side]
                todo += [(child, b), (child + 1, b)] if side == 0 else [(a, child), (a, child + 1)]
        if todo:
            raise self._wrong(row, "the walk leaves faces out")
        return np.reshape(boxes, (-1, 2)).astype(np.int64), np.reshape(faces, (-1, 2)).astype(np.int64)

    def _boxes_apart(self, frame: Rows, nodes: Rows) -> Flags:
        """Whether an axis or a ball keeps the boxes of two nodes apart: K frames (K,), their nodes (K, 2)."""
        self._told["boxes"] += len(frame)
        bodies, ends = self._bodies, range(2)
        turn, place = zip(*(self._pose(k, frame) for k in ends), strict=True)
        # Rows are the axes of a box in the world.
        axes = [bodies[k].axes[nodes[:, k]] @ np.swapaxes(turn[k], 1, 2) for k in ends]
        half = [bodies[k].half[nodes[:, k]][..., None] for k in ends]
        centre = [turn[k] @ bodies[k].centre[nodes[:, k]][..., None] for k in ends]
        between = (place[1] - place[0])[..., None] + (centre[1] - centre[0])
        pad = self._pad(*place)[:, None, None]
        across = np.cross(axes[0][:, :, None], axes[1][:, None]).reshape(-1, 9, 3)
        ways = np.concatenate([*axes, across], axis=1)
        reach = sum(np.abs(ways @ np.swapaxes(axes[k], 1, 2)) @ half[k] for k in ends)
        apart: Flags = (np.abs(ways @ between) > reach + pad).any(axis=(1, 2))
        for k in ends:
            # The ball around the other box lies beyond this box.
            over = np.maximum(np.abs(axes[k] @ between) - half[k], 0.0)
            apart |= np.sqrt((over**2).sum(axis=(1, 2))) > bodies[1 - k].radius[nodes[:, 1 - k]] + pad[:, 0, 0]
        return apart

    def _faces_apart(self, frame: Rows, faces: Rows) -> Flags:
        """Whether two faces (K, 2) do not meet in K frames (K,)."""
        corners = []
        for k, body in enumerate(self._bodies):
            turn, place = self._pose(k, frame)
            corners.append(placed(body.triangles[faces[:, k]], turn[:, None], place[:, None]))
        meet, exact = meeting(*corners)
        self._told.update({"face_pairs": len(frame), "by_integers": exact})
        return ~meet

    def _check_inside(self, row: Rows, frame: Rows) -> None:
        for at, now in zip(row.tolist(), frame.tolist(), strict=True):
            side, corner = self._rows[at, 5:7].tolist()
            if side not in (0, 1) or not 0 <= corner < 3 * len(self._bodies[side].order):
                raise self._wrong(at, "there is no such corner")
            point = self._bodies[side].triangles.reshape(-1, 3)[corner]
            if not self._bodies[1 - side].closed or not self._is_inside(side, point, now):
                raise self._wrong(at, "this corner is not inside")

    def _check_outside(self, row: Rows, frame: Rows) -> None:
        """No part of a body is inside the other; where the boxes of the whole bodies are apart none can be."""
        number = self._rows[row, 4]
        asked = [self._word != NOT_ASKED and self._walk(k) != BOXES_APART for k in np.unique(number).tolist()]
        open_ = np.isin(number, np.unique(number)[asked])
        row, frame = row[open_], frame[open_]
        for side, body in enumerate(self._bodies):
            for part in body.parts if self._bodies[1 - side].closed else []:
                near = self._may_be_inside(side, part, frame)
                for at, now in zip(row[near].tolist(), frame[near].tolist(), strict=True):
                    if self._is_inside(side, part[0], now):
                        raise self._wrong(at, "a part of one body is inside the other")

    def _may_be_inside(self, side: int, part: Floats, frame: Rows) -> Flags:
        """Whether the box of the other body holds all these corners of a part, in each of K frames."""
        (turn, place), (turned, there) = self._pose(side, frame), self._pose(1 - side, frame)
        other = self._bodies[1 - side]
        way = part @ np.swapaxes(turn, 1, 2) + (place - there)[:, None]
        seen = np.abs((way @ turned - other.centre[0]) @ other.axes[0].T)
        return (seen <= other.half[0] + self._pad(place, there)[:, None, None]).all(axis=(1, 2))

    def _is_inside(self, side: int, point: Floats, frame: int) -> bool:
        self._told["rays"] += 1
        surface = placed(self._bodies[1 - side].triangles, *self._pose(1 - side, frame))
        return inside(placed(point, *self._pose(side, frame)), surface)

    def _pad(self, place: Floats, there: Floats) -> Floats:
        """What boxes must keep in K frames in which the bodies are at places (K, 3) each, (K,) metres."""
        reach = sum(one.reach for one in self._bodies)
        return PAD * (reach + np.abs(place).sum(axis=1) + np.abs(there).sum(axis=1))
