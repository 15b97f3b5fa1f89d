"""The paper's search: volumes, then the colony over pairs of faces, every hit confirmed on triangles: ``qaco`` after
spheres, ``hybrid-qaco`` after spheres and boxes, with a mesh query for what it left open if asked to.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from time import perf_counter
from typing import Any, ClassVar

import numpy as np

from cdcore.broad.broad_phase import BroadAnswer, BroadPhase
from cdcore.containment.containment_stage import ContainmentStage
from cdcore.detectors.detector_table import COLONY, FCL, PAPER
from cdcore.narrow.mesh_stage import MeshAnswer, MeshStage
from cdcore.narrow.sections.section_source import section_of_frame
from cdcore.numerics import IntArray
from cdcore.protocol import Body, Detection, Explanation, FaceSets, Live, Motion, PairDetector, Verdict
from cdcore.protocol.settings import choice, flag, number
from cdcore.search.search_settings import MOST_WEIGHT, SearchSettings
from cdcore.search.stage import CONTAINMENT_REFUSED, LiveSearch, PairMemory, SearchAnswer, SearchStage
from cdcore.search.tracing import NotingStage, SearchExplainer, Watched
from cdcore.tolerances import LARGEST_OF_SQUARES_M


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
    largest_m = LARGEST_OF_SQUARES_M
    Settings: ClassVar[type] = SearchSettings
    sources: ClassVar[tuple[str, ...]] = (f"{PAPER}, equations (15) to (20)", *COLONY)
    choose_when = "you want to see what a sampled search costs and misses"
    cannot = "say CLEAR where spheres overlap, or promise to find a contact"
    stages: ClassVar[tuple[str, ...]] = ("spheres", "search")
    _containment: ContainmentStage
    """Of a row that asks meshes what the search left open."""

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, settings: Any) -> None:
        super().__init__(bodies, pairs, settings)
        self._broad = BroadPhase(bodies, pairs, boxes="boxes" in self.stages)
        self._search = SearchStage(bodies, pairs, settings)
        self._explainer = SearchExplainer(self.bodies, pairs, settings)
        self._meshes: MeshStage | None = None

    def explain(self, motion: Motion, frame: int, pair: int, faces: IntArray) -> Explanation:
        """Say whether the volumes meet, and where they do whether ten times the budget finds the contact.

        With ``decide="mesh"`` volumes alone can lose one.
        """
        spheres_meet, boxes_meet = self._broad.volumes_meet(motion, frame, pair)
        explanation = Explanation()
        if self._meshes is None and spheres_meet and boxes_meet is not False:
            explanation = self._explainer.explain(motion, frame, pair, faces)
        return replace(explanation, spheres_meet=spheres_meet, boxes_meet=boxes_meet)

    def watch(self, motion: Motion) -> Watched:
        """Search the whole motion again and keep what each stage did."""
        spheres, boxes = self._broad.by_stage(motion)
        stage = NotingStage(self.bodies, self.pairs, self.settings, self._search.empty)
        search_answer = stage.decide(motion, boxes, stage.fresh_memory(), faces=True)
        searched = np.zeros_like(spheres)
        for pair_frame in stage.noted:
            searched[pair_frame] = True
        sets = search_answer.face_sets() if self._meshes is None else None
        return Watched(spheres, boxes, searched, stage, self.settings, sets)

    def _fresh_memory(self) -> list[PairMemory]:
        return self._search.fresh_memory()

    def _run(self, motion: Motion, memory: list[PairMemory], faces: bool) -> Detection:
        broad = self._broad.candidates(motion)
        near = np.zeros(broad.verdict.shape, dtype=np.bool_)
        near[broad.frames, broad.columns] = True
        search_answer = self._search.decide(motion, near, memory, faces=faces)
        broad.verdict[near] = Verdict.NOT_FOUND
        broad.verdict[search_answer.hits] = Verdict.CONTACT
        broad.clock.append(perf_counter())
        sets, containment = search_answer.face_sets(), (CONTAINMENT_REFUSED,) * len(self.pairs)
        if self._meshes is not None:
            sets = self._decide_on_meshes(self._meshes, motion, broad, search_answer, faces)
            containment = self._containment.labels
        return self._detection(
            motion,
            broad.verdict,
            face_sets=sets if faces else None,
            containment=containment,
            work=broad.work | search_answer.work,
            seconds=self._seconds(broad.clock),
            section_source=partial(section_of_frame, self.bodies, self.pairs, motion) if faces else None,
        )

    def _decide_on_meshes(
        self, stage: MeshStage, motion: Motion, broad: BroadAnswer, search_answer: SearchAnswer, faces: bool
    ) -> FaceSets:
        """Ask meshes what the search left open, and whether one body is inside the other; the faces of all contacts."""
        frames, columns = broad.frames, broad.columns
        if not faces:
            left = ~search_answer.hits[frames, columns]
            frames, columns = frames[left], columns[left]
        meshes = stage.decide(motion, frames, columns, faces=faces)
        hits = meshes.hits | search_answer.hits[frames, columns]
        broad.verdict[frames, columns] = np.where(hits, Verdict.CONTACT, Verdict.CLEAR)
        sets = _joined_faces(search_answer, meshes, frames, columns) if faces else search_answer.face_sets()
        broad.clock.append(perf_counter())
        contained = self._containment.mark(motion, frames[~hits], columns[~hits], broad.verdict)
        broad.clock.append(perf_counter())
        broad.work.update(mesh_queries=meshes.queries, containment_tests=contained)
        return sets


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

    Source: sections 3 and 4 of the paper; the boxes are ours.
    """

    name = "hybrid-qaco"
    Settings = HybridQacoSettings
    sources = (f"{PAPER}, sections 3 and 4", *COLONY, FCL)
    choose_when = "you audit the paper's pipeline (the default of a run), or with `decide=mesh` want all contacts"
    cannot = "promise to find a contact with `decide=search`"
    stages = ("spheres", "boxes", "search", "meshes", "containment")

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, settings: HybridQacoSettings) -> None:
        super().__init__(bodies, pairs, settings)
        if settings.decide == "mesh":
            self._meshes = MeshStage(bodies, pairs)
            self._containment = ContainmentStage(bodies, pairs, enabled=settings.containment)

    def live(self) -> Live:
        """A session that is asked one frame after the other."""
        return LiveSearch(self._broad, self._search) if self._meshes is None else super().live()


def _joined_faces(search_answer: SearchAnswer, meshes: MeshAnswer, frames: IntArray, columns: IntArray) -> FaceSets:
    """Faces of the meshes; those the search confirmed where FCL, which may leave out degenerate faces, lists none."""
    searched = np.zeros(search_answer.hits.shape, dtype=np.int64)
    for frame, column, which_set in search_answer.entries:
        searched[frame, column] = len(meshes.sets) + which_set
    which = np.where(meshes.hits | ~search_answer.hits[frames, columns], meshes.which, searched[frames, columns])
    return FaceSets.from_shared(frames, columns, which, [*meshes.sets, *search_answer.sets])
