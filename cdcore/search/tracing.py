"""Explains searches afterwards: how each search of a run began, everything that one evaluated, and why one missed.

A search is traced by searching again from the same start, with the same stream and budget; its kernel then writes every
evaluation to an array.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from cdcore.numerics import BoolArray, FloatArray, IntArray
from cdcore.protocol import Body, Explanation, FaceSets, Motion, pair_has_pose
from cdcore.search.pair_search import Pair, PairSearch, SearchResult
from cdcore.search.search_settings import SearchSettings
from cdcore.search.stage import SearchKey, SearchStage
from cdcore.search.state import SOURCES

TIMES_MORE: Final = 10
"""A miss is blamed on the budget where this many times the budget finds the contact."""


FRAMES_BEFORE: Final = 32
"""At least so many frames before a miss are searched again too, because a search starts where the one before ended.
Of 74 misses of ``hybrid-qaco[budget=100]`` in bench-bumps (choreography 1) a cold search finds 40, one warm for 16
frames 67, for 32 72; a run with ten times the budget finds as many. To begin from the run's own closest faces changes
none of these."""


@dataclass(frozen=True)
class NotedSearch:
    """A search of a run: the pair it started at, its budget, and what it gave."""

    start: Pair | None
    budget: int
    result: SearchResult


@dataclass(frozen=True, eq=False)
class SearchTrace:
    """Every evaluation of one search, in order."""

    faces: IntArray  # (n, 2) face numbers, in the order of the pair
    distance: FloatArray  # (n,) of their centroids, metres
    iteration: IntArray  # (n,) of the colony; 0 before its first
    source: NDArray[np.str_]  # (n,) of ``SOURCES``: where the pair came from
    pheromone: FloatArray  # (n,) of the ant at the end of its iteration; nan where no ant chose the pair
    result: SearchResult  # what the search gave

    def best(self) -> IntArray:
        """Evaluations that came closer than all before, and last the hit, in order."""
        nearer = np.minimum.accumulate(self.distance)
        rows = np.flatnonzero(np.append(True, nearer[1:] < nearer[:-1]))
        last = len(self.distance) - 1
        return rows if self.result.hit is None or rows[-1] == last else np.append(rows, last)


class NotingStage(SearchStage):
    """The search of a run once more, with a note of every pair-frame: ``noted[frame, column]``.

    ``known``: searches of that run without a hit; they are not searched again.
    """

    def __init__(
        self, bodies: Sequence[Body], pairs: IntArray, settings: SearchSettings, known: Mapping[SearchKey, SearchResult]
    ) -> None:
        super().__init__(bodies, pairs, settings)
        self._known = known
        self.noted: dict[tuple[int, int], NotedSearch] = {}

    def trace(self, motion: Motion, frame: int, column: int) -> SearchTrace:
        """Everything that a noted search evaluated."""
        searched, noted = self._searches[column], self.noted[frame, column]
        # A search of its own: that of the run keeps what its next search starts from.
        search = PairSearch(searched.first, searched.second, searched.names, self._settings)
        rows = search.trace(noted.result.evaluations)
        poses, stamp = self._poses(motion, frame, column), float(motion.times[frame])
        result = search.search(*poses, stamp, start=noted.start, budget=noted.budget)
        i, j, iteration, by = rows[:, [0, 1, 3, 4]].astype(np.int64).T
        faces = self._numbered_face_pairs(column, np.stack([i, j], axis=1))
        return SearchTrace(faces, rows[:, 2], iteration, np.array(SOURCES)[by], rows[:, 5], result)

    def points(self, motion: Motion, frame: int, column: int, pair: Pair) -> FloatArray:
        """World centroids (2, 3) of a pair that a search gave, in the order of the search."""
        search, poses = self._searches[column], self._poses(motion, frame, column)
        sides = zip((search.first, search.second), pair, poses, strict=True)
        return np.array([rotation @ side.rows[row, :3] + move for side, row, (rotation, move) in sides])

    def _search(self, frame: int, key: SearchKey) -> SearchResult:
        column, _, _, start, budget = key
        result = self._known.get(key) or super()._search(frame, key)
        self.noted[frame, column] = NotedSearch(start, budget, result)
        return result


@dataclass(frozen=True, eq=False)
class Watched:
    """Record of what a detector with a search did with a motion.

    ``spheres``, ``boxes``, ``searched``: (T, P), the pair-frames that each stage let through, and those searched.
    ``search``: traces one of them. ``settings``: of the detector. ``face_sets``: of the contacts, as if faces were
    requested; ``None`` where others than the search find some.
    """

    spheres: BoolArray
    boxes: BoolArray
    searched: BoolArray
    search: NotingStage
    settings: SearchSettings
    face_sets: FaceSets | None


@runtime_checkable
class Watchable(Protocol):
    """A detector that can show how it came to its answer."""

    def watch(self, motion: Motion) -> Watched:
        """Answer again, as without blocks, and keep what each stage did; the motion is held in memory."""


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

    def explain(self, motion: Motion, frame: int, pair: int, faces: IntArray) -> Explanation:
        """Explains one pair in one frame by its search.

        Parameters
        ----------
        faces : (k, 2) the face pairs that meet, in the order of the pair.
        """
        sampled = self._stage(pair).samples_meet(0, faces) if len(faces) else None
        finds_now = self._finds(motion, frame, pair) if sampled else None
        return Explanation(sample_meets=sampled, found_with_more=finds_now)

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
