"""The search over a whole motion, frame by frame as in a live engine. Each pair starts from its closest faces so far.

Where both poses of a pair are bit for bit those of its search before, the answer is that answer. A pair that has not
moved since the whole budget found nothing gets less of it (``rest``); a search that is left out leaves the verdict
NOT_FOUND: it neither invents a contact nor calls a pair clear.
"""

from collections import Counter
from collections.abc import Sequence
from typing import Final

import numpy as np

from cdcore.broad.broad_phase import BroadPhase
from cdcore.broad.live_pairs import LivePairs
from cdcore.kernels.compiling import hot_kernel, kernel
from cdcore.numerics import BoolArray, FloatArray, Int32Array, IntArray, readonly
from cdcore.protocol import NO_FACES, Body, FaceSets, Motion, Verdict, ordered_by_name
from cdcore.search.features import Features, features_of, sample_of
from cdcore.search.pair_search import Pair, PairSearch, Pose, SearchResult
from cdcore.search.search_settings import SearchSettings
from cdcore.tolerances import EPS

PROBE: Final = 192
"""Evaluations in which a warm start has reached its valley: a few steps to 28 neighbours each."""

ROUNDING_ULPS: Final = 4096.0
"""In eps of sizes and distances: a thing that a hand carries seems to move by this much against the hand. Two poses are
rounded, and one relative pose is computed for each of two frames: below 1000 eps together. At 1 m it is a picometre."""

SEEDS = 64
"""Pairs of the frame before from which the flood fill starts as well: a second curve then is met again."""

NO_SEEDS: IntArray = readonly(np.zeros((0, 2), dtype=np.int64))
NO_RELATIVE: FloatArray = np.full(13, np.nan)

CONTAINMENT_REFUSED = "refused: a search that finds nothing does not know that surfaces are disjoint"
"""What a detector that ends with a search says about containment."""

MOST_NOTED_SEARCHES = 100_000
"""Looks without a contact that a stage remembers: 40 MB; more than an audit that is watched makes of an hour."""

COUNTERS = ("looks", "reused", "short", "evaluations", "exact_tests", "flood_tests", "restarts", "iterations", "broken")


SearchKey = tuple[int, float, int, Pair | None, int]
"""Column, stamp, hash of the poses, start and budget: with the settings all that a search depends on."""


class PairMemory:
    """Remembers the last search of a pair; passes from block to block."""

    def __init__(self) -> None:
        self.poses = b""
        """Every bit of the poses of that search."""
        self.hit = False
        """Whether the pair met."""
        self.start: Pair | None = None
        """The hit, or the closest pair of faces: where the next search starts."""
        self.seeds = NO_SEEDS
        """Pairs that met, from which the next flood fill starts as well."""
        self.faces = NO_FACES
        """Face pairs that met, (k, 2)."""
        self.searched = NO_RELATIVE
        """Relative pose (13,) at which the whole budget found nothing since the last hit."""
        self.last_relative = NO_RELATIVE
        """Relative pose (13,) of the search before."""
        self.number = -1
        """Number of ``faces`` among the sets of this block; -1: none yet."""


class SearchAnswer:
    """Answers of the searches of one block.

    ``hits`` (T, P): where a contact was confirmed. ``work``: counters. With ``faces``, ``entries`` holds frame, column
    and number of every pair-frame in contact; its face pairs are ``sets[number]``.
    """

    def __init__(self, shape: tuple[int, ...], faces: bool) -> None:
        self.faces = faces
        self.hits = np.zeros(shape, dtype=np.bool_)
        self.work = dict.fromkeys(COUNTERS, 0)
        self.entries: list[tuple[int, int, int]] = []
        self.sets: list[Int32Array] = []

    def count(self, result: SearchResult, flood_tests: int) -> None:
        """Add the work of one search."""
        work = self.work
        work["evaluations"] += result.evaluations
        work["exact_tests"] += result.tests
        work["flood_tests"] += flood_tests
        work["restarts"] += result.restarts
        work["iterations"] += result.iterations
        work["broken"] += int(result.reason == "broken")

    def face_sets(self) -> FaceSets:
        """The faces as a detection keeps them."""
        frames, columns, numbers = np.array(self.entries, dtype=np.int64).reshape(-1, 3).T
        return FaceSets.from_shared(frames, columns, numbers, self.sets)


