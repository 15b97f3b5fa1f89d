"""Between the frames: misses no contact on the way from one recorded pose to the next. CLEAR is always proven."""

from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Final, NamedTuple

import numpy as np

from cdcore.bounding.bounding_sphere import sphere_best
from cdcore.containment.containment_stage import ContainmentStage
from cdcore.containment.hole_passages import HolePassages
from cdcore.impact import ImpactSettings
from cdcore.narrow.bvh.box_tree import box_trees_of
from cdcore.narrow.bvh.whole_motion import MotionAnswer, decide_motion
from cdcore.narrow.continuous.interval_search import FREE, HIT
from cdcore.narrow.continuous.segment_stage import SegmentStage
from cdcore.narrow.continuous.swept import SweptSpheres
from cdcore.numerics import BoolArray, ByteArray, IntArray, true_indices
from cdcore.protocol import (
    Body,
    Detection,
    Motion,
    PairDetector,
    Verdict,
    ordered_by_name,
    pair_has_pose,
)
from cdcore.protocol.settings import flag

LOST_BEFORE: Final = "no pose in the frame before"
GAP_BEFORE: Final = "gap in the track before this frame: the way here is not known"


class _Answers(NamedTuple):
    """Answers about T intervals and P pairs, which each stage completes."""

    verdict: ByteArray
    """(T, P)."""
    reasons: dict[tuple[int, int], str]
    """Why (frame, pair) is undecided."""
    toi: dict[tuple[int, int], tuple[float, float]]
    """Seconds between which the contact of (frame, pair) begins."""


@dataclass(frozen=True, kw_only=True)
class ContinuousSettings(ImpactSettings):
    """Settings of ``continuous``.

    ``tolerance``: metres; what comes no closer than this is always decided, nearer things almost always.
    ``effort``: most tests spent on one interval of what is nearer.
    ``containment``: whether to ask, where surfaces do not meet, if one body is inside the other.
    """

    containment: bool = flag(True)


