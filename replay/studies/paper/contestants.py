"""Who takes part, and what each finds in a pose: every row is asked the same way, its findings held to the truth."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from time import perf_counter
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from cdcore import Body, Detector, Motion, create_detector
from replay.base.constants import HEADSET_HZ
from replay.studies.paper.fixtures import Fixture, faces_of_pairs

SEARCH: Final = {"stop_first": False, "warm_start": False, "budget": 10_000}
"""A search knows nothing of the pose before, and spends its evaluations on further curves after a hit."""


@dataclass(frozen=True)
class Contestant:
    """One row.

    Parameters
    ----------
    detector, settings : what is created.
    counters : work that ``budget`` limits; empty: the row has no budget.
    complete : whether it claims to find every face.
    """

    detector: str
    settings: Mapping[str, Any] = field(default_factory=dict)
    counters: tuple[str, ...] = ()
    complete: bool = True


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
    truth: tuple[NDArray[np.int64], ...]


@dataclass(frozen=True)
class Answer:
    """What was found in one pose, beside the truth: unique faces of both meshes, and face pairs; time if taken."""

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


def ask(name: str, detector: Detector, group: Group, pose: int) -> Answer:
    """What ``detector``, made for row ``name``, finds in one pose."""
    frame = group.motion.frames(pose, pose + 1)
    start = perf_counter()
    found = detector.detect(frame, faces=True)
    pairs = found.faces(0, 0)
    seconds = perf_counter() - start
    operations = int(sum(int(np.sum(found.work[counter])) for counter in CONTESTANTS[name].counters))
    return answer_of(pairs, group.truth[pose], operations, seconds)


def answer_of(
    pairs: NDArray[np.integer], truth: NDArray[np.int64], operations: int, seconds: float | None = None
) -> Answer:
    """Face pairs found (k, 2) held to the truth."""
    right = np.array(sorted(set(map(tuple, pairs.tolist())) & set(map(tuple, truth.tolist()))), dtype=np.int64)
    right = right.reshape(-1, 2)
    faces, true_faces = faces_of_pairs(right), faces_of_pairs(truth)
    return Answer(faces, true_faces, len(pairs), len(truth), len(right), operations, seconds)