class SearchStage:
    """Searches candidate pair-frames of ``pairs`` (P, 2) for contact, with the constants, seed and budget of settings.

    Each pair is searched in the order of its names; its order here does not matter.
    """

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, settings: SearchSettings) -> None:
        self._settings = settings
        ordered, self._swapped = ordered_by_name(bodies, pairs)
        self._ends: list[tuple[int, int]] = [(a, b) for a, b in ordered.tolist()]
        names = [body.name for body in bodies]
        features = {
            k: sample_of(features_of(bodies[k].mesh), settings.samples, settings.seed, names[k])
            for k in np.unique(pairs).tolist()
        }
        self._searches = [PairSearch(features[a], features[b], (names[a], names[b]), settings) for a, b in self._ends]
        self._lengths = [lengths_at_rest(features[a], features[b], settings.rest) for a, b in self._ends]
        # A pair that rests is searched in brief only if it starts from where it was closest.
        self._rested = settings.rest > 0.0 and settings.warm_start
        # Results of searches without a hit: the same search need not be repeated.
        self.empty: dict[SearchKey, SearchResult] = {}

    def fresh_memory(self) -> list[PairMemory]:
        """Returns an empty memory of each pair; it passes from block to block."""
        return [PairMemory() for _ in self._ends]

    def samples_meet(self, column: int, faces: IntArray) -> bool:
        """Whether one of the face pairs (k, 2), in the order of the pair, has both its faces in the samples."""
        search = self._searches[column]
        first, second = faces.T[::-1] if self._swapped[column] else faces.T
        drawn = [np.isin(faces, of.face[of.pick]) for faces, of in ((first, search.first), (second, search.second))]
        return bool((drawn[0] & drawn[1]).any())

    def decide(self, motion: Motion, near: BoolArray, memory: list[PairMemory], *, faces: bool = False) -> SearchAnswer:
        """Search where ``near`` (T, P) says so; what is learned stays in ``memory`` for the block after."""
        answer = SearchAnswer(near.shape, faces)
        for known in memory:
            known.number = -1
        for frame, column in np.argwhere(near).tolist():
            self.decide_frame(motion, frame, column, memory[column], answer)
        return answer

    def decide_frame(self, motion: Motion, frame: int, column: int, known: PairMemory, answer: SearchAnswer) -> bool:
        """Search one pair in one frame, and write down what came of it; whether it meets."""
        result = self._sample(motion, frame, column, known, answer.work)
        if result is not None:
            known.hit, known.start, known.number = result.hit is not None, result.hit or result.closest, -1
            result = self._collect(column, result, known) if answer.faces else result
            answer.count(result, self._searches[column].flood_tests)
        answer.hits[frame, column] = known.hit
        if answer.faces and known.hit:
            if known.number < 0:
                known.number = len(answer.sets)
                answer.sets.append(known.faces)
            answer.entries.append((frame, column, known.number))
        return known.hit

    def _sample(
        self, motion: Motion, frame: int, column: int, known: PairMemory, work: dict[str, int]
    ) -> SearchResult | None:
        """Search a pair in a frame; ``None``: the answer of its last search stands.

        It stands where both poses are bit for bit those of that search, or where the pair rests at a pose at which the
        whole budget found nothing. Where it nearly rests there, less of the budget is spent.
        """
        search, budget = self._searches[column], self._settings.budget
        search.set_poses(*self._poses(motion, frame, column))
        if self._rested:
            budget = budget_at_rest(search.relative, known.searched, known.last_relative, self._lengths[column], budget)
        bits = search.pose_bits()
        if not budget or bits == known.poses:
            work["reused"] += 1
            return None
        work["looks"] += 1
        known.poses, known.last_relative = bits, search.relative.copy()
        start, stamp = known.start if self._settings.warm_start else None, float(motion.times[frame])
        result = self._search(frame, (column, stamp, hash(bits), start, budget))
        if result.hit is not None:
            known.searched = NO_RELATIVE
        elif budget == self._settings.budget:
            known.searched = known.last_relative
        else:
            work["short"] += 1
        return result

    def _search(self, _frame: int, key: SearchKey) -> SearchResult:
        """Search a pair at the poses that were set last."""
        column, stamp, _, start, budget = key
        result = self._searches[column].search_from(stamp, start, budget)
        if result.hit is None and len(self.empty) < MOST_NOTED_SEARCHES:
            self.empty[key] = result
        return result

    def _poses(self, motion: Motion, frame: int, column: int) -> tuple[Pose, Pose]:
        """Poses of both bodies of a pair, in the order of the search."""
        a, b = self._ends[column]
        rotations, moves = motion.rotations[frame], motion.translations[frame]
        return (rotations[a], moves[a]), (rotations[b], moves[b])

    def _collect(self, column: int, result: SearchResult, known: PairMemory) -> SearchResult:
        """Fill the curve of a hit and, if the settings say so, search on for others."""
        search = self._searches[column]
        if result.hit is None:
            known.seeds, known.faces = NO_SEEDS, NO_FACES
            return result
        pairs = search.curve(known.seeds if self._settings.warm_start else NO_SEEDS)
        while result.hit is not None and not self._settings.stop_first:
            result = search.search_further()
            if result.hit is not None:
                pairs = search.curve(NO_SEEDS)
        known.seeds = pairs[np.linspace(0, len(pairs) - 1, min(SEEDS, len(pairs))).astype(np.int64)]
        faces = self._numbered_face_pairs(column, pairs)
        known.faces = faces[np.lexsort((faces[:, 1], faces[:, 0]))].astype(np.int32)
        return result

    def _numbered_face_pairs(self, column: int, indices: IntArray) -> IntArray:
        """The face pairs, in the order of the pair, at indices (k, 2) in the order of the search."""
        search = self._searches[column]
        faces = np.stack([search.first.face[indices[:, 0]], search.second.face[indices[:, 1]]], axis=1)
        return faces[:, ::-1] if self._swapped[column] else faces


