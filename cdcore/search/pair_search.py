"""The search of one pair of bodies at one pair of poses: finds a face pair that meets, or says it has not found one.

Whatever it finds has passed the exact triangle test at the reference vertices, so it never invents a contact. One
compiled call runs until it has found a pair, spent its budget, or needs something from outside.
"""

from typing import Final, NamedTuple

import numpy as np

from cdcore.kernels.compiling import hot_kernel, kernel, never_inlined, records
from cdcore.kernels.memory import address_of
from cdcore.numerics import FloatArray, IntArray, readonly
from cdcore.poses.kernels import relative_pose
from cdcore.search.evaluation import evaluate, grow_table, meeting_pairs
from cdcore.search.features import Features
from cdcore.search.flood import flood
from cdcore.search.local_descent import descend, drawn_pair, is_over, local_round
from cdcore.search.printed import SearchOverError, iterations_as_printed
from cdcore.search.search_settings import SearchSettings
from cdcore.search.state import (
    ANT,
    DONE,
    FROM_DRAW,
    FROM_START,
    FULL,
    SEARCH_RECORD,
    TRACED,
    UNSURE,
    Faces,
    State,
    States,
    Swarm,
    key_of,
    stream_of,
)
from cdcore.search.swarm import iterate, populate
from cdcore.tolerances import EPS, UNDERFLOW_PAD

COLONY, LOCAL, RANDOM = 0, 1, 2
"""The strategies of the search."""
SEARCH, SEARCH_ON, FOLLOW = range(3)
"""What to do: take the poses, evaluate the start and search; go on with a search; evaluate a pair by itself, and go
down from it if the strategy has local search."""

PLACING_PAD = 1024.0 * EPS
"""Pad of the threshold in size of both bodies: their relative pose is rounded five times, each by a few eps of that
size; a pad a hundred times too wide costs a triangle test now and then, one too narrow a contact."""

TABLE: Final = 1024
"""First size of the table of tested pairs; it doubles when half full."""

FROM_SETTINGS: Final = (
    "restart_after",
    "ants",
    "turn",
    "mutation",
    "alpha",
    "beta",
    "evaporation",
    "reward",
    "pheromone_least",
    "pheromone_most",
)
"""Fields of the state that are those of the settings."""

ANSWER: Final = ("hit_a", "hit_b", "best_a", "best_b", "closest", "evaluations", "tests", "restarts", "iterations")
"""Fields of the state of which a result is made."""

NO_PAIR: Final = (-1, -1)

SEARCHERS: Final = {"memetic": COLONY, "corrected": COLONY, "local": LOCAL, "random": RANDOM}

Pose = tuple[FloatArray, FloatArray]

Pair = tuple[int, int]
"""Indices of two faces in the order of the search, one of each body."""


class SearchResult(NamedTuple):
    """A pair of faces that meets or ``None``, and the cost of the search.

    ``closest``: the pair whose centroids came closest, at ``distance`` metres. ``evaluations``: distances of centroids;
    ``tests``: of triangles; ``restarts``: populations drawn anew; ``iterations``: of the colony. ``reason``: "hit",
    "budget" or "broken" (the equations as printed gave a probability that is none).
    """

    hit: Pair | None
    closest: Pair
    distance: float
    evaluations: int
    tests: int
    restarts: int
    iterations: int
    reason: str


