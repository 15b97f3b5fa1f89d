"""The search of one pair of bodies at one pair of poses: finds a face pair that meets, or says it has not found one.

Whatever it finds has passed the exact triangle test at the reference vertices, so it never invents a contact.
"""

from collections.abc import Callable
from time import perf_counter
from typing import Final

import numpy as np

from cdcore.kernels.memory import address_of
from cdcore.numerics import EPS, UNDERFLOW_PAD, FloatArray, IntArray
from cdcore.search.advance import COLONY, LOCAL, RANDOM, advance, follow
from cdcore.search.features import Features
from cdcore.search.flood import flood, sow
from cdcore.search.pair_test import grow_table, meeting_pairs
from cdcore.search.printed import search_as_printed
from cdcore.search.result import Pair, SearchResult
from cdcore.search.rng import BLOCK, stream_of
from cdcore.search.samples import Sample, sample_of
from cdcore.search.settings import SearchSettings
from cdcore.search.state import ANT, FOUND, FULL, HUNGRY, SPENT, STALE, STATE, TRACED, UNSURE, Faces

PLACE_PAD: Final = 1024.0 * EPS
"""Pad of the threshold in size of both bodies: their relative pose is rounded five times, each by a few eps of that
size; a pad a hundred times too wide costs a triangle test now and then, one too narrow a contact."""

SLICE: Final = 512
"""Evaluations between two looks at the clock, some 30 microseconds."""

TABLE: Final = 1024
"""First size of the table of tested pairs; it doubles when half full."""

FROM_SETTINGS: Final = (
    "restart_after", "ants", "turn", "mutation", "alpha", "beta", "evaporation", "reward", "pheromone_least",
    "pheromone_most",
)  # fmt: skip
"""Fields of the state that are those of the settings."""

SEARCHERS: Final = {"memetic": COLONY, "corrected": COLONY, "local": LOCAL, "random": RANDOM}

Pose = tuple[FloatArray, FloatArray]


