"""Spheres only: one test a pair and frame, and never a false negative."""

from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter

from cdcore.bounding.bounding_sphere import SPHERES, sphere_in_mode
from cdcore.broad.sphere_stage import SphereStage
from cdcore.detectors.detector_table import PAPER
from cdcore.numerics import IntArray
from cdcore.protocol import Body, Detection, Motion, PairDetector
from cdcore.protocol.settings import CheckedSettings, choice


@dataclass(frozen=True, kw_only=True)
class SphereSettings(CheckedSettings):
    """``sphere``: "paper" for equation (21), "best" for the smallest ball known."""

    sphere: str = choice("best", SPHERES)


class SphereDetector(PairDetector[SphereSettings]):
    """Says CANDIDATE where bounding spheres overlap, CLEAR where they do not, and cannot say CONTACT.

    Every contact of any other detector is among its candidates, and most candidates are none. Source: equation (21) and
    the padding of ``cdcore.broad.sphere_stage``.
    """

    name = "sphere"
    stages = ("spheres",)
    kind = "paper"
    online = True
    Settings = SphereSettings
    sources = (f"{PAPER}, equation (21)",)
    choose_when = "you want an answer that never misses from one test a pair and frame"
    cannot = "confirm anything"

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, settings: SphereSettings) -> None:
        super().__init__(bodies, pairs, settings)
        spheres = [sphere_in_mode(body.mesh, settings.sphere) for body in bodies]
        self._spheres = SphereStage(spheres, pairs)

    def _run(self, motion: Motion, _memory: None, _faces: bool) -> Detection:
        start = perf_counter()
        verdict, tests = self._spheres.candidates(motion)
        seconds = {"spheres": perf_counter() - start}
        refused = ("refused: spheres alone cannot tell",) * len(self.pairs)
        return self._detection(motion, verdict, containment=refused, work={"sphere_tests": tests}, seconds=seconds)
