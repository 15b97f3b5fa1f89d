"""Oriented boxes that turn with their bodies: complete, with the tightest boxes of the hierarchies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from cdcore.narrow.obb.search import ObbSearch
from cdcore.narrow.tree_stage import TreeSettings, TreeStage
from cdcore.protocol import Body, Detection, Motion, PairDetector


@dataclass(frozen=True, kw_only=True)
class ObbSettings(TreeSettings):
    """Settings of ``obb``: ``mode``, ``budget``, ``containment``."""


class ObbDetector(PairDetector[ObbSettings]):
    """A tree of oriented boxes, fifteen axes a test, exact faces at its leaves.

    Choose it as the plain hierarchy of rigid bodies, with counters and a budget. It asks every pair-frame from its root
    boxes, and knows nothing of the frame before; ``exact`` does, and is faster over a motion.

    Source: see ``sources``. Cost: a box test at the root some 0.1 microseconds a pair-frame, then what meets.
    """

    name: ClassVar[str] = "obb"
    online: ClassVar[bool] = False
    Settings: ClassVar[type] = ObbSettings
    sources: ClassVar[tuple[str, ...]] = (
        "S. Gottschalk, M. C. Lin, D. Manocha, OBBTree: a hierarchical structure for rapid interference detection, "
        "SIGGRAPH 1996",
    )
    choose_when: ClassVar[str] = "you want a complete tree of rigid bodies whose work you can count or cut"
    cannot: ClassVar[str] = "use what the frame before knew, as `exact` does"

    def __init__(self, bodies: Sequence[Body], pairs: NDArray[np.int64], settings: ObbSettings) -> None:
        super().__init__(bodies, pairs, settings)
        self._trees = TreeStage(bodies, pairs, ObbSearch([body.mesh.triangles for body in bodies]), settings)

    def _run(self, motion: Motion, memory: None, faces: bool) -> Detection:
        del memory
        near = self._trees.everywhere(motion)
        return self._trees.detection(self.name, motion, near, faces=faces, broad=0.0, work={})