class PairSearch:
    """Searches one pair of bodies, again and again, from the features of both.

    The names of both choose the random stream, with seed and stamp; settings say who searches, with which constants.
    """

    def __init__(self, first: Features, second: Features, names: tuple[str, str], settings: SearchSettings) -> None:
        self.first, self.second, self.names, self.settings = first, second, names, settings
        self.states = records(np.zeros(2, dtype=SEARCH_RECORD))
        self.state, self._fresh = self.states
        self._key = np.uint64(key_of(settings.seed, "qaco", *sorted(names)) % 2**64)
        # Views of the record: to ask it for a field takes longer than to write one.
        self.relative: FloatArray = self._fresh["relative"]
        """(13,) pose of the first body as the second sees it: rotation by rows, translation, largest coordinate."""
        self._placed = self._fresh["world_a"], self._fresh["world_b"]
        self._result = self.states[list(ANSWER)][:1]
        self.swarm = records(np.zeros(settings.ants, dtype=ANT))
        self._table = np.zeros((TABLE, 2), dtype=np.int64)
        self._contacts = np.zeros((256, 2), dtype=np.int64)
        self.faces = Faces(
            first.pick, second.pick, first.rows, second.rows, first.near_picked, second.near_picked, self._table
        )
        self._set_constants()

    def trace(self, rows: int) -> FloatArray:
        """Write the first so many evaluations of each search from here on down, (rows, TRACED), as ``state`` says."""
        self._trace = np.zeros((rows, TRACED))
        self._fresh["trace_address"], self._fresh["trace_rows"] = address_of(self._trace), rows
        return self._trace

    def search(
        self, pose_a: Pose, pose_b: Pose, stamp: float, *, start: Pair | None = None, budget: int | None = None
    ) -> SearchResult:
        """Search until the first hit or the end of the budget (evaluations; ``None``: that of the settings).

        Poses are rotation (3, 3) and translation (3,); ``stamp``, the time of the frame, is part of the key of the
        random stream; ``start``: indices of a pair to begin at, such as the closest of the frame before.
        """
        self.set_poses(pose_a, pose_b)
        return self.search_from(stamp, start, self.settings.budget if budget is None else budget)

    def set_poses(self, pose_a: Pose, pose_b: Pose) -> None:
        """Take new poses, for the search that begins next."""
        take_poses(*pose_a, *pose_b, self.states)

    def pose_bits(self) -> bytes:
        """The poses taken last, every bit of them."""
        return self._placed[0].tobytes() + self._placed[1].tobytes()

    def search_from(self, stamp: float, start: Pair | None, budget: int) -> SearchResult:
        """Searches at the poses that were set last; otherwise as ``search``."""
        self._stamp = stamp
        self._fresh["stream"] = self._key ^ np.float64(stamp).view(np.uint64)
        return self._search(SEARCH, start or NO_PAIR, budget)

    def search_further(self) -> SearchResult:
        """Search on from a hit for one outside the contacts so far, within the same budget; counts go on too."""
        self.state["hit_a"] = -1
        self.state["quiet"] = 0
        return self._search(SEARCH_ON, NO_PAIR, int(self.state["budget"]))

    def curve(self, seeds: IntArray) -> IntArray:
        """Every pair that meets and hangs together with the hit or with a seed that still meets, (k, 2), sorted.

        Pairs found by an earlier call at these poses are kept. ``seeds`` (n, 2): indices, of the frame before.
        """
        state = self.state
        if state["undecided"]:
            state["by_corners"] = 1
        if state["hit_a"] >= 0:
            self._add(np.array([[state["hit_a"], state["hit_b"]]]))
        # All faces with their neighbours on the mesh, whatever is sampled.
        near_a, near_b, links = self.first.near, self.second.near, (self.first.links, self.second.links)
        while True:
            faces = self.faces._replace(near_a=near_a, near_b=near_b)
            # read-only whoever gave them: else the kernel would be compiled for both kinds
            outcome = flood(readonly(seeds[:]), self._contacts, links, faces, self.states)
            if outcome == DONE:
                break
            if outcome == FULL:
                self._grow()
                self._contacts = np.concatenate([self._contacts, np.zeros_like(self._contacts)])
            self._add(self._ask_open())
        first, second = self._contacts[: state["contact_count"]].T
        return np.stack(np.divmod(np.unique(first * len(self.second) + second), len(self.second)), axis=1)

    @property
    def flood_tests(self) -> int:
        """Triangle tests of the flood fill at these poses."""
        return int(self.state["flood_tests"])

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
        state, first, second = self.state, self.first.pick, self.second.pick

        def evaluate(i: int, j: int) -> float:
            advance(FOLLOW, int(first[i]), int(second[j]), budget, self.swarm, self.faces, self.states)
            if self._resolve() or state["evaluations"] >= budget:
                raise SearchOverError
            return float(state["followed"])

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
            outcome = advance(task, *start, budget, self.swarm, self.faces, self.states)
            if outcome == FULL:
                self._grow()
            elif outcome != UNSURE or self._resolve():
                return
            task = SEARCH_ON

    def _resolve(self) -> bool:
        """Ask the exact predicate about the pairs left open; whether there is a hit now."""
        meeting, state = self._ask_open(), self.state
        if len(meeting) and state["hit_a"] < 0:
            state["hit_a"], state["hit_b"] = meeting[0]
            meeting = meeting[1:]
        # these would be lost to the flood fill: the table holds them as tested
        self._add(meeting)
        return bool(state["hit_a"] >= 0)

    def _ask_open(self) -> IntArray:
        """Pairs left open that meet, (k, 2); none is open after this."""
        keys = self.state["open_keys"][: self.state["open"]].copy()
        self.state["open"] = 0
        if not len(keys):
            return np.zeros((0, 2), dtype=np.int64)
        pairs = np.stack(np.divmod(keys, len(self.second)), axis=1)
        return meeting_pairs(self.first, self.second, self.state, pairs)

    def _add(self, pairs: IntArray) -> None:
        """Put pairs that meet where the flood fill starts from."""
        before = int(self.state["contact_count"])
        after = before + len(pairs)
        while after > len(self._contacts):
            self._contacts = np.concatenate([self._contacts, np.zeros_like(self._contacts)])
        self._contacts[before:after] = pairs
        self.state["contact_count"] = after

    def _grow(self) -> None:
        larger = np.zeros((2 * len(self._table), 2), dtype=np.int64)
        grow_table(self._table, larger, self.states)
        self._table, self.faces = larger, self.faces._replace(table=larger)


