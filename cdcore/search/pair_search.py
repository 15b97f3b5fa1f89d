"""The search of one pair of bodies at one pair of poses: finds a face pair that meets, or says it has not found one.

Whatever it finds has passed the exact triangle test at the reference vertices, so it never invents a contact.
"""

from collections.abc import Callable
from time import perf_counter
from typing import Final

import numpy as np

from cdcore.numerics import EPS, UNDERFLOW_PAD, FloatArray, IntArray
from cdcore.search import state
from cdcore.search.advance import COLONY, LOCAL, RANDOM, advance, follow
from cdcore.search.features import Features
from cdcore.search.flood import flood, sow
from cdcore.search.pair_test import grow_table, meeting_pairs
from cdcore.search.printed import search_as_printed
from cdcore.search.result import Pair, SearchResult
from cdcore.search.rng import BLOCK, stream_of
from cdcore.search.samples import Sample, sample_of
from cdcore.search.settings import SearchSettings

PLACE_PAD: Final = 1024.0 * EPS
"""Pad of the threshold in size of both bodies: their relative pose is rounded five times, each by a few eps of that
size; a pad a hundred times too wide costs a triangle test now and then, one too narrow a contact."""

SLICE: Final = 512
"""Evaluations between two looks at the clock, some 30 microseconds."""

TABLE: Final = 1024
"""First size of the table of tested pairs; it doubles when half full."""

SEARCHERS: Final = {"memetic": COLONY, "corrected": COLONY, "local": LOCAL, "random": RANDOM}

Pose = tuple[FloatArray, FloatArray]


