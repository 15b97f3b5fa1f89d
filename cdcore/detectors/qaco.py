"""Spheres, then a search over pairs of faces: never invents a contact, and may miss one."""

from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import ClassVar

import numpy as np

from cdcore.bounding.sphere import SPHERES, sphere_in_mode
from cdcore.broad.sphere_stage import SphereStage
from cdcore.detectors import COLONY, PAPER
from cdcore.narrow.sections.section_source import sections_of
from cdcore.numerics import IntArray
from cdcore.protocol import Body, Detection, Explanation, Motion, PairDetector, Verdict
from cdcore.protocol.settings import choice
from cdcore.search.explaining import SearchExplainer
from cdcore.search.settings import SearchSettings
from cdcore.search.stage import CONTAINMENT_REFUSED, SearchMemory, SearchStage
from cdcore.search.tracing import Watched, watched


@dataclass(frozen=True, kw_only=True)
class QacoSettings(SearchSettings):
    """Settings of ``qaco``: those of the search, and the spheres before it.

    ``sphere``: "paper" for equation (21), "best" for the smallest ball known.
    """

    sphere: str = choice("best", SPHERES)


class QacoDetector(PairDetector[QacoSettings]):
    """The quantum ant colony of the paper, its equations corrected, its best ant improved by local search.

    Choose it to see what a sampled search costs and misses, or for an answer within a fixed number of evaluations. It
    cannot say that bodies are apart: where spheres overlap and nothing is found the verdict is NOT_FOUND. On meshes of
    a laboratory ``exact`` is faster and complete. Each frame starts from the closest pair of the frame before.

    Source: equations (15) to (20) of the paper as corrected in section 3 of the project's specification.
    Cost: some 50 ns an evaluation; a pair in contact is found again in a few, one near but apart spends the budget.
    """

    name: ClassVar[str] = "qaco"
    kind: ClassVar[str] = "paper"
    online: ClassVar[bool] = True
    Settings: ClassVar[type] = QacoSettings
    sources: ClassVar[tuple[str, ...]] = (f"{PAPER}, equations (15) to (20)", *COLONY)
    choose_when: ClassVar[str] = "you want to see what a sampled search costs and misses"
    cannot: ClassVar[str] = "say CLEAR where spheres overlap, or promise to find a contact"

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, settings: QacoSettings) -> None:
        super().__init__(bodies, pairs, settings)
        self._spheres = SphereStage([sphere_in_mode(body.mesh, settings.sphere) for body in bodies], pairs)
        self._search = SearchStage(bodies, pairs, settings)
        self._explainer = SearchExplainer(self.bodies, pairs, settings)

    def explain(self, motion: Motion, frame: int, pair: int, faces: IntArray) -> Explanation:
        """Say whether the spheres met, and whether ten times the budget finds the contact."""
        spheres = self._spheres.candidates(motion.frames(frame, frame + 1)).verdict[0, pair]
        return self._explainer.explain(motion, frame, pair, faces, volumes_meet=int(spheres) == Verdict.CANDIDATE)

    def watch(self, motion: Motion) -> Watched:
        """Search the whole motion again and keep what each stage did; there are no boxes."""
        near = self._spheres.candidates(motion).verdict == Verdict.CANDIDATE
        return watched(self.bodies, self.pairs, self.settings, motion, (near, near), self._search.empty)

    def _fresh_memory(self) -> SearchMemory:
        return self._search.fresh_memory()

    def _run(self, motion: Motion, memory: SearchMemory, faces: bool) -> Detection:
        clock = [perf_counter()]
        spheres = self._spheres.candidates(motion)
        verdict = spheres.verdict
        near = verdict == Verdict.CANDIDATE
        clock.append(perf_counter())
        found = self._search.decide(motion, near, memory, faces=faces)
        verdict[near] = Verdict.NOT_FOUND
        verdict[found.hits] = Verdict.CONTACT
        clock.append(perf_counter())
        return self._detection(
            motion,
            verdict,
            face_sets=found.face_sets() if faces else None,
            containment=(CONTAINMENT_REFUSED,) * len(self.pairs),
            work=spheres.work | found.work,
            seconds=dict(zip(("spheres", "search"), np.diff(clock).tolist(), strict=True)),
            reproducible=self.settings.budget_seconds is None,
            section_source=sections_of(self.bodies, self.pairs, motion) if faces else None,
        )
