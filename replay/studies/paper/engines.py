"""Trees and features built once, asked with any budget: to the bit what the detector of that budget finds.

A detector has its budget among its settings and builds its trees when it is made; a table of many budgets would spend
its time on building. An engine is the same search without the stages before it; those let all of Table I through.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from cdcore import Body, Motion
from cdcore.detectors import load_detector
from cdcore.narrow.fcl_meshes import FclMeshes
from cdcore.narrow.tree_stage import TreeSettings, TreeStage
from cdcore.narrow.trees.search import TREE_KINDS, TreeSearch
from cdcore.search.features import Features, features_of
from cdcore.search.pair_search import PairSearch
from cdcore.search.result import Look
from cdcore.search.samples import Sample, sample_of
from cdcore.search.settings import SearchSettings
from replay.studies.paper.contestants import CONTESTANTS, TREE, Answer, Group, answer_of

TREES: Final = tuple(TREE_KINDS)
"""Rows that search two trees."""

ONLY: Final = np.array([[0, 1]], dtype=np.int64)
FIRST: Final = np.zeros(1, dtype=np.int64)
NO_SEEDS: Final = np.zeros((0, 2), dtype=np.int64)

Found = tuple[NDArray[np.int64], int]
"""Face pairs (k, 2) that meet, sorted, and the operations they took."""


class Engine(Protocol):
    """A row that can be cut short."""

    def ask(self, frame: Motion, budget: int) -> Found:
        """What it finds in a motion of one frame within ``budget`` operations."""
        ...


class TreeEngine:
    """Two trees and a way through them."""

    def __init__(self, bodies: Sequence[Body], search: TreeSearch) -> None:
        self._bodies, self._search = bodies, search

    def ask(self, frame: Motion, budget: int) -> Found:
        """What is found within ``budget`` node and leaf tests."""
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

    def sampled_faces(self, size: int | None, seed: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Numbers of the faces of the first and the second body that such a sample holds."""
        drawn = self._samples(size, seed)
        faces = [self._search.first.face[drawn[0].pick], self._search.second.face[drawn[1].pick]]
        return faces[self._order.index(0)], faces[self._order.index(1)]

    def first_hit(self, frame: Motion, budget: int) -> int | None:
        """Evaluations until the first hit in a motion of one frame; ``None``: none within ``budget``."""
        look = self._look(frame, budget)
        return None if look.hit is None else look.evaluations

    def ask(self, frame: Motion, budget: int) -> Found:
        """What is found within ``budget`` evaluations, looking on after each hit."""
        search = self._search
        look = self._look(frame, budget)
        pairs = NO_SEEDS
        while look.hit is not None:
            pairs = search.curve(NO_SEEDS)
            look = search.look_on()
        faces = np.stack([search.first.face[pairs[:, 0]], search.second.face[pairs[:, 1]]], axis=1)[:, self._order]
        return faces[np.lexsort((faces[:, 1], faces[:, 0]))], look.evaluations

    def _look(self, frame: Motion, budget: int) -> Look:
        pose_a, pose_b = ((frame.rotations[0, k], frame.translations[0, k]) for k in self._order)
        return self._search.look(pose_a, pose_b, float(frame.times[0]), budget=budget)

    def _samples(self, size: int | None, seed: int) -> tuple[Sample, Sample]:
        first, second = self._search.first, self._search.second
        return _drawn(first, size, seed, self._names[0]), _drawn(second, size, seed, self._names[1])


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

Capped = Mapping[tuple[str, int], list[tuple[int, Answer]]]
"""Row and cap -> target and answer, a pose each."""


def ask_capped(group: Group, engines: Mapping[str, Engine], whole: Mapping[str, list[int]]) -> Capped:
    """What each row of ``CAPPED`` finds in every pose of a group before it stops.

    ``engines``: of the trees.
    ``whole``: row -> operations of each pose when nothing stops it.
    """
    found: dict[tuple[str, int], list[tuple[int, Answer]]] = {(name, cap): [] for name in CAPPED for cap in CAPS}
    meshes = FclMeshes([body.mesh for body in group.bodies])
    for pose, truth in enumerate(group.truth):
        frame = group.motion.frames(pose, pose + 1)
        for body in range(2):
            meshes.place(body, frame.rotations[0, body], frame.translations[0, body])
        for cap in CAPS:
            for name in TREES:
                pairs, operations = first_contacts(engines[name], frame, cap, whole[name][pose])
                found[name, cap].append((group.target, answer_of(pairs, truth, operations)))
            found[FCL, cap].append((group.target, answer_of(meshes.faces(0, 1, most=cap), truth, 0)))
    return found


def first_contacts(engine: Engine, frame: Motion, cap: int, whole: int) -> tuple[NDArray[np.int64], int]:
    """The first ``cap`` face pairs that a traversal comes to, and its operations until then.

    ``whole``: operations that find every pair.
    """
    least = bisect_left(range(1, whole), cap, key=lambda budget: len(engine.ask(frame, budget)[0]))
    return engine.ask(frame, 1 + least)
