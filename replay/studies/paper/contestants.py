"""Who takes part, and what each finds in a pose: every row is asked the same way, its findings held to the truth.

A detector has its budget among its settings and builds its trees when it is made. An engine is the same search without
the stages before it, built once and asked with any budget: to the bit what the detector of that budget finds.

Of T1c: an engine that stops after k contacts lists k face pairs, whatever meets. A traversal goes its way whatever its
budget, so one that stops at its k-th contact is the traversal with the least budget that finds k.
"""

from bisect import bisect_left
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import groupby
from time import perf_counter
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from cdcore import Body, Detector, Motion, create_detector
from cdcore.detectors import load_detector
from cdcore.narrow.fcl_meshes import FclMeshes
from cdcore.narrow.tree_stage import TreeSettings, TreeStage
from cdcore.narrow.trees.search import TREE_KINDS, TreeSearch
from cdcore.numerics import IntArray
from cdcore.search.features import Features, features_of
from cdcore.search.pair_search import PairSearch
from cdcore.search.result import SearchResult
from cdcore.search.samples import Sample, sample_of
from cdcore.search.settings import SearchSettings
from replay.base.constants import HEADSET_HZ
from replay.studies.paper.fixtures import Fixture, faces_of_pairs

SEARCH: Final = {"stop_first": False, "warm_start": False, "budget": 10_000}
"""A search knows nothing of the pose before, and spends its evaluations on further curves after a hit."""


@dataclass(frozen=True)
class Contestant:
    """One row."""

    # detector, settings: what is created
    detector: str
    settings: Mapping[str, Any] = field(default_factory=dict)
    counters: tuple[str, ...] = ()  # work that ``budget`` limits; empty: the row has no budget
    complete: bool = True  # whether it claims to find every face


BARE: Final = {"containment": False}
TREE: Final = ("node_tests", "leaf_tests")

CONTESTANTS: Final[dict[str, Contestant]] = {
    "exact": Contestant("exact", BARE),
    "hybrid": Contestant("hybrid", BARE),
    "hybrid-qaco mesh": Contestant("hybrid-qaco", BARE | SEARCH | {"decide": "mesh"}),
    "rapid-style": Contestant("rapid-style", BARE, TREE),
    "solid-style": Contestant("solid-style", BARE, TREE),
    "aabb": Contestant("aabb", BARE, TREE),
    "obb": Contestant("obb", BARE, TREE),
    "hybrid-qaco": Contestant("hybrid-qaco", SEARCH, ("evaluations",), complete=False),
} | {
    f"qaco {variant}": Contestant("qaco", SEARCH | {"variant": variant}, ("evaluations",), complete=False)
    for variant in ("memetic", "corrected", "local", "random", "printed")
}
"""Name -> what is asked. ``hybrid-qaco`` decides by search, the paper's pipeline."""


@dataclass(frozen=True, eq=False)
class Group:
    """The poses of one pair of meshes: a frame each, with a stamp of its own, hence a random stream of its own."""

    family: str
    target: int
    bodies: tuple[Body, Body]
    motion: Motion
    truth: tuple[IntArray, ...]


@dataclass(frozen=True)
class PoseAnswer:
    """What was found in one pose, beside the truth: unique faces of both meshes, and face pairs; time if taken."""

    target: int  # of its group
    faces: int
    true_faces: int
    pairs: int
    true_pairs: int
    right_pairs: int
    operations: int
    seconds: float | None

    @property
    def face_recall(self) -> float:
        """Share of the faces that meet which were found; invented ones would not count here but in ``precision``."""
        return self.faces / self.true_faces

    @property
    def invented(self) -> int:
        """Face pairs reported that do not meet."""
        return self.pairs - self.right_pairs


