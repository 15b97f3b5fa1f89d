"""Why a search found nothing: ten times the budget finds it, or the search itself failed on what it could draw."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cdcore.protocol import Body, Explanation, Motion
from cdcore.search.settings import SearchSettings
from cdcore.search.stage import SearchStage

TIMES_MORE: Final = 10
"""A budget is said to have run out where this many times as much finds the contact."""


class SearchExplainer:
    """Searches single pair-frames again, patiently.

    Parameters
    ----------
    bodies, pairs, settings : of the detector that missed; trees of a pair are built when it is first asked about.
    """

    def __init__(self, bodies: Sequence[Body], pairs: NDArray[np.int64], settings: SearchSettings) -> None:
        self._bodies, self._pairs = bodies, pairs
        self._settings = replace(settings, budget=settings.budget * TIMES_MORE, budget_seconds=None)
        self._stages: dict[int, SearchStage] = {}

    def explain(
        self, motion: Motion, frame: int, pair: int, faces: NDArray[np.int64], *, volumes_meet: bool
    ) -> Explanation:
        """What spheres and search make of one pair in one frame.

        Parameters
        ----------
        faces : (k, 2) the face pairs that meet; every face can be drawn, so any of them is in the sample.
        volumes_meet : whether spheres and boxes let the pair through.
        """
        if not len(faces):
            return Explanation(spheres_meet=volumes_meet)
        return Explanation(
            spheres_meet=volumes_meet, sample_meets=True, found_with_more=self._finds(motion, frame, pair)
        )

    def _finds(self, motion: Motion, frame: int, pair: int) -> bool:
        if pair not in self._stages:
            self._stages[pair] = SearchStage(self._bodies, self._pairs[[pair]], self._settings)
        stage = self._stages[pair]
        now = motion.frames(frame, frame + 1)
        return bool(stage.decide(now, np.ones((1, 1), dtype=np.bool_), stage.fresh_memory()).hits[0, 0])
