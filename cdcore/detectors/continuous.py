"""Between the frames: misses no contact on the way from one recorded pose to the next. CLEAR is always proven."""

from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Final

import numpy as np

from cdcore.bounding.bounding_sphere import sphere_best
from cdcore.narrow.bvh.box_tree import build_box_tree
from cdcore.narrow.bvh.whole_motion import decide_motion
from cdcore.narrow.containment.containment_stage import ContainmentStage
from cdcore.narrow.continuous.interval_search import FREE, HIT
from cdcore.narrow.continuous.segment_stage import SegmentAnswer, SegmentStage
from cdcore.narrow.continuous.swept_spheres import SweptSpheres
from cdcore.narrow.continuous.time_of_impact import ImpactSettings
from cdcore.numerics import BoolArray, ByteArray, FloatArray, IntArray
from cdcore.protocol import Body, Detection, Motion, PairDetector, Verdict, ordered_by_name, pair_has_pose
from cdcore.protocol.settings import flag

LOST_BEFORE: Final = "no pose in the frame before"
GAP_BEFORE: Final = "gap in the track before this frame: the way here is not known"


@dataclass(frozen=True, kw_only=True)
class ContinuousSettings(ImpactSettings):
    """Settings of ``continuous``.

    ``tolerance``: metres; what comes no closer than this is always decided, nearer things almost always.
    ``effort``: most tests spent on one interval of what is nearer.
    ``containment``: whether to ask, where surfaces do not meet, if one body is inside the other.
    """

    containment: bool = flag(True)


@dataclass(eq=False)
class _Found:
    """What the intervals of a motion came to, filled stage by stage."""

    verdict: ByteArray
    reasons: dict[tuple[int, int], str]
    toi: dict[tuple[int, int], tuple[float, float]]
    work: dict[str, int]


