"""RAPID as it really is: run to completion it loses no face."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from cdcore.narrow.rapid_style.search import RapidSearch
from cdcore.narrow.tree_stage import TreeSettings, TreeStage
from cdcore.protocol import Body, Detection, Motion, PairDetector


@dataclass(frozen=True, kw_only=True)
class RapidStyleSettings(TreeSettings):
    """Settings of ``rapid-style``: ``mode``, ``budget``, ``containment``."""


class RapidStyleDetector(PairDetector[RapidStyleSettings]):
    """Re-creation of RAPID: its tree, its descent, its two modes, with faces decided exactly.

    Choose it to see what RAPID does on your recording, complete or cut short by ``budget``. It follows
    the published description; the library itself may not be used commercially and is not used here.

    Source: see ``sources``. Differs: the leaf test is exact where the library's rounds.
    """

    name: ClassVar[str] = "rapid-style"
    online: ClassVar[bool] = False
    Settings: ClassVar[type] = RapidStyleSettings
    sources: ClassVar[tuple[str, ...]] = (
        "S. Gottschalk, M. C. Lin, D. Manocha, OBBTree: a hierarchical structure for rapid interference detection, "
        "SIGGRAPH 1996",
    )
    choose_when: ClassVar[str] = "you compare with RAPID: its descent, its counters, its first-contact mode"
    cannot: ClassVar[str] = "speak for RAPID's own rounding: its leaf test here is exact"

    def __init__(self, bodies: Sequence[Body], pairs: NDArray[np.int64], settings: RapidStyleSettings) -> None:
        super().__init__(bodies, pairs, settings)
        self._trees = TreeStage(bodies, pairs, RapidSearch([body.mesh.triangles for body in bodies]), settings)

    def _run(self, motion: Motion, memory: None, faces: bool) -> Detection:
        del memory
        near = self._trees.everywhere(motion)
        return self._trees.detection(self.name, motion, near, faces=faces, broad=0.0, work={})