class LiveSearch(LivePairs):
    """Looks of ``search`` at the pairs that ``volumes`` leave: CONTACT where it confirms one, else NOT_FOUND."""

    def __init__(self, volumes: BroadPhase, search: SearchStage) -> None:
        memory = search.fresh_memory()
        self._answer = SearchAnswer((1, len(memory)), faces=False)

        def decide(now: Motion, column: int, _margin: float) -> tuple[int, bool]:
            meets = search.decide_frame(now, 0, column, memory[column], self._answer)
            return int(Verdict.CONTACT if meets else Verdict.NOT_FOUND), False

        super().__init__(volumes, decide, None)

    @property
    def seconds(self) -> dict[str, float]:
        """Seconds of the last sample, by stage."""
        seconds = super().seconds
        return {"volumes": seconds["volumes"], "search": seconds["surfaces"]}

    @property
    def work(self) -> Counter[str]:
        """Counters of all samples so far."""
        return Counter(self._answer.work)


def lengths_at_rest(first: Features, second: Features, fraction: float) -> tuple[float, float, float]:
    """Metres: size of the first body, of both, and how far a pair has moved that counts as new.

    ``fraction`` is in diameters of the mean face of the finer mesh, which limits how small a contact can be. With the
    mean of both, a ball of 512 faces was searched in brief for 18 frames on its way to a plate of 12, and the first two
    frames of their contact were missed.
    """
    news = fraction * 2.0 * min(first.mean_radius, second.mean_radius)
    return first.size, first.size + second.size, news


@hot_kernel
def distance_moved(pose: FloatArray, before: FloatArray, size: float) -> float:
    """Farthest any point within ``size`` of the first body's origin can have moved between two relative poses."""
    rotation_change = move = 0.0
    for k in range(9):
        change = pose[k] - before[k]
        rotation_change += change * change
    for k in range(9, 12):
        moved = pose[k] - before[k]
        move += moved * moved
    return float(np.sqrt(rotation_change) * size + np.sqrt(move))


@kernel
def budget_at_rest(
    pose: FloatArray, searched: FloatArray, last_relative: FloatArray, lengths: tuple[float, float, float], whole: int
) -> int:
    """Evaluations, of the ``whole`` budget, at a relative pose (13,); 0: all of it found nothing here before.

    ``searched``: relative pose at which the whole budget found nothing; ``last_relative``: relative pose at the search
    before; not a number where there is none. A pair that comes to rest at a new pose is searched there once.
    """
    size, sizes, news = lengths
    rounding = ROUNDING_ULPS * EPS * (sizes + max(pose[12], searched[12], last_relative[12]))
    moved = distance_moved(pose, searched, size)
    if moved <= rounding:
        return 0
    came_to_rest = distance_moved(pose, last_relative, size) <= rounding
    # Written so that what is not a number has moved.
    return whole if came_to_rest or not moved < news else min(whole, PROBE)
