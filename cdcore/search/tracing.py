"""A search watched: how each look of a run began, and on request everything that one look evaluated.

A look is traced by searching again from the same start, with the same stream and budget. Its kernels then run as plain
Python, from their own source, and call an ``evaluate`` that writes down what it was asked. So a run pays nothing, and
there is no second version of the search to keep alike.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from types import FunctionType, SimpleNamespace
from typing import Any, Final, Protocol, cast, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from cdcore.numerics import BoolArray, FloatArray, IntArray
from cdcore.protocol import Body, FaceSets, Motion
from cdcore.search import advance, descent, equations, state, swarm
from cdcore.search.features import Features
from cdcore.search.pair_search import PairSearch, Pose
from cdcore.search.result import Pair, SearchResult
from cdcore.search.samples import Sample
from cdcore.search.settings import SearchSettings
from cdcore.search.stage import LookKey, PairMemory, SearchAnswer, SearchStage

ASKED_BY: Final = {"follow": "start", "iterate": "ant", "closest_around": "walk", "local_round": "draw"}
"""Kernel that evaluates -> word for it in a trace; any other draws at random."""

MATHEMATICS: Final = SimpleNamespace(
    **{name: getattr(math, name) for name in ("cos", "sin", "log", "exp", "floor", "inf")}, empty=np.empty
)
"""What the kernels use of numpy, as compiled: numpy's own exp and log may differ in the last bit."""


@dataclass(frozen=True)
class Step:
    """How a look began or went on: the samples in use, the pair to start at, the budget."""

    samples: tuple[Sample, Sample]
    start: Pair | None
    budget: int | None


@dataclass(frozen=True)
class NotedLook:
    """A look of a run: its steps, and what it gave."""

    steps: tuple[Step, ...]
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


class NotedSearch(PairSearch):
    """A search that remembers its samples, and the steps of its last look."""

    steps: list[Step]

    def use(self, first: Sample, second: Sample) -> None:
        """Search these samples, and remember which."""
        super().use(first, second)
        self.samples = first, second

    def look_longer(self, budget: int) -> SearchResult:
        """Search on, and remember that."""
        self.steps.append(Step(self.samples, None, budget))
        return super().look_longer(budget)


