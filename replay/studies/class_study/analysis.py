"""From answers and metrics to a study: reliabilities, regressions declared beforehand, and results refused with reason.

Every regression carries its n, the detector behind the behaviour and that detector's measured recall; each is fitted
again with every other detector, to see whether its conclusion depends on what the detector missed.
"""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final, TypeVar

import numpy as np

from cdcore.numerics import FloatArray, IntArray
from replay.detection.detector_spec import TRUSTED
from replay.errors import StudyError
from replay.studies.class_study.codebook import Codebook, Item, RegressionQuestion
from replay.studies.class_study.conclusions import Sensitivity, compared, results
from replay.studies.class_study.groups import GroupDifference, compare_groups
from replay.studies.class_study.joining import DETECTOR, RECALL, STUDENT, Metrics, Questionnaire, rows_of_students
from replay.studies.class_study.refusals import LEAST_IN_CELL, PERSONS_PER_ITEM, StudyRefusedError, few
from replay.studies.class_study.regression import Regression, holm, regress, student_means
from replay.studies.class_study.reliability import Bartlett, Reliability, bartlett, kmo, reliability
from sessions.scene_files.toml_table import nearest
from sessions.synthetic.rng import random_stream

Result = TypeVar("Result")

DOMINANT: Final = 0.25
"""A warning is given where this share of the students, or less, brings half of the sessions."""


@dataclass(frozen=True)
class Study:
    """The results of a study: everything that a page or a table needs.

    ``detector`` and ``recall`` stand behind every behaviour (``""`` and ``None`` for a questionnaire alone).
    ``reliabilities`` are by construct, KMO and Bartlett's test of all items together. ``regressions`` stand in the
    order asked, p corrected across all of them; ``groups`` compare the declared groups, ``group_sizes`` says how many
    students each has. ``sensitivity`` are both again with each other detector. ``refusals`` are results that a rule
    forbids, ``warnings`` speak of those that carry little.
    """

    students: int
    rows: int
    detector: str
    recall: float | None
    reliabilities: dict[str, Reliability]
    kmo: float | None
    bartlett: Bartlett | None
    regressions: tuple[Regression, ...]
    groups: tuple[GroupDifference, ...]
    group_sizes: dict[str, str]
    sensitivity: tuple[Sensitivity, ...]
    refusals: tuple[StudyRefusedError, ...]
    warnings: tuple[str, ...]


def analyse(
    codebook: Codebook, questionnaire: Questionnaire, metrics: Metrics | None = None, *, detector: str | None = None,
    seed: int = 0,
) -> Study:  # fmt: skip
    """Analyse a class; without metrics, the questionnaire alone.

    ``detector`` says whose contacts stand for behaviour; ``None``: of those there are, the one that misses least.
    Raises ``StudyError``: a regression names no construct or metric, or there is no such detector;
    ``StudyRefusedError`` ``ids`` or ``small-cell``: there is no study at all.
    """
    if len(questionnaire.students) < LEAST_IN_CELL:
        raise StudyRefusedError("small-cell", f"a study of {len(questionnaire.students)} students")
    _check_names(codebook, metrics)
    refusals: list[StudyRefusedError] = []
    chosen = _choose(metrics, detector) if metrics is not None else ""
    own = metrics.of(chosen) if metrics is not None else None
    reliabilities = {}
    for name, items in codebook.constructs.items():
        figure = partial(reliability, random=random_stream(seed, "reliability", name))
        found = _try(partial(_of_items, questionnaire, items, figure), f"alpha of {name}", refusals)
        if found is not None:
            reliabilities[name] = found
    adequacy = _try(partial(_of_items, questionnaire, codebook.items, kmo), "KMO", refusals)
    sphericity = _try(partial(_of_items, questionnaire, codebook.items, bartlett), "Bartlett's test", refusals)
    regressions = _regressions(codebook, questionnaire, own, seed, refusals)
    groups = _groups(codebook, questionnaire, own, seed, refusals)
    sensitivity: list[Sensitivity] = []
    if metrics is not None and own is not None and own.recall() is not None:
        for other in (metrics.of(name) for name in metrics.detectors if name != chosen):
            asked = (codebook, questionnaire, other, seed)
            again = results(_regressions(*asked, []), _groups(*asked, []))
            sensitivity += compared(results(regressions, groups), again, other)
    sizes = {name: few(questionnaire.group.count(name)) for name in (codebook.groups or ("", ()))[1]}
    return Study(
        students=len(questionnaire.students), rows=len(questionnaire.students) if own is None else len(own),
        detector=chosen, recall=None if own is None else own.recall(), reliabilities=reliabilities, kmo=adequacy,
        bartlett=sphericity, regressions=regressions, groups=groups, group_sizes=sizes,
        sensitivity=tuple(sensitivity), refusals=tuple(refusals),
        warnings=tuple(_warnings(codebook, questionnaire, own)),
    )  # fmt: skip


