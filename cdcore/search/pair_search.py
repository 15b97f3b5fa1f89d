"""The search of one pair of bodies at one pair of poses: finds a face pair that meets, or says it has not found one.

Whatever it finds has passed the exact triangle test at the reference vertices, so it never invents a contact.
"""

from typing import Final

import numpy as np

from cdcore.kernels.compiling import records
from cdcore.kernels.memory import address_of
from cdcore.numerics import FloatArray, IntArray, readonly
from cdcore.search.advance import COLONY, LOCAL, RANDOM, SEARCH, SEARCH_ON, advance, follow, take_poses
from cdcore.search.evaluation import grow_table, meeting_pairs
from cdcore.search.features import Features
from cdcore.search.flood import flood
from cdcore.search.printed import SearchOverError, iterations_as_printed
from cdcore.search.result import Pair, SearchResult
from cdcore.search.rng import key_of, stream_of
from cdcore.search.search_settings import SearchSettings
from cdcore.search.state import ANT, DONE, FULL, STATE, TRACED, UNSURE, Faces

TABLE: Final = 1024
"""First size of the table of tested pairs; it doubles when half full."""

FROM_SETTINGS: Final = (
    "restart_after", "ants", "turn", "mutation", "alpha", "beta", "evaporation", "reward", "pheromone_least",
    "pheromone_most",
)  # fmt: skip
"""Fields of the state that are those of the settings."""

ANSWER: Final = ("hit_a", "hit_b", "best_a", "best_b", "closest", "evaluations", "tests", "restarts", "iterations")
"""Fields of the state of which a result is made."""

NO_PAIR: Final = (-1, -1)

SEARCHERS: Final = {"memetic": COLONY, "corrected": COLONY, "local": LOCAL, "random": RANDOM}

Pose = tuple[FloatArray, FloatArray]