class ContinuousDetector(PairDetector[ContinuousSettings]):
    """Follows faces from frame to frame: row t is the interval before frame t, clear by proof or in contact since when.

    Row t of its answer is the closed interval from frame t-1 to t; row 0 is the pose itself.
    CONTACT: the surfaces meet at either end or between, seen exactly on triangles. ``toi`` holds, for every contact
    that begins in the interval, seconds (low, high): proven clear before ``low``, in contact at ``high``, at most 1e-6
    s apart; further only where the bodies graze or creep nearer than rounding can tell, which far from the origin is
    more. A contact that the interval starts in has no entry. CLEAR and CONTAINED: proven for the whole way.
    UNRESOLVED: neither, with a reason in ``reasons``. Where a pose is missing before a frame, or the track has a gap or
    a teleport, there is no way to speak of: CONTACT if the frame's own poses meet, else NO_POSE with the reason.

    Between frames body origins move along lines and rotations turn at a constant rate along the shorter arc. Choose it
    for whatever moves faster than the things it may hit are thick, as hands among thin glass do. It says in which
    interval and when, not in which faces; ask ``exact`` for those of a frame and ``time_of_impact`` for one interval.

    Source: section 2.1 of the project's specification. Cost: ``exact``, and 1 to 30 microseconds for each interval in
    which bounding spheres meet and no contact is known.
    """

    name = "continuous"
    sources = (
        "S. Redon, A. Kheddar, S. Coquillart, Fast continuous collision detection between rigid bodies, Computer "
        "Graphics Forum 21(3), 2002",
    )
    choose_when = "hands move fast among thin glass, through which every look at frames can pass"
    cannot = "look across lost poses and gaps, or list faces"
    stages = ("frames", "between", "containment")
    Settings = ContinuousSettings

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, settings: ContinuousSettings) -> None:
        super().__init__(bodies, pairs, settings)
        self._trees = [build_box_tree(body.mesh.triangles) for body in bodies]
        self._spheres = SweptSpheres([sphere_best(body.mesh) for body in bodies])
        ordered, _ = ordered_by_name(bodies, pairs)
        self._segments = SegmentStage(self._trees, ordered, tolerance=settings.tolerance, effort=settings.effort)
        self._containment = ContainmentStage(bodies, pairs, asked=settings.containment)

    def _fresh_memory(self) -> list[Motion]:
        return []

    def _run(self, motion: Motion, memory: list[Motion], _faces: bool) -> Detection:
        """Detect from the last frame of the block before on, which is the memory, and leave out that row."""
        block, first = motion, len(memory)
        if memory:
            motion = _joined(memory[0], block)
        if len(block):
            memory[:] = [block.frames(len(block) - 1, len(block))]
        clock = [perf_counter()]
        answer = decide_motion(self._trees, self.pairs, motion)
        clock.append(perf_counter())
        found = self._between(motion, answer.hits, first)
        found.work["face_tests_at_frames"] = answer.work["face_tests"]
        clock.append(perf_counter())
        frames, columns = answer.near
        clear = found.verdict[frames, columns] == Verdict.CLEAR
        # as one end of an interval without contact is, so is the whole way
        asked = self._containment.mark(motion, frames[clear], columns[clear], found.verdict)
        found.work["containment_tests"] = asked
        clock.append(perf_counter())
        return self._detection(
            block,
            found.verdict[first:].copy(),
            covers="intervals",
            containment=self._containment.words,
            work=found.work,
            seconds=self._seconds(clock),
            reasons={(t - first, p): why for (t, p), why in found.reasons.items()},
            toi={(t - first, p): toi for (t, p), toi in found.toi.items()},
        )

    def _between(self, motion: Motion, hits: BoolArray, first: int) -> _Found:
        has_pose = pair_has_pose(motion, self.pairs)
        way = motion.linked[:, self.pairs[:, 0]] & motion.linked[:, self.pairs[:, 1]]
        way[:1] = False
        before = np.zeros_like(hits)
        before[1:] = hits[:-1]
        verdict = np.where(hits | (before & way), np.uint8(Verdict.CONTACT), np.uint8(Verdict.CLEAR))
        verdict[~has_pose] = Verdict.NO_POSE
        nowhere = has_pose & ~way & ~hits
        nowhere[:1] = False
        verdict[nowhere] = Verdict.NO_POSE
        # A contact in a frame without an interval before it begins, as far as is known, in that frame.
        begun = [(t, p) for t, p in np.argwhere(hits & ~way).tolist() if t >= first]
        toi = {(t, p): (float(motion.times[t]), float(motion.times[t])) for t, p in begun}
        found = _Found(verdict, _no_way(motion, self.pairs, nowhere, first), toi, {})
        self._search(motion, way & ~before, hits, found, first)
        return found

    def _search(self, motion: Motion, asked: BoolArray, hits: BoolArray, found: _Found, first: int) -> None:
        """Decide the intervals that do not start in contact."""
        asked[:first] = False
        moving = _moves(motion)
        asked &= moving[:, self.pairs[:, 0]] | moving[:, self.pairs[:, 1]]
        near = self._spheres.may_meet(motion.rotations, motion.translations, motion.valid, self.pairs, asked)
        columns, frames = np.nonzero(near.T)
        answer = self._segments.decide(motion.times, motion.rotations, motion.translations, frames, columns)
        self._note(motion.times, frames, columns, answer, hits, found)
        found.work |= {"intervals": int(asked.sum()), "searched": len(frames)} | answer.work

    def _note(
        self, times: FloatArray, frames: IntArray, columns: IntArray, answer: SegmentAnswer,
        hits: BoolArray, found: _Found,
    ) -> None:  # fmt: skip
        """Write down what the search of K intervals came to."""
        open_ = 0
        for k in np.flatnonzero(answer.states != FREE).tolist():
            place = (int(frames[k]), int(columns[k]))
            low, high = answer.impact[k].tolist()
            if answer.states[k] == HIT or hits[place]:
                found.verdict[place] = Verdict.CONTACT
                found.toi[place] = (low, high if answer.states[k] == HIT else float(times[frames[k]]))
                continue
            open_ += 1
            found.verdict[place] = Verdict.UNRESOLVED
            found.reasons[place] = f"{self._segments.reason(int(answer.states[k]))} ({low:.6f} to {high:.6f} s)"
        found.work["unresolved"] = open_


def _joined(last: Motion, motion: Motion) -> Motion:
    """A block with the last frame of the block before at its head; poses keep their bits."""
    names = ("times", "translations", "rotations", "valid", "linked")
    *poses, linked = (np.concatenate([getattr(last, name), getattr(motion, name)]) for name in names)
    return Motion(*poses, linked=linked)


def _moves(motion: Motion) -> BoolArray:
    """(T, N): whether a body's pose differs from the frame before in any bit."""
    moves = np.ones(motion.valid.shape, dtype=np.bool_)
    turn, place = motion.rotations, motion.translations
    moves[1:] = (turn[1:] != turn[:-1]).any(axis=(2, 3)) | (place[1:] != place[:-1]).any(axis=2)
    return moves


def _no_way(motion: Motion, pairs: IntArray, nowhere: BoolArray, first: int) -> dict[tuple[int, int], str]:
    """Why a frame with poses has no interval before it."""
    reasons = {}
    for t, p in np.argwhere(nowhere).tolist():
        if t >= first:
            known = motion.valid[t - 1, pairs[p, 0]] and motion.valid[t - 1, pairs[p, 1]]
            reasons[t, p] = GAP_BEFORE if known else LOST_BEFORE
    return reasons