def _choose(metrics: Metrics, detector: str | None) -> str:
    there = metrics.detectors
    if detector is None:
        # Who misses nothing may still report false contacts; the reference does neither.
        found = {name: (metrics.of(name).recall() or 0.0, name == TRUSTED, -there.index(name)) for name in there}
        return max(there, key=lambda name: found[name])
    if detector not in there:
        raise StudyError(f"no metrics of detector {detector!r}; there are: {', '.join(there)}")
    return detector


def _try(make: Callable[[], Result], what: str, refusals: list[StudyRefusedError]) -> Result | None:
    try:
        return make()
    except StudyRefusedError as refused:
        refusals.append(StudyRefusedError(refused.rule, what))
        return None


def _of_items(questionnaire: Questionnaire, items: Sequence[Item], figure: Callable[[FloatArray], Result]) -> Result:
    """A figure of the complete answers to some items, if so many students gave them that none can be recognised."""
    answers = np.column_stack([questionnaire.answers[item.name] for item in items])
    answers = answers[np.isfinite(answers).all(axis=1)]
    if len(answers) < LEAST_IN_CELL:
        raise StudyRefusedError("small-cell", "")
    return figure(answers)


def _warnings(codebook: Codebook, questionnaire: Questionnaire, metrics: Metrics | None) -> list[str]:
    students, items = len(questionnaire.students), len(codebook.items)
    words = []
    if students < PERSONS_PER_ITEM * items:
        words.append(
            f"{students} students for {items} items are {students / items:.1f} per item (usual advice 5 to 10): "
            "alpha, KMO and Bartlett's test carry little"
        )
    unanswered = int(sum(np.isnan(values).sum() for values in questionnaire.answers.values()))
    if unanswered:
        words.append(f"{few(unanswered)} answers are missing; rows with a missing value are left out where it is used")
    return words + ([] if metrics is None else _dominance(metrics))


def _dominance(metrics: Metrics) -> list[str]:
    """Whether few students bring most sessions: who looks at rows would take theirs for the class."""
    counts = sorted(Counter(metrics.columns[STUDENT]).values(), reverse=True)
    most = int(np.searchsorted(np.cumsum(counts), len(metrics) / 2)) + 1
    if most > len(counts) * DOMINANT:
        return []
    who = f"{few(most)} of {len(counts)} students bring half or more of the {len(metrics)} sessions"
    return [f"{who}; every student counts once, by the mean of their sessions"]


def _check_names(codebook: Codebook, metrics: Metrics | None) -> None:
    known = {*codebook.constructs, *([codebook.groups[0]] if codebook.groups else [])}
    if metrics is not None:
        known |= {name for name in metrics.columns if name not in (STUDENT, DETECTOR, RECALL)}
    for question in codebook.questions:
        for name in (question.outcome, *question.predictors):
            if name not in known:
                what = f"the codebook's regressions name {name!r}, which is no construct or metric"
                raise StudyError(f"{what}{nearest(name, known)}")


