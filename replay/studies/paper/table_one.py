"""Table I, T1a, Fig. 7 a to c: run to completion exact rows find every face; cut short, each finds its share.

Wall times are taken once: they turn a common wall time into a budget of operations for every row.
"""

from collections.abc import Mapping, Sequence
from statistics import fmean, mean, median
from typing import Final

import numpy as np

from replay.base.machine import machine
from replay.base.tables import Table
from replay.outputs.paper_table import Cell, paper_table
from replay.studies.paper.fixtures import Fixture
from replay.studies.paper.printed import ACCURACY, OURS, PRINTED, TABLE_1, TIME_TO_RAPID, VARIANCE
from replay.studies.paper.rows import BUDGETED, ROWS, Answers, PoseAnswer, ask, make
from sessions.synthetic.rng import random_stream

SHARES: Final = (0.25, 0.5, 1.0, 2.0)
"""Common wall times B, in medians of ``hybrid``."""

RESAMPLES: Final = 1000


def ask_to_completion(group: Sequence[Fixture]) -> Answers:
    """Ask and time every row in every pose of a group, rows in turn within a pose, after one warm round."""
    detectors = {name: make(name, group[0].bodies) for name in ROWS}
    for name, detector in detectors.items():
        ask(name, detector, group[0])
    answers: dict[str, list[PoseAnswer]] = {name: [] for name in ROWS}
    for pose in group:
        for name, detector in detectors.items():
            answers[name].append(ask(name, detector, pose))
    return answers


def budget(complete: Answers, name: str, target: int, share: float) -> int:
    """Operations that row ``name`` does in ``share`` medians of ``hybrid``; 1 at least."""
    hybrid = median(answer.seconds for answer in complete["hybrid"] if answer.target == target)
    row = [answer for answer in complete[name] if answer.target == target]
    rate = sum(answer.operations for answer in row) / sum(answer.seconds for answer in row)
    return max(1, round(share * hybrid * rate))


def ask_cut_short(group: Sequence[Fixture], complete: Answers, share: float) -> Answers:
    """Ask every row that takes a budget in every pose of a group, with ``share`` medians of ``hybrid``."""
    answers = {}
    for name in BUDGETED:
        detector = make(name, group[0].bodies, budget=budget(complete, name, group[0].target, share))
        answers[name] = [ask(name, detector, pose) for pose in group]
    return answers


def joined(parts: Sequence[Answers]) -> Answers:
    """The answers of all groups, in their order."""
    return {name: [answer for part in parts for answer in part[name]] for name in parts[0]}


def table_one(complete: Answers, equal: Mapping[float, Answers]) -> Table:
    """Table I; ``equal`` are the answers by share of the common wall time."""
    rows: list[tuple[Cell, ...]] = []
    for target in sorted({answer.target for answer in complete["exact"]}):
        for name, theirs in OURS.items():
            asked = (complete[name], *(equal[share][name] for share in SHARES))
            cells = [fmean(answer.faces for answer in answers if answer.target == target) for answers in asked]
            true = fmean(answer.true_faces for answer in complete[name] if answer.target == target)
            rows.append((target, f"{name} ({theirs})", true, *cells, TABLE_1[name].get(target)))
    head = ("faces", "algorithm", "true faces", "to completion", *(f"B = {share:g}" for share in SHARES), PRINTED)
    return paper_table(
        "Table I", "Mean faces detected, to completion and within equal wall times B", head, tuple(rows),
        "B is in medians of hybrid's wall time; hybrid-qaco searches and its completion is 10,000 evaluations.",
    )  # fmt: skip


def to_completion(complete: Answers) -> Table:
    """T1a: the headline."""
    rows: list[tuple[Cell, ...]] = []
    for name, answers in complete.items():
        whole = sum(answer.right_pairs == answer.true_pairs for answer in answers)
        faces, true, pairs, true_pairs, right, operations = (
            sum(getattr(answer, field) for answer in answers)
            for field in ("faces", "true_faces", "pairs", "true_pairs", "right_pairs", "operations")
        )
        poses = len(answers)
        rows.append((
            name, poses, whole, faces / poses, faces / true, right / true_pairs, right / pairs if pairs else None,
            operations / poses or None, 1e3 * mean(answer.seconds for answer in answers),
        ))  # fmt: skip
    head = (
        "algorithm", "poses", "poses with every pair", "faces", "face recall", "pair recall", "precision",
        "operations", "ms",
    )  # fmt: skip
    note = (
        "The first seven run to completion; searches stop after 10,000 evaluations. Faces found, operations, ms: mean "
        "of a pose. Recalls, precision: of all poses together."
    )
    return paper_table("T1a", "Run to completion, exact hierarchies lose no face", head, tuple(rows), note)


def accuracy(equal: Mapping[float, Answers]) -> Table:
    """Fig. 7 a and b: face recall of single poses."""
    rows = []
    for name in BUDGETED:
        for share in SHARES:
            recalls = [answer.face_recall for answer in equal[share][name]]
            rows.append((name, share, *spread(recalls), ACCURACY.get(name), VARIANCE.get(name)))
    head = (
        "algorithm", "B", "n", "mean", "mean, low", "mean, high", "standard deviation", "variance",
        f"mean: {PRINTED}", f'"variance": {PRINTED}',
    )  # fmt: skip
    note = "Intervals: bootstrap, 95 %. The printed variances are of the size of a standard deviation."
    return paper_table("F7ab", "Accuracy (face recall of a pose) at equal wall time", head, tuple(rows), note)


def times(complete: Answers) -> Table:
    """Fig. 7 c."""
    to = median(answer.seconds for answer in complete["rapid-style"])
    rows = []
    for name, answers in complete.items():
        low, middle, high = np.quantile([answer.seconds for answer in answers], [0.25, 0.5, 0.75]).tolist()
        rows.append((name, 1e3 * middle, 1e3 * low, 1e3 * high, middle / to, TIME_TO_RAPID.get(name)))
    head = ("algorithm", "median, ms", "lower quartile, ms", "upper quartile, ms", "to rapid-style", PRINTED)
    where = ", ".join(f"{key} {value}" for key, value in machine().items())
    note = f"All faces of a pose; one process, warm, rows in turn; measured on: {where}."
    return paper_table("F7c", "Wall time of a pose", head, tuple(rows), note)


def spread(values: Sequence[float], seed: int = 0) -> tuple[int, float, float, float, float, float]:
    """Number, mean, interval of the mean at 95 %, standard deviation and variance (by n - 1) of one value or more.

    The interval is a percentile bootstrap of ``RESAMPLES`` draws.

    Examples
    --------
    >>> spread([1.0, 3.0])[-1]
    2.0
    """
    given = np.asarray(values, dtype=np.float64)
    draws = random_stream(seed, "paper/bootstrap").integers(0, len(given), size=(RESAMPLES, len(given)))
    low, high = np.quantile(given[draws].mean(axis=1), [0.025, 0.975])
    variance = float(given.var(ddof=1)) if len(given) > 1 else 0.0
    return len(given), float(given.mean()), float(low), float(high), variance**0.5, variance
