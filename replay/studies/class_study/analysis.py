"""From answers and metrics to a study: reliabilities, regressions declared beforehand, and results refused with reason.

Every regression carries its n, the detector behind the behaviour and that detector's measured recall; each is fitted
again with every other detector, to see whether its conclusion depends on what the detector missed.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from cdcore.numerics import FloatArray
from replay.detection.detector_spec import TRUSTED
from replay.errors import StudyError
from replay.studies.class_study.codebook import Codebook, Item, RegressionQuestion
from replay.studies.class_study.groups import GroupDifference, compare_groups
from replay.studies.class_study.joining import DETECTOR, RECALL, STUDENT, Metrics, Questionnaire, means_of_students
from replay.studies.class_study.refusals import LEAST_IN_CELL, PERSONS_PER_ITEM, StudyRefusedError, few
from replay.studies.class_study.regression import Finding, Regression, holm, regress
from replay.studies.class_study.reliability import Bartlett, Reliability, bartlett, kmo, reliability
from sessions.scene_files.toml_table import nearest
from sessions.synthetic.rng import random_stream


@dataclass(frozen=True)
class Sensitivity:
    """One result about behaviour, as it is with another detector.

    ``recall`` is what that detector finds of the contacts, ``students`` are those used; ``before`` is the result of the
    study, ``after`` that with the other detector, ``None`` where none could be computed.
    """

    detector: str
    recall: float | None
    students: int
    outcome: str
    before: Finding
    after: Finding | None

    @property
    def tested(self) -> bool:
        """Whether both have a p-value."""
        return self.after is not None and self.before.p is not None and self.after.p is not None

    @property
    def changes(self) -> bool:
        """Whether the conclusion differs: associated or not, and its sign."""
        if self.after is None:
            return False
        turned = self.after.associated and bool(np.sign(self.before.beta) != np.sign(self.after.beta))
        return self.before.associated != self.after.associated or turned

    @property
    def conclusion(self) -> str:
        """Whether it is another, in the words of every table."""
        return "another conclusion" if self.changes else "the same" if self.tested else "not tested"


class Judged(NamedTuple):
    """A finding, its outcome, the students used, and the names of all variables of its regression or comparison."""

    outcome: str
    students: int
    variables: tuple[str, ...]
    finding: Finding


@dataclass(frozen=True)
class Study:
    """The results of a study: everything that a page or a table needs.

    ``detector`` and ``recall`` stand behind every behaviour. ``reliabilities`` are by construct, KMO and Bartlett's
    test of all items together. ``regressions`` stand in the order asked, p corrected across all of them; ``groups``
    compare the declared groups, ``group_sizes`` says how many students each has. ``sensitivity`` is both again with
    each other detector. ``refusals`` are results that a rule forbids, ``warnings`` speak of those that carry little.
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

    @property
    def findings(self) -> list[Judged]:
        """Every coefficient, then every difference of groups."""
        return findings_of(self.regressions, self.groups)


def analyse(
    codebook: Codebook,
    questionnaire: Questionnaire,
    metrics: Metrics,
    *,
    detector: str | None = None,
    seed: int = 0,
) -> Study:
    """Analyse a class.

    ``detector`` says whose contacts stand for behaviour; ``None``: of those there are, the one that misses least.
    Raises ``StudyError``: a regression names no construct or metric, or there is no such detector;
    ``StudyRefusedError`` ``ids`` or ``small-cell``: there is no study at all.
    """
    if len(questionnaire.students) < LEAST_IN_CELL:
        raise StudyRefusedError("small-cell", f"a study of {len(questionnaire.students)} students")
    _check_names(codebook, metrics)
    chosen = _choose(metrics, detector)
    seen = _Analysis(codebook, questionnaire, metrics.of(chosen), seed)
    reliabilities = {}
    for name, items in codebook.constructs.items():
        with seen.noted(f"alpha of {name}"):
            random = random_stream(seed, "reliability", name)
            reliabilities[name] = reliability(_answers(questionnaire, items), random)
    adequacy, sphericity = None, None
    with seen.noted("KMO"):
        adequacy = kmo(_answers(questionnaire, codebook.items))
    with seen.noted("Bartlett's test"):
        sphericity = bartlett(_answers(questionnaire, codebook.items))
    regressions, groups = seen.regressions(), seen.groups()
    sensitivity: list[Sensitivity] = []
    if seen.recall is not None:
        for name in metrics.detectors:
            if name != chosen:
                other = _Analysis(codebook, questionnaire, metrics.of(name), seed)
                again = findings_of(other.regressions(), other.groups())
                sensitivity += compared(findings_of(regressions, groups), again, other.metrics)
    return Study(
        students=len(questionnaire.students),
        rows=len(seen.metrics),
        detector=chosen,
        recall=seen.recall,
        reliabilities=reliabilities,
        kmo=adequacy,
        bartlett=sphericity,
        regressions=regressions,
        groups=groups,
        group_sizes={name: few(questionnaire.group.count(name)) for name in codebook.group_names},
        sensitivity=tuple(sensitivity),
        refusals=tuple(seen.refusals),
        warnings=tuple(_warnings(codebook, questionnaire)),
    )