def _regressions(
    codebook: Codebook, questionnaire: Questionnaire, metrics: Metrics | None, seed: int,
    refusals: list[StudyRefusedError],
) -> tuple[Regression, ...]:  # fmt: skip
    done = []
    for question in codebook.questions:
        words = f"the regression of {question.outcome} on {', '.join(question.predictors)}"
        random = random_stream(seed, "regression", question.outcome, *question.predictors)
        fitted = _try(partial(_fit, question, codebook, questionnaire, metrics, random), words, refusals)
        if fitted is not None:
            done.append(fitted)
            if any(one.p is None for one in fitted.coefficients):
                refusals.append(StudyRefusedError("few-students", f"p of {words}"))
    return holm(done)


def _fit(
    question: RegressionQuestion, codebook: Codebook, questionnaire: Questionnaire, metrics: Metrics | None,
    random: np.random.Generator,
) -> Regression:  # fmt: skip
    named = (question.outcome, *question.predictors)
    if metrics is not None and any(name in metrics.columns for name in named):
        if metrics.recall() is None:
            raise StudyRefusedError("provenance", "")
        rows = rows_of_students(metrics, questionnaire)
    else:
        metrics, rows = None, np.arange(len(questionnaire.students), dtype=np.int64)
    outcome = _variable(question.outcome, codebook, questionnaire, metrics, rows)
    if len(outcome) > 1:
        raise StudyRefusedError("undeclared-groups", "")
    names: list[str] = []
    columns: list[FloatArray] = []
    for name in question.predictors:
        for word, values in _variable(name, codebook, questionnaire, metrics, rows).items():
            names.append(word)
            columns.append(values)
    y = next(iter(outcome.values()))
    x = np.column_stack(columns)
    used = np.unique(rows[np.isfinite(y) & np.isfinite(x).all(axis=1)])
    cells = [len(used)]
    if codebook.groups and codebook.groups[0] in named:
        cells += [sum(questionnaire.group[k] == group for k in used) for group in codebook.groups[1]]
    if min(cells) < LEAST_IN_CELL:
        raise StudyRefusedError("small-cell", "")
    return regress(question.outcome, y, names, x, rows, random)


def _variable(
    name: str, codebook: Codebook, questionnaire: Questionnaire, metrics: Metrics | None, rows: IntArray
) -> dict[str, FloatArray]:
    """One variable row by row; a group is one column per group after the first."""
    if name in codebook.constructs:
        return {name: questionnaire.scores(codebook.constructs[name])[rows]}
    if codebook.groups and name == codebook.groups[0]:
        first, *others = codebook.groups[1]
        mine = np.array(questionnaire.group)[rows]
        return {f"{name} {group} against {first}": (mine == group).astype(np.float64) for group in others}
    assert metrics is not None
    return {name: metrics.numbers(name)}


def _groups(
    codebook: Codebook, questionnaire: Questionnaire, metrics: Metrics | None, seed: int,
    refusals: list[StudyRefusedError],
) -> tuple[GroupDifference, ...]:  # fmt: skip
    """The declared groups compared by every construct, and by the behaviour that the codebook asks about."""
    if codebook.groups is None:
        return ()
    variables = {name: questionnaire.scores(items) for name, items in codebook.constructs.items()}
    if metrics is not None and metrics.recall() is not None:
        rows = rows_of_students(metrics, questionnaire)
        asked = dict.fromkeys(name for one in codebook.questions for name in (one.outcome, *one.predictors))
        for name in (name for name in asked if name in metrics.columns):
            people, _, means = student_means(metrics.numbers(name)[:, None], rows)
            variables[name] = np.full(len(questionnaire.students), np.nan)
            variables[name][people] = means[:, 0]
    return compare_groups(variables, questionnaire.group, codebook.groups[1], seed, refusals)
