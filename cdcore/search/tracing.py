"""A search watched: how each look of a run began, and on request everything that one look evaluated.

A look is traced by searching again from the same start, with the same stream and budget; its kernel then writes every
evaluation to an array.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from cdcore.numerics import BoolArray, FloatArray, IntArray
from cdcore.protocol import Body, FaceSets, Motion
from cdcore.search.pair_search import PairSearch
from cdcore.search.result import Pair, SearchResult
from cdcore.search.search_settings import SearchSettings
from cdcore.search.stage import LookKey, SearchStage
from cdcore.search.state import ASKED_BY


@dataclass(frozen=True)
class NotedLook:
    """A look of a run: the pair it started at, its budget, and what it gave."""

    start: Pair | None
    budget: int
    result: SearchResult


@dataclass(frozen=True, eq=False)
class LookTrace:
    """Every evaluation of one look, in order."""

    faces: IntArray  # (n, 2) face numbers, in the order of the pair
    distance: FloatArray  # (n,) of their centroids, metres
    iteration: IntArray  # (n,) of the colony; 0 before its first
    asked_by: NDArray[np.str_]  # (n,) "start", "ant", "walk" (local search) or "draw"
    pheromone: FloatArray  # (n,) of the ant at the end of its iteration; nan where no ant asked
    result: SearchResult  # what the look gave

    def best(self) -> IntArray:
        """Evaluations that came closer than all before, and last the hit, in order."""
        nearer = np.minimum.accumulate(self.distance)
        rows = np.flatnonzero(np.append(True, nearer[1:] < nearer[:-1]))
        last = len(self.distance) - 1
        return rows if self.result.hit is None or rows[-1] == last else np.append(rows, last)


class NotingStage(SearchStage):
    """The search of a run once more, with a note of every look: ``noted[frame, column]``.

    ``known``: looks of that run that found nothing; they are not searched again.
    """

    def __init__(
        self, bodies: Sequence[Body], pairs: IntArray, settings: SearchSettings, known: Mapping[LookKey, SearchResult]
    ) -> None:
        super().__init__(bodies, pairs, settings)
        self._known = known
        self.noted: dict[tuple[int, int], NotedLook] = {}

    def trace(self, motion: Motion, frame: int, column: int) -> LookTrace:
        """Everything that a noted look evaluated."""
        searched, noted = self._searches[column], self.noted[frame, column]
        # A search of its own: that of the run keeps what its next look starts from.
        search = PairSearch(searched.first, searched.second, searched.names, self._settings)
        rows = search.trace(noted.result.evaluations)
        poses, stamp = self._poses(motion, frame, column), float(motion.times[frame])
        result = search.look(*poses, stamp, start=noted.start, budget=noted.budget)
        i, j, iteration, by = rows[:, [0, 1, 3, 4]].astype(np.int64).T
        faces = self._numbered(column, np.stack([i, j], axis=1))
        return LookTrace(faces, rows[:, 2], iteration, np.array(ASKED_BY)[by], rows[:, 5], result)

    def points(self, motion: Motion, frame: int, column: int, pair: Pair) -> FloatArray:
        """World centroids (2, 3) of a pair that a look gave, in the order of the search."""
        search, poses = self._searches[column], self._poses(motion, frame, column)
        sides = zip((search.first, search.second), pair, poses, strict=True)
        return np.array([rotation @ side.rows[row, :3] + move for side, row, (rotation, move) in sides])

    def _search(self, frame: int, key: LookKey) -> SearchResult:
        column, _, _, start, budget = key
        result = self._known.get(key) or super()._search(frame, key)
        self.noted[frame, column] = NotedLook(start, budget, result)
        return result


@dataclass(frozen=True, eq=False)
class Watched:
    """Record of what a detector with a search did with a motion.

    ``spheres``, ``boxes``, ``searched``: (T, P), the pair-frames that each stage let through, and those looked at.
    ``search``: traces a look. ``settings``: of the detector. ``face_sets``: of the contacts, as if faces had been asked
    for; ``None`` where others than the search find some.
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