class PairSearch:
    """Searches one pair of bodies, again and again, from the features of both.

    The names of both choose the random stream, with seed and stamp; settings say who searches, with which constants.
    """

    def __init__(self, first: Features, second: Features, names: tuple[str, str], settings: SearchSettings) -> None:
        self.first, self.second, self.names, self.settings = first, second, names, settings
        self._states = records(np.zeros(2, dtype=STATE))
        self._state, self._fresh = self._states
        self._key = np.uint64(key_of(settings.seed, "qaco", *sorted(names)) % 2**64)
        # Views of the record: to ask it for a field takes longer than to write one.
        self.relative: FloatArray = self._fresh["relative"]
        """(13,) pose of the first body as the second sees it: rotation by rows, translation, largest coordinate."""
        self._placed = self._fresh["world_a"], self._fresh["world_b"]
        self._result = self._states[list(ANSWER)][:1]
        self._swarm = records(np.zeros(settings.ants, dtype=ANT))
        self._table = np.zeros((TABLE, 2), dtype=np.int64)
        self._contacts = np.zeros((256, 2), dtype=np.int64)
        self._faces = Faces(
            first.pick, second.pick, first.rows, second.rows, first.near_picked, second.near_picked, self._table
        )
        self._set_constants()

    def trace(self, rows: int) -> FloatArray:
        """Write the first so many evaluations of each look from here on down, (rows, TRACED), as ``state`` says."""
        self._trace = np.zeros((rows, TRACED))
        self._fresh["trace_address"], self._fresh["trace_rows"] = address_of(self._trace), rows
        return self._trace

    def look(
        self, pose_a: Pose, pose_b: Pose, stamp: float, *, start: Pair | None = None, budget: int | None = None
    ) -> SearchResult:
        """Search until the first hit or the end of the budget (evaluations; ``None``: that of the settings).

        Poses are rotation (3, 3) and translation (3,); ``stamp``, the time of the frame, is part of the key of the
        random stream; ``start``: places of a pair to begin at, such as the closest of the frame before.
        """
        self.place(pose_a, pose_b)
        return self.search_from(stamp, start, self.settings.budget if budget is None else budget)

    def place(self, pose_a: Pose, pose_b: Pose) -> None:
        """Take new poses, for the search that begins next."""
        take_poses(*pose_a, *pose_b, self._states)

    def pose_bits(self) -> bytes:
        """The poses taken last, every bit of them."""
        return self._placed[0].tobytes() + self._placed[1].tobytes()

    def search_from(self, stamp: float, start: Pair | None, budget: int) -> SearchResult:
        """Searches at the poses that were set last; otherwise as ``look``."""
        self._stamp = stamp
        self._fresh["stream"] = self._key ^ np.float64(stamp).view(np.uint64)
        return self._search(SEARCH, start or NO_PAIR, budget)

    def search_further(self) -> SearchResult:
        """Search on from a hit for one outside what was found so far, within the same budget; counts go on too."""
        self._state["hit_a"] = -1
        self._state["quiet"] = 0
        return self._search(SEARCH_ON, NO_PAIR, int(self._state["budget"]))

    def curve(self, seeds: IntArray) -> IntArray:
        """Every pair that meets and hangs together with the hit or with a seed that still meets, (k, 2) places, sorted.

        Pairs found by an earlier call at these poses are kept. ``seeds`` (n, 2): places, of the frame before.
        """
        state = self._state
        if state["undecided"]:
            state["by_corners"] = 1
        if state["hit_a"] >= 0:
            self._add(np.array([[state["hit_a"], state["hit_b"]]]))
        # All faces with their neighbours on the mesh, whatever is sampled.
        near_a, near_b, links = self.first.near, self.second.near, (self.first.links, self.second.links)
        while True:
            faces = self._faces._replace(near_a=near_a, near_b=near_b)
            # read-only whoever gave them: else the kernel would be compiled for both kinds
            outcome = flood(readonly(seeds[:]), self._contacts, links, faces, self._states)
            if outcome == DONE:
                break
            if outcome == FULL:
                self._grow()
                self._contacts = np.concatenate([self._contacts, np.zeros_like(self._contacts)])
            self._add(self._ask_open())
        first, second = self._contacts[: state["found_count"]].T
        return np.stack(np.divmod(np.unique(first * len(self.second) + second), len(self.second)), axis=1)

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
        fresh["fresh"] = 1
        fresh["left_out_equation"] = settings.without_equation or 0
        fresh["searcher"] = SEARCHERS.get(settings.variant, COLONY)
        fresh["descends_from_start"] = settings.variant in ("memetic", "local")
        fresh["improves_best"] = settings.variant == "memetic"
        fresh["scale"] = self.first.mean_radius + self.second.mean_radius or 1.0
        fresh["closest"], fresh["bodies_size"] = np.inf, self.first.size + self.second.size

    def _search(self, task: int, start: Pair, budget: int) -> SearchResult:
        if self.settings.variant == "printed":
            broken = self._search_as_printed(task, budget)
        else:
            broken = False
            self._run(task, start, budget)
        hit_a, hit_b, best_a, best_b, distance, evaluations, tests, restarts, iterations = self._result[0].item()
        hit = (hit_a, hit_b) if hit_a >= 0 else None
        reason = "hit" if hit else "broken" if broken else "budget"
        return SearchResult(hit, (best_a, best_b), distance, evaluations, tests, restarts, iterations, reason)

    def _search_as_printed(self, task: int, budget: int) -> bool:
        """The equations as printed, one pair at a time; whether they broke."""
        if task == SEARCH_ON:
            return False
        self._run(task, NO_PAIR, 0)
        state, first, second = self._state, self.first.pick, self.second.pick

        def evaluate(i: int, j: int) -> float:
            distance = follow(int(first[i]), int(second[j]), self._faces, self._states)
            if self._resolve() or state["evaluations"] >= budget:
                raise SearchOverError
            return distance

        stream = stream_of(self.settings.seed, "qaco", *self.names, self._stamp)
        iterations = iterations_as_printed(evaluate, (len(first), len(second)), self.settings, stream)
        try:
            for number in iterations:
                state["iterations"] = number
        except SearchOverError:
            return False
        return True

    def _run(self, task: int, start: Pair, budget: int) -> None:
        """Serve the kernel with what it asks for until it has a hit or its budget is spent."""
        while True:
            outcome = advance(task, *start, budget, self._swarm, self._faces, self._states)
            if outcome == FULL:
                self._grow()
            elif outcome != UNSURE or self._resolve():
                return
            task = SEARCH_ON

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

    def _add(self, pairs: IntArray) -> None:
        """Put pairs that meet where the flood fill starts from."""
        before = int(self._state["found_count"])
        after = before + len(pairs)
        while after > len(self._contacts):
            self._contacts = np.concatenate([self._contacts, np.zeros_like(self._contacts)])
        self._contacts[before:after] = pairs
        self._state["found_count"] = after

    def _grow(self) -> None:
        larger = np.zeros((2 * len(self._table), 2), dtype=np.int64)
        grow_table(self._table, larger, self._states)
        self._table, self._faces = larger, self._faces._replace(table=larger)
