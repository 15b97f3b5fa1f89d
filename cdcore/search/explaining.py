"""Why a search found nothing: no pair that meets was in its sample, its budget ran out, or the search itself failed."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from cdcore.numerics import BoolArray, IntArray
from cdcore.protocol import Body, Explanation, Motion, pair_has_pose
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
    bodies, pairs, settings : of the detector that missed; what a pair is searched with is built when it is first asked
        about.
    """

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, settings: SearchSettings) -> None:
        self._bodies, self._pairs = bodies, pairs
        self._settings = replace(settings, budget=settings.budget * TIMES_MORE)
        self._stages: dict[int, SearchStage] = {}
        self._motion: Motion | None = None
        self._finds_by_pair: dict[tuple[int, int], BoolArray] = {}

    def explain(self, motion: Motion, frame: int, pair: int, faces: IntArray, *, volumes_meet: bool) -> Explanation:
        """Explains one pair in one frame by its spheres and its search.

        Parameters
        ----------
        faces : (k, 2) the face pairs that meet, in the order of the pair.
        volumes_meet : whether spheres and boxes let the pair through.
        """
        sampled = self._stage(pair).samples_meet(0, faces) if len(faces) else None
        finds_now = self._finds(motion, frame, pair) if sampled else None
        return Explanation(spheres_meet=volumes_meet, sample_meets=sampled, found_with_more=finds_now)

    def _stage(self, pair: int) -> SearchStage:
        if pair not in self._stages:
            self._stages[pair] = SearchStage(self._bodies, self._pairs[[pair]], self._settings)
        return self._stages[pair]

    def _finds(self, motion: Motion, frame: int, pair: int) -> bool:
        """Whether it is found with ten times the budget; neighbours in time share a search, which is kept."""
        if motion is not self._motion:
            self._motion, self._finds_by_pair = motion, {}
        first = max(0, frame // FRAMES_BEFORE - 1) * FRAMES_BEFORE
        if (pair, first) not in self._finds_by_pair:
            stage, frames = self._stage(pair), motion.frames(first, first + 2 * FRAMES_BEFORE)
            near = pair_has_pose(frames, self._pairs[[pair]])
            self._finds_by_pair[pair, first] = stage.decide(frames, near, stage.fresh_memory()).hits[:, 0]
        return bool(self._finds_by_pair[pair, first][frame - first])