class TracedSearch(PairSearch):
    """A search that writes down what it evaluates: some microseconds each."""

    def __init__(self, first: Features, second: Features, names: tuple[str, str], settings: SearchSettings) -> None:
        super().__init__(first, second, names, settings)
        self._asked: list[tuple[int, int, float, int, str]] = []
        self._trails: dict[int, FloatArray] = {}
        self._behind: set[int] = set()
        plain = _interpreted(self._evaluate, self._is_new, self._move)
        self._move_plainly, self._advance, self._follow = plain["move"], plain["advance"], plain["follow"]

    def trace(self, noted: NotedLook, *poses: Any, turned: bool) -> LookTrace:
        """Look again as ``noted``; ``poses`` as for ``look``; ``turned``: the pair was asked for in the other order."""
        self._asked, self._trails, self._behind = [], {}, set()
        head, *more = noted.steps
        self.use(*head.samples)
        result = self.look(*poses, start=head.start, budget=head.budget)
        for step in more:
            assert step.budget is not None
            self.use(*step.samples)
            result = self.look_longer(step.budget)
        i, j, distance, iteration, by = (np.array(column) for column in zip(*self._asked, strict=True))
        faces = np.stack([self.first.face[i], self.second.face[j]], axis=1)
        asked_by = np.array([ASKED_BY.get(name, "draw") for name in by])
        pheromone = self._pheromone(iteration, asked_by == "ant")
        return LookTrace(faces[:, ::-1] if turned else faces, distance, iteration, asked_by, pheromone, result)

    def _pheromone(self, iteration: IntArray, by_ant: BoolArray) -> FloatArray:
        """Of each evaluation by an ant; an iteration that was cut short has what its ants had in the end."""
        chains = 1 if self.settings.without_equation == 15 else 2
        pheromone = np.full(len(iteration), np.nan)
        for number in np.unique(iteration[by_ant]).tolist():
            rows = np.flatnonzero(by_ant & (iteration == number))
            trail = self._trails.get(number, self._swarm[:, state.PHEROMONE])
            pheromone[rows] = trail[np.arange(len(rows)) // chains]
        return pheromone

    def _evaluate(
        self, asked_by: str, i: int, j: int, rows_a: FloatArray, rows_b: FloatArray, pose: FloatArray,
        number: FloatArray, count: IntArray, table: IntArray, _pair: FloatArray,
    ) -> float:  # fmt: skip
        """One evaluation by the compiled kernel; the closest pair so far is kept here, not by it."""
        closest, best = float(number[state.CLOSEST]), count[[state.BEST_A, state.BEST_B]]
        number[state.CLOSEST] = np.inf
        advance.follow(False, i, j, rows_a, rows_b, *self._near, pose, number, count, table)
        distance = float(number[state.CLOSEST])
        if not distance < closest:
            number[state.CLOSEST], count[[state.BEST_A, state.BEST_B]] = closest, best
        self._asked.append((int(i), int(j), distance, int(count[state.ITERATIONS]), asked_by))
        return distance

    def _is_new(self, _table: IntArray, _count: IntArray, key: int) -> bool:
        """Whether local search has not been here in this look; the compiled kernel keeps the pairs it tested."""
        known = key in self._behind
        self._behind.add(int(key))
        return not known

    def _move(
        self, swarm_now: FloatArray, total: float, number: FloatArray, count: IntArray, random: FloatArray
    ) -> None:
        """The ants move, after their pheromone is written down."""
        self._trails[int(count[state.ITERATIONS])] = swarm_now[:, state.PHEROMONE].copy()
        self._move_plainly(swarm_now, total, number, count, random)


def _interpreted(
    evaluate: Callable[..., float], is_new: Callable[..., bool], move: Callable[..., None]
) -> dict[str, Callable[..., Any]]:
    """The kernels of the search as plain Python; ``evaluate`` is also given the name of the kernel that asks."""
    compiled = {
        name: part.py_func
        for module in (advance, descent, equations, swarm)
        for name, part in vars(module).items()
        if hasattr(part, "py_func")
    }
    plain = {name: FunctionType(part.__code__, dict(part.__globals__), name) for name, part in compiled.items()}
    shared = {
        **plain,
        "np": MATHEMATICS,
        "is_new": is_new,
        "stay_one_function": lambda: None,
        "become_part_of_caller": lambda: None,
        "move": move,
    }
    for name, function in plain.items():
        function.__globals__.update(shared, evaluate=partial(evaluate, name))
    return {**plain}


class NotingStage(SearchStage):
    """The search of a run once more, with a note of every look: ``noted[frame, column]``.

    ``known``: looks of that run that found nothing; they are not searched again.
    """

    def __init__(
        self, bodies: Sequence[Body], pairs: IntArray, settings: SearchSettings, known: Mapping[LookKey, SearchResult]
    ) -> None:
        super().__init__(bodies, pairs, settings, search=NotedSearch)
        self._noting = cast(list[NotedSearch], self._searches)
        # With samples that change a search goes on from a look that found nothing.
        self._known = {} if settings.samples == "auto" else known
        self.noted: dict[tuple[int, int], NotedLook] = {}
        self._traced: dict[int, TracedSearch] = {}

    def trace(self, motion: Motion, frame: int, column: int) -> LookTrace:
        """Everything that a noted look evaluated."""
        if column not in self._traced:
            one = self._searches[column]
            self._traced[column] = TracedSearch(one.first, one.second, one.names, self._settings)
        poses = self._poses(motion, frame, column)
        noted, turned = self.noted[frame, column], bool(self._turned[column])
        return self._traced[column].trace(noted, *poses, float(motion.times[frame]), turned=turned)

    def places(self, motion: Motion, frame: int, column: int, pair: Pair) -> FloatArray:
        """World centroids (2, 3) of a pair that a look gave, in the order of the search."""
        search, poses = self._searches[column], self._poses(motion, frame, column)
        sides = zip((search.first, search.second), pair, poses, strict=True)
        return np.array([turn @ side.rows[place, :3] + move for side, place, (turn, move) in sides])

    def _search(self, key: LookKey, pose_a: Pose, pose_b: Pose) -> SearchResult:
        search = self._noting[key[0]]
        search.steps = [Step(search.samples, *key[3:])]
        return self._known.get(key) or super()._search(key, pose_a, pose_b)

    def _finish(
        self, frame: int, column: int, look: SearchResult | None, known: PairMemory, found: SearchAnswer
    ) -> None:
        if look is not None:
            self.noted[frame, column] = NotedLook(tuple(self._noting[column].steps), look)
        super()._finish(frame, column, look, known, found)


@dataclass(frozen=True, eq=False)
class Watched:
    """What a detector with a search did with a motion.

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


def watched(
    bodies: Sequence[Body], pairs: IntArray, settings: SearchSettings, motion: Motion,
    near: tuple[BoolArray, BoolArray], known: Mapping[LookKey, SearchResult],
) -> Watched:  # fmt: skip
    """Search where spheres and boxes met; ``near``: those of the spheres, and of the boxes too; ``known``: what a run
    of these bodies, pairs and settings looked at and found nothing.
    """
    stage = NotingStage(bodies, pairs, settings, known)
    found = stage.decide(motion, near[1], stage.fresh_memory(), faces=True)
    searched = np.zeros_like(near[0])
    for frame, column in stage.noted:
        searched[frame, column] = True
    return Watched(*near, searched, stage, settings, found.face_sets())
