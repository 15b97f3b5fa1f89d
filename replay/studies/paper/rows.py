"""Who takes part, and what each finds in a pose: every row is asked the same way, its findings held to the truth."""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from time import perf_counter
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from cdcore import Body, Detector, create_detector
from replay.studies.paper.fixtures import Fixture, faces_of_pairs

SEARCH_SETTINGS: Final = {"stop_first": False, "warm_start": False, "budget": 10_000}
"""A search knows nothing of the pose before, and spends its evaluations on further curves after a hit."""


@dataclass(frozen=True)
class Row:
    """One detector, its settings, the work that ``budget`` limits (none: no budget), whether it claims every face."""

    detector: str
    settings: Mapping[str, Any] = field(default_factory=dict)
    counters: tuple[str, ...] = ()
    complete: bool = True


WITHOUT_CONTAINMENT: Final = {"containment": False}
TREE_COUNTS: Final = ("node_tests", "leaf_tests")

ROWS: Final[dict[str, Row]] = {
    "exact": Row("exact", WITHOUT_CONTAINMENT),
    "hybrid": Row("hybrid", WITHOUT_CONTAINMENT),
    "hybrid-qaco mesh": Row("hybrid-qaco", WITHOUT_CONTAINMENT | SEARCH_SETTINGS | {"decide": "mesh"}),
    "rapid-style": Row("rapid-style", WITHOUT_CONTAINMENT, TREE_COUNTS),
    "solid-style": Row("solid-style", WITHOUT_CONTAINMENT, TREE_COUNTS),
    "aabb": Row("aabb", WITHOUT_CONTAINMENT, TREE_COUNTS),
    "obb": Row("obb", WITHOUT_CONTAINMENT, TREE_COUNTS),
    "hybrid-qaco": Row("hybrid-qaco", SEARCH_SETTINGS, ("evaluations",), complete=False),
} | {
    f"qaco {variant}": Row("qaco", SEARCH_SETTINGS | {"variant": variant}, ("evaluations",), complete=False)
    for variant in ("memetic", "corrected", "local", "random", "printed")
}
"""Name -> what is asked. ``hybrid-qaco`` decides by search, the paper's pipeline."""

BUDGETED_ROWS: Final = tuple(name for name, row in ROWS.items() if row.counters)


ANSWER_DTYPE: Final = np.dtype(
    [(name, int) for name in ("target", "faces", "true_faces", "pairs", "true_pairs", "right_pairs", "operations")]
    + [("seconds", float)]
)
"""What was found in one pose of a target, beside the truth: unique faces of both meshes, and face pairs; operations are
0 of a row without a budget.
"""

Answers = Mapping[str, NDArray[Any]]
"""Row -> an answer a pose."""


def groups_of(fixtures: Iterable[Fixture]) -> list[list[Fixture]]:
    """The fixtures, those of the same meshes together."""
    groups: defaultdict[tuple[int, str], list[Fixture]] = defaultdict(list)
    for pose in sorted(fixtures, key=lambda pose: (pose.target, pose.family, pose.number)):
        groups[pose.target, pose.family].append(pose)
    return [*groups.values()]


def make_detector_of_row(row_name: str, bodies: Sequence[Body], **settings: Any) -> Detector:
    """The detector of a row, with some settings changed."""
    row = ROWS[row_name]
    return create_detector(row.detector, bodies, **dict(row.settings) | settings)


def compared_answers(row_name: str, detector: Detector, poses: Iterable[Fixture]) -> NDArray[Any]:
    """Answers of ``detector``, made for row ``row_name``, in some poses, compared with the truth."""
    answers = []
    for pose in poses:
        start = perf_counter()
        detection = detector.detect(pose.motion, faces=True)
        pairs = detection.faces(0, 0)
        seconds = perf_counter() - start
        common_pairs = set(map(tuple, pairs.tolist())) & set(map(tuple, pose.pairs.tolist()))
        right_face_pairs = np.array(sorted(common_pairs), dtype=np.int64).reshape(-1, 2)
        operation_count = sum(int(np.sum(detection.work[counter])) for counter in ROWS[row_name].counters)
        counts = faces_of_pairs(right_face_pairs), pose.faces, len(pairs), len(pose.pairs), len(right_face_pairs)
        answers.append((pose.target, *counts, operation_count, seconds))
    return np.array(answers, ANSWER_DTYPE)