class PairSearch:
    """Searches one pair of bodies, again and again, from the features of both.

    The names of both choose the random stream, with seed and stamp; settings say who searches, with which constants.
    """

    _advance: Callable[..., int] = staticmethod(advance)
    _follow: Callable[..., int] = staticmethod(follow)

    def __init__(self, first: Features, second: Features, names: tuple[str, str], settings: SearchSettings) -> None:
        self.first, self.second, self.names, self.settings = first, second, names, settings
        self._who = SEARCHERS.get(settings.variant, COLONY)
        self._count, self._fresh = np.zeros((2, state.COUNTERS), dtype=np.int64)
        self._number = np.zeros(state.NUMBERS)
        self._pose = np.zeros(state.POSES)
        self._swarm = np.zeros((settings.ants, state.ANT))
        self._table = np.zeros((TABLE, 2), dtype=np.int64)
        self._found = np.zeros((256, 2), dtype=np.int64)
        self._stamp, self._deadline, self._restart = 0.0, 0.0, 0
        self._forget_random()
        self._set_constants()
        self.use(sample_of(first, None, 0, ""), sample_of(second, None, 0, ""))

    def use(self, first: Sample, second: Sample) -> None:
        """Search these samples of both bodies from here on; the flood fill goes over all faces still."""
        self._pick = first.pick, second.pick
        self._near = first.near, second.near

    def look(
        self, pose_a: Pose, pose_b: Pose, stamp: float, *, start: Pair | None = None, budget: int | None = None
    ) -> SearchResult:
        """Search until the first hit or the end of the budget (evaluations; ``None``: that of the settings).

        Poses are rotation (3, 3) and translation (3,); ``stamp``, the time of the frame, is part of the key of the
        random stream; ``start``: places of a pair to begin at, such as the closest of the frame before.
        """
        self._place(pose_a, pose_b, stamp)
        self._count[state.BUDGET] = self.settings.budget if budget is None else budget
        if start is not None:
            self._begin_at(start)
        return self._search()

    def look_longer(self, budget: int) -> SearchResult:
        """Search on without a hit, up to a larger budget; the same as a look with that budget from the start."""
        self._count[state.BUDGET] = budget
        return self._search()

    def look_on(self) -> SearchResult:
        """Search on from a hit for one outside what was found so far, within the same budget; counts go on too."""
        self._count[state.HIT_A] = -1
        self._count[state.QUIET] = 0
        return self._search()

    def curve(self, seeds: IntArray) -> IntArray:
        """Every pair that meets and hangs together with the hit or with a seed that still meets, (k, 2) places, sorted.

        Pairs found by an earlier call at these poses are kept. ``seeds`` (n, 2): places, of the frame before.
        """
        count = self._count
        if count[state.UNDECIDED]:
            count[state.BY_CORNERS] = 1
        if count[state.HIT_A] >= 0:
            self._add(count[[state.HIT_A, state.HIT_B]][None])
        self._flow(lambda: sow(seeds, self._found, *self._rows(), self._pose, count, self._table))
        near = (self.first.near, self.second.near, self.first.links, self.second.links)
        self._flow(lambda: flood(self._found, *self._rows(), *near, self._pose, count, self._table))
        first, second = self._found[: count[state.FOUND_COUNT]].T
        return np.stack(np.divmod(np.unique(first * len(self.second) + second), len(self.second)), axis=1)

    @property
    def flood_tests(self) -> int:
        """Triangle tests of the flood fill at these poses."""
        return int(self._count[state.FLOOD_TESTS])

    def _set_constants(self) -> None:
        """The numbers of the settings, and the counters of a search that has not begun."""
        s, fresh, number = self.settings, self._fresh, self._number
        fresh[[state.HIT_A, state.HIT_B, state.LAST_A, state.LAST_B, state.START_A, state.START_B]] = -1
        fresh[[state.RESTART_AFTER, state.ANTS, state.FRESH]] = s.restart_after, s.ants, 1
        fresh[[state.DAEMON, state.AMPLITUDE]] = s.variant == "memetic", s.decode == "amplitude"
        fresh[state.WITHOUT] = s.without_equation or 0
        number[[state.TURN, state.MUTATION, state.ALPHA, state.BETA]] = s.turn, s.mutation, s.alpha, s.beta
        number[[state.EVAPORATION, state.REWARD]] = s.evaporation, s.reward
        number[[state.LEAST, state.MOST]] = s.pheromone_least, s.pheromone_most
        number[state.SCALE] = self.first.mean_radius + self.second.mean_radius or 1.0

    def _place(self, pose_a: Pose, pose_b: Pose, stamp: float) -> None:
        """Forget the search before and take new poses."""
        (turn_a, move_a), (turn_b, move_b) = pose_a, pose_b
        relative = turn_b.T @ turn_a, turn_b.T @ (move_a - move_b)
        for at, (turn, move) in ((state.WORLD_A, pose_a), (state.WORLD_B, pose_b), (state.RELATIVE, relative)):
            self._pose[at : at + 9], self._pose[at + 9 : at + 12] = turn.ravel(), move
        size = self.first.size + self.second.size + float(np.abs(move_a).max() + np.abs(move_b).max())
        self._number[state.PAD] = PLACE_PAD * size + UNDERFLOW_PAD
        self._number[state.CLOSEST] = np.inf
        generation = self._count[state.GENERATION] + 1
        self._count[:] = self._fresh
        self._count[state.GENERATION] = generation
        self._stamp, self._restart = stamp, 0
        self._forget_random()
        self._deadline = perf_counter() + (self.settings.budget_seconds or 0.0)

    def _begin_at(self, start: Pair) -> None:
        """Look at a pair first. Variants with local search descend from it; the colony's first ant starts there."""
        walk = self.settings.variant in ("memetic", "local")
        count = self._count
        self._follow(walk, *start, *self._rows(), *self._near, self._pose, self._number, count, self._table)
        self._resolve()
        best = count[state.BEST_A], count[state.BEST_B]
        for at, place, pick in zip((state.START_A, state.START_B), best, self._pick, strict=True):
            count[at] = min(int(np.searchsorted(pick, place)), len(pick) - 1)

    def _search(self) -> SearchResult:
        if self.settings.variant == "printed":
            return self._search_as_printed()
        if self.settings.budget_seconds is None:
            self._run()
            return self._answer()
        count = self._count
        while count[state.HIT_A] < 0 and perf_counter() < self._deadline:
            count[state.BUDGET] = count[state.EVALUATIONS] + SLICE
            self._run()
        return self._answer()

    def _search_as_printed(self) -> SearchResult:
        """The equations as printed, one pair at a time; their closest pair is kept here, not by them."""
        number, count = self._number, self._count
        closest, pair = np.inf, (-1, -1)

        def evaluate(i: int, j: int) -> float:
            nonlocal closest, pair
            number[state.CLOSEST] = np.inf
            pair_now = int(self._pick[0][i]), int(self._pick[1][j])
            self._follow(False, *pair_now, *self._rows(), *self._near, self._pose, number, count, self._table)
            self._resolve()
            distance = float(number[state.CLOSEST])
            if distance < closest:
                closest, pair = distance, pair_now
            return distance

        def is_over() -> bool:
            return bool(count[state.HIT_A] >= 0 or count[state.EVALUATIONS] >= count[state.BUDGET])

        stream = stream_of(self.settings.seed, *self.names, self._stamp, self._restart)
        sizes = (len(self._pick[0]), len(self._pick[1]))
        count[state.ITERATIONS], broken = search_as_printed(evaluate, is_over, sizes, self.settings, stream)
        if closest < np.inf:  # else a warm start has spent the budget, and what it found holds
            number[state.CLOSEST], (count[state.BEST_A], count[state.BEST_B]) = closest, pair
        return self._answer(broken=broken)

    def _run(self) -> None:
        """Serve the kernel with what it asks for until it has a hit or its budget is spent."""
        while True:
            outcome = self._advance(
                self._who, self._swarm, *self._pick, *self._rows(), *self._near, self._pose, self._number,
                self._count, self._table, self._random,
            )  # fmt: skip
            if outcome in (state.FOUND, state.SPENT):
                return
            if outcome == state.HUNGRY:
                self._feed()
            elif outcome == state.STALE:
                self._restart += 1
                self._forget_random()
                self._count[state.CURSOR] = 0
            elif outcome == state.FULL:
                self._grow()
            elif outcome == state.UNSURE and self._resolve():
                return

    def _forget_random(self) -> None:
        self._stream: np.random.Generator | None = None
        self._random = np.zeros(0)

    def _feed(self) -> None:
        """More random numbers, after those not used yet."""
        if self._stream is None:
            self._stream = stream_of(self.settings.seed, *self.names, self._stamp, self._restart)
        left = self._random[self._count[state.CURSOR] :]
        size = max(BLOCK, 16 * self.settings.ants)
        self._random = np.concatenate([left, self._stream.random(size)])
        self._count[state.CURSOR] = 0

    def _resolve(self) -> bool:
        """Ask the exact predicate about the pairs left open; whether there is a hit now."""
        meeting, count = self._ask_open(), self._count
        if len(meeting) and count[state.HIT_A] < 0:
            count[state.HIT_A], count[state.HIT_B] = meeting[0]
            meeting = meeting[1:]
        # these would be lost to the flood fill: the table holds them as tested
        self._add(meeting)
        return bool(count[state.HIT_A] >= 0)

    def _ask_open(self) -> IntArray:
        """Pairs left open that meet, (k, 2); none is open after this."""
        count = self._count
        keys = count[state.OPEN_FIRST : state.OPEN_FIRST + count[state.OPEN]].copy()
        count[state.OPEN] = 0
        if not len(keys):
            return np.zeros((0, 2), dtype=np.int64)
        pairs = np.stack(np.divmod(keys, len(self.second)), axis=1)
        return meeting_pairs(self.first, self.second, self._pose, pairs)

    def _flow(self, run: Callable[[], int]) -> None:
        """Serve the flood fill until it is done."""
        while True:
            outcome = run()
            if outcome == state.SPENT:
                return
            if outcome == state.FULL:
                self._grow()
                self._found = np.concatenate([self._found, np.zeros_like(self._found)])
            self._add(self._ask_open())

    def _add(self, pairs: IntArray) -> None:
        """Put pairs that meet where the flood fill starts from."""
        before = int(self._count[state.FOUND_COUNT])
        after = before + len(pairs)
        while after > len(self._found):
            self._found = np.concatenate([self._found, np.zeros_like(self._found)])
        self._found[before:after] = pairs
        self._count[state.FOUND_COUNT] = after

    def _grow(self) -> None:
        larger = np.zeros((2 * len(self._table), 2), dtype=np.int64)
        grow_table(self._table, larger, self._count)
        self._table = larger

    def _rows(self) -> tuple[FloatArray, FloatArray]:
        return self.first.rows, self.second.rows

    def _answer(self, *, broken: bool = False) -> SearchResult:
        count = self._count
        hit_a, hit_b, best_a, best_b = count[[state.HIT_A, state.HIT_B, state.BEST_A, state.BEST_B]].tolist()
        hit = (hit_a, hit_b) if hit_a >= 0 else None
        return SearchResult(
            hit=hit,
            closest=(best_a, best_b),
            distance=float(self._number[state.CLOSEST]),
            evaluations=int(count[state.EVALUATIONS]),
            tests=int(count[state.TESTS]),
            restarts=self._restart,
            iterations=int(count[state.ITERATIONS]),
            reason="hit" if hit else "broken" if broken else "budget",
        )
