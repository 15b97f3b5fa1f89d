"""The detectors that search two trees of boxes: ``aabb``, ``obb``, ``rapid-style`` and ``solid-style``.

Each is a row of ``cdcore.narrow.trees.search.TREE_KINDS``, the words that say when to choose it, and its broad phase.
Run to completion, none of them loses a face.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any, ClassVar, Final

from cdcore.bounding.box import box_by_body_axes
from cdcore.bounding.sphere import sphere_best
from cdcore.broad.broad_looks import BroadLooks
from cdcore.broad.broad_phase import BroadPhase
from cdcore.broad.sphere_stage import SphereStage
from cdcore.broad.sweep_stage import SweepLooks, SweepMemory, SweepStage
from cdcore.narrow.tree_stage import TreeSettings, TreeStage
from cdcore.narrow.trees.search import TreeSearch
from cdcore.numerics import ByteArray, IntArray
from cdcore.protocol import Body, Detection, Live, Motion, Near, PairDetector

OBB_TREE: Final = (
    "S. Gottschalk, M. C. Lin, D. Manocha, OBBTree: a hierarchical structure for rapid interference detection, "
    "SIGGRAPH 1996"
)
AABB_TREE: Final = (
    "G. van den Bergen, Efficient collision detection of complex deformable models using AABB trees, Journal of "
    "Graphics Tools 2(4), 1997"
)

Broad = tuple[ByteArray, dict[str, int]]
"""Verdicts (T, P) of a broad phase, CANDIDATE where the trees are to be asked, and its work counters."""


@dataclass(frozen=True, kw_only=True)
class AabbSettings(TreeSettings):
    """Settings of ``aabb``: ``mode``, ``budget``, ``containment``."""


@dataclass(frozen=True, kw_only=True)
class ObbSettings(TreeSettings):
    """Settings of ``obb``: ``mode``, ``budget``, ``containment``."""


@dataclass(frozen=True, kw_only=True)
class RapidStyleSettings(TreeSettings):
    """Settings of ``rapid-style``: ``mode``, ``budget``, ``containment``."""


@dataclass(frozen=True, kw_only=True)
class SolidStyleSettings(TreeSettings):
    """Settings of ``solid-style``: ``mode`` ("first" is what the library offers), ``budget``, ``containment``."""


class TreeDetector(PairDetector[TreeSettings]):
    """Searches two trees wherever the broad phase says; without a broad phase of its own, in every pair-frame."""

    online: ClassVar[bool] = False

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, settings: TreeSettings) -> None:
        super().__init__(bodies, pairs, settings)
        search = TreeSearch(self.name, [body.mesh.triangles for body in bodies])
        self._trees = TreeStage(bodies, pairs, search, settings)

    def live(self) -> Live:
        """A session that is asked one frame after the other; a budget is spent as over the whole motion."""
        if self.settings.budget is not None:
            return super().live()
        return self._trees.live(self._volumes())

    def _volumes(self) -> Near:
        return BroadLooks(BroadPhase(self.bodies, self.pairs))

    def _near(self, motion: Motion, memory: Any) -> Broad:
        del memory
        return self._trees.everywhere(motion), {}

    def _run(self, motion: Motion, memory: Any, faces: bool) -> Detection:
        start = perf_counter()
        verdict, work = self._near(motion, memory)
        broad = perf_counter() - start
        return self._trees.detection(self.name, motion, verdict, faces=faces, broad=broad, work=work)


class AabbDetector(TreeDetector):
    """A tree of axis-aligned boxes around the reference vertices, exact faces at its leaves.

    Choose it as the simplest complete hierarchy: its box tests compare numbers that were rounded already, so it has no
    tolerance to doubt. ``obb`` is faster wherever bodies are rigid.

    Source: see ``sources``. Cost: all faces of both bodies once a pose whose spheres overlap, then the boxes that meet.
    """

    name: ClassVar[str] = "aabb"
    Settings: ClassVar[type] = AabbSettings
    sources: ClassVar[tuple[str, ...]] = (AABB_TREE,)
    choose_when: ClassVar[str] = "you want a complete tree without any tolerance, to compare others with"
    cannot: ClassVar[str] = "be fast on large meshes: it refits every box in every pose"

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, settings: TreeSettings) -> None:
        super().__init__(bodies, pairs, settings)
        self._spheres = SphereStage([sphere_best(body.mesh) for body in bodies], pairs)

    def _near(self, motion: Motion, memory: Any) -> Broad:
        del memory
        near = self._spheres.candidates(motion)
        return near.verdict, {"sphere_tests": near.tests, "skipped": near.skipped}


class ObbDetector(TreeDetector):
    """A tree of oriented boxes, fifteen axes a test, exact faces at its leaves.

    Choose it as the plain hierarchy of rigid bodies, with counters and a budget. It asks every pair-frame from its root
    boxes, and knows nothing of the frame before; ``exact`` does, and is faster over a motion.

    Source: see ``sources``. Cost: a box test at the root some 0.1 microseconds a pair-frame, then what meets.
    """

    name: ClassVar[str] = "obb"
    Settings: ClassVar[type] = ObbSettings
    sources: ClassVar[tuple[str, ...]] = (OBB_TREE,)
    choose_when: ClassVar[str] = "you want a complete tree of rigid bodies whose work you can count or cut"
    cannot: ClassVar[str] = "use what the frame before knew, as `exact` does"


class RapidStyleDetector(TreeDetector):
    """Re-creation of RAPID: its tree, its descent, its two modes, with faces decided exactly.

    Choose it to see what RAPID does on your recording, complete or cut short by ``budget``. It follows
    the published description; the library itself may not be used commercially and is not used here.

    Source: see ``sources``. Differs: the leaf test is exact where the library's rounds.
    """

    name: ClassVar[str] = "rapid-style"
    Settings: ClassVar[type] = RapidStyleSettings
    sources: ClassVar[tuple[str, ...]] = (OBB_TREE,)
    choose_when: ClassVar[str] = "you compare with RAPID: its descent, its counters, its first-contact mode"
    cannot: ClassVar[str] = "speak for RAPID's own rounding: its leaf test here is exact"


class SolidStyleDetector(TreeDetector):
    """Re-creation of SOLID: sweep and prune, boxes in the body's frame, GJK with a kept axis, then faces exactly.

    Choose it to see what SOLID does on your recording, complete or cut short by ``budget``. The library itself returns
    at the first pair of faces (``mode="first"``); "all" goes on. ``work["cache_hits"]`` counts face pairs that the axis
    of an earlier pair kept apart.

    Source: see ``sources``. Differs: what GJK does not separate for certain is decided exactly.
    """

    name: ClassVar[str] = "solid-style"
    Settings: ClassVar[type] = SolidStyleSettings
    sources: ClassVar[tuple[str, ...]] = (
        AABB_TREE,
        "G. van den Bergen, A fast and robust GJK implementation for collision detection of convex objects, Journal of "
        "Graphics Tools 4(2), 1999",
        "D. Baraff, Dynamic simulation of non-penetrating rigid bodies, PhD thesis, Cornell University 1992",
    )
    choose_when: ClassVar[str] = "you compare with SOLID: its descent, its counters, its cached axes"
    cannot: ClassVar[str] = "speak for SOLID's own rounding: what GJK leaves open is decided exactly here"

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, settings: TreeSettings) -> None:
        super().__init__(bodies, pairs, settings)
        self._sweep = SweepStage([box_by_body_axes(body.mesh) for body in bodies], pairs)

    def _volumes(self) -> Near:
        return SweepLooks(self._sweep)

    def _fresh_memory(self) -> SweepMemory:
        return self._sweep.fresh_memory()

    def _near(self, motion: Motion, memory: SweepMemory) -> Broad:
        near = self._sweep.candidates(motion, memory)
        return near.verdict, {"swaps": near.swaps, "pair_events": near.events}
