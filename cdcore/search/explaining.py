"""Why a search found nothing: no pair that meets was in its sample, its budget ran out, or the search itself failed."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from cdcore.numerics import BoolArray, IntArray
from cdcore.protocol import Body, Explanation, Motion, pair_has_pose
from cdcore.search.features import features_of
from cdcore.search.samples import sample_of
from cdcore.search.search_settings import SearchSettings
from cdcore.search.stage import SearchStage

TIMES_MORE: Final = 10
"""A miss is blamed on the budget where this many times the budget finds the contact."""


FRAMES_BEFORE: Final = 32
"""At least so many frames before a miss are searched again too, because a search starts where the one before ended.
Of 74 misses of ``hybrid-qaco[budget=100]`` in bench-bumps (choreography 1) a cold search finds 40, one warm for 16
frames 67, for 32 72; a run with ten times the budget finds as many. To begin from the run's own closest faces changes
none of these."""


class SearchExplainer:
    """Searches pair-frames again with ten times the budget, warm from frames before as the run was.

    Parameters
    ----------
    bodies, pairs, settings : of the detector that missed; trees of a pair are built when it is first asked about.
    """

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, settings: SearchSettings) -> None:
        self._bodies, self._pairs = bodies, pairs
        self._settings = replace(settings, budget=settings.budget * TIMES_MORE)
        self._stages: dict[int, SearchStage] = {}
        self._drawn: dict[int, IntArray] = {}
        self._motion: Motion | None = None
        self._found: dict[tuple[int, int], BoolArray] = {}

    def explain(self, motion: Motion, frame: int, pair: int, faces: IntArray, *, volumes_meet: bool) -> Explanation:
        """What spheres and search make of one pair in one frame.

        Parameters
        ----------
        faces : (k, 2) the face pairs that meet, in the order of the pair. With ``samples`` they are looked up
            in the sample; without, every face can be drawn.
        volumes_meet : whether spheres and boxes let the pair through.
        """
        sampled = self._sample_meets(pair, faces) if len(faces) else None
        found = self._finds(motion, frame, pair) if sampled else None
        return Explanation(spheres_meet=volumes_meet, sample_meets=sampled, found_with_more=found)

    def _sample_meets(self, pair: int, faces: IntArray) -> bool:
        """Whether a pair of faces that meets has both its faces in the sample."""
        size = self._settings.samples
        if size is None:
            return True
        first, second = (self._sample(body, size) for body in self._pairs[pair].tolist())
        return bool((np.isin(faces[:, 0], first) & np.isin(faces[:, 1], second)).any())

    def _sample(self, body: int, size: int) -> IntArray:
        """Numbers of the faces of a body that its searches draw from."""
        if body not in self._drawn:
            features = features_of(self._bodies[body].mesh)
            sample = sample_of(features, size, self._settings.seed, self._bodies[body].name)
            self._drawn[body] = features.face[sample.pick]
        return self._drawn[body]

    def _finds(self, motion: Motion, frame: int, pair: int) -> bool:
        """Whether it is found with ten times the budget; neighbours in time share a search, which is kept."""
        if motion is not self._motion:
            self._motion, self._found = motion, {}
        first = max(0, frame // FRAMES_BEFORE - 1) * FRAMES_BEFORE
        if (pair, first) not in self._found:
            self._found[pair, first] = self._search_again(motion, first, pair)
        return bool(self._found[pair, first][frame - first])

    def _search_again(self, motion: Motion, first: int, pair: int) -> BoolArray:
        if pair not in self._stages:
            self._stages[pair] = SearchStage(self._bodies, self._pairs[[pair]], self._settings)
        stage = self._stages[pair]
        known, now = stage.fresh_memory(), motion.frames(first, first + 2 * FRAMES_BEFORE)
        return stage.decide(now, pair_has_pose(now, self._pairs[[pair]]), known).hits[:, 0]
