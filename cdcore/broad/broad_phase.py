"""Spheres, then boxes if asked: the pair-frames that they let through may meet, all others are clear."""

from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from cdcore.bounding.bounding_sphere import sphere_best
from cdcore.bounding.box import box_best
from cdcore.broad.box_stage import BoxStage
from cdcore.broad.sphere_stage import CLEAR, NO_POSE, SphereStage
from cdcore.numerics import BoolArray, ByteArray, IntArray, true_indices
from cdcore.protocol import Body, Motion, Verdict, pair_has_pose


@dataclass(frozen=True, eq=False)
class BroadAnswer:
    """Answer of volumes: ``frames`` and ``columns`` (K,) of the pair-frames that may meet, by pair, then frame."""

    verdict: ByteArray
    """(T, P) CLEAR or NO_POSE; the caller writes its answers about the pair-frames into it."""
    frames: IntArray
    columns: IntArray
    work: dict[str, int]
    """Counters of sphere and box tests."""
    clock: list[float]
    """Seconds of the performance counter at the start, after the spheres and, if they are asked, after the boxes."""


class BroadPhase:
    """The volumes of all bodies; ``boxes``: False: whole motions are asked about spheres only."""

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, *, boxes: bool = True) -> None:
        self.spheres = SphereStage([sphere_best(body.mesh) for body in bodies], pairs)
        self.boxes = BoxStage([box_best(body.mesh) for body in bodies], pairs)
        self._asks_boxes, self._pairs = boxes, pairs

    def candidates(self, motion: Motion) -> BroadAnswer:
        """Answer for every frame and pair of the motion."""
        clock = [perf_counter()]
        verdict, tests = self.spheres.candidates(motion)
        frames, columns = true_indices(verdict == Verdict.CANDIDATE)
        clock.append(perf_counter())
        work = {"sphere_tests": tests}
        verdict[frames, columns] = Verdict.CLEAR
        if self._asks_boxes:
            work["box_tests"] = len(frames)
            meet = self.boxes.may_meet(motion, frames, columns)
            frames, columns = frames[meet], columns[meet]
            clock.append(perf_counter())
        return BroadAnswer(verdict, frames, columns, work, clock)

    def everywhere(self, motion: Motion) -> BroadAnswer:
        """Candidates as if all volumes overlapped: every pair-frame with poses."""
        start, has_pose = perf_counter(), pair_has_pose(motion, self._pairs)
        frames, columns = true_indices(has_pose)
        verdict = np.where(has_pose, CLEAR, NO_POSE)
        return BroadAnswer(verdict, frames, columns, {}, [start, perf_counter()])

    def volumes_meet(self, motion: Motion, frame: int, pair: int) -> tuple[bool | None, bool | None]:
        """Whether the spheres of a pair overlap in one frame, and whether its boxes do; ``None``: not tested there."""
        now = motion.frames(frame, frame + 1)
        verdict, _ = self.spheres.candidates(now)
        if verdict[0, pair] == Verdict.NO_POSE:
            return None, None
        spheres_meet = bool(verdict[0, pair] == Verdict.CANDIDATE)
        if not (spheres_meet and self._asks_boxes):
            return spheres_meet, None
        return True, bool(self.boxes.may_meet(now, np.array([0]), np.array([pair]))[0])

    def by_stage(self, motion: Motion) -> tuple[BoolArray, BoolArray]:
        """(T, P) twice: where the spheres overlap, and where the boxes do too."""
        spheres, both = self.spheres.candidates(motion)[0] == Verdict.CANDIDATE, self.candidates(motion)
        boxes = np.zeros_like(spheres)
        boxes[both.frames, both.columns] = True
        return spheres, boxes
