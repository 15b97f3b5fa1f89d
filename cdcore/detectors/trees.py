"""The detectors that search two trees of boxes: ``aabb``, ``obb``, ``rapid-style`` and ``solid-style``.

Each is a row of ``TREE_KINDS`` (``cdcore.narrow.tree_kinds``), the words that say when to choose it, and its broad
phase. Run to completion, none of them loses a face.
"""

from collections.abc import Sequence
from functools import partial
from time import perf_counter
from typing import Final

import numpy as np

from cdcore.broad.broad_phase import BroadPhase
from cdcore.broad.live_pairs import LivePairs
from cdcore.containment.containment_stage import ContainmentStage
from cdcore.detectors.detector_table import OBB_TREE
from cdcore.narrow.sections.section_source import section_of_frame
from cdcore.narrow.tree_stage import TreeSettings, TreeStage
from cdcore.numerics import IntArray
from cdcore.protocol import Body, Detection, FaceSets, Live, Motion, PairDetector, Verdict

AABB_TREE: Final = (
    "G. van den Bergen, Efficient collision detection of complex deformable models using AABB trees, Journal of "
    "Graphics Tools 2(4), 1997"
)


class TreeDetector(PairDetector[TreeSettings]):
    """Searches two trees where bounding spheres overlap, or in every pair-frame."""

    stages = ("broad", "traversal", "containment")
    spheres_first = False
    online = True
    Settings = TreeSettings

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, settings: TreeSettings) -> None:
        super().__init__(bodies, pairs, settings)
        self._trees = TreeStage(bodies, pairs, self.name, settings)
        self._containment = ContainmentStage(bodies, pairs, enabled=settings.containment)
        self._broad = BroadPhase(bodies, pairs, boxes=False)

    def live(self) -> Live:
        """A session that is asked one frame after the other; a budget is spent as over the whole motion.

        Without a budget, spheres and boxes come first, and what was found apart stays so until bodies moved that far.
        """
        if self.settings.budget is not None:
            return super().live()
        decide = partial(self._trees.decide_now, {})
        return LivePairs(self._broad, decide, self._containment.question, self._containment.holed)

    def _run(self, motion: Motion, _memory: None, faces: bool) -> Detection:
        near = self._broad.candidates(motion) if self.spheres_first else self._broad.everywhere(motion)
        verdict, frames, columns, clock = near.verdict, near.frames, near.columns, near.clock
        answer = self._trees.decide(motion, frames, columns, every=faces and self.settings.mode == "all")
        verdict[frames, columns] = np.where(answer.truncated, Verdict.NOT_FOUND, Verdict.CLEAR)
        verdict[frames[answer.hits], columns[answer.hits]] = Verdict.CONTACT
        clock.append(perf_counter())
        left = ~answer.hits & ~answer.truncated
        containment_tests = self._containment.mark(motion, frames[left], columns[left], verdict)
        clock.append(perf_counter())
        return self._detection(
            motion,
            verdict,
            face_sets=FaceSets.from_shared(frames, columns, answer.which, answer.sets) if faces else None,
            containment=self._containment.labels,
            work=near.work | answer.work | {"containment_tests": containment_tests},
            seconds=self._seconds(clock),
            section_source=partial(section_of_frame, self.bodies, self.pairs, motion) if faces else None,
        )


class AabbDetector(TreeDetector):
    """A tree of boxes along the world's axes, placed around each node's own box, exact faces at its leaves.

    Three comparisons a test. Cost: spheres first, then the boxes that meet, some 30 nanoseconds each.
    """

    name = "aabb"
    sources = (AABB_TREE,)
    choose_when = "you want the simplest complete tree, to compare others with"
    cannot = "be as tight as `obb`: the box around a turned box is larger"
    spheres_first = True


class ObbDetector(TreeDetector):
    """A tree of oriented boxes, fifteen axes a test, exact faces at its leaves.

    It asks every pair-frame from its root boxes; ``exact`` is faster over a motion. Cost: a box test at the root some
    0.1 microseconds a pair-frame, then what meets.
    """

    name = "obb"
    sources = (OBB_TREE,)
    choose_when = "you want a complete tree of rigid bodies whose work you can count or cut"
    cannot = "use what the frame before knew, as `exact` does"


class RapidStyleDetector(TreeDetector):
    """Re-creation of RAPID: its tree, its descent, its two modes, with faces decided exactly.

    It follows the published description, complete or cut short by ``budget``; the library itself may not be used
    commercially and is not used here.
    """

    name = "rapid-style"
    kind = "re-creation"
    sources = (OBB_TREE,)
    choose_when = "you compare with RAPID: its descent, its counters, its first-contact mode"
    cannot = "speak for RAPID's own rounding: its leaf test here is exact"


class SolidStyleDetector(TreeDetector):
    """Re-creation of SOLID: boxes in the body's frame, GJK with a kept axis, then faces exactly.

    The library itself returns at the first pair of faces (``mode="first"``); "all" goes on. ``work["cache_hits"]``
    counts face pairs that the axis of an earlier pair kept apart.

    Differs: spheres come first, not sweep and prune; what GJK does not separate for certain is decided exactly.
    """

    name = "solid-style"
    kind = "re-creation"
    sources = (
        AABB_TREE,
        "G. van den Bergen, A fast and robust GJK implementation for collision detection of convex objects, Journal of "
        "Graphics Tools 4(2), 1999",
    )
    choose_when = "you compare with SOLID: its descent, its counters, its cached axes"
    cannot = "speak for SOLID's own rounding: what GJK leaves open is decided exactly here"
    spheres_first = True
