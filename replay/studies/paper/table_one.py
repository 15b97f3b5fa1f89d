"""Table I, T1a, Fig. 7 a to c: run to completion exact rows find every face; cut short, each finds its share.

Wall times are taken once: they turn a common wall time into a budget of operations for every row.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from cdcore.numerics import FloatArray
from replay.document.machine import machine
from replay.document.tables import Table
from replay.show.paper_table import Cell, paper_table
from replay.studies.paper.fixtures import Fixture
from replay.studies.paper.printed import ABOUT_PRINTED, PRINTED_FIGURES, PRINTED_LABEL, printed_figure
from replay.studies.paper.rows import BUDGETED_ROWS, ROWS, Answers, compared_answers, make_detector_of_row
from sessions.synthetic.rng import random_stream

BUDGET_FRACTIONS: Final = (0.25, 0.5, 1.0, 2.0)
"""Common wall times B, in medians of ``hybrid``."""

BOOTSTRAP_DRAWS: Final = 1000


def ask_to_completion(group: Sequence[Fixture]) -> Answers:
    """Ask and time every row in every pose of a group, rows in turn within a pose, after one warm round."""
    detectors = {name: make_detector_of_row(name, group[0].bodies) for name in ROWS}
    answers_of_rounds = [
        {name: compared_answers(name, detector, [pose]) for name, detector in detectors.items()}
        for pose in (group[0], *group)
    ]
    return join_answers(answers_of_rounds[1:])


def budget(complete_answers: Answers, row_name: str, target: int, fraction: float) -> int:
    """Operations that row ``row_name`` does in ``fraction`` medians of ``hybrid``; 1 at least."""
    hybrid_answers, row_answers = (of_target(complete_answers[row], target) for row in ("hybrid", row_name))
    operations_a_second = row_answers["operations"].sum() / row_answers["seconds"].sum()
    return max(1, round(fraction * float(np.median(hybrid_answers["seconds"])) * float(operations_a_second)))


def ask_cut_short(group: Sequence[Fixture], complete_answers: Answers, fraction: float) -> Answers:
    """Ask every row that takes a budget in every pose of a group, with ``fraction`` medians of ``hybrid``."""
    budget_of_name = {name: budget(complete_answers, name, group[0].target, fraction) for name in BUDGETED_ROWS}
    return {
        name: compared_answers(name, make_detector_of_row(name, group[0].bodies, budget=most_operations), group)
        for name, most_operations in budget_of_name.items()
    }


def join_answers(answers: Sequence[Answers]) -> Answers:
    """The answers of all groups, in their order."""
    return {name: np.concatenate([answer[name] for answer in answers]) for name in answers[0]}


def of_target(answers: NDArray[Any], target: int) -> NDArray[Any]:
    """Those of one column of Table I."""
    return answers[answers["target"] == target]


def run_time_table(complete_answers: Answers, answers_by_fraction: Mapping[float, Answers]) -> Table:
    """Table I; ``answers_by_fraction``: by share of the common wall time."""
    rows: list[tuple[Cell, ...]] = []
    for target in np.unique(complete_answers["exact"]["target"]).tolist():
        for name, printed_figures in PRINTED_FIGURES.items():
            answers_of_budget = [
                of_target(answers_of_all[name], target)
                for answers_of_all in (
                    complete_answers,
                    *(answers_by_fraction[fraction] for fraction in BUDGET_FRACTIONS),
                )
            ]
            budget_cells = [float(answers["faces"].mean()) for answers in answers_of_budget]
            true_faces, printed_faces = (
                float(answers_of_budget[0]["true_faces"].mean()),
                printed_figures["detected"].get(str(target)),
            )
            rows.append((target, f"{name} ({printed_figures['name']})", true_faces, *budget_cells, printed_faces))
    head = (
        "faces",
        "algorithm",
        "true faces",
        "to completion",
        *(f"B = {fraction:g}" for fraction in BUDGET_FRACTIONS),
        PRINTED_LABEL,
    )
    return paper_table(
        "Table I", "Mean faces detected, to completion and within equal wall times B", head, tuple(rows),
        "B is in medians of hybrid's wall time; hybrid-qaco searches and its completion is 10,000 evaluations. "
        f"{ABOUT_PRINTED}",
    )  # fmt: skip


def completion_table(complete_answers: Answers) -> Table:
    """T1a: the headline."""
    rows: list[tuple[Cell, ...]] = []
    for name, answers in complete_answers.items():
        poses = len(answers)
        full_poses = int((answers["right_pairs"] == answers["true_pairs"]).sum())
        faces, true_faces, pairs, true_pairs, right_pairs, operations = (
            int(answers[field].sum())
            for field in ("faces", "true_faces", "pairs", "true_pairs", "right_pairs", "operations")
        )
        rows.append((
            name, poses, full_poses, faces / poses, faces / true_faces, right_pairs / true_pairs,
            right_pairs / pairs if pairs else None, operations / poses or None, 1e3 * float(answers["seconds"].mean()),
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


def accuracy_table(answers_by_fraction: Mapping[float, Answers]) -> Table:
    """Fig. 7 a and b: face recall of single poses."""
    rows = []
    for name in BUDGETED_ROWS:
        for fraction in BUDGET_FRACTIONS:
            answers = answers_by_fraction[fraction][name]
            face_recalls = answers["faces"] / answers["true_faces"]
            rows.append(
                (
                    name,
                    fraction,
                    *mean_and_spread(face_recalls),
                    printed_figure(name, "accuracy"),
                    printed_figure(name, "variance"),
                )
            )
    head = (
        "algorithm", "B", "n", "mean", "mean, low", "mean, high", "standard deviation", "variance",
        f"mean: {PRINTED_LABEL}", f'"variance": {PRINTED_LABEL}',
    )  # fmt: skip
    note = "Intervals: bootstrap, 95 %. The printed variances are of the size of a standard deviation."
    return paper_table("F7ab", "Accuracy (face recall of a pose) at equal wall time", head, tuple(rows), note)


def time_table(complete_answers: Answers) -> Table:
    """Fig. 7 c."""
    quartiles = {
        name: np.quantile(answers["seconds"], [0.25, 0.5, 0.75]).tolist() for name, answers in complete_answers.items()
    }
    reference_s = quartiles["rapid-style"][1]
    rows = [
        (name, 1e3 * middle, 1e3 * lower, 1e3 * upper, middle / reference_s, printed_figure(name, "time"))
        for name, (lower, middle, upper) in quartiles.items()
    ]
    head = ("algorithm", "median, ms", "lower quartile, ms", "upper quartile, ms", "to rapid-style", PRINTED_LABEL)
    machine_text = ", ".join(f"{key} {value}" for key, value in machine().items())
    note = f"All faces of a pose; one process, warm, rows in turn; measured on: {machine_text}."
    return paper_table("F7c", "Wall time of a pose", head, tuple(rows), note)


def mean_and_spread(values: FloatArray) -> tuple[int, float, float, float, float, float]:
    """Number, mean, interval of the mean at 95 %, standard deviation and variance (by n - 1) of one value or more.

    The interval is a percentile bootstrap of ``BOOTSTRAP_DRAWS`` draws.

    Examples
    --------
    >>> mean_and_spread(np.array([1.0, 3.0]))[-1]
    2.0
    """
    resampled_indices = random_stream(0, "paper/bootstrap").integers(
        0, len(values), size=(BOOTSTRAP_DRAWS, len(values))
    )
    lower, upper = np.quantile(values[resampled_indices].mean(axis=1), [0.025, 0.975])
    variance = float(values.var(ddof=1)) if len(values) > 1 else 0.0
    return len(values), float(values.mean()), float(lower), float(upper), variance**0.5, variance