def groups_of(fixtures: Sequence[Fixture]) -> Iterator[Group]:
    """The fixtures, those of the same meshes together."""
    ordered = sorted(fixtures, key=lambda one: (one.target, one.family, one.number))
    for (target, family), members in groupby(ordered, key=lambda one: (one.target, one.family)):
        some = list(members)
        motion = Motion(
            np.array([one.number for one in some]) / HEADSET_HZ,
            np.concatenate([one.motion.translations for one in some]),
            np.concatenate([one.motion.rotations for one in some]),
        )
        yield Group(family, target, some[0].bodies, motion, tuple(one.pairs for one in some))


def make(name: str, bodies: Sequence[Body], **settings: Any) -> Detector:
    """The detector of a row, with some settings changed."""
    row = CONTESTANTS[name]
    return create_detector(row.detector, bodies, **dict(row.settings) | settings)


def ask(name: str, detector: Detector, group: Group, pose: int) -> PoseAnswer:
    """What ``detector``, made for row ``name``, finds in one pose."""
    frame = group.motion.frames(pose, pose + 1)
    start = perf_counter()
    found = detector.detect(frame, faces=True)
    pairs = found.faces(0, 0)
    seconds = perf_counter() - start
    operations = sum(int(np.sum(found.work[counter])) for counter in CONTESTANTS[name].counters)
    return answer_of(group, pose, pairs, operations, seconds)


def answer_of(
    group: Group, pose: int, pairs: NDArray[np.integer], operations: int, seconds: float | None = None
) -> PoseAnswer:
    """Face pairs found (k, 2) in one pose held to the truth."""
    truth = group.truth[pose]
    both = set(map(tuple, pairs.tolist())) & set(map(tuple, truth.tolist()))
    right = np.array(sorted(both), dtype=np.int64).reshape(-1, 2)
    faces, true_faces = faces_of_pairs(right), faces_of_pairs(truth)
    return PoseAnswer(group.target, faces, true_faces, len(pairs), len(truth), len(right), operations, seconds)


TREES: Final = tuple(TREE_KINDS)
"""Rows that search two trees."""

ONLY: Final = np.array([[0, 1]], dtype=np.int64)
FIRST: Final = np.zeros(1, dtype=np.int64)
NO_SEEDS: Final = np.zeros((0, 2), dtype=np.int64)

Found = tuple[IntArray, int]
"""Face pairs (k, 2) that meet, sorted, and the operations they took."""


class TreeEngine:
    """Two trees and a way through them."""

    def __init__(self, bodies: Sequence[Body], search: TreeSearch) -> None:
        self._bodies, self._search = bodies, search

    def ask(self, frame: Motion, budget: int) -> Found:
        """What is found in a motion of one frame within ``budget`` node and leaf tests."""
        stage = TreeStage(self._bodies, ONLY, self._search, TreeSettings(budget=budget, containment=False))
        answer = stage.decide(frame, FIRST, FIRST, every=True)
        pairs = answer.sets[int(answer.which[0])].astype(np.int64)
        return pairs, sum(answer.work[counter] for counter in TREE)


class SearchEngine:
    """A sampled search over features; every hit brings the pairs of its curve.

    ``bodies``, ``features``: of both.
    ``settings``: who searches, with which constants and seed.
    """

    def __init__(self, bodies: Sequence[Body], features: Sequence[Features], settings: SearchSettings) -> None:
        self._order = sorted(range(2), key=lambda k: bodies[k].name)
        first, second = self._order
        self._names = bodies[first].name, bodies[second].name
        self._settings = settings
        self._search = PairSearch(features[first], features[second], self._names, settings)

    def sample(self, size: int | None, seed: int) -> None:
        """Search ``size`` faces of each body from here on, drawn by area; ``None``: all."""
        self._search.use(*self._samples(size, seed))

    def sampled_faces(self, size: int | None, seed: int) -> tuple[IntArray, IntArray]:
        """Numbers of the faces of the first and the second body that such a sample holds."""
        drawn = self._samples(size, seed)
        faces = [self._search.first.face[drawn[0].pick], self._search.second.face[drawn[1].pick]]
        return faces[self._order.index(0)], faces[self._order.index(1)]

    def first_hit(self, frame: Motion, budget: int) -> int | None:
        """Evaluations until the first hit in a motion of one frame; ``None``: none within ``budget``."""
        look = self._look(frame, budget)
        return None if look.hit is None else look.evaluations

    def ask(self, frame: Motion, budget: int) -> Found:
        """What is found in a motion of one frame within ``budget`` evaluations, looking on after each hit."""
        search = self._search
        look = self._look(frame, budget)
        pairs = NO_SEEDS
        while look.hit is not None:
            pairs = search.curve(NO_SEEDS)
            look = search.look_on()
        faces = np.stack([search.first.face[pairs[:, 0]], search.second.face[pairs[:, 1]]], axis=1)[:, self._order]
        return faces[np.lexsort((faces[:, 1], faces[:, 0]))], look.evaluations

    def _look(self, frame: Motion, budget: int) -> SearchResult:
        pose_a, pose_b = ((frame.rotations[0, k], frame.translations[0, k]) for k in self._order)
        return self._search.look(pose_a, pose_b, float(frame.times[0]), budget=budget)

    def _samples(self, size: int | None, seed: int) -> tuple[Sample, Sample]:
        first, second = self._search.first, self._search.second
        return _drawn(first, size, seed, self._names[0]), _drawn(second, size, seed, self._names[1])


