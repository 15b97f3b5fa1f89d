"""Who takes part, and what each finds in a pose: every row is asked the same way, its findings held to the truth."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from time import perf_counter
from typing import Any, Final

import numpy as np

from cdcore import Body, Detector, Motion, create_detector
from cdcore.numerics import IntArray
from replay.base.constants import HEADSET_HZ
from replay.studies.paper.fixtures import Fixture, faces_of_pairs

SEARCH: Final = {"stop_first": False, "warm_start": False, "budget": 10_000}
"""A search knows nothing of the pose before, and spends its evaluations on further curves after a hit."""


@dataclass(frozen=True)
class Row:
    """One detector, its settings, the work that ``budget`` limits (none: no budget), whether it claims every face."""

    detector: str
    settings: Mapping[str, Any] = field(default_factory=dict)
    counters: tuple[str, ...] = ()
    complete: bool = True


BARE: Final = {"containment": False}
TREE: Final = ("node_tests", "leaf_tests")

ROWS: Final[dict[str, Row]] = {
    "exact": Row("exact", BARE),
    "hybrid": Row("hybrid", BARE),
    "hybrid-qaco mesh": Row("hybrid-qaco", BARE | SEARCH | {"decide": "mesh"}),
    "rapid-style": Row("rapid-style", BARE, TREE),
    "solid-style": Row("solid-style", BARE, TREE),
    "aabb": Row("aabb", BARE, TREE),
    "obb": Row("obb", BARE, TREE),
    "hybrid-qaco": Row("hybrid-qaco", SEARCH, ("evaluations",), complete=False),
} | {
    f"qaco {variant}": Row("qaco", SEARCH | {"variant": variant}, ("evaluations",), complete=False)
    for variant in ("memetic", "corrected", "local", "random", "printed")
}
"""Name -> what is asked. ``hybrid-qaco`` decides by search, the paper's pipeline."""

BUDGETED: Final = tuple(name for name, row in ROWS.items() if row.counters)


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
    """What was found in one pose, beside the truth: unique faces of both meshes, and face pairs."""

    target: int  # of its group
    faces: int
    true_faces: int
    pairs: int
    true_pairs: int
    right_pairs: int
    operations: int  # 0 of a row without a budget
    seconds: float

    @property
    def face_recall(self) -> float:
        """Share of the faces that meet which were found; false ones would not count here but in the precision."""
        return self.faces / self.true_faces


Answers = Mapping[str, Sequence[PoseAnswer]]
"""Row -> an answer a pose."""


def groups_of(fixtures: Sequence[Fixture]) -> Iterator[Group]:
    """The fixtures, those of the same meshes together."""
    ordered = sorted(fixtures, key=lambda pose: (pose.target, pose.family, pose.number))
    for (target, family), members in groupby(ordered, key=lambda pose: (pose.target, pose.family)):
        poses = list(members)
        motion = Motion(
            np.array([pose.number for pose in poses]) / HEADSET_HZ,
            np.concatenate([pose.motion.translations for pose in poses]),
            np.concatenate([pose.motion.rotations for pose in poses]),
        )
        yield Group(family, target, poses[0].bodies, motion, tuple(pose.pairs for pose in poses))


def make(name: str, bodies: Sequence[Body], **settings: Any) -> Detector:
    """The detector of a row, with some settings changed."""
    row = ROWS[name]
    return create_detector(row.detector, bodies, **dict(row.settings) | settings)


def ask(name: str, detector: Detector, group: Group, pose: int) -> PoseAnswer:
    """What ``detector``, made for row ``name``, finds in one pose, held to the truth."""
    frame = group.motion.frames(pose, pose + 1)
    start = perf_counter()
    detection = detector.detect(frame, faces=True)
    pairs = detection.faces(0, 0)
    seconds = perf_counter() - start
    truth = group.truth[pose]
    both = set(map(tuple, pairs.tolist())) & set(map(tuple, truth.tolist()))
    right = np.array(sorted(both), dtype=np.int64).reshape(-1, 2)
    return PoseAnswer(
        target=group.target,
        faces=faces_of_pairs(right),
        true_faces=faces_of_pairs(truth),
        pairs=len(pairs),
        true_pairs=len(truth),
        right_pairs=len(right),
        operations=sum(int(np.sum(detection.work[counter])) for counter in ROWS[name].counters),
        seconds=seconds,
    )
