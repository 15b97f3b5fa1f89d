"""The search over a whole motion, frame by frame as in a live engine. Each pair starts from its closest faces so far.

Where both poses of a pair are bit for bit those of its look before, the answer is that answer; where it rests, and the
whole budget found nothing, it gets less (``rest``).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache

import numpy as np

from cdcore.numerics import BoolArray, FloatArray, Int32Array, IntArray, readonly
from cdcore.protocol import NO_FACES, Body, FaceSets, Motion, ordered_by_name
from cdcore.search.features import RADIUS, Features, features_of
from cdcore.search.pair_search import PairSearch, Pose
from cdcore.search.resting_contact import RestingContact, relative_pose
from cdcore.search.result import Pair, SearchResult
from cdcore.search.sample_control import LEAST_SAMPLE, LEVELS, PROBE, SampleControl, band_of
from cdcore.search.samples import Sample, sample_of
from cdcore.search.search_settings import SearchSettings

SEEDS = 64
"""Pairs of the frame before from which the flood fill starts as well: a second curve then is found again."""

NO_SEEDS: IntArray = readonly(np.zeros((0, 2), dtype=np.int64))

CONTAINMENT_REFUSED = "refused: a search that finds nothing does not know that surfaces are disjoint"
"""What a detector that ends with a search says about containment."""

NOTED_LOOKS = 100_000
"""Looks without a contact that a stage remembers: 40 MB; more than an audit that is watched makes of an hour."""

COUNTERS = ("looks", "reused", "short", "evaluations", "exact_tests", "flood_tests", "restarts", "iterations", "broken")


LookKey = tuple[int, float, int, Pair | None, int]
"""Column, stamp, hash of the poses, start and budget: with the settings all that a look depends on."""


@dataclass(eq=False)
class PairMemory:
    """What is known of a pair from its last look: its poses, whether it met and in which faces, the closest pair."""

    poses: bytes = b""
    hit: bool = False
    start: Pair | None = None
    seeds: IntArray = field(default_factory=lambda: NO_SEEDS)
    faces: Int32Array = field(default_factory=lambda: NO_FACES)
    searched: FloatArray | None = None
    """Relative pose (13,) at which the whole budget found nothing; ``None``: there is none since the last hit."""
    seen: FloatArray | None = None
    """Relative pose (13,) of the look before."""
    number: int = -1
    """Of the face set, in this block; -1: none yet."""


@dataclass(eq=False)
class SearchMemory:
    """What passes from block to block: what is known of each pair, and with ``samples="auto"`` of all searches."""

    pairs: list[PairMemory]
    control: SampleControl | None


class SearchAnswer:
    """What the searches of one block gave.

    ``hits`` (T, P): where a contact was confirmed. ``work``: counters. With ``faces``, ``entries`` holds frame, column
    and number of every pair-frame in contact; its face pairs are ``sets[number]``.
    """

    def __init__(self, shape: tuple[int, ...], faces: bool) -> None:
        self.faces = faces
        self.hits = np.zeros(shape, dtype=np.bool_)
        self.work = dict.fromkeys(COUNTERS, 0)
        self.entries: list[tuple[int, int, int]] = []
        self.sets: list[Int32Array] = []

    def count(self, look: SearchResult, flood_tests: int) -> None:
        """Add the work of one look."""
        work = self.work
        work["evaluations"] += look.evaluations
        work["exact_tests"] += look.tests
        work["flood_tests"] += flood_tests
        work["restarts"] += look.restarts
        work["iterations"] += look.iterations
        work["broken"] += int(look.reason == "broken")

    def face_sets(self) -> FaceSets:
        """The faces as a detection keeps them."""
        frames, columns, numbers = np.array(self.entries, dtype=np.int64).reshape(-1, 3).T
        return FaceSets.from_shared(frames, columns, numbers, self.sets)


class SearchStage:
    """Searches candidate pair-frames of ``pairs`` (P, 2) for contact, with the constants, seed and budget of settings.

    Each pair is searched in the order of its names; its order here does not matter. ``search``: what searches a pair.
    """

    def __init__(
        self, bodies: Sequence[Body], pairs: IntArray, settings: SearchSettings, search: type[PairSearch] = PairSearch
    ) -> None:
        self._settings = settings
        ordered, self._turned = ordered_by_name(bodies, pairs)
        self._ends: list[tuple[int, int]] = [(a, b) for a, b in ordered.tolist()]
        features: dict[int, Features] = {k: features_of(bodies[k].mesh) for k in np.unique(pairs).tolist()}
        names = [(bodies[a].name, bodies[b].name) for a, b in self._ends]
        ends = zip(self._ends, names, strict=True)
        self._searches = [search(features[a], features[b], name, settings) for (a, b), name in ends]
        self._rests = [RestingContact(features[a], features[b], settings.rest) for a, b in self._ends]
        self._samples = self._draw(bodies, features)
        self._rank = {column: rank for rank, column in enumerate(sorted(range(len(names)), key=names.__getitem__))}
        # A pair that rests is searched in brief only if it starts from where it was closest.
        self._rested = settings.rest > 0.0 and settings.warm_start
        # What looks gave that found nothing: who asks the same again need not search.
        self.empty: dict[LookKey, SearchResult] = {}

    def fresh_memory(self) -> SearchMemory:
        """What is known before the first frame: nothing."""
        control = None
        if self._settings.samples == "auto":
            control = SampleControl(self._settings.frame_budget, self._settings.target_recall)
        return SearchMemory([PairMemory() for _ in self._ends], control)

    def decide(self, motion: Motion, near: BoolArray, memory: SearchMemory, *, faces: bool = False) -> SearchAnswer:
        """Search where ``near`` (T, P) says so; what is learned stays in ``memory`` for the block after."""
        found = SearchAnswer(near.shape, faces)
        for known in memory.pairs:
            known.number = -1
        for frame in np.flatnonzero(near.any(axis=1)).tolist():
            self.decide_frame(motion, frame, np.flatnonzero(near[frame]).tolist(), memory, found)
        return found

    def decide_frame(
        self, motion: Motion, frame: int, columns: list[int], memory: SearchMemory, found: SearchAnswer
    ) -> None:
        """Search some pairs in one frame."""
        columns.sort(key=self._rank.__getitem__)
        if memory.control is not None:
            self._decide_within(motion, frame, columns, memory, found)
            return
        search = self._look_rested if self._rested else self._look
        for column in columns:
            known = memory.pairs[column]
            look = search(motion, frame, column, known, self._settings.budget, found)
            self._finish(frame, column, look, known, found)

    def _decide_within(
        self, motion: Motion, frame: int, columns: list[int], memory: SearchMemory, found: SearchAnswer
    ) -> None:
        """One frame within its budget: a probe of every pair, then what is left to those that came closest."""
        control = memory.control
        assert control is not None
        left = control.begin()
        looks: dict[int, SearchResult | None] = {}
        apart: list[tuple[float, int]] = []
        for done, column in enumerate(columns):
            share = left // (len(columns) - done)
            if share == 0:
                continue
            search = self._searches[column]
            search.use(*self._samples[column][0])
            looks[column] = look = self._look(motion, frame, column, memory.pairs[column], min(PROBE, share), found)
            left -= look.evaluations if look else 0
            if look is not None and look.hit is None:
                apart.append((_gap(search, look), column))
        for done, (gap, column) in enumerate(sorted(apart)):
            before, band = looks[column], band_of(gap)
            extra = control.allowance(band, left, len(apart) - done)
            if before is None or extra <= 0:
                continue
            level = control.level()
            self._searches[column].use(*self._samples[column][level])
            look = self._searches[column].look_longer(before.evaluations + extra)
            spent = look.evaluations - before.evaluations
            left -= spent
            control.learn(level, band, spent, look.hit is not None)
            looks[column] = look
        self._run_on(control, [column for _, column in sorted(apart) if memory.pairs[column].hit], looks)
        for column, one in looks.items():
            self._finish(frame, column, one, memory.pairs[column], found)

    def _run_on(self, control: SampleControl, lost: list[int], looks: dict[int, SearchResult | None]) -> None:
        """Search beyond the frame's budget for the nearest of the pairs that met in the frame before, if it may."""
        for column in lost:
            before = looks[column]
            if before is not None and before.hit is None:
                more = control.run_on()
                if more > 0:
                    self._searches[column].use(*self._samples[column][0])
                    looks[column] = self._searches[column].look_longer(before.evaluations + more)
                return

    def _look_rested(
        self, motion: Motion, frame: int, column: int, known: PairMemory, whole: int, found: SearchAnswer
    ) -> SearchResult | None:
        """Search a pair with the whole budget; with less or not at all while it rests where that found nothing."""
        pose = np.empty(13)
        relative_pose(frame, *self._ends[column], motion.rotations, motion.translations, pose)
        budget = self._rests[column].budget(pose, known.searched, known.seen, whole)
        if budget == 0:
            found.work["reused"] += 1
            return None
        known.seen = pose
        look = self._look(motion, frame, column, known, budget, found)
        if look is not None and look.hit is not None:
            known.searched = None
        elif look is not None and budget == whole:
            known.searched = pose
        elif look is not None:
            found.work["short"] += 1
        return look

    def _look(
        self, motion: Motion, frame: int, column: int, known: PairMemory, budget: int, found: SearchAnswer
    ) -> SearchResult | None:
        """Search a pair in a frame; ``None``: both poses are bit for bit those of its last look."""
        pose_a, pose_b = self._poses(motion, frame, column)
        poses = b"".join(part.tobytes() for part in (*pose_a, *pose_b))
        if poses == known.poses:
            found.work["reused"] += 1
            return None
        found.work["looks"] += 1
        known.poses = poses
        start, stamp = known.start if self._settings.warm_start else None, float(motion.times[frame])
        return self._search((column, stamp, hash(poses), start, budget), pose_a, pose_b)

    def _search(self, key: LookKey, pose_a: Pose, pose_b: Pose) -> SearchResult:
        column, stamp, _, start, budget = key
        look = self._searches[column].look(pose_a, pose_b, stamp, start=start, budget=budget)
        if look.hit is None and len(self.empty) < NOTED_LOOKS:
            self.empty[key] = look
        return look

    def _poses(self, motion: Motion, frame: int, column: int) -> tuple[Pose, Pose]:
        """Poses of both bodies of a pair, in the order of the search."""
        a, b = self._ends[column]
        turns, moves = motion.rotations[frame], motion.translations[frame]
        return (turns[a], moves[a]), (turns[b], moves[b])

    def _finish(
        self, frame: int, column: int, look: SearchResult | None, known: PairMemory, found: SearchAnswer
    ) -> None:
        """Write down a look, with its faces if they are asked for; ``None``: repeat the answer of the look before."""
        if look is not None:
            known.hit, known.start, known.number = look.hit is not None, look.hit or look.closest, -1
            look = self._collect(column, look, known) if found.faces else look
            found.count(look, self._searches[column].flood_tests)
        found.hits[frame, column] = known.hit
        if found.faces and known.hit:
            if known.number < 0:
                known.number = len(found.sets)
                found.sets.append(known.faces)
            found.entries.append((frame, column, known.number))

    def _draw(self, bodies: Sequence[Body], features: dict[int, Features]) -> list[list[tuple[Sample, Sample]]]:
        """Samples of both bodies of every pair at every level; a fixed size is used at once."""
        wanted = self._settings.samples

        @cache
        def sample(body: int, size: int | None) -> Sample:
            return sample_of(features[body], size, self._settings.seed, bodies[body].name)

        def thinned(body: int, part: int) -> Sample:
            faces = len(features[body])
            return sample(body, max(faces // part, min(LEAST_SAMPLE, faces)))

        if wanted == "auto":
            return [[(thinned(a, part), thinned(b, part)) for part in LEVELS] for a, b in self._ends]
        if wanted is not None:
            for (a, b), search in zip(self._ends, self._searches, strict=True):
                search.use(sample(a, int(wanted)), sample(b, int(wanted)))
        return []

    def _collect(self, column: int, look: SearchResult, known: PairMemory) -> SearchResult:
        """Fill the curve of a hit and, if asked to, search on for others."""
        search = self._searches[column]
        if look.hit is None:
            known.seeds, known.faces = NO_SEEDS, NO_FACES
            return look
        pairs = search.curve(known.seeds if self._settings.warm_start else NO_SEEDS)
        while look.hit is not None and not self._settings.stop_first:
            look = search.look_on()
            if look.hit is not None:
                pairs = search.curve(NO_SEEDS)
        known.seeds = pairs[np.linspace(0, len(pairs) - 1, min(SEEDS, len(pairs))).astype(np.int64)]
        known.faces = self._faces(column, pairs)
        return look

    def _faces(self, column: int, pairs: IntArray) -> Int32Array:
        """Places as face numbers, first and second as the pair was asked for, sorted."""
        search = self._searches[column]
        faces = np.stack([search.first.face[pairs[:, 0]], search.second.face[pairs[:, 1]]], axis=1)
        faces = faces[:, ::-1] if self._turned[column] else faces
        return faces[np.lexsort((faces[:, 1], faces[:, 0]))].astype(np.int32)


def _gap(search: PairSearch, look: SearchResult) -> float:
    """Distance of the balls of the closest faces of a look, in units of the mean size of the faces of both."""
    (i, j), first, second = look.closest, search.first, search.second
    size = first.mean_radius + second.mean_radius
    gap = look.distance - float(first.rows[i, RADIUS] + second.rows[j, RADIUS])
    return gap / size if size > 0.0 else gap