class _Analysis:
    """What the codebook asks of the answers and of the behaviour that one detector saw."""

    def __init__(self, codebook: Codebook, questionnaire: Questionnaire, metrics: Metrics, seed: int) -> None:
        self.codebook, self.questionnaire, self.metrics, self.seed = codebook, questionnaire, metrics, seed
        self.recall = metrics.recall()
        self.refusals: list[StudyRefusedError] = []
        # variables: name -> (students,); forbidden: the rule by which there is no behaviour among them, if one does
        self.variables = {name: questionnaire.scores(items) for name, items in codebook.constructs.items()}
        self.forbidden = "provenance" if self.recall is None else ""
        if not self.forbidden:
            asked = dict.fromkeys(name for q in codebook.questions for name in (q.outcome, *q.predictors))
            behaviour = [name for name in asked if name in metrics.columns]
            try:
                self.variables |= means_of_students(metrics, questionnaire, behaviour)
            except StudyRefusedError as refused:
                self.forbidden = refused.rule

    @contextmanager
    def noted(self, what: str) -> Iterator[None]:
        """A result that a rule may forbid: then there is none, and that is noted."""
        try:
            yield
        except StudyRefusedError as refused:
            self.refusals.append(StudyRefusedError(refused.rule, what))

    def regressions(self) -> tuple[Regression, ...]:
        """Those of the codebook that no rule forbids."""
        done = []
        for question in self.codebook.questions:
            words = f"the regression of {question.outcome} on {', '.join(question.predictors)}"
            with self.noted(words):
                done.append(self._fit(question))
                if any(c.p is None for c in done[-1].coefficients):
                    self.refusals.append(StudyRefusedError("few-students", f"p of {words}"))
        corrected = iter(holm([c for fitted in done for c in fitted.coefficients]))
        return tuple(replace(fit, coefficients=tuple(next(corrected) for _ in fit.coefficients)) for fit in done)

    def _fit(self, question: RegressionQuestion) -> Regression:
        names = (question.outcome, *question.predictors)
        if not self.variables.keys() >= {*names}:
            raise StudyRefusedError(self.forbidden, "")
        table = np.column_stack([self.variables[name] for name in names])
        table = table[np.isfinite(table).all(axis=1)]
        if len(table) < LEAST_IN_CELL:
            raise StudyRefusedError("small-cell", "")
        random = random_stream(self.seed, "regression", *names)
        return regress(question.outcome, table[:, 0], question.predictors, table[:, 1:], random)

    def groups(self) -> tuple[GroupDifference, ...]:
        """The declared groups compared by every construct, and by the behaviour that the codebook asks about."""
        names = self.codebook.group_names
        return compare_groups(self.variables, self.questionnaire.group, names, self.seed, self.refusals)


def _choose(metrics: Metrics, detector: str | None) -> str:
    there = metrics.detectors
    if detector is None:
        # Who misses nothing may still report false contacts; the reference does neither.
        worth = {name: (metrics.of(name).recall() or 0.0, name == TRUSTED, -there.index(name)) for name in there}
        return max(there, key=lambda name: worth[name])
    if detector not in there:
        raise StudyError(f"no metrics of detector {detector!r}; there are: {', '.join(there)}")
    return detector


def _answers(questionnaire: Questionnaire, items: Sequence[Item]) -> FloatArray:
    """The complete answers to some items, if so many students gave them that none can be recognised."""
    answers = np.column_stack([questionnaire.answers[item.name] for item in items])
    answers = answers[np.isfinite(answers).all(axis=1)]
    if len(answers) < LEAST_IN_CELL:
        raise StudyRefusedError("small-cell", "")
    return answers


def _warnings(codebook: Codebook, questionnaire: Questionnaire) -> Iterator[str]:
    students, items = len(questionnaire.students), len(codebook.items)
    if students < PERSONS_PER_ITEM * items:
        yield (
            f"{students} students for {items} items are {students / items:.1f} per item (usual advice 5 to 10): "
            "alpha, KMO and Bartlett's test carry little"
        )
    unanswered = int(sum(np.isnan(values).sum() for values in questionnaire.answers.values()))
    if unanswered:
        yield f"{few(unanswered)} answers are missing; rows with a missing value are left out where it is used"


def _check_names(codebook: Codebook, metrics: Metrics) -> None:
    known = {*codebook.constructs, *(name for name in metrics.columns if name not in (STUDENT, DETECTOR, RECALL))}
    for question in codebook.questions:
        for name in (question.outcome, *question.predictors):
            if codebook.groups is not None and name == codebook.groups[0]:
                raise StudyError(f"the codebook's groups, {name!r}, are compared without a regression; leave them out")
            if name not in known:
                what = f"the codebook's regressions name {name!r}, which is no construct or metric"
                raise StudyError(f"{what}{nearest(name, known)}")


def findings_of(regressions: Sequence[Regression], groups: Sequence[GroupDifference]) -> list[Judged]:
    """Every coefficient and every difference of groups."""
    findings = [
        Judged(fit.outcome, fit.students, (fit.outcome, *(other.name for other in fit.coefficients)), finding)
        for fit in regressions
        for finding in fit.coefficients
    ]
    return findings + [Judged(two.outcome, sum(two.students), (two.outcome,), two.effect) for two in groups]


def compared(before: Sequence[Judged], after: Sequence[Judged], metrics: Metrics) -> Iterator[Sensitivity]:
    """The results that use behaviour, beside those with another detector; each was fitted in its own family of p."""
    detector, recall = str(metrics.columns[DETECTOR][0]), metrics.recall()
    again = {(result.variables, result.finding.name): result for result in after}
    for result in before:
        if any(name in metrics.columns for name in result.variables):
            other = again.get((result.variables, result.finding.name))
            students = result.students if other is None else other.students
            finding = None if other is None else other.finding
            yield Sensitivity(detector, recall, students, result.outcome, result.finding, finding)
