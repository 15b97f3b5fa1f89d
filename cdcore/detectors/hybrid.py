"""Spheres, boxes, then FCL meshes: complete about contact, and only what volumes leave open reaches a triangle."""

from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import ClassVar

import numpy as np

from cdcore.bounding.sphere import SPHERES
from cdcore.broad.broad_looks import LivePairs
from cdcore.broad.broad_phase import BroadPhase
from cdcore.detectors import FCL, PAPER
from cdcore.narrow.containment.containment_stage import ContainmentStage
from cdcore.narrow.mesh_stage import MeshStage
from cdcore.narrow.sections.section_source import sections_of
from cdcore.numerics import IntArray
from cdcore.protocol import Body, Detection, Live, Motion, PairDetector, Verdict
from cdcore.protocol.settings import CheckedSettings, choice, flag


@dataclass(frozen=True, kw_only=True)
class HybridSettings(CheckedSettings):
    """Settings of ``hybrid``.

    ``sphere``: "paper" for equation (21), "best" for the smallest ball known; the verdicts are the same.
    ``containment``: whether to ask, where surfaces do not meet, if one body is inside the other.
    ``skip``: whether the sphere stage leaps over frames in which the recorded paths are too short to close the gap.
    """

    sphere: str = choice("best", SPHERES)
    containment: bool = flag(True)
    skip: bool = flag(True)


class HybridDetector(PairDetector[HybridSettings]):
    """The paper's pipeline without its search: spheres over the whole motion, boxes, FCL meshes, containment.

    Choose it for a complete answer in general position with a widely used engine underneath. It inherits FCL's limits
    on degenerate faces and resting ties (see ``cdcore.narrow.fcl_meshes``); ``exact`` has none.

    Source: section 4 of the paper, with its inverted condition put right: spheres that do *not* meet end the matter.
    Cost: spheres and boxes some ten nanoseconds a pair-frame, meshes some ten microseconds each.
    """

    name: ClassVar[str] = "hybrid"
    kind: ClassVar[str] = "engine"
    online: ClassVar[bool] = True
    Settings: ClassVar[type] = HybridSettings
    sources: ClassVar[tuple[str, ...]] = (f"{PAPER}, section 4", FCL)
    choose_when: ClassVar[str] = "you want contacts and faces of ordinary meshes from a widely used engine"
    cannot: ClassVar[str] = "be exact on degenerate faces and resting ties"

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, settings: HybridSettings) -> None:
        super().__init__(bodies, pairs, settings)
        self._broad = BroadPhase(bodies, pairs, sphere=settings.sphere, skip=settings.skip)
        self._meshes = MeshStage(bodies, pairs)
        self._containment = ContainmentStage(bodies, pairs, asked=settings.containment)

    def live(self) -> Live:
        """A session that is asked one frame after the other."""
        return LivePairs(self._broad, self._meshes.decide_now, self._containment.question)

    def _run(self, motion: Motion, _memory: None, faces: bool) -> Detection:
        near = self._broad.candidates(motion)
        verdict, frames, columns, clock = near.verdict, near.frames, near.columns, near.clock
        meshes = self._meshes.decide(motion, frames, columns, faces=faces)
        verdict[frames[meshes.hits], columns[meshes.hits]] = Verdict.CONTACT
        clock.append(perf_counter())
        contained = self._containment.mark(motion, frames[~meshes.hits], columns[~meshes.hits], verdict)
        clock.append(perf_counter())
        work = {"mesh_queries": meshes.queries, "reused": meshes.reused, "containment_tests": contained}
        work["face_pairs"] = int(sum(len(one) for one in meshes.sets))
        return self._detection(
            motion,
            verdict,
            face_sets=meshes.face_sets(frames, columns) if faces else None,
            containment=self._containment.words,
            work=near.work | work,
            seconds=dict(zip(("spheres", "boxes", "meshes", "containment"), np.diff(clock).tolist(), strict=True)),
            section_source=sections_of(self.bodies, self.pairs, motion) if faces else None,
        )