class PairSearch:
    """Searches one pair of bodies, again and again, from the features of both.

    The names of both choose the random stream, with seed and stamp; settings say who searches, with which constants.
    """

    def __init__(self, first: Features, second: Features, names: tuple[str, str], settings: SearchSettings) -> None:
        self.first, self.second, self.names, self.settings = first, second, names, settings
        self._who = SEARCHERS.get(settings.variant, COLONY)
        self._states = np.zeros(2, dtype=STATE)
        self._state, self._fresh = self._states
        self._bytes = self._states.view(np.uint8).reshape(2, -1)
        self._poses = [self._state[name] for name in ("world_a", "world_b", "relative")]
        self._swarm = np.zeros(settings.ants, dtype=ANT)
        self._table = np.zeros((TABLE, 2), dtype=np.int64)
        self._found = np.zeros((256, 2), dtype=np.int64)
        self._stamp, self._deadline, self._restart = 0.0, 0.0, 0
        self._forget_random()
        self._set_constants()
        self.use(sample_of(first, None, 0, ""), sample_of(second, None, 0, ""))

    def use(self, first: Sample, second: Sample) -> None:
        """Search these samples of both bodies from here on; the flood fill goes over all faces still."""
        self.samples = first, second
        rows = self.first.rows, self.second.rows
        self._faces = Faces(first.pick, second.pick, *rows, first.near, second.near, self._table)

    def trace(self, rows: int) -> FloatArray:
        """Write the first so many evaluations of each look from here on down, (rows, TRACED), as ``state`` says."""
        self._trace = np.zeros((rows, TRACED))
        self._fresh["trace"], self._fresh["trace_rows"] = address_of(self._trace), rows
        return self._trace

    def look(
        self, pose_a: Pose, pose_b: Pose, stamp: float, *, start: Pair | None = None, budget: int | None = None
    ) -> SearchResult:
        """Search until the first hit or the end of the budget (evaluations; ``None``: that of the settings).

        Poses are rotation (3, 3) and translation (3,); ``stamp``, the time of the frame, is part of the key of the
        random stream; ``start``: places of a pair to begin at, such as the closest of the frame before.
        """
        self._place(pose_a, pose_b, stamp)
        self._state["budget"] = self.settings.budget if budget is None else budget
        if start is not None:
            self._begin_at(start)
        return self._search()

    def look_longer(self, budget: int) -> SearchResult:
        """Search on without a hit, up to a larger budget; the same as a look with that budget from the start."""
        self._state["budget"] = budget
        return self._search()

    def look_on(self) -> SearchResult:
        """Search on from a hit for one outside what was found so far, within the same budget; counts go on too."""
        self._state["hit_a"] = -1
        self._state["quiet"] = 0
        return self._search()

    def curve(self, seeds: IntArray) -> IntArray:
        """Every pair that meets and hangs together with the hit or with a seed that still meets, (k, 2) places, sorted.

        Pairs found by an earlier call at these poses are kept. ``seeds`` (n, 2): places, of the frame before.
        """
        state = self._state
        if state["undecided"]:
            state["by_corners"] = 1
        if state["hit_a"] >= 0:
            self._add(np.array([[state["hit_a"], state["hit_b"]]]))
        links = self.first.links, self.second.links
        self._flow(lambda: sow(seeds, self._found, self._whole(), self._states))
        self._flow(lambda: flood(self._found, *links, self._whole(), self._states))
        first, second = self._found[: state["found_count"]].T
        return np.stack(np.divmod(np.unique(first * len(self.second) + second), len(self.second)), axis=1)

    def _whole(self) -> Faces:
        """All faces with their neighbours on the mesh, whatever is sampled."""
        return self._faces._replace(near_a=self.first.near, near_b=self.second.near)

    @property
    def flood_tests(self) -> int:
        """Triangle tests of the flood fill at these poses."""
        return int(self._state["flood_tests"])

    def _set_constants(self) -> None:
        """The numbers of the settings, and the counters of a search that has not begun."""
        settings, fresh = self.settings, self._fresh
        for name in ("hit_a", "hit_b", "last_a", "last_b", "start_a", "start_b"):
            fresh[name] = -1
        for name in FROM_SETTINGS:
            fresh[name] = getattr(settings, name)
        fresh["fresh"], fresh["without"] = 1, settings.without_equation or 0
        fresh["daemon"], fresh["amplitude"] = settings.variant == "memetic", settings.decode == "amplitude"
        fresh["scale"] = self.first.mean_radius + self.second.mean_radius or 1.0
        fresh["closest"] = np.inf

    def _place(self, pose_a: Pose, pose_b: Pose, stamp: float) -> None:
        """Forget the search before and take new poses."""
        (turn_a, move_a), (turn_b, move_b) = pose_a, pose_b
        generation = self._state["generation"] + 1
        self._bytes[0] = self._bytes[1]  # field by field it takes three times as long
        self._state["generation"] = generation
        relative = turn_b.T @ turn_a, turn_b.T @ (move_a - move_b)
        for place, (turn, move) in zip(self._poses, (pose_a, pose_b, relative), strict=True):
            place[:9], place[9:] = turn.ravel(), move
        size = self.first.size + self.second.size + float(np.abs(move_a).max() + np.abs(move_b).max())
        self._state["pad"] = PLACE_PAD * size + UNDERFLOW_PAD
        self._stamp, self._restart = stamp, 0
        self._forget_random()
        self._deadline = perf_counter() + (self.settings.budget_seconds or 0.0)

    def _begin_at(self, start: Pair) -> None:
        """Look at a pair first. Variants with local search descend from it; the colony's first ant starts there."""
        walk = self.settings.variant in ("memetic", "local")
        state = self._state
        follow(walk, *start, self._faces, self._states)
        self._resolve()
        for side, sample in zip("ab", self.samples, strict=True):
            place = int(np.searchsorted(sample.pick, state[f"best_{side}"]))
            state[f"start_{side}"] = min(place, len(sample) - 1)

    def _search(self) -> SearchResult:
        if self.settings.variant == "printed":
            return self._search_as_printed()
        if self.settings.budget_seconds is None:
            self._run()
            return self._answer()
        state = self._state
        while state["hit_a"] < 0 and perf_counter() < self._deadline:
            state["budget"] = state["evaluations"] + SLICE
            self._run()
        return self._answer()

    def _search_as_printed(self) -> SearchResult:
        """The equations as printed, one pair at a time; their closest pair is kept here, not by them."""
        state, picks = self._state, [sample.pick for sample in self.samples]
        closest, pair = np.inf, (-1, -1)

        def evaluate(i: int, j: int) -> float:
            nonlocal closest, pair
            state["closest"] = np.inf
            pair_now = int(picks[0][i]), int(picks[1][j])
            follow(False, *pair_now, self._faces, self._states)
            self._resolve()
            distance = float(state["closest"])
            if distance < closest:
                closest, pair = distance, pair_now
            return distance

        def is_over() -> bool:
            return bool(state["hit_a"] >= 0 or state["evaluations"] >= state["budget"])

        stream = stream_of(self.settings.seed, *self.names, self._stamp, self._restart)
        sizes = (len(picks[0]), len(picks[1]))
        state["iterations"], broken = search_as_printed(evaluate, is_over, sizes, self.settings, stream)
        if closest < np.inf:  # else a warm start has spent the budget, and what it found holds
            state["closest"], (state["best_a"], state["best_b"]) = closest, pair
        return self._answer(broken=broken)

    def _run(self) -> None:
        """Serve the kernel with what it asks for until it has a hit or its budget is spent."""
        while True:
            outcome = advance(self._who, self._swarm, self._faces, self._states, self._random)
            if outcome in (FOUND, SPENT):
                return
            if outcome == HUNGRY:
                self._feed()
            elif outcome == STALE:
                self._restart += 1
                self._forget_random()
                self._state["cursor"] = 0
            elif outcome == FULL:
                self._grow()
            elif outcome == UNSURE and self._resolve():
                return

    def _forget_random(self) -> None:
        self._stream: np.random.Generator | None = None
        self._random = np.zeros(0)

    def _feed(self) -> None:
        """More random numbers, after those not used yet."""
        if self._stream is None:
            self._stream = stream_of(self.settings.seed, *self.names, self._stamp, self._restart)
        left = self._random[self._state["cursor"] :]
        size = max(BLOCK, 16 * self.settings.ants)
        self._random = np.concatenate([left, self._stream.random(size)])
        self._state["cursor"] = 0

    def _resolve(self) -> bool:
        """Ask the exact predicate about the pairs left open; whether there is a hit now."""
        meeting, state = self._ask_open(), self._state
        if len(meeting) and state["hit_a"] < 0:
            state["hit_a"], state["hit_b"] = meeting[0]
            meeting = meeting[1:]
        # these would be lost to the flood fill: the table holds them as tested
        self._add(meeting)
        return bool(state["hit_a"] >= 0)

    def _ask_open(self) -> IntArray:
        """Pairs left open that meet, (k, 2); none is open after this."""
        keys = self._state["open_keys"][: self._state["open"]].copy()
        self._state["open"] = 0
        if not len(keys):
            return np.zeros((0, 2), dtype=np.int64)
        pairs = np.stack(np.divmod(keys, len(self.second)), axis=1)
        return meeting_pairs(self.first, self.second, self._state, pairs)

    def _flow(self, run: Callable[[], int]) -> None:
        """Serve the flood fill until it is done."""
        while True:
            outcome = run()
            if outcome == SPENT:
                return
            if outcome == FULL:
                self._grow()
                self._found = np.concatenate([self._found, np.zeros_like(self._found)])
            self._add(self._ask_open())

    def _add(self, pairs: IntArray) -> None:
        """Put pairs that meet where the flood fill starts from."""
        before = int(self._state["found_count"])
        after = before + len(pairs)
        while after > len(self._found):
            self._found = np.concatenate([self._found, np.zeros_like(self._found)])
        self._found[before:after] = pairs
        self._state["found_count"] = after

    def _grow(self) -> None:
        larger = np.zeros((2 * len(self._table), 2), dtype=np.int64)
        grow_table(self._table, larger, self._states)
        self._table, self._faces = larger, self._faces._replace(table=larger)

    def _answer(self, *, broken: bool = False) -> SearchResult:
        state = self._state
        hit = (int(state["hit_a"]), int(state["hit_b"])) if state["hit_a"] >= 0 else None
        return SearchResult(
            hit=hit,
            closest=(int(state["best_a"]), int(state["best_b"])),
            distance=float(state["closest"]),
            evaluations=int(state["evaluations"]),
            tests=int(state["tests"]),
            restarts=self._restart,
            iterations=int(state["iterations"]),
            reason="hit" if hit else "broken" if broken else "budget",
        )
