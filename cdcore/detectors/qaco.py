"""The paper's search: volumes, then the colony over pairs of faces, every hit confirmed on triangles: ``qaco`` after
spheres, ``hybrid-qaco`` after spheres and boxes, with a mesh query for what it left open if asked to.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any, ClassVar

import numpy as np

from cdcore.broad.broad_phase import BroadAnswer, BroadPhase
from cdcore.detectors import COLONY, FCL, PAPER
from cdcore.narrow.containment.containment_stage import ContainmentStage
from cdcore.narrow.mesh_stage import MeshAnswer, MeshStage
from cdcore.narrow.sections.section_source import sections_of
from cdcore.numerics import Int32Array, IntArray
from cdcore.protocol import NO_FACES, Body, Detection, Explanation, FaceSets, Live, Motion, PairDetector, Verdict
from cdcore.protocol.settings import choice, flag, number
from cdcore.search.explaining import SearchExplainer
from cdcore.search.live_search import LiveSearch
from cdcore.search.search_settings import MOST_WEIGHT, SearchSettings
from cdcore.search.stage import CONTAINMENT_REFUSED, PairMemory, SearchAnswer, SearchStage
from cdcore.search.tracing import NotingStage, Watched


class QacoDetector(PairDetector[Any]):
    """The quantum ant colony of the paper, its equations corrected, its best ant improved by local search.

    It answers within a fixed number of evaluations; where spheres overlap and nothing is found the verdict is
    NOT_FOUND. On meshes of a laboratory ``exact`` is faster and complete. Each frame starts from the closest pair of
    the frame before.

    Source: equations (15) to (20) of the paper as corrected in section 3 of the project's specification.
    Cost: some 50 ns an evaluation; a pair in contact is found again in a few, one near but apart spends the budget.
    """

    name = "qaco"
    kind = "paper"
    online = True
    Settings: ClassVar[type] = SearchSettings
    sources: ClassVar[tuple[str, ...]] = (f"{PAPER}, equations (15) to (20)", *COLONY)
    choose_when = "you want to see what a sampled search costs and misses"
    cannot = "say CLEAR where spheres overlap, or promise to find a contact"
    stages: ClassVar[tuple[str, ...]] = ("spheres", "search")

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, settings: Any) -> None:
        super().__init__(bodies, pairs, settings)
        self._broad = BroadPhase(bodies, pairs, boxes="boxes" in self.stages)
        self._search = SearchStage(bodies, pairs, settings)
        self._explainer = SearchExplainer(self.bodies, pairs, settings)
        self._words = (CONTAINMENT_REFUSED,) * len(pairs)

    def explain(self, motion: Motion, frame: int, pair: int, faces: IntArray) -> Explanation:
        """Say whether the volumes met, and whether ten times the budget finds the contact."""
        near = self._volumes_meet(motion, frame, pair)
        return self._explainer.explain(motion, frame, pair, faces, volumes_meet=near)

    def _volumes_meet(self, motion: Motion, frame: int, pair: int) -> bool:
        return pair in self._broad.candidates(motion.frames(frame, frame + 1)).columns

    def watch(self, motion: Motion) -> Watched:
        """Search the whole motion again and keep what each stage did."""
        spheres, boxes = self._broad.by_stage(motion)
        stage = NotingStage(self.bodies, self.pairs, self.settings, self._search.empty)
        found = stage.decide(motion, boxes, stage.fresh_memory(), faces=True)
        searched = np.zeros_like(spheres)
        for frame, column in stage.noted:
            searched[frame, column] = True
        return Watched(spheres, boxes, searched, stage, self.settings, found.face_sets())

    def _fresh_memory(self) -> list[PairMemory]:
        return self._search.fresh_memory()

    def _run(self, motion: Motion, memory: list[PairMemory], faces: bool) -> Detection:
        broad = self._broad.candidates(motion)
        near = np.zeros(broad.verdict.shape, dtype=np.bool_)
        near[broad.frames, broad.columns] = True
        found = self._search.decide(motion, near, memory, faces=faces)
        broad.verdict[near] = Verdict.NOT_FOUND
        broad.verdict[found.hits] = Verdict.CONTACT
        broad.clock.append(perf_counter())
        sets, work = self._complete(motion, broad, found, faces)
        return self._detection(
            motion,
            broad.verdict,
            face_sets=sets,
            containment=self._words,
            work=broad.work | found.work | work,
            seconds=self._seconds(broad.clock),
            section_source=sections_of(self.bodies, self.pairs, motion) if faces else None,
        )

    def _complete(
        self, _motion: Motion, _broad: BroadAnswer, found: SearchAnswer, faces: bool
    ) -> tuple[FaceSets | None, dict[str, int]]:
        """Decide what the search left open; the faces of all contacts if asked for, and counters."""
        return found.face_sets() if faces else None, {}


@dataclass(frozen=True, kw_only=True)
class HybridQacoSettings(SearchSettings):
    """Settings of ``hybrid-qaco``: those of the search, and what stands before and after it.

    ``decide``: "search": what the search finds is the answer, and what it misses is missed; "mesh": FCL meshes decide
    what the search left open, so that the answer is that of ``hybrid`` and the search is early evidence.
    ``containment``: with ``decide="mesh"``, whether to ask if one body is inside the other.
    ``rest``: a tenth of a face, here: a pair that hardly moves is not searched anew in every frame.
    """

    rest: float = number(0.1, 0, MOST_WEIGHT)
    decide: str = choice("search", ("search", "mesh"))
    containment: bool = flag(True)


class HybridQacoDetector(QacoDetector):
    """Bounding spheres, bounding boxes, the colony, and with ``decide="mesh"`` a mesh query where it found nothing.

    With ``decide="search"`` its contacts are true, and its misses are what an audit shows. With ``decide="mesh"`` the
    answer is complete (with FCL's limits, see ``hybrid``) and needs no mesh query where the search has found a contact
    already; with faces every candidate is asked.

    Source: sections 3 and 4 of the paper; the boxes are ours. ``work["mesh_queries"]`` is 0 with ``decide="search"``.
    """

    name = "hybrid-qaco"
    Settings = HybridQacoSettings
    sources = (f"{PAPER}, sections 3 and 4", *COLONY, FCL)
    choose_when = "you audit the paper's pipeline (what a run does unasked), or with `decide=mesh` want all contacts"
    cannot = "promise to find a contact with `decide=search`"
    stages = ("spheres", "boxes", "search", "meshes", "containment")

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, settings: HybridQacoSettings) -> None:
        super().__init__(bodies, pairs, settings)
        self._meshes = MeshStage(bodies, pairs) if settings.decide == "mesh" else None
        self._containment = ContainmentStage(bodies, pairs, asked=self._meshes is not None and settings.containment)
        if self._meshes is not None:
            self._words = self._containment.words

    def explain(self, motion: Motion, frame: int, pair: int, faces: IntArray) -> Explanation:
        """As ``qaco`` with ``decide="search"``; with "mesh" volumes alone can lose a contact."""
        if self._meshes is None:
            return super().explain(motion, frame, pair, faces)
        return Explanation(spheres_meet=self._volumes_meet(motion, frame, pair))

    def watch(self, motion: Motion) -> Watched:
        """Search the whole motion again and keep what each stage did."""
        seen = super().watch(motion)
        return seen if self._meshes is None else replace(seen, face_sets=None)

    def live(self) -> Live:
        """A session that is asked one frame after the other."""
        return LiveSearch(self._broad, self._search) if self._meshes is None else super().live()

    def _complete(
        self, motion: Motion, broad: BroadAnswer, found: SearchAnswer, faces: bool
    ) -> tuple[FaceSets | None, dict[str, int]]:
        """Ask meshes, and whether one body is inside the other."""
        sets, work = super()._complete(motion, broad, found, faces)
        frames, columns, queries, contained = broad.frames, broad.columns, 0, 0
        if self._meshes is not None:
            if not faces:
                left = ~found.hits[frames, columns]
                frames, columns = frames[left], columns[left]
            answer = self._meshes.decide(motion, frames, columns, faces=faces)
            queries, hits = answer.queries, answer.hits | found.hits[frames, columns]
            broad.verdict[frames, columns] = np.where(hits, Verdict.CONTACT, Verdict.CLEAR)
            sets = _joined_faces(found, answer, frames, columns) if faces else None
        broad.clock.append(perf_counter())
        if self._meshes is not None:
            contained = self._containment.mark(motion, frames[~hits], columns[~hits], broad.verdict)
        broad.clock.append(perf_counter())
        return sets, work | {"mesh_queries": queries, "containment_tests": contained}


def _joined_faces(found: SearchAnswer, meshes: MeshAnswer, frames: IntArray, columns: IntArray) -> FaceSets:
    """Faces of the meshes and those the search confirmed, which FCL may leave out where faces are degenerate."""
    searched = {(frame, column): number for frame, column, number in found.entries}
    joined: dict[tuple[int, int], int] = {}
    sets: list[Int32Array] = []
    which = np.zeros(len(frames), dtype=np.int64)
    for row, place in enumerate(zip(frames.tolist(), columns.tolist(), strict=True)):
        key = (int(meshes.which[row]), searched.get(place, -1))
        if key not in joined:
            joined[key] = len(sets)
            extra = found.sets[key[1]] if key[1] >= 0 else NO_FACES
            both = np.concatenate([meshes.sets[key[0]], extra])
            sets.append(np.unique(both, axis=0).astype(np.int32) if len(extra) else meshes.sets[key[0]])
        which[row] = joined[key]
    return FaceSets.from_shared(frames, columns, which, sets)
