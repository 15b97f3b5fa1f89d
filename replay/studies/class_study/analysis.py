"""From answers and metrics to a study: reliabilities, regressions declared beforehand, and results refused with reason.

Every regression carries its n, the detector behind the behaviour and that detector's measured recall; each is fitted
again with every other detector, to see whether its conclusion depends on what the detector missed.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from cdcore.numerics import FloatArray
from replay.detection.detector_spec import TRUSTED_DETECTOR
from replay.errors import StudyError
from replay.studies.class_study.codebook import Codebook
from replay.studies.class_study.groups import GroupDifference, compare_groups
from replay.studies.class_study.joining import (
    DETECTOR,
    RECALL_COLUMN,
    STUDENT,
    means_of_students,
    recall_of,
    unmatched_students,
)
from replay.studies.class_study.refusals import LEAST_IN_CELL, PERSONS_PER_ITEM, StudyRefusedError, count_text
from replay.studies.class_study.regression import Finding, holm_corrected, standardised_findings
from replay.studies.class_study.reliability import (
    ACCEPTABLE_ALPHA,
    Bartlett,
    Reliability,
    bartlett_test,
    kmo,
    reliability,
)
from replay.words import plural
from sessions.input_files import nearest
from sessions.synthetic.rng import random_stream

if TYPE_CHECKING:
    from pandas import DataFrame


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
        return self.after is not None and self.after.direction != self.before.direction

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
    ``unmatched`` names students of one file who are not in the other: for a terminal, not for what is shared.
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
    unmatched: tuple[str, ...] = ()
    group_of: Mapping[str, str] = field(default_factory=dict)

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Every coefficient, then every difference of groups."""
        return self.coefficients + self.groups

    @property
    def tested(self) -> bool:
        """Whether any result has a p-value."""
        return any(finding.p is not None for finding in self.findings)

    @property
    def obstacle(self) -> StudyRefusedError | None:
        """The refusal because of which no result is tested; ``None``: one is, or none was asked for."""
        refusals = (refused for refused in self.refusals if "regression" in refused.what)
        return None if self.tested else next(refusals, None)

    @property
    def nothing_associated(self) -> bool:
        """Whether no result is an association or a difference of groups."""
        return not any(finding.associated for finding in self.findings)

    @property
    def retested_results(self) -> tuple[Sensitivity, ...]:
        """The results that were tested with another detector too."""
        return tuple(row for row in self.sensitivity if row.tested)

    @property
    def changing_detectors(self) -> list[str]:
        """The detectors with which a conclusion is another."""
        return list(dict.fromkeys(row.detector for row in self.retested_results if row.changes))

    @property
    def same_results(self) -> bool:
        """Whether each result has the same figure with every detector, to the digits printed."""
        pairs = ((row.before, row.after) for row in self.retested_results)
        return all(after is not None and f"{before.beta:.3f}" == f"{after.beta:.3f}" for before, after in pairs)

    @property
    def unreliable_scales(self) -> list[str]:
        """The constructs of results whose alpha is below the usual limit."""
        used_names = {name for finding in self.findings for name in finding.variables}
        return [
            name
            for name, own_reliability in self.reliabilities.items()
            if name in used_names and not own_reliability.alpha >= ACCEPTABLE_ALPHA
        ]


def analyse(
    codebook: Codebook, answers: "DataFrame", metrics: "DataFrame", *, detector: str | None = None, seed: int = 0
) -> Study:
    """Analyse a class.

    ``answers`` are those of ``read_questionnaire``, ``metrics`` have a row per session and detector; ``detector`` says
    whose contacts stand for behaviour; ``None``: of those there are, the one that misses least. Raises ``StudyError``:
    a regression names no construct or metric, or there is no such detector; ``StudyRefusedError`` ``ids`` or
    ``small-cell``: there is no study at all.
    """
    if len(answers) < LEAST_IN_CELL:
        raise StudyRefusedError("small-cell", f"a study of {len(answers)} students")
    _check_names(codebook, metrics)
    analyses = {
        name: _Analysis(codebook, answers, detector_rows, seed)
        for name, detector_rows in metrics.groupby(DETECTOR, sort=False)
    }
    # Who misses nothing may still report false contacts; the reference does neither.
    chosen_detector = detector or max(
        analyses, key=lambda name: (analyses[name].recall or 0.0, name == TRUSTED_DETECTOR)
    )
    if chosen_detector not in analyses:
        raise StudyError(f"no metrics of detector {detector!r}; there are: {', '.join(analyses)}")
    study = analyses.pop(chosen_detector)
    reliabilities, adequacy, sphericity = {}, None, None
    for name, item_names in codebook.constructs.items():
        with study.noting_refusal(f"alpha of {name}"):
            reliabilities[name] = reliability(
                _complete_rows(answers[item_names]), random_stream(seed, "reliability", name)
            )
    item_names = [item.name for item in codebook.items]
    with study.noting_refusal("KMO"):
        adequacy = kmo(_complete_rows(answers[item_names]))
    with study.noting_refusal("Bartlett's test"):
        sphericity = bartlett_test(_complete_rows(answers[item_names]))
    unmatched_students_of_answers = unmatched_students(answers.index, metrics[STUDENT])
    coefficients, groups = study.coefficients(), study.groups()
    sensitivity_rows = []
    if study.recall is not None:
        behaviour_findings = [row for row in (*coefficients, *groups) if {*metrics} & {*row.variables}]
        for name, other_analysis in analyses.items():
            # Each detector's findings are a family of p of their own.
            findings_by_key = {
                (row.variables, row.name): row for row in (*other_analysis.coefficients(), *other_analysis.groups())
            }
            sensitivity_rows += [
                Sensitivity(
                    name,
                    other_analysis.recall,
                    finding_before,
                    findings_by_key.get((finding_before.variables, finding_before.name)),
                )
                for finding_before in behaviour_findings
            ]
    return Study(
        students=len(answers),
        rows=study.rows,
        detector=chosen_detector,
        recall=study.recall,
        reliabilities=reliabilities,
        kmo=adequacy,
        bartlett=sphericity,
        coefficients=coefficients,
        groups=groups,
        group_sizes={name: count_text(int((answers[codebook.group_column] == name).sum())) for name in codebook.groups},
        sensitivity=tuple(sensitivity_rows),
        refusals=tuple(study.refusals),
        warnings=(*_study_warnings(answers[item_names]), *_unmatched_warning(unmatched_students_of_answers)),
        unmatched=tuple(unmatched_students_of_answers),
        group_of=dict(answers[codebook.group_column]) if codebook.groups else {},
    )


