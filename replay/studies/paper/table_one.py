"""Table I, T1a to c, Fig. 7 a to c: run to completion exact rows find every face; cut short, each finds its share."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from statistics import mean, median
from typing import Final

import numpy as np

from replay.base.machine import machine
from replay.base.progress import Progress, Silent
from replay.outputs.paper_table import Cell, PaperTable
from replay.studies.paper import contestants
from replay.studies.paper.calibration import SHARES, Calibration
from replay.studies.paper.contestants import CONTESTANTS, TREES, Capped, Group, PoseAnswer
from replay.studies.paper.printed import ACCURACY, OURS, PRINTED, TABLE_1, TIME_TO_RAPID, VARIANCE
from sessions.synthetic.rng import random_stream

Answers = Mapping[str, Sequence[PoseAnswer]]
"""Row -> an answer a pose."""

RESAMPLES: Final = 1000
BUDGETED: Final = tuple(name for name, row in CONTESTANTS.items() if row.counters)


@dataclass(frozen=True)
class TableOne:
    """Answers of all rows: ``complete`` with the budgets of their rows, ``equal`` by share of the common wall time,
    ``capped`` by row and number of contacts.
    """

    complete: Answers
    equal: Mapping[float, Answers]
    capped: Capped


def measure(groups: Sequence[Group], progress: Progress | None = None) -> Calibration:
    """Time every row in every pose in this process, rows in turn within a pose, after one warm round."""
    seconds: dict[str, dict[int, list[float]]] = {name: {} for name in CONTESTANTS}
    operations: dict[str, dict[int, list[int]]] = {name: {} for name in CONTESTANTS}
    with (progress or Silent()).stage("measuring times", sum(len(one.truth) for one in groups), "poses") as advance:
        for group in groups:
            detectors = {name: contestants.make(name, group.bodies) for name in CONTESTANTS}
            for name, detector in detectors.items():
                contestants.ask(name, detector, group, 0)
            for pose in range(len(group.truth)):
                for name, detector in detectors.items():
                    answer = contestants.ask(name, detector, group, pose)
                    seconds[name].setdefault(group.target, []).append(answer.seconds or 0.0)
                    operations[name].setdefault(group.target, []).append(answer.operations)
                advance(1)
    return Calibration(machine(), seconds, operations)


def ask_group(group: Group, calibration: Calibration) -> TableOne:
    """Ask every row in every pose of a group: to completion, with the budgets of ``calibration``, and capped."""
    poses, complete = range(len(group.truth)), dict[str, list[PoseAnswer]]()
    for name in CONTESTANTS:
        detector = contestants.make(name, group.bodies)
        complete[name] = [contestants.ask(name, detector, group, pose) for pose in poses]
    engines = contestants.engines_of(group.bodies, BUDGETED)
    equal: dict[float, dict[str, list[PoseAnswer]]] = {share: {} for share in SHARES}
    for share, name in product(SHARES, BUDGETED):
        budget = calibration.budget(name, group.target, share)
        found = [engines[name].ask(group.motion.frames(pose, pose + 1), budget) for pose in poses]
        equal[share][name] = [contestants.answer_of(group, pose, *one) for pose, one in enumerate(found)]
    whole = {name: [one.operations for one in complete[name]] for name in TREES}
    return TableOne(complete, equal, contestants.ask_capped(group, engines, whole))


def joined(parts: Sequence[TableOne]) -> TableOne:
    """The answers of all groups, in their order."""
    first = parts[0]
    return TableOne(
        {name: [one for part in parts for one in part.complete[name]] for name in first.complete},
        {
            share: {name: [one for part in parts for one in part.equal[share][name]] for name in first.equal[share]}
            for share in first.equal
        },
        {key: [one for part in parts for one in part.capped[key]] for key in first.capped},
    )


def tables_of(found: TableOne, calibration: Calibration) -> list[PaperTable]:
    """Table I beside the printed one, T1a, T1b, T1c, and Fig. 7 a to c."""
    return [
        beside_printed(found), to_completion(found, calibration), equal_budget(found, calibration),
        contact_caps(found, calibration), accuracy(found), times(calibration),
    ]  # fmt: skip


def beside_printed(found: TableOne) -> PaperTable:
    """Table I."""
    rows: list[tuple[Cell, ...]] = []
    for target in sorted({one.target for one in found.complete["exact"]}):
        for name, theirs in OURS.items():
            asked = (found.complete[name], *(found.equal[share][name] for share in SHARES))
            cells = [_mean(one.faces for one in some if one.target == target) for some in asked]
            true = _mean(one.true_faces for one in found.complete[name] if one.target == target)
            rows.append((target, f"{name} ({theirs})", true, *cells, TABLE_1[name].get(target)))
    head = ("faces", "algorithm", "true faces", "to completion", *(f"B = {share:g}" for share in SHARES), PRINTED)
    return PaperTable(
        "Table I", "Mean faces detected, to completion and within equal wall times B", head, tuple(rows),
        "B is in medians of hybrid's wall time; hybrid-qaco searches and its completion is 10,000 evaluations.",
    )  # fmt: skip


def _mean(values: Iterable[int]) -> float:
    some = list(values)
    return sum(some) / len(some)


def to_completion(found: TableOne, calibration: Calibration) -> PaperTable:
    """T1a: the headline."""
    rows = []
    for name, some in found.complete.items():
        whole = sum(one.right_pairs == one.true_pairs for one in some)
        rows.append((name, len(some), whole, *_shares(some), 1e3 * mean(calibration.all_seconds(name))))
    head = ("algorithm", "poses", "poses with every pair", *SHARE_HEAD)
    note = f"The first seven run to completion; searches stop after 10,000 evaluations. {MEANS}"
    return PaperTable("T1a", "Run to completion, exact hierarchies lose no face", head, tuple(rows), note)


SHARE_HEAD: Final = ("faces", "face recall", "pair recall", "precision", "operations", "ms")
MEANS: Final = (
    "Faces found, operations, ms: mean of a pose, times by calibration. Recalls, precision: of all poses together."
)


def _shares(some: Sequence[PoseAnswer]) -> tuple[Cell, ...]:
    """Mean faces, face recall, pair recall and precision over all poses together, and mean operations of a pose."""
    reported = sum(one.pairs for one in some)
    right = sum(one.right_pairs for one in some)
    faces = sum(one.faces for one in some)
    return (
        faces / len(some),
        faces / sum(one.true_faces for one in some),
        right / sum(one.true_pairs for one in some),
        right / reported if reported else None,
        sum(one.operations for one in some) / len(some) or None,
    )


def _cut_short(name: str, answers: Sequence[PoseAnswer], calibration: Calibration) -> tuple[Cell, ...]:
    """``_shares``, and the mean time of a pose where operations are counted."""
    if name not in CONTESTANTS:
        return (*_shares(answers), None)
    times = (calibration.seconds_of(name, one.target, one.operations) for one in answers)
    return (*_shares(answers), 1e3 * mean(times))


def equal_budget(found: TableOne, calibration: Calibration) -> PaperTable:
    """T1b."""
    rows = []
    for name in BUDGETED:
        for share, asked in found.equal.items():
            nothing = sum(one.pairs == 0 for one in asked[name])
            rows.append((name, share, len(asked[name]), nothing, *_cut_short(name, asked[name], calibration)))
    head = ("algorithm", "B", "poses", "poses with nothing found", *SHARE_HEAD)
    note = f"Budgets in operations, set once from the calibration to a wall time of B medians of hybrid. {MEANS}"
    return PaperTable("T1b", "At equal wall time", head, tuple(rows), note)


def contact_caps(found: TableOne, calibration: Calibration) -> PaperTable:
    """T1c."""
    rows = [
        (name, cap, len(answers), *_cut_short(name, answers, calibration))
        for (name, cap), answers in found.capped.items()
    ]
    head = ("algorithm", "contacts", "poses", *SHARE_HEAD)
    note = (
        "The engine stops at so many face pairs; 1 is the first-contact mode, and FCL unless it is asked for more. FCL "
        f"counts no operations. {MEANS}"
    )
    return PaperTable("T1c", "Stopped after some contacts", head, tuple(rows), note)


def accuracy(found: TableOne) -> PaperTable:
    """Fig. 7 a and b: face recall of single poses."""
    rows = []
    for name in BUDGETED:
        for share in SHARES:
            recalls = [answer.face_recall for answer in found.equal[share][name]]
            rows.append((name, share, *spread(recalls), ACCURACY.get(name), VARIANCE.get(name)))
    head = (
        "algorithm", "B", "n", "mean", "mean, low", "mean, high", "standard deviation", "variance",
        f"mean: {PRINTED}", f'"variance": {PRINTED}',
    )  # fmt: skip
    note = "Intervals: bootstrap, 95 %. The printed variances are of the size of a standard deviation."
    return PaperTable("F7ab", "Accuracy (face recall of a pose) at equal wall time", head, tuple(rows), note)


def times(calibration: Calibration) -> PaperTable:
    """Fig. 7 c."""
    to = median(calibration.all_seconds("rapid-style"))
    rows = []
    for name in CONTESTANTS:
        low, middle, high = (1e3 * np.quantile(calibration.all_seconds(name), [0.25, 0.5, 0.75])).tolist()
        rows.append((name, middle, low, high, middle / (1e3 * to), TIME_TO_RAPID.get(name)))
    head = ("algorithm", "median, ms", "lower quartile, ms", "upper quartile, ms", "to rapid-style", PRINTED)
    where = ", ".join(f"{key} {value}" for key, value in calibration.machine.items())
    note = f"All faces of a pose; one process, warm, rows in turn; measured on: {where}."
    return PaperTable("F7c", "Wall time of a pose", head, tuple(rows), note)


def spread(values: Sequence[float], seed: int = 0) -> tuple[int, float, float, float, float, float]:
    """Number, mean, interval of the mean at 95 %, standard deviation and variance (by n - 1) of one value or more.

    The interval is a percentile bootstrap of ``RESAMPLES`` draws. Raises ValueError: there is no value.

    Examples
    --------
    >>> spread([1.0, 3.0])[-1]
    2.0
    """
    if not len(values):
        raise ValueError("nothing was measured; give one value or more")
    given = np.asarray(values, dtype=np.float64)
    draws = random_stream(seed, "paper/bootstrap").integers(0, len(given), size=(RESAMPLES, len(given)))
    low, high = np.quantile(given[draws].mean(axis=1), [0.025, 0.975])
    variance = float(given.var(ddof=1)) if len(given) > 1 else 0.0
    return len(given), float(given.mean()), float(low), float(high), variance**0.5, variance
