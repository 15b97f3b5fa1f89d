"""Why a search found nothing: no pair that meets was in its sample, its budget ran out, or the search itself failed."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from cdcore.numerics import IntArray
from cdcore.protocol import Body, Explanation, Motion
from cdcore.search.features import features_of
from cdcore.search.samples import sample_of
from cdcore.search.settings import SearchSettings
from cdcore.search.stage import SearchStage

TIMES_MORE: Final = 10
"""A miss is blamed on the budget where this many times the budget finds the contact."""


class SearchExplainer:
    """Searches single pair-frames again, with ten times the budget.

    Parameters
    ----------
    bodies, pairs, settings : of the detector that missed; trees of a pair are built when it is first asked about.
    """

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, settings: SearchSettings) -> None:
        self._bodies, self._pairs = bodies, pairs
        more, whole_frame = settings.budget * TIMES_MORE, settings.frame_budget * TIMES_MORE
        self._settings = replace(settings, budget=more, frame_budget=whole_frame, budget_seconds=None)
        self._stages: dict[int, SearchStage] = {}
        self._drawn: dict[int, IntArray] = {}

    def explain(self, motion: Motion, frame: int, pair: int, faces: IntArray, *, volumes_meet: bool) -> Explanation:
        """What spheres and search make of one pair in one frame.

        Parameters
        ----------
        faces : (k, 2) the face pairs that meet, in the order of the pair. With ``samples`` a number they are looked
            up in the sample; without it, and with "auto", which probes them all, every face can be drawn.
        volumes_meet : whether spheres and boxes let the pair through.
        """
        sampled = self._sample_meets(pair, faces) if len(faces) else None
        found = self._finds(motion, frame, pair) if sampled else None
        return Explanation(spheres_meet=volumes_meet, sample_meets=sampled, found_with_more=found)

    def _sample_meets(self, pair: int, faces: IntArray) -> bool:
        """Whether a pair of faces that meets has both its faces in the sample."""
        if not isinstance(self._settings.samples, int):
            return True
        first, second = (self._sample(body, self._settings.samples) for body in self._pairs[pair].tolist())
        return bool((np.isin(faces[:, 0], first) & np.isin(faces[:, 1], second)).any())

    def _sample(self, body: int, size: int) -> IntArray:
        """Numbers of the faces of a body that its searches draw from."""
        if body not in self._drawn:
            features = features_of(self._bodies[body].mesh)
            sample = sample_of(features, size, self._settings.seed, self._bodies[body].name)
            self._drawn[body] = features.face[sample.pick]
        return self._drawn[body]

    def _finds(self, motion: Motion, frame: int, pair: int) -> bool:
        if pair not in self._stages:
            self._stages[pair] = SearchStage(self._bodies, self._pairs[[pair]], self._settings)
        stage = self._stages[pair]
        now = motion.frames(frame, frame + 1)
        return bool(stage.decide(now, np.ones((1, 1), dtype=np.bool_), stage.fresh_memory()).hits[0, 0])