class _Analysis:
    """Analysis, after the codebook, of answers and of behaviour measured by one detector."""

    def __init__(self, codebook: Codebook, answers: "DataFrame", metrics: "DataFrame", seed: int) -> None:
        self.codebook, self.answers, self.seed = codebook, answers, seed
        self.rows, self.recall = len(metrics), recall_of(metrics)
        self.refusals: list[StudyRefusedError] = []
        # variables: a row a student; forbidden: the rule by which there is no behaviour among them, if one does
        score_of_construct = {
            name: answers[items].mean(axis=1, skipna=False) for name, items in codebook.constructs.items()
        }
        self.variables = answers[[]].assign(**score_of_construct)
        self.forbidding_rule = "provenance" if self.recall is None else ""
        if not self.forbidding_rule:
            requested_metrics = dict.fromkeys(
                name for question in codebook.questions for name in question if name in metrics
            )
            try:
                self.variables = self.variables.join(means_of_students(metrics, answers, [*requested_metrics]))
            except StudyRefusedError as refused:
                self.forbidding_rule = refused.rule

    @contextmanager
    def noting_refusal(self, result_name: str) -> Iterator[None]:
        """A result that a rule may forbid: then there is none, and that is noted."""
        try:
            yield
        except StudyRefusedError as refused:
            self.refusals.append(StudyRefusedError(refused.rule, result_name))

    def coefficients(self) -> tuple[Finding, ...]:
        """Those of the codebook's regressions that no rule forbids."""
        coefficients_done: list[Finding] = []
        for question in self.codebook.questions:
            model_name = f"the regression of {question[0]} on {', '.join(question[1:])}"
            with self.noting_refusal(model_name):
                findings = self._fit(*question)
                coefficients_done += findings
                if findings[0].p is None:
                    self.refusals.append(StudyRefusedError("few-students", f"p of {model_name}"))
        return holm_corrected(coefficients_done)

    def _fit(self, *names: str) -> list[Finding]:
        if not {*names} <= {*self.variables}:
            raise StudyRefusedError(self.forbidding_rule, "")
        return standardised_findings(
            names, _complete_rows(self.variables[[*names]]), random_stream(self.seed, "regression", *names)
        )

    def groups(self) -> tuple[GroupDifference, ...]:
        """The declared groups compared by every construct, and by the behaviour that the codebook asks about."""
        group = self.answers.get(self.codebook.group_column)
        return compare_groups(self.variables, group, self.codebook.groups, self.seed, self.refusals)


def _complete_rows(table: "DataFrame") -> FloatArray:
    """The rows without a gap, if they are of so many students that none can be recognised."""
    complete_rows: FloatArray = table.dropna().to_numpy()
    if len(complete_rows) < LEAST_IN_CELL:
        raise StudyRefusedError("small-cell", "")
    return complete_rows


def _study_warnings(answers: "DataFrame") -> Iterator[str]:
    students, items = answers.shape
    if students < PERSONS_PER_ITEM * items:
        yield (
            f"{students} students for {items} items are {students / items:.1f} per item (usual advice 5 to 10): "
            "alpha, KMO and Bartlett's test carry little"
        )
    unanswered_count = int(answers.isna().sum().sum())
    if unanswered_count:
        yield (
            f"{count_text(unanswered_count)} answers are missing; rows with a missing value are left out "
            f"where it is used"
        )


def _unmatched_warning(unmatched_names: Sequence[str]) -> Iterator[str]:
    if unmatched_names:
        yield (
            f"{plural(len(unmatched_names), 'student')} of only one file, questionnaire or recordings, "
            f"{'is' if len(unmatched_names) == 1 else 'are'} in no result that needs both: n counts those of both"
        )


def _check_names(codebook: Codebook, metrics: "DataFrame") -> None:
    known_names = {*codebook.constructs, *metrics.select_dtypes("number")} - {RECALL_COLUMN}
    for name in (name for question in codebook.questions for name in question):
        if name == codebook.group_column:
            raise StudyError(f"the codebook's groups, {name!r}, are compared without a regression; leave them out")
        if name not in known_names:
            problem = f"the codebook's regressions name {name!r}, which is no construct or metric"
            raise StudyError(f"{problem}{nearest(name, known_names)}")
