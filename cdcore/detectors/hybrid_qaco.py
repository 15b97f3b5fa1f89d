"""The paper's pipeline: spheres, boxes, then the colony over mesh faces, every hit confirmed on triangles."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import ClassVar

import numpy as np

from cdcore.bounding.sphere import SPHERES
from cdcore.broad.broad_phase import BroadPhase
from cdcore.detectors import COLONY, FCL, PAPER
from cdcore.narrow.containment.containment_stage import REFUSAL, ContainmentStage
from cdcore.narrow.mesh_stage import MeshAnswer, MeshStage
from cdcore.narrow.sections.section_source import sections_of
from cdcore.numerics import ByteArray, Int32Array, IntArray
from cdcore.protocol import NO_FACES, Body, Detection, Explanation, FaceSets, Live, Motion, PairDetector, Verdict
from cdcore.protocol.settings import choice, flag, number
from cdcore.search.explaining import SearchExplainer
from cdcore.search.live_search import LiveSearch
from cdcore.search.settings import MOST_WEIGHT, SearchSettings
from cdcore.search.stage import CONTAINMENT_REFUSED, SearchAnswer, SearchMemory, SearchStage
from cdcore.search.tracing import Watched, watched


@dataclass(frozen=True, kw_only=True)
class HybridQacoSettings(SearchSettings):
    """Settings of ``hybrid-qaco``: those of the search, and what stands before and after it.

    ``decide``: "search": what the search finds is the answer, and what it misses is missed; "mesh": FCL meshes decide
    what the search left open, so that the answer is that of ``hybrid`` and the search is early evidence.
    ``sphere``: "paper" for equation (21), "best" for the smallest ball known.
    ``containment``: with ``decide="mesh"``, whether to ask if one body is inside the other.
    ``rest``: a tenth of a face, here: a pair that hardly moves is not searched anew in every frame.
    """

    rest: float = number(0.1, 0, MOST_WEIGHT)
    decide: str = choice("search", ("search", "mesh"))
    sphere: str = choice("best", SPHERES)
    containment: bool = flag(True)


class HybridQacoDetector(PairDetector[HybridQacoSettings]):
    """Bounding spheres, bounding boxes, the colony, and with ``decide="mesh"`` a mesh query where it found nothing.

    Choose ``decide="search"`` to audit the paper's algorithm: its contacts are true, its misses are what the audit
    shows. Choose ``decide="mesh"`` for a complete answer (with FCL's limits, see ``hybrid``) that needs no mesh query
    where the search has found a contact already; with faces every candidate is asked.

    Source: sections 3 and 4 of the paper; the boxes are ours. ``work["mesh_queries"]`` is 0 with ``decide="search"``.
    """

    name: ClassVar[str] = "hybrid-qaco"
    kind: ClassVar[str] = "paper"
    online: ClassVar[bool] = True
    Settings: ClassVar[type] = HybridQacoSettings
    sources: ClassVar[tuple[str, ...]] = (f"{PAPER}, sections 3 and 4", *COLONY, FCL)
    choose_when: ClassVar[str] = (
        "you audit the paper's pipeline (what a run does unasked), or with `decide=mesh` want all contacts"
    )
    cannot: ClassVar[str] = "promise to find a contact with `decide=search`"

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, settings: HybridQacoSettings) -> None:
        super().__init__(bodies, pairs, settings)
        complete = settings.decide == "mesh"
        self._broad = BroadPhase(bodies, pairs, sphere=settings.sphere)
        self._search = SearchStage(bodies, pairs, settings)
        self._explainer = SearchExplainer(self.bodies, pairs, settings)
        self._meshes = MeshStage(bodies, pairs) if complete else None
        self._containment = ContainmentStage(
            bodies, pairs, asked=complete and settings.containment, refusal=REFUSAL if complete else CONTAINMENT_REFUSED
        )

    def explain(self, motion: Motion, frame: int, pair: int, faces: IntArray) -> Explanation:
        """Say whether spheres and boxes met, and with ``decide="search"`` whether ten times the budget finds it."""
        near = pair in self._broad.candidates(motion.frames(frame, frame + 1)).columns
        if self._meshes is not None:
            return Explanation(spheres_meet=near)
        return self._explainer.explain(motion, frame, pair, faces, volumes_meet=near)

    def watch(self, motion: Motion) -> Watched:
        """Search the whole motion again and keep what each stage did."""
        seen = watched(self.bodies, self.pairs, self.settings, motion, self._broad.by_stage(motion), self._search.empty)
        return seen if self._meshes is None else replace(seen, face_sets=None)

    def live(self) -> Live:
        """A session that is asked one frame after the other."""
        return LiveSearch(self._broad, self._search) if self._meshes is None else super().live()

    def _fresh_memory(self) -> SearchMemory:
        return self._search.fresh_memory()

    def _run(self, motion: Motion, memory: SearchMemory, faces: bool) -> Detection:
        broad = self._broad.candidates(motion)
        verdict, frames, columns, clock = broad.verdict, broad.frames, broad.columns, broad.clock
        near = np.zeros(verdict.shape, dtype=np.bool_)
        near[frames, columns] = True
        found = self._search.decide(motion, near, memory, faces=faces)
        verdict[near] = Verdict.NOT_FOUND
        verdict[found.hits] = Verdict.CONTACT
        clock.append(perf_counter())
        queries, sets = self._ask_meshes(motion, frames, columns, found, verdict, faces)
        clock.append(perf_counter())
        columns, frames = np.nonzero((near & (verdict == Verdict.CLEAR)).T)
        contained = self._containment.mark(motion, frames, columns, verdict)
        clock.append(perf_counter())
        stages = ("spheres", "boxes", "search", "meshes", "containment")
        return self._detection(
            motion,
            verdict,
            face_sets=sets,
            containment=self._containment.words,
            work=broad.work | found.work | {"mesh_queries": queries, "containment_tests": contained},
            seconds=dict(zip(stages, np.diff(clock).tolist(), strict=True)),
            reproducible=self.settings.budget_seconds is None,
            section_source=sections_of(self.bodies, self.pairs, motion) if faces else None,
        )

    def _ask_meshes(
        self, motion: Motion, frames: IntArray, columns: IntArray, found: SearchAnswer,
        verdict: ByteArray, faces: bool,
    ) -> tuple[int, FaceSets | None]:  # fmt: skip
        """Decide on meshes what the search left open; returns queries done and the faces of both if asked for."""
        if self._meshes is None:
            return 0, found.face_sets() if faces else None
        if not faces:
            left = ~found.hits[frames, columns]
            frames, columns = frames[left], columns[left]
        answer = self._meshes.decide(motion, frames, columns, faces=faces)
        hits = answer.hits | found.hits[frames, columns]
        verdict[frames, columns] = np.where(hits, Verdict.CONTACT, Verdict.CLEAR)
        return answer.queries, _joined_faces(found, answer, frames, columns) if faces else None


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
