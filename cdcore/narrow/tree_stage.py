"""Asks a search of one pair about all pairs, in the same way for every kind of tree.

A search that runs to completion is complete: a pad around volumes covers rounding, and faces are decided at the
reference vertices. A search that its budget ends says what it found, and NOT_FOUND where that is nothing.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cdcore.mesh import once_for_meshes
from cdcore.narrow.brute_force import meeting_faces_placed
from cdcore.narrow.bvh.bounds import LARGEST_SIZE, position_pad
from cdcore.narrow.descent import WIDTH
from cdcore.narrow.pair_frames import Poses, ask_changed_poses, swapped_faces
from cdcore.narrow.published_trees.tree_search import CUT_SHORT, PairPoses, search_rows
from cdcore.narrow.tree_kinds import TREE_KINDS
from cdcore.numerics import BoolArray, ByteArray, FloatArray, IntArray, readonly
from cdcore.poses.kernels import place_face
from cdcore.protocol import Body, Motion, Verdict, ordered_by_name
from cdcore.protocol.settings import MOST_WORK, CheckedSettings, choice, flag, whole
from cdcore.tolerances import ORTHONORMAL_KEEP, UNDERFLOW_PAD
from cdcore.triangles.decide import UNDECIDED, answer_pairs, new_digits

FIRST_FRAME: Final = np.zeros(1, dtype=np.int64)
CONTACT, CLEAR = int(Verdict.CONTACT), int(Verdict.CLEAR)
MARGIN_TESTS: Final = 128
"""Tests spent on whether surfaces are apart by a margin, before they are asked without one."""
SMALLEST_MARGIN: Final = 1e-60
"""Metres: products of four lengths as small as this are still numbers; of surfaces nearer than that none is known."""
UNLIMITED: Final = int(np.iinfo(np.int64).max)
"""The budget of a search that runs to completion."""
MODES: Final = ("all", "first")
TREES_OF: Final = {name: once_for_meshes(kind.trees) for name, kind in TREE_KINDS.items() if kind.search}
"""Detector -> the trees of meshes, and their depths; kept as long as the meshes, for all settings of a detector."""

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
    """Asks trees of one kind, a row of ``TREE_KINDS``, about pair-frames of its bodies.

    Each of the ``pairs`` (P, 2) is tested in the order of its names; its order here does not matter.
    """

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, kind: str, settings: TreeSettings) -> None:
        self._kind = TREE_KINDS[kind]
        assert self._kind.search is not None, f"{kind} is searched by cdcore.narrow.bvh"
        self._traversal = self._kind.search
        self._counters = ("node_tests", "leaf_tests", *self._kind.more_counters)
        self._corners = [body.mesh.triangles for body in bodies]
        self.trees, depths = zip(*TREES_OF[kind]([body.mesh for body in bodies]), strict=True)
        self._ordered, self._swapped = ordered_by_name(bodies, pairs)
        self._ends: list[tuple[int, int]] = [(a, b) for a, b in self._ordered.tolist()]
        self._budget = UNLIMITED if settings.budget is None else settings.budget
        # writable: the kernels are compiled for such arrays
        self._now = PairPoses(np.empty((1, 3, 3)), np.empty((1, 3)), np.empty((1, 3, 3)), np.empty((1, 3)), np.empty(1))
        self._reach = [_reach(corners) for corners in self._corners]
        # A step takes one pair from the stack and puts two, or four where both boxes are opened at once.
        self._stack = np.empty(WIDTH * (3 * max(depths) + 4), dtype=np.int64)
        self._pair, self._pair_answer, self._digits = np.empty(18), np.empty(1, dtype=np.uint8), new_digits()
        self._pair_to_decide = readonly(self._pair.reshape(1, 2, 3, 3))

    def decide(self, motion: Motion, frames: IntArray, columns: IntArray, *, every: bool) -> TreeAnswer:
        """Answer for K pair-frames at which both bodies have a pose, sorted by column, then frame."""
        work = dict.fromkeys((*self._counters, "exhaustive"), 0)

        def ask(column: int, pose_a: Poses, pose_b: Poses) -> Iterable[tuple[NDArray[np.int32], bool]]:
            a, b = self._ends[column]
            poses = self._poses(a, b, pose_a, pose_b)
            pair_rows, counts, ended = self.search(a, b, poses, every=every, budget=self._budget)
            order = np.lexsort((pair_rows[:, 2], pair_rows[:, 1], pair_rows[:, 0]))
            if not every:
                _, order = np.unique(pair_rows[:, 0], return_index=True)
            bounds = np.searchsorted(pair_rows[order, 0], np.arange(1, len(ended)))
            sets = np.split(pair_rows[order, 1:].astype(np.int32), bounds)
            left = np.flatnonzero(ended == UNDECIDED).tolist()
            for k in left:
                first, second = ((rotations[k], moves[k]) for rotations, moves in (pose_a, pose_b))
                meeting = meeting_faces_placed(self._corners[a], first, self._corners[b], second)
                sets[k] = meeting[: None if every else 1]
            for name, count in zip((*work,), (*counts.sum(axis=0).tolist(), len(left)), strict=True):
                work[name] += count
            return zip(map(swapped_faces, sets) if self._swapped[column] else sets, ended == CUT_SHORT, strict=True)

        answers, which = ask_changed_poses(motion, self._ordered, frames, columns, ask)
        sets = [faces for faces, _ in answers]
        hits = np.array([len(faces) > 0 for faces in sets], dtype=np.bool_)[which]
        truncated = np.array([cut for _, cut in answers], dtype=np.bool_)[which]
        work |= {"tree_queries": len(answers), "reused": len(frames) - len(answers)}
        return TreeAnswer(hits, truncated & ~hits, which, sets, work)

    def search(
        self, a: int, b: int, poses: PairPoses, *, every: bool, budget: int
    ) -> tuple[IntArray, IntArray, ByteArray]:
        """Look for faces of two bodies that meet in K poses: ``every`` one, or the first; at most ``budget`` tests.

        Returns ``pair_rows`` (M, 3) row, face of A, face of B, in order of discovery; ``counts`` (K, C) of each row,
        node and leaf tests first; and ``ended`` (K,): 0 where done, CUT_SHORT, or UNDECIDED: ask every pair of faces.
        """
        counts = np.zeros((len(poses.pad), len(self._counters)), dtype=np.int64)
        ended = np.zeros(len(poses.pad), dtype=np.uint8)
        pair_rows = search_rows(
            self._traversal,
            self.trees[a],
            self.trees[b],
            poses,
            every,
            budget,
            self._stack,
            self._digits,
            counts,
            ended,
        )
        return pair_rows, counts, ended

    def decide_now(
        self, last_met: dict[int, tuple[int, int]], now: Motion, column: int, margin: float
    ) -> tuple[int, bool]:
        """CONTACT or CLEAR for one pair in a motion of one frame, without a budget.

        Also whether the surfaces are known to be more than ``margin`` apart. ``last_met``, of one session: pair -> the
        faces that met when it was last asked. In a contact that lasts they meet again, and so are asked first.
        """
        a, b = self._ends[column]
        poses = self._now
        poses.rotation_a[0], poses.rotation_b[0] = now.rotations[0, a], now.rotations[0, b]
        poses.move_a[0], poses.move_b[0] = now.translations[0, a], now.translations[0, b]
        away = math.hypot(*poses.move_a[0].tolist()) + math.hypot(*poses.move_b[0].tolist())
        size = self._reach[a] + self._reach[b] + away
        if not size <= LARGEST_SIZE:
            return self._exhaustive(now, column), False
        met = last_met.pop(column, None)
        if met is not None and self._meet_again(a, b, met):
            last_met[column] = met
            return CONTACT, False
        tight = position_pad(size, SKEW) + UNDERFLOW_PAD
        # With a margin some hundred tests only: where surfaces are near each other, most faces lie within it.
        tried = margin > SMALLEST_MARGIN and met is None
        reaches = ((margin, MARGIN_TESTS), (0.0, UNLIMITED)) if tried else ((0.0, UNLIMITED),)
        for extra, budget in reaches:
            poses.pad[0] = tight + extra
            pair_rows, counts, ended = self.search(a, b, poses, every=False, budget=budget)
            if ended[0] == UNDECIDED:
                return self._exhaustive(now, column), False
            if len(pair_rows):
                last_met[column] = pair_rows[0, 1], pair_rows[0, 2]
                return CONTACT, False
            if not ended[0]:
                break
        return CLEAR, bool(extra > 0.0 and counts[0, self._kind.undismissed] == 0)

    def _exhaustive(self, now: Motion, column: int) -> int:
        return CONTACT if self.decide(now, FIRST_FRAME, np.array([column]), every=False).hits[0] else CLEAR

    def _meet_again(self, a: int, b: int, faces: tuple[int, int]) -> bool:
        """Whether two faces meet in the pose of now; False too where only integers can tell."""
        now, pair = self._now, self._pair
        place_face(self._corners[a], faces[0], now.rotation_a[0], now.move_a[0], pair, 0)
        place_face(self._corners[b], faces[1], now.rotation_b[0], now.move_b[0], pair, 9)
        # Not the leaf test of hierarchies: compiled once more, it takes two seconds of a first live look (2026-11).
        answer_pairs(self._pair_to_decide, self._pair_answer, False, self._digits)
        return bool(self._pair_answer[0] == 1)

    def _poses(self, a: int, b: int, pose_a: Poses, pose_b: Poses) -> PairPoses:
        """The poses to ask about; the pad is infinite where they lie so far out that it no longer holds."""
        (rotation_a, move_a), (rotation_b, move_b) = pose_a, pose_b
        with np.errstate(over="ignore"):
            size = self._reach[a] + self._reach[b] + np.linalg.norm(move_a, axis=1) + np.linalg.norm(move_b, axis=1)
        size[~(size <= LARGEST_SIZE)] = np.inf
        return PairPoses(rotation_a, move_a, rotation_b, move_b, position_pad(1.0, SKEW) * size + UNDERFLOW_PAD)


def _reach(triangles: FloatArray) -> float:
    """Largest distance of a corner from the body's origin; infinite where its square overflows."""
    with np.errstate(over="ignore"):
        return float(np.sqrt((triangles * triangles).sum(axis=-1).max()))