class ContinuousDetector(PairDetector[ContinuousSettings]):
    """Follows faces from frame to frame: row t is the interval before frame t, clear by proof or in contact since when.

    Row t of its answer is the closed interval from frame t-1 to t; row 0 is the pose itself.
    CONTACT: the surfaces meet at either end or between, seen exactly on triangles. ``toi`` holds, for every contact
    that begins in the interval, seconds (lower, upper): proven clear before ``lower``, in contact at ``upper``, at most
    1e-6 s apart; further only where the bodies graze or creep nearer than rounding can tell, which far from the origin
    is more. A contact that the interval starts in has no entry. CLEAR and CONTAINED: proven for the whole way.
    UNRESOLVED: neither, with a reason in ``reasons``; so too where holes leave open what is inside at either end, or a
    body passes through a hole on the way without contact. Where a pose is missing before a frame, or the track has a
    gap or a teleport, there is no way to speak of: CONTACT if the frame's own poses meet, else NO_POSE with the reason.

    Between frames body origins move along lines and rotations turn at a constant rate along the shorter arc. It says in
    which interval and when, not in which faces; ask ``exact`` for those of a frame and ``time_of_impact`` for one
    interval.

    Source: section 2.1 of the project's specification. Cost: ``exact``, and 1 to 30 microseconds for each interval in
    which bounding spheres meet and no contact is known.
    """

    name = "continuous"
    sources = (
        "S. Redon, A. Kheddar, S. Coquillart, Fast continuous collision detection between rigid bodies, Computer "
        "Graphics Forum 21(3), 2002",
    )
    choose_when = "hands move fast among thin glass, which every test at frames can miss"
    cannot = "look across lost poses and gaps, or list faces"
    stages = ("frames", "between", "containment")
    Settings = ContinuousSettings

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, settings: ContinuousSettings) -> None:
        super().__init__(bodies, pairs, settings)
        self._trees = box_trees_of([body.mesh for body in bodies])
        self._spheres = SweptSpheres([sphere_best(body.mesh) for body in bodies])
        ordered, _ = ordered_by_name(bodies, pairs)
        tolerance, effort = settings.tolerance, settings.effort
        self._segments = SegmentStage(self._trees, ordered, tolerance=tolerance, effort=effort)
        self._containment = ContainmentStage(bodies, pairs, enabled=settings.containment)
        self._passages = HolePassages(self._containment, ordered, tolerance=tolerance, effort=effort)

    def _fresh_memory(self) -> list[Motion]:
        return []

    def _run(self, motion: Motion, memory: list[Motion], _faces: bool) -> Detection:
        """Detect from the last frame of the block before on, which is the memory, and leave out that row."""
        block, first = motion, len(memory)
        if memory:
            motion = _joined_motion(memory[0], block)
        if len(block):
            memory[:] = [block.frames(len(block) - 1, len(block))]
        clock = [perf_counter()]
        surfaces = decide_motion(self._trees, self.pairs, motion)
        clock.append(perf_counter())
        has_interval = motion.linked[:, self.pairs[:, 0]] & motion.linked[:, self.pairs[:, 1]]
        has_interval[:1] = False
        before = np.zeros_like(surfaces.hits)
        before[1:] = surfaces.hits[:-1]
        answers = self._answers_of_frames(motion, surfaces.hits, before, has_interval)
        searched = has_interval & ~before & motion.changed[:, self.pairs].any(axis=2)
        # The intervals to search in which bounding spheres meet.
        spheres_meet = self._spheres.may_meet(motion.rotations, motion.translations, motion.valid, self.pairs, searched)
        legs = true_indices(spheres_meet)
        search_work = self._search(motion, *legs, answers)
        clock.append(perf_counter())
        containment_tests = self._contain(motion, surfaces, has_interval, answers.verdict)
        containment_tests += self._passages.mark(motion, *legs, answers.verdict)
        clock.append(perf_counter())
        work = {
            "intervals": int(searched.sum()),
            "face_tests_at_frames": surfaces.work["face_tests"],
            "containment_tests": containment_tests,
        }
        return self._detection(
            block,
            answers.verdict[first:].copy(),
            covers="intervals",
            containment=self._containment.labels,
            work=work | search_work,
            seconds=self._seconds(clock),
            reasons={(t - first, p): why for (t, p), why in answers.reasons.items()},
            toi={(t - first, p): seconds for (t, p), seconds in answers.toi.items() if t >= first},
        )

    def _answers_of_frames(
        self, motion: Motion, hits: BoolArray, before: BoolArray, has_interval: BoolArray
    ) -> _Answers:
        """The answers that contact at both ends of an interval gives; all arrays (T, P)."""
        has_pose = pair_has_pose(motion, self.pairs)
        known = has_interval.copy()
        known[:1] = has_pose[:1]
        verdict = np.where(known, np.uint8(Verdict.CLEAR), np.uint8(Verdict.NO_POSE))
        verdict[hits | (before & has_interval)] = Verdict.CONTACT
        reasons = {
            (t, p): GAP_BEFORE if has_pose[t - 1, p] else LOST_BEFORE
            for t, p in np.argwhere(has_pose & (verdict == Verdict.NO_POSE)).tolist()
        }
        # A contact in a frame without an interval before it begins, as far as is known, in that frame.
        begun = np.argwhere(hits & ~has_interval).tolist()
        toi = {(t, p): (float(motion.times[t]), float(motion.times[t])) for t, p in begun}
        return _Answers(verdict, reasons, toi)

    def _contain(self, motion: Motion, surfaces: MotionAnswer, has_interval: BoolArray, verdict: ByteArray) -> int:
        """Mark containment in intervals without contact; returns the number of tests."""
        frames, columns = surfaces.near
        clear = verdict[frames, columns] == Verdict.CLEAR
        # as one end of an interval without contact is, so is the whole way
        tests = self._containment.mark(motion, frames[clear], columns[clear], verdict)
        return tests + self._mark_intervals_through_holes(motion, surfaces, has_interval, verdict)

    def _mark_intervals_through_holes(
        self, motion: Motion, surfaces: MotionAnswer, has_interval: BoolArray, verdict: ByteArray
    ) -> int:
        """Give an interval without contact the answer of its beginning too, where a body can pass through a hole."""
        holed = self._containment.holed
        if not holed:
            return 0
        at_frames = np.zeros_like(verdict)
        frames, columns = surfaces.near
        chosen = np.isin(columns, holed)
        containment_tests = self._containment.mark(motion, frames[chosen], columns[chosen], at_frames)
        before = np.zeros_like(at_frames)
        before[1:] = np.where(has_interval[1:], at_frames[:-1], Verdict.CLEAR)
        verdict[(verdict == Verdict.CLEAR) & (before != Verdict.CLEAR)] = Verdict.UNRESOLVED
        return containment_tests

    def _search(self, motion: Motion, frames: IntArray, columns: IntArray, answers: _Answers) -> dict[str, int]:
        """Decide the intervals before ``frames`` (K,), none of which starts in contact; returns counters."""
        searched = self._segments.decide(motion.times, motion.rotations, motion.translations, frames, columns)
        for row in np.flatnonzero(searched.states != FREE).tolist():
            pair_frame, state = (int(frames[row]), int(columns[row])), int(searched.states[row])
            lower, upper = searched.impact[row].tolist()
            if state == HIT or answers.verdict[pair_frame] == Verdict.CONTACT:
                answers.verdict[pair_frame] = Verdict.CONTACT
                answers.toi[pair_frame] = lower, upper if state == HIT else float(motion.times[pair_frame[0]])
            else:
                answers.verdict[pair_frame] = Verdict.UNRESOLVED
                answers.reasons[pair_frame] = f"{self._segments.reason(state)} ({lower:.6f} to {upper:.6f} s)"
        unresolved = int((answers.verdict == Verdict.UNRESOLVED).sum())
        return {"unresolved": unresolved, "searched": len(frames)} | searched.work


def _joined_motion(last: Motion, motion: Motion) -> Motion:
    """A block with the last frame of the block before at its head; poses keep their bits."""
    names = ("times", "translations", "rotations", "valid", "linked")
    *poses, linked = (np.concatenate([getattr(last, name), getattr(motion, name)]) for name in names)
    return Motion(*poses, linked=linked)