Engine = TreeEngine | SearchEngine
"""A row that can be cut short."""


@lru_cache(maxsize=16)
def _drawn(features: Features, size: int | None, seed: int, name: str) -> Sample:
    """A sample, drawn once for all who search it: its neighbours took longer than most searches."""
    return sample_of(features, size, seed, name)


def engines_of(bodies: Sequence[Body], names: Sequence[str]) -> Mapping[str, Engine]:
    """An engine for each of the rows ``names``, all of which take a budget."""
    corners = [body.mesh.triangles for body in bodies]
    made: dict[str, Engine] = {name: TreeEngine(bodies, TreeSearch(name, corners)) for name in names if name in TREES}
    searched = [name for name in names if name not in TREES]
    features = [features_of(body.mesh) for body in bodies] if searched else []
    for name in searched:
        row = CONTESTANTS[name]
        settings: SearchSettings = load_detector(row.detector).Settings(**row.settings)
        made[name] = SearchEngine(bodies, features, settings)
    return made


CAPS: Final = (1, 10, 100)
"""Contacts after which an engine stops; 1 is the first-contact mode of RAPID and SOLID, and FCL's default."""
FCL: Final = "python-fcl"
CAPPED: Final = (*TREES, FCL)

Capped = Mapping[tuple[str, int], list[PoseAnswer]]
"""Row and cap -> an answer a pose."""


def ask_capped(group: Group, engines: Mapping[str, Engine], whole: Mapping[str, list[int]]) -> Capped:
    """What each row of ``CAPPED`` finds in every pose of a group before it stops.

    ``engines``: of the trees.
    ``whole``: row -> operations of each pose when nothing stops it.
    """
    found: dict[tuple[str, int], list[PoseAnswer]] = {(name, cap): [] for name in CAPPED for cap in CAPS}
    meshes = FclMeshes([body.mesh for body in group.bodies])
    for pose in range(len(group.truth)):
        frame = group.motion.frames(pose, pose + 1)
        for body in range(2):
            meshes.place(body, frame.rotations[0, body], frame.translations[0, body])
        for cap in CAPS:
            for name in TREES:
                pairs, operations = first_contacts(engines[name], frame, cap, whole[name][pose])
                found[name, cap].append(answer_of(group, pose, pairs, operations))
            found[FCL, cap].append(answer_of(group, pose, meshes.faces(0, 1, most=cap), 0))
    return found


def first_contacts(engine: Engine, frame: Motion, cap: int, whole: int) -> tuple[IntArray, int]:
    """The first ``cap`` face pairs that a traversal comes to, and its operations until then.

    ``whole``: operations that find every pair.
    """
    least = bisect_left(range(1, whole), cap, key=lambda budget: len(engine.ask(frame, budget)[0]))
    return engine.ask(frame, 1 + least)
