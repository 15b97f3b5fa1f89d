"""From answers and metrics to a study: reliabilities, regressions declared beforehand, and results refused with reason.

Every regression carries its n, the detector behind the behaviour and that detector's measured recall; each is fitted
again with every other detector, to see whether its conclusion depends on what the detector missed.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from cdcore.numerics import FloatArray
from replay.detection.detector_spec import TRUSTED
from replay.errors import StudyError
from replay.studies.class_study.codebook import Codebook, Item
from replay.studies.class_study.groups import GroupDifference, compare_groups
from replay.studies.class_study.joining import DETECTOR, RECALL, STUDENT, Metrics, Questionnaire, means_of_students
from replay.studies.class_study.refusals import LEAST_IN_CELL, PERSONS_PER_ITEM, StudyRefusedError, few
from replay.studies.class_study.regression import Finding, holm, regress
from replay.studies.class_study.reliability import Bartlett, Reliability, bartlett, kmo, reliability
from sessions.scene_files.toml_table import nearest
from sessions.synthetic.rng import random_stream


@dataclass(frozen=True)
class Sensitivity:
    """One result about behaviour, as it is with another detector.

    ``recall`` is what that detector finds of the contacts; ``before`` is the result of the study, ``after`` that with
    the other detector, ``None`` where none could be computed.
    """

    detector: str
    recall: float | None
    before: Finding
    after: Finding | None

    @property
    def students(self) -> int:
        """How many were used."""
        return (self.after or self.before).students

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


@dataclass(frozen=True)
class Study:
    """The results of a study: everything that a page or a table needs.

    ``detector`` and ``recall`` stand behind every behaviour. ``reliabilities`` are by construct, KMO and Bartlett's
    test of all items together. ``coefficients`` stand in the order asked, p corrected across all of them; ``groups``
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
    coefficients: tuple[Finding, ...]
    groups: tuple[GroupDifference, ...]
    group_sizes: dict[str, str]
    sensitivity: tuple[Sensitivity, ...]
    refusals: tuple[StudyRefusedError, ...]
    warnings: tuple[str, ...]

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Every coefficient, then every difference of groups."""
        return self.coefficients + self.groups


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
    coefficients, groups = seen.coefficients(), seen.groups()
    about_behaviour = [one for one in (*coefficients, *groups) if metrics.columns.keys() & {*one.variables}]
    sensitivity = []
    for name in metrics.detectors:
        if name != chosen and seen.recall is not None:
            # Each detector's findings are a family of p of their own.
            other = _Analysis(codebook, questionnaire, metrics.of(name), seed)
            again = {(one.variables, one.name): one for one in (*other.coefficients(), *other.groups())}
            sensitivity += [
                Sensitivity(name, other.recall, before, again.get((before.variables, before.name)))
                for before in about_behaviour
            ]
    return Study(
        students=len(questionnaire.students),
        rows=len(seen.metrics),
        detector=chosen,
        recall=seen.recall,
        reliabilities=reliabilities,
        kmo=adequacy,
        bartlett=sphericity,
        coefficients=coefficients,
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
            asked = dict.fromkeys(name for question in codebook.questions for name in question)
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

    def coefficients(self) -> tuple[Finding, ...]:
        """Those of the codebook's regressions that no rule forbids."""
        done: list[Finding] = []
        for question in self.codebook.questions:
            words = f"the regression of {question[0]} on {', '.join(question[1:])}"
            with self.noted(words):
                fitted = self._fit(*question)
                done += fitted
                if fitted[0].p is None:
                    self.refusals.append(StudyRefusedError("few-students", f"p of {words}"))
        return holm(done)

    def _fit(self, outcome: str, *predictors: str) -> list[Finding]:
        names = (outcome, *predictors)
        if not self.variables.keys() >= {*names}:
            raise StudyRefusedError(self.forbidden, "")
        table = _complete([self.variables[name] for name in names])
        random = random_stream(self.seed, "regression", *names)
        return regress(outcome, table[:, 0], predictors, table[:, 1:], random)

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
    """The complete answers to some items."""
    return _complete([questionnaire.answers[item.name] for item in items])


def _complete(columns: Sequence[FloatArray]) -> FloatArray:
    """The rows without a gap, if they are of so many students that none can be recognised."""
    table = np.column_stack(columns)
    table = table[np.isfinite(table).all(axis=1)]
    if len(table) < LEAST_IN_CELL:
        raise StudyRefusedError("small-cell", "")
    return table


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
    known = {*codebook.constructs, *metrics.columns} - {STUDENT, DETECTOR, RECALL}
    for name in (name for question in codebook.questions for name in question):
        if codebook.groups is not None and name == codebook.groups[0]:
            raise StudyError(f"the codebook's groups, {name!r}, are compared without a regression; leave them out")
        if name not in known:
            what = f"the codebook's regressions name {name!r}, which is no construct or metric"
            raise StudyError(f"{what}{nearest(name, known)}")
