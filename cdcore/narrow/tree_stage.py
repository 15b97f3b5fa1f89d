"""Asks a search of one pair about all pairs, in the same way for every kind of tree.

A search that runs to completion is complete: a pad around volumes covers rounding, and faces are decided at the
reference vertices. A search that its budget ends says what it found, and NOT_FOUND where that is nothing.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cdcore.narrow.brute_force import meeting_faces_placed
from cdcore.narrow.bvh.bounds import LARGEST_SIZE, position_pad
from cdcore.narrow.face_pair import decided_by_integers, faces_meet
from cdcore.narrow.pair_frames import Poses, ask_changed_poses, turned_faces
from cdcore.narrow.published_trees.tree_descent import PairPoses
from cdcore.narrow.published_trees.tree_search import UNLIMITED, TreeSearch
from cdcore.narrow.triangles.sums import new_digits
from cdcore.numerics import ORTHONORMAL_KEEP, UNDERFLOW_PAD, BoolArray, FloatArray, IntArray
from cdcore.protocol import Body, Motion, Verdict, ordered_by_name
from cdcore.protocol.settings import MOST_WORK, CheckedSettings, choice, flag, whole

FIRST_FRAME: Final = np.zeros(1, dtype=np.int64)
CONTACT, CLEAR = int(Verdict.CONTACT), int(Verdict.CLEAR)
MARGIN_TESTS: Final = 128
"""Tests spent on whether surfaces are apart by a margin, before they are asked without one."""
SMALLEST_MARGIN: Final = 1e-60
"""Metres: products of four lengths as small as this are still numbers; of surfaces nearer than that none is known."""
MODES: Final = ("all", "first")

SKEW: Final = 2.0 * 3.0 * ORTHONORMAL_KEEP
"""Joint Frobenius norm of R^T R - I of both bodies: a motion keeps each of nine entries within ORTHONORMAL_KEEP."""


@dataclass(frozen=True, kw_only=True)
class TreeSettings(CheckedSettings):
    """Settings of a hierarchy.

    ``mode``: "all" faces that meet, or the "first" found, which ends the search of its frame; verdicts are the same.
    ``budget``: node and leaf tests per pair and frame; ``None``: until done. Cut short, a search without a hit says
    NOT_FOUND and a set of faces may lack some.
    ``containment``: whether to ask, where surfaces do not meet, if one body is inside the other.
    """

    mode: str = choice("all", MODES)
    budget: int | None = whole(None, 1, MOST_WORK)
    containment: bool = flag(True)


@dataclass(frozen=True, eq=False)
class TreeAnswer:
    """The answer for K pair-frames; ``which`` (K,) is the row of each in ``sets``."""

    hits: BoolArray
    truncated: BoolArray
    which: IntArray
    sets: list[NDArray[np.int32]]
    work: dict[str, int]


class TreeStage:
    """Asks a search about pair-frames of its bodies.

    Each of the ``pairs`` (P, 2) is tested in the order of its names; its order here does not matter.
    """

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, search: TreeSearch, settings: TreeSettings) -> None:
        self._bodies = tuple(bodies)
        self._ordered, self._turned = ordered_by_name(bodies, pairs)
        self._ends: list[tuple[int, int]] = [(a, b) for a, b in self._ordered.tolist()]
        self._search = search
        self._budget = UNLIMITED if settings.budget is None else settings.budget
        # writable: the kernels are compiled for such arrays
        self._now = PairPoses(np.empty((1, 3, 3)), np.empty((1, 3)), np.empty((1, 3, 3)), np.empty((1, 3)), np.empty(1))
        self._reach = [_reach(body.mesh.triangles) for body in bodies]
        self._corners, self._digits = np.empty((6, 3)), new_digits()

    def decide(self, motion: Motion, frames: IntArray, columns: IntArray, *, every: bool) -> TreeAnswer:
        """Answer for K pair-frames at which both bodies have a pose, sorted by column, then frame."""
        work = dict.fromkeys((*self._search.counters, "exhaustive"), 0)

        def ask(column: int, pose_a: Poses, pose_b: Poses) -> Iterable[tuple[NDArray[np.int32], bool]]:
            a, b = self._ends[column]
            poses, large = self._poses(a, b, pose_a, pose_b)
            near = np.flatnonzero(~large)
            near_poses = PairPoses(*(part[near] for part in poses))
            searched = self._search.search(a, b, near_poses, every=every, budget=self._budget)
            searched.found[:, 0] = near[searched.found[:, 0]]
            cut = np.zeros(len(large), dtype=np.bool_)
            cut[near] = searched.truncated
            found = self._found(a, b, poses, searched.found, every)
            for k in np.flatnonzero(large).tolist():
                meeting = meeting_faces_placed(
                    self._bodies[a].mesh.triangles, (poses.turn_a[k], poses.move_a[k]),
                    self._bodies[b].mesh.triangles, (poses.turn_b[k], poses.move_b[k]),
                )  # fmt: skip
                found[k] = meeting[: None if every else 1]
            for name, count in zip(self._search.counters, searched.counts.sum(axis=0).tolist(), strict=True):
                work[name] += count
            work["exhaustive"] += int(large.sum())
            return zip([turned_faces(one) for one in found] if self._turned[column] else found, cut, strict=True)

        answers, which = ask_changed_poses(motion, self._ordered, frames, columns, ask)
        sets = [faces for faces, _ in answers]
        hits = np.array([len(faces) > 0 for faces in sets], dtype=np.bool_)[which]
        truncated = np.array([cut for _, cut in answers], dtype=np.bool_)[which]
        work |= {"tree_queries": len(answers), "reused": len(frames) - len(answers)}
        return TreeAnswer(hits, truncated & ~hits, which, sets, work)

    def decide_now(
        self, last_met: dict[int, tuple[int, int]], now: Motion, column: int, margin: float
    ) -> tuple[int, bool]:
        """CONTACT or CLEAR for one pair in a motion of one frame, without a budget.

        Also whether the surfaces are known to be more than ``margin`` apart. ``last_met``, of one session: pair -> the
        faces that met when it was last asked. In a contact that lasts they meet again, and so are asked first.
        """
        a, b = self._ends[column]
        poses = self._now
        poses.turn_a[0], poses.turn_b[0] = now.rotations[0, a], now.rotations[0, b]
        poses.move_a[0], poses.move_b[0] = now.translations[0, a], now.translations[0, b]
        away = math.hypot(*poses.move_a[0].tolist()) + math.hypot(*poses.move_b[0].tolist())
        size = self._reach[a] + self._reach[b] + away
        if not size <= LARGEST_SIZE:
            hit = self.decide(now, FIRST_FRAME, np.array([column]), every=False).hits[0]
            return (CONTACT if hit else CLEAR), False
        corners, met = (self._bodies[a].mesh.triangles, self._bodies[b].mesh.triangles), last_met.pop(column, None)
        if met is not None and self._meet_again(corners, met):
            last_met[column] = met
            return CONTACT, False
        tight = position_pad(size, SKEW) + UNDERFLOW_PAD
        # With a margin some hundred tests only: where surfaces are near each other, most faces lie within it.
        tried = margin > SMALLEST_MARGIN and met is None
        reaches = ((margin, MARGIN_TESTS), (0.0, UNLIMITED)) if tried else ((0.0, UNLIMITED),)
        for extra, budget in reaches:
            poses.pad[0] = tight + extra
            found, counts, truncated = self._search.search(a, b, poses, every=False, budget=budget)
            meeting = self._decided(a, b, poses, found) if len(found) else found
            if len(meeting):
                last_met[column] = meeting[0, 1], meeting[0, 2]
                return CONTACT, False
            if not truncated[0]:
                break
        return CLEAR, bool(extra > 0.0 and counts[0, self._search.undismissed] == 0)

    def _meet_again(self, corners: tuple[FloatArray, FloatArray], faces: tuple[int, int]) -> bool:
        """Whether two faces meet in the pose of now; False too where only integers can tell."""
        now = self._now
        answer = faces_meet(
            corners[0], faces[0], now.turn_a[0], now.move_a[0], corners[1], faces[1], now.turn_b[0], now.move_b[0],
            self._corners, self._digits,
        )  # fmt: skip
        return answer == 1

    def _poses(self, a: int, b: int, pose_a: Poses, pose_b: Poses) -> tuple[PairPoses, BoolArray]:
        """The poses to ask about, and which of them lie so far out that the pads no longer hold."""
        (turn_a, move_a), (turn_b, move_b) = pose_a, pose_b
        with np.errstate(over="ignore"):
            size = self._reach[a] + self._reach[b] + np.linalg.norm(move_a, axis=1) + np.linalg.norm(move_b, axis=1)
        large = ~(size <= LARGEST_SIZE)
        pad = position_pad(1.0, SKEW) * np.where(large, 0.0, size) + UNDERFLOW_PAD
        return PairPoses(turn_a, move_a, turn_b, move_b, pad), large

    def _decided(self, a: int, b: int, poses: PairPoses, found: IntArray) -> IntArray:
        corners = self._bodies[a].mesh.triangles, self._bodies[b].mesh.triangles
        return decided_by_integers(found, corners, (poses.turn_a, poses.turn_b), (poses.move_a, poses.move_b))

    def _found(self, a: int, b: int, poses: PairPoses, found: IntArray, every: bool) -> list[NDArray[np.int32]]:
        """Per pose the faces that meet, (k, 2), sorted."""
        found = self._decided(a, b, poses, found)
        order = np.lexsort((found[:, 2], found[:, 1], found[:, 0]))
        if not every:
            _, order = np.unique(found[:, 0], return_index=True)
        bounds = np.searchsorted(found[order, 0], np.arange(len(poses.pad) + 1)).tolist()
        faces = found[order, 1:3].astype(np.int32)
        return [faces[start:stop] for start, stop in pairwise(bounds)]


def _reach(triangles: FloatArray) -> float:
    """Largest distance of a corner from the body's origin; infinite where its square overflows."""
    with np.errstate(over="ignore"):
        return float(np.sqrt((triangles * triangles).sum(axis=-1).max()))
