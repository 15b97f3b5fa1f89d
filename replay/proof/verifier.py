"""Checks every claim of a proof against meshes and poses; trusts no number in it.

It shares no code with what made the proof. Faces are placed by the formula of the reference vertices; a contact is two
faces that meet exactly; a clear frame is a walk through two trees whose every end is a separating axis, found here, or
faces asked one by one; what lies inside is told by the parity of a ray.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from replay.proof.bodies import PAD, CheckedBody, Poses
from replay.proof.boxes import Rows, Two, apart, faces_apart, faces_meet
from replay.proof.claims import CLEAR, CONTACT, CONTAINED, KINDS, NO_POSE, Proof, WrongRecord
from replay.proof.exact import Floats, inside, placed

DECIDED: Final = "decided"
NOT_ASKED: Final = "refused: containment=False"
BOXES_APART: Final = b"X"


class Mesh(NamedTuple):
    """Vertices (v, 3) and faces (f, 3) of a body."""

    vertices: Floats
    faces: NDArray[Any]


class Front(NamedTuple):
    """The ends of one walk: nodes (k, 2) whose boxes are to be apart, and whose faces are to be asked."""

    boxes: Rows
    faces: Rows
    whole: bool


def verify(proof: Proof, meshes: Sequence[Mesh], poses: Poses) -> Counter[str]:
    """How many pair-frames of each kind were proven, and by what; ``WrongRecord``: the first that is not.

    ``meshes`` and the columns of ``poses`` are of the bodies, the rows of the frames that the proof speaks of.
    """
    poses.check()
    bodies = [
        CheckedBody(name, *mesh, *(proof[f"{table}/{k}"] for table in ("faces", "nodes", "axes")))
        for k, (name, mesh) in enumerate(zip(proof.header["bodies"], meshes, strict=True))
    ]
    pairs, claims = proof.header["pairs"], proof["claims"].astype(np.int64)
    if not np.isin(claims[:, 0], np.arange(len(pairs))).all():
        raise WrongRecord("a claim names a pair that there is not")
    told: Counter[str] = Counter()
    for number, (i, j, word) in enumerate(pairs):
        two = Two((bodies[i], bodies[j]), (i, j), poses)
        told += _Pair(two, proof, claims[claims[:, 0] == number], word).checked()
    return told


def verdicts(proof: Proof, frames: int) -> NDArray[np.uint8]:
    """The verdict of every pair in every frame, (T, P), of a proof that was verified."""
    table = np.zeros((frames, len(proof.header["pairs"])), dtype=np.uint8)
    for pair, first, last, kind in proof["claims"][:, :4].tolist():
        table[first : last + 1, pair] = kind
    return table


class _Pair:
    """The claims of one pair."""

    def __init__(self, two: Two, proof: Proof, claims: Rows, word: str) -> None:
        self._two, self._proof, self._word = two, proof, word
        self._name = "-".join(one.name for one in two.bodies)
        self._rows = claims[np.argsort(claims[:, 1], kind="stable")]
        self._told: Counter[str] = Counter()

    def checked(self) -> Counter[str]:
        """Count what was proven."""
        rows = self._rows
        frames = len(self._two.poses.valid)
        follows = np.concatenate([[0], rows[:, 2] + 1])
        if (rows[:, 1] != follows[:-1]).any() or follows[-1] != frames or (rows[:, 2] < rows[:, 1]).any():
            gap = int(np.flatnonzero(np.concatenate([rows[:, 1], [frames]]) != follows)[:1].sum())
            raise WrongRecord(f"pair {self._name}: frame {int(follows[gap])} is not claimed, or more than once")
        length = rows[:, 2] - rows[:, 1] + 1
        row = np.repeat(np.arange(len(rows)), length)
        kind = rows[row, 3]
        self._check_kinds(kind, row)
        if self._word != NOT_ASKED:
            self._check_word()
        fresh = np.flatnonzero(self._fresh(row))
        self._check_contacts(row[fresh], fresh)
        self._check_fronts(row[fresh], fresh)
        self._check_insides(row[fresh], fresh)
        self._told.update({KINDS[one]: count for one, count in Counter(kind.tolist()).items()})
        return self._told

    def _fresh(self, row: Rows) -> NDArray[np.bool_]:
        """The frames (T,) that do not repeat claim and poses of the one before, to the last bit."""
        fresh = np.ones(len(row), dtype=np.bool_)
        fresh[1:] = row[1:] != row[:-1]
        for values in self._two.poses:
            own = values[:, list(self._two.columns)].reshape(len(row), -1)
            fresh[1:] |= (own[1:] != own[:-1]).any(axis=1)
        return fresh

    def _wrong(self, row: int, why: str) -> WrongRecord:
        _, first, last, kind = self._rows[row, :4].tolist()
        return WrongRecord(f"pair {self._name}, frames {first} to {last}, {KINDS.get(kind, kind)}: {why}")

    def _refuse(self, bad: NDArray[np.bool_], row: Rows, why: str) -> None:
        if bad.any():
            raise self._wrong(int(row[bad].min()), why)

    def _check_kinds(self, kind: Rows, row: Rows) -> None:
        self._refuse(~np.isin(kind, list(KINDS)), row, "there is no such verdict")
        there = self._two.poses.valid[:, list(self._two.columns)].all(axis=1)
        self._refuse((kind == NO_POSE) & there, row, "both bodies have a pose")
        self._refuse((kind != NO_POSE) & ~there, row, "a body has no pose")

    def _check_word(self) -> None:
        """Containment is decided of closed meshes without doubled faces; of those of several parts it may not be."""
        bodies = self._two.bodies
        refused = self._word.startswith("refused: ") and any(len(one.parts) > 1 for one in bodies)
        if any(not one.closed or one.doubled for one in bodies) == (self._word == DECIDED) and not refused:
            raise WrongRecord(f"pair {self._name}: containment is not {self._word!r} of these meshes")

    def _check_contacts(self, row: Rows, frame: Rows) -> None:
        here = self._rows[row, 3] == CONTACT
        row, frame = row[here], frame[here]
        faces = self._rows[row][:, 5:7]
        most = [len(one.order) for one in self._two.bodies]
        self._refuse(np.any((faces < 0) | (faces >= most), axis=1), row, "there is no such face")
        meet, exact = faces_meet(self._two, frame, faces[:, 0], faces[:, 1])
        self._refuse(~meet, row, "these two faces do not meet")
        self._told.update({"face_pairs": len(frame), "by_integers": exact})

    def _check_fronts(self, row: Rows, frame: Rows) -> None:
        here = np.isin(self._rows[row, 3], (CLEAR, CONTAINED))
        row, frame = row[here], frame[here]
        number = self._rows[row, 4]
        fronts = {k: self._walked(k, row[number == k]) for k in np.unique(number).tolist()}
        for nodes, check in (
            ([fronts[k].boxes for k in number.tolist()], self._check_boxes),
            ([fronts[k].faces for k in number.tolist()], self._check_faces),
        ):
            counts = np.array([len(some) for some in nodes], dtype=np.int64)
            if counts.sum():
                check(np.repeat(row, counts), np.repeat(frame, counts), np.concatenate(nodes))
        self._apart = {k for k, front in fronts.items() if front.whole}

    def _check_boxes(self, row: Rows, frame: Rows, nodes: Rows) -> None:
        self._refuse(~apart(self._two, frame, nodes), row, "no axis of two boxes separates them")
        self._told["boxes"] += len(row)

    def _check_faces(self, row: Rows, frame: Rows, nodes: Rows) -> None:
        clear, asked, exact = faces_apart(self._two, frame, nodes)
        self._refuse(~clear, row, "two faces meet")
        self._told.update({"face_pairs": asked, "by_integers": exact})

    def _walked(self, number: int, row: Rows) -> Front:
        """The ends of a walk; it begins at both roots and leaves nothing out."""
        ends = self._proof["front_ends"]
        if not 0 <= number < len(ends):
            raise self._wrong(int(row.min()), "there is no such front")
        walk = self._proof["fronts"][ends[number - 1] if number else 0 : ends[number]].tobytes()
        children = [one.nodes[:, 2] for one in self._two.bodies]
        found: dict[int, list[tuple[int, int]]] = {ord("X"): [], ord("F"): []}
        todo = [(0, 0)]
        for letter in walk:
            if not todo:
                raise self._wrong(int(row.min()), "the walk goes on after its end")
            a, b = todo.pop()
            if letter in found:
                found[letter].append((a, b))
                continue
            side = b"AB".find(letter)
            child = int(children[side][(a, b)[side]]) if side >= 0 else -1
            if child < 0:
                raise self._wrong(int(row.min()), "the walk opens what cannot be opened")
            todo += [(child, b), (child + 1, b)] if side == 0 else [(a, child), (a, child + 1)]
        if todo:
            raise self._wrong(int(row.min()), "the walk leaves faces out")
        boxes, faces = (np.array(some, dtype=np.int64).reshape(-1, 2) for some in found.values())
        return Front(boxes, faces, walk == BOXES_APART)

    def _check_insides(self, row: Rows, frame: Rows) -> None:
        kind, front = self._rows[row, 3], self._rows[row, 4]
        for at in np.flatnonzero(kind == CONTAINED).tolist():
            side, corner = self._rows[row[at], 5:7].tolist()
            if side not in (0, 1) or not 0 <= corner < 3 * len(self._two.bodies[side].order):
                raise self._wrong(int(row[at]), "there is no such corner")
            point = self._two.bodies[side].triangles.reshape(-1, 3)[corner]
            if not self._two.bodies[1 - side].closed or not self._is_inside(side, point, int(frame[at])):
                raise self._wrong(int(row[at]), "this corner is not inside")
        asked = np.flatnonzero((kind == CLEAR) & ~np.isin(front, list(self._apart)))
        asked = asked[: 0 if self._word == NOT_ASKED else None]
        a, b = self._two.bodies
        for side, part in [(0, part) for part in a.parts if b.closed] + [(1, part) for part in b.parts if a.closed]:
            for at in asked[self._may_be_inside(side, part, frame[asked])].tolist():
                if self._is_inside(side, part[0], int(frame[at])):
                    raise self._wrong(int(row[at]), "a part of one body is inside the other")

    def _may_be_inside(self, side: int, part: Floats, frame: Rows) -> NDArray[np.bool_]:
        """Whether the box of the other body holds all these corners of a part, in each of K frames."""
        poses, (inner, outer) = self._two.poses, (self._two.columns[side], self._two.columns[1 - side])
        body, other = self._two.bodies[side], self._two.bodies[1 - side]
        turn, place = poses.rotation[frame, inner], poses.translation[frame, inner]
        way = part @ np.swapaxes(turn, 1, 2) + (place - poses.translation[frame, outer])[:, None]
        seen = np.abs((way @ poses.rotation[frame, outer] - other.centre[0]) @ other.axes[0].T)
        far = np.abs(place).sum(axis=1) + np.abs(poses.translation[frame, outer]).sum(axis=1)
        most = other.half[0] + (PAD * (body.reach + other.reach + far))[:, None, None]
        return (seen <= most).all(axis=(1, 2))

    def _is_inside(self, side: int, point: Floats, frame: int) -> bool:
        inner, outer, poses = self._two.columns[side], self._two.columns[1 - side], self._two.poses
        self._told["rays"] += 1
        world = placed(point, poses.rotation[frame, inner], poses.translation[frame, inner])
        return inside(world, self._two.bodies[1 - side].world(poses, outer, frame))
