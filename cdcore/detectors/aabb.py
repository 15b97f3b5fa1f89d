"""World boxes fitted anew to every pose: complete, exact, and the same cost whether or not the bodies turn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from cdcore.bounding.sphere import sphere_best
from cdcore.broad.sphere_stage import SphereStage
from cdcore.narrow.aabb.search import AabbSearch
from cdcore.narrow.tree_stage import TreeSettings, TreeStage
from cdcore.protocol import Body, Detection, Motion, PairDetector


@dataclass(frozen=True, kw_only=True)
class AabbSettings(TreeSettings):
    """Settings of ``aabb``: ``mode``, ``budget``, ``containment``."""


class AabbDetector(PairDetector[AabbSettings]):
    """A tree of axis-aligned boxes around the points that count, exact faces at its leaves.

    Choose it as the simplest complete hierarchy: its box tests compare numbers that were rounded already, so it has no
    tolerance to doubt. ``obb`` is faster wherever bodies are rigid.

    Source: see ``sources``. Cost: all faces of both bodies once a pose whose spheres overlap, then the boxes that meet.
    """

    name: ClassVar[str] = "aabb"
    online: ClassVar[bool] = False
    Settings: ClassVar[type] = AabbSettings
    sources: ClassVar[tuple[str, ...]] = (
        "G. van den Bergen, Efficient collision detection of complex deformable models using AABB trees, Journal of "
        "Graphics Tools 2(4), 1997",
    )
    choose_when: ClassVar[str] = "you want a complete tree without any tolerance, to compare others with"
    cannot: ClassVar[str] = "be fast on large meshes: it refits every box in every pose"

    def __init__(self, bodies: Sequence[Body], pairs: NDArray[np.int64], settings: AabbSettings) -> None:
        super().__init__(bodies, pairs, settings)
        self._spheres = SphereStage([sphere_best(body.mesh) for body in bodies], pairs)
        search = AabbSearch([body.mesh.triangles for body in bodies])
        self._trees = TreeStage(bodies, pairs, search, settings)

    def _run(self, motion: Motion, memory: None, faces: bool) -> Detection:
        del memory
        start = perf_counter()
        near = self._spheres.candidates(motion)
        work = {"sphere_tests": near.tests, "skipped": near.skipped}
        broad = perf_counter() - start
        return self._trees.detection(self.name, motion, near.verdict, faces=faces, broad=broad, work=work)