@kernel
def take_poses(
    rotation_a: FloatArray, move_a: FloatArray, rotation_b: FloatArray, move_b: FloatArray, states: States
) -> None:
    """Write poses of both bodies, and of A as B sees it, to the record that the next search begins as."""
    state, rotation, move = states[1], np.empty((3, 3)), np.empty(3)
    relative_pose(rotation_b, move_b, rotation_a, move_a, rotation, move)
    state.relative[12] = 0.0
    for i in range(3):  # assigned as slices, arrays took 2.5 s to compile, not 0.3 (2026-11)
        for j in range(3):
            state.world_a[3 * i + j], state.world_b[3 * i + j] = rotation_a[i, j], rotation_b[i, j]
            state.relative[3 * i + j] = rotation[i, j]
        state.world_a[9 + i], state.world_b[9 + i], state.relative[9 + i] = move_a[i], move_b[i], move[i]
        state.relative[12] = max(state.relative[12], abs(move_a[i]), abs(move_b[i]))


@hot_kernel
def index_in(pick: IntArray, face: int) -> int:
    """Index of a face among ascending ones, or where it would be inserted."""
    lower, upper = 0, len(pick) - 1
    while lower < upper:
        middle = (lower + upper) // 2
        if pick[middle] < face:
            lower = middle + 1
        else:
            upper = middle
    return lower


@hot_kernel
def follow_start(i: int, j: int, faces: Faces, state: State) -> float:
    """Warm start: evaluate a pair and, if the strategy has local search, go down from it; distance of the pair."""
    never_inlined()
    state.source = FROM_START
    distance: float = evaluate(i, j, faces, state)
    if state.descends_from_start != 0:
        descend(i, j, distance, faces, state)
    return distance


@hot_kernel
def step(swarm: Swarm, faces: Faces, state: State) -> None:
    """A round of the strategy: an iteration of the colony, a local search, or a random pair."""
    if state.searcher == RANDOM:
        state.source = FROM_DRAW
        i, j = drawn_pair(faces, state)
        evaluate(i, j, faces, state)
    elif state.searcher == LOCAL:
        local_round(faces, state)
    else:
        if state.fresh != 0:
            populate(swarm, len(faces.pick_a), len(faces.pick_b), state)
            state.fresh = 0
        iterate(swarm, faces, state)


@kernel
def advance(task: int, i: int, j: int, budget: int, swarm: Swarm, faces: Faces, states: States) -> int:
    """Do a task within ``budget`` evaluations: DONE, FULL (grow the table) or UNSURE (ask about the pairs left open).

    A search begins as ``states[1]``, which has its poses, at the pair (i, j); i below 0: at none.
    """
    state = states[0]
    if task == FOLLOW:
        state.followed = follow_start(i, j, faces, state)
        return DONE
    if task == SEARCH:
        generation = state.generation + 1
        states[0] = states[1]
        state.generation = generation
        state.pad = PLACING_PAD * (state.bodies_size + 2.0 * state.relative[12]) + UNDERFLOW_PAD
    state.budget = budget
    if task == SEARCH and i >= 0:
        follow_start(i, j, faces, state)
        state.start_a, state.start_b = index_in(faces.pick_a, state.best_a), index_in(faces.pick_b, state.best_b)
        if state.open > 0:
            return UNSURE
    while not is_over(state):
        if state.searcher == COLONY and state.quiet >= state.restart_after:
            state.fresh, state.quiet = 1, 0
            state.restarts += 1
        if 2 * state.entries >= faces.table.shape[0]:
            return FULL
        step(swarm, faces, state)
    return UNSURE if state.hit_a < 0 and state.open > 0 else DONE
