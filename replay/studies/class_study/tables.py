"""The sentences and tables of a study, for page, terminal and files; none of them claims a cause."""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

from replay import words
from replay.detection.detector_spec import TRUSTED_DETECTOR
from replay.document.tables import STRONG, Cell, Column, Marked, Table
from replay.studies.class_study.analysis import Sensitivity, Study
from replay.studies.class_study.refusals import count_text
from replay.studies.class_study.regression import (
    AFTER_HOLM,
    INTERVAL_HOLDS_ZERO,
    SIGNIFICANCE_LEVEL,
    UNDECIDED,
    Finding,
)
from replay.words import joined_names, plural

OBSERVED_ONLY_NOTE: Final = (
    "Associations in the students observed. Nothing was assigned at random, so no figure here says what would happen "
    "if something were changed."
)


STUDY_TITLE: Final = (
    "Design of Virtual Experiment Teaching of Inorganic Chemistry in Colleges and Universities Based on Unity3D"
)
"""Title of the published study of which this page follows the tables."""

PRINTED_SAMPLE: Final = {
    "students": "52, at this stage of a chemistry course",
    "groups": "2 of 26",
    "content": "inorganic-chemistry manipulative experiment",
    "device": "HTC VIVE",
    "answers": "questionnaire",
    "computed with": "IBM SPSS Statistics 24",
}
"""The sample as Table II of the paper prints it."""

ASSOCIATION_LABELS: Final = ("association", "associations")
COMPARISON_LABELS: Final = ("comparison of groups", "comparisons of groups")
"""One and several results of a kind; p-values are corrected within a kind."""

MOST_UNDECIDED: Final = 2
"""Undecided results that are named."""


def readable_name(name: str) -> str:
    """A column's name as words: ``contacts_per_min`` is contacts per minute."""
    return re.sub(r"\bper min\b", "per minute", name.replace("_", " "))


def result_name(finding: Finding) -> str:
    """A result in words: ``near misses with motivation``; ``near misses: group b less group a``."""
    name, outcome = readable_name(finding.name), readable_name(finding.outcome)
    return f"{outcome}: {name}" if finding.kind == "groups" else f"{name} with {outcome}"


def condition_text(finding: Finding) -> str:
    """Return what follows the name of a coefficient of several predictors."""
    return ", others held constant" if finding.kind == "multiple" else ""


def p_text(p: float | None) -> str:
    """A p-value with three places; ``none`` where no rule allows one."""
    return "none" if p is None else "< 0.001" if p < 0.001 else f"{p:.3f}"


def p_relation(p: float) -> str:
    """Return the words after *p* in a sentence: ``= 0.002``, ``< 0.001``."""
    text = p_text(p)
    return text if text.startswith("<") else f"= {text}"


def headlines(study: Study) -> list[str]:
    """Headlines: the associations, most pronounced first, or a sentence that there are none."""
    lines = []
    for c in sorted((c for c in study.coefficients if c.associated), key=lambda c: -abs(c.beta)):
        condition = "" if c.kind == "simple" else ", with the other predictors held constant"
        association_clause = (
            f"{_with_capital(c.name)} is associated with {_direction_word(c)} {readable_name(c.outcome)}{condition}"
        )
        lines.append(f"{association_clause}: {_figure_text(c)}, n = {c.students}")
    for group_difference in study.groups:
        if group_difference.associated:
            lines.append(
                f"{_with_capital(group_difference.outcome)} is {_direction_word(group_difference)} in group "
                f"{group_difference.second_group} than in {group_difference.first_group}: "
                f"{_figure_text(group_difference)}, n = {group_difference.first_students} and "
                f"{group_difference.second_students}"
            )
    if lines:
        return lines
    tested_counts = sorted({finding.students for finding in study.findings if finding.p is not None})
    if not tested_counts:
        return ["No association was tested"]
    undecided_findings = [finding for finding in study.findings if finding.conclusion.startswith(UNDECIDED)]
    if not undecided_findings:
        students = f"{tested_counts[0]}" if len(tested_counts) == 1 else f"{tested_counts[0]} to {tested_counts[-1]}"
        return [f"No association could be distinguished from chance in {students} students"]
    undecided_names = "; ".join(
        f"{result_name(finding)}{condition_text(finding)}" for finding in undecided_findings[:MOST_UNDECIDED]
    )
    among_text = "among them " if len(undecided_findings) > MOST_UNDECIDED else ""
    verb = "is" if len(undecided_findings) == 1 else "are"
    others_sentence = "" if len(undecided_findings) == len(study.findings) else ". The others may be chance"
    results_text = plural(len(study.findings), "result")
    return [
        f"{len(undecided_findings)} of {results_text} {verb} undecided: {among_text}{undecided_names}{others_sentence}"
    ]


def undecided_text(study: Study) -> str:
    """Sentences that define each kind of undecided result by its first one; ``""``: every result is decided."""
    by_conclusion = {finding.conclusion: finding for finding in reversed(study.findings)}
    sentences = []
    if finding := by_conclusion.get(AFTER_HOLM):
        findings_of_kind, kind_labels = (
            (study.groups, COMPARISON_LABELS) if finding.kind == "groups" else (study.coefficients, ASSOCIATION_LABELS)
        )
        tests = plural(sum(other_finding.p is not None for other_finding in findings_of_kind), *kind_labels)
        sentences.append(
            f"Undecided means here: p is {p_text(finding.p)} alone, which is below {SIGNIFICANCE_LEVEL:g}, but "
            f"{p_text(finding.p_holm)} after correction for {tests} tested together."
        )
    if finding := by_conclusion.get(INTERVAL_HOLDS_ZERO):
        sentences.append(
            f"Undecided means {'also' if sentences else 'here'}: p is {p_text(finding.p)}, which is below "
            f"{SIGNIFICANCE_LEVEL:g}, "
            "but the 95 % interval holds zero."
        )
    return " ".join(sentences)


def families_text(study: Study) -> str:
    """Sentence on the results of both kinds; ``""``: all are of one kind."""
    if not study.coefficients or not study.groups:
        return ""
    kind_texts = plural(len(study.coefficients), *ASSOCIATION_LABELS), plural(len(study.groups), *COMPARISON_LABELS)
    return f"The results are {kind_texts[0]} and {kind_texts[1]}."


def _direction_word(finding: Finding) -> str:
    return "higher" if finding.beta > 0 else "lower"


def _figure_text(finding: Finding) -> str:
    return f"{finding.beta:+.2f} [{finding.low:+.2f}, {finding.high:+.2f}]"


def _with_capital(name: str) -> str:
    return readable_name(name)[:1].upper() + readable_name(name)[1:]


def source_sentence(study: Study) -> str:
    """Sentence on the students, sessions, detector and its recall behind the study."""
    source = f"contacts from {study.detector}, whose recall was not measured"
    if study.detector == TRUSTED_DETECTOR:
        source = f"contacts from the reference ({study.detector})"
    elif study.recall is not None:
        source = f"contacts from {study.detector}, which finds {words.as_percentage(study.recall)} of contact frames"
    return f"{study.students} students, {study.rows} sessions, {source}"


def _recall_text(recall: float | None) -> str:
    return "not measured" if recall is None else words.as_percentage(recall)


CELL_TEXTS: Final[dict[str, Callable[[Any], Cell]]] = {
    "outcome": readable_name, "predictor": readable_name, "construct": str, "regression": str, "detector": str,
    "first_group": str, "second_group": str,
    "conclusion": lambda value: Marked(value, STRONG if value == "associated" else ""),
}  # fmt: skip
"""Column of words -> what people read of it."""

NUMBER_FORMATS: Final[dict[str, Callable[[Any], Cell] | str]] = {
    "beta": "+.3f", "difference": "+.3f", "low": "+.3f", "high": "+.3f", "p": p_text, "p_holm": p_text, "vif": ".2f",
    "adjusted_r2": ".3f", "recall": _recall_text, "alpha": ".3f", "least_item_total": ".2f", "pooled_beta": "+.3f",
    "pooled_fit": ".3f", "pooled_p": ".3f", "first_mean": ".4g", "second_mean": ".4g",
}  # fmt: skip
"""Column of numbers -> its format."""

COLUMN_HEADS: Final = {
    "students": "n",
    "first_group": "first group, mean",
    "second_group": "second group, mean",
    "low": "95 % interval",
    "p_holm": "p (Holm)",
    "adjusted_r2": "adj. R²",
    "vif": "VIF",
    "alpha": "Cronbach's alpha",
    "least_item_total": "least item with the rest",
    "pooled_beta": "pooled coefficient",
    "pooled_fit": "its fit",
    "pooled_p": "its p",
}
"""Column -> its heading on the page."""

FILE_ONLY_COLUMNS: Final = ("associated", "changes", "tested")
"""Columns that a page does not show, since it says the same in other words."""


COLUMN_TYPES: Final[dict[str, type]] = (
    dict.fromkeys(("items", "students", "first_students", "second_students"), int)
    | dict.fromkeys(FILE_ONLY_COLUMNS, bool)
    | dict.fromkeys(CELL_TEXTS, str)
)
"""Column that is no fraction or coefficient -> its type in files."""


def _raw_table(title: str, rows: Iterable[Any], columns: str, notes: Iterable[str] = ()) -> Table:
    """Raw values of rows; ``columns`` are names, with ``=`` and where a row has the value if it is elsewhere."""
    column_specs = (column.partition("=") for column in columns.split())
    number_formats = CELL_TEXTS | NUMBER_FORMATS
    columns_kept = (
        Column(name, COLUMN_TYPES.get(name, float), of=value_path, show=number_formats.get(name, ""))
        for name, _, value_path in column_specs
    )
    return Table.of(columns_kept, rows, title, notes)


def page_table(table: Table) -> Table:
    """Columns of a table that a page shows: an interval in one, and each group with its mean and number."""
    for prefix in ("first", "second"):
        table = _with_merged_columns(table, f"{prefix}_group", (f"{prefix}_students", f"{prefix}_mean"), _group_words)
    table = _with_merged_columns(table, "low", ("high",), _interval_words)
    return table.only(*(name for name in table.head if name not in FILE_ONLY_COLUMNS), heads=COLUMN_HEADS)


def _with_merged_columns(
    table: Table, column_name: str, merged_columns: tuple[str, ...], merged_text: Callable[..., str]
) -> Table:
    """A table in which one column stands for itself and others; unchanged where it has no such columns."""
    if not {column_name, *merged_columns} <= {*table.head}:
        return table
    values = [table.column(column) for column in (column_name, *merged_columns)]
    index, dropped_columns = table.head.index(column_name), {table.head.index(other) for other in merged_columns}
    columns = [*table.columns]
    columns[index] = replace(columns[index], dtype=str, show="")
    columns_kept = tuple(column for k, column in enumerate(columns) if k not in dropped_columns)
    rows = []
    for row, *cells in zip(table.rows, *values, strict=True):
        cell_text = None if cells[0] is None else merged_text(*cells)
        rows.append(tuple(cell_text if k == index else cell for k, cell in enumerate(row) if k not in dropped_columns))
    return replace(table, columns=columns_kept, rows=tuple(rows))


def _interval_words(lower: float, upper: float) -> str:
    return f"{lower:+.2f} to {upper:+.2f}"


def _group_words(group: str, students: int, mean: float) -> str:
    return f"{group}: {mean:.3g} (n\N{NO-BREAK SPACE}=\N{NO-BREAK SPACE}{students:.0f})"


def study_tables(study: Study) -> dict[str, Table]:
    """Name in the file -> table: a row per coefficient, construct, result with another detector, and outcome."""
    return {
        "associations": _raw_table(
            source_sentence(study), [(study, finding) for finding in study.coefficients],
            "outcome=1.outcome predictor=1.name regression=1.kind students=1.students beta=1.beta low=1.low "
            "high=1.high p=1.p p_holm=1.p_holm conclusion=1.conclusion adjusted_r2=1.adjusted_r2 vif=1.vif "
            "associated=1.associated detector=0.detector recall=0.recall",
            ["n counts students; several sessions of a student are taken as their mean."],
        ),
        "reliability": _raw_table(
            "questionnaire", study.reliabilities.items(),
            "construct=0 items=1.items students=1.students alpha=1.alpha low=1.low high=1.high "
            "least_item_total=1.least_item_total",
        ),
        "sensitivity": _raw_table(
            f"compared with {study.detector} above", study.sensitivity,
            "outcome=before.outcome predictor=before.name detector students recall beta=after.beta "
            "p_holm=after.p_holm conclusion changes tested",
            ["For groups, beta is the difference of their means."] if study.groups else (),
        ),
        "groups": _raw_table(
            "Groups compared", study.groups,
            "outcome first_group first_students first_mean second_group second_students second_mean pooled_beta "
            "pooled_fit pooled_p difference=beta low high p p_holm conclusion",
            [
                f"{STUDY_TITLE} computes the pooled coefficient, its fit and its p: one "
                "predictor, nothing corrected.",
                "The data allow the second group's mean less the first's, p of t with HC3 errors, Holm across "
                "the rows.",
            ],
        ),
    }  # fmt: skip


def opening_sentence(study: Study | None, counts: str) -> str:
    """The first sentence of page and terminal: how many, and whether a conclusion changes with the detector."""
    return f"{counts}: {_detector_sentence(study)}"


def _detector_sentence(study: Study | None) -> str:
    """Whether the detector changes a conclusion, what changes, or why that is not known."""
    unknown_text = "whether the detector changes a conclusion is not known"
    if study is None:
        return f"{unknown_text}, since there is no questionnaire."
    if not study.sensitivity:
        return f"{unknown_text}, since no result about contacts could be compared between detectors."
    if not any(row.tested for row in study.sensitivity):
        return f"{unknown_text}, since no result could be tested with another detector."
    changed_texts: dict[str, list[Sensitivity]] = {}
    for row in study.sensitivity:
        if row.tested and row.changes:
            changed_texts.setdefault(_result_text(row.before), []).append(row)
    if changed_texts:
        texts = [text for result, rows in changed_texts.items() for text in _changed_text(study, result, rows)]
        return f"the detector changes {plural(len(changed_texts), 'conclusion')}: {'; '.join(texts)}."
    return f"{_nothing_associated(study) or 'the detector changes no conclusion'}."


def _nothing_associated(study: Study) -> str:
    """Say that there is no association, whichever detector counts; ``""`` where one about behaviour was found."""
    behaviour_findings = [
        result for row in study.sensitivity for result in (row.before, row.after) if result is not None
    ]
    if any(result.associated for result in behaviour_findings):
        return ""
    behaviour_text = " with behaviour" if any(finding.associated for finding in study.findings) else ""
    clear_text = (
        "clear "
        if any(result.conclusion.startswith(UNDECIDED) for result in (*behaviour_findings, *study.findings))
        else ""
    )
    return f"no {clear_text}association{behaviour_text} was found, whichever collision detector counts the contacts"


def _result_text(finding: Finding) -> str:
    """A result as the subject of a sentence."""
    name, outcome = readable_name(finding.name), readable_name(finding.outcome)
    if finding.kind == "groups":
        return f"the difference in {outcome} ({name})"
    return f"the association of {name} with {outcome}{condition_text(finding)}"


def _changed_text(study: Study, result_text: str, sensitivity_rows: Sequence[Sensitivity]) -> Iterator[str]:
    """Yields with which detectors a result holds, with which it does not, and with which it has another sign."""
    same_detectors = [
        row.detector
        for row in sensitivity_rows
        if row.before.associated and row.after is not None and row.after.associated
    ]
    other_detectors = [row.detector for row in sensitivity_rows if row.detector not in same_detectors]
    if other_detectors and sensitivity_rows[0].before.associated:
        yield f"{result_text} holds with {study.detector}, not with {joined_names(other_detectors, 'or')}"
    elif other_detectors:
        yield f"{result_text} holds with {joined_names(other_detectors)}, not with {study.detector}"
    if same_detectors:
        yield f"{result_text} has another sign with {joined_names(same_detectors)} than with {study.detector}"


def sample_table(study: Study, own_sample: Mapping[str, str]) -> Table:
    """The sample as the paper prints it, beside this one; ``own_sample`` is what the sessions state."""
    sizes = ", ".join(f"{name} {count}" for name, count in study.group_sizes.items())
    sample_here = {
        "students": count_text(study.students), "groups": sizes or "none declared", "answers": "questionnaire",
        "computed with": "this tool: permutations, bootstrap, Holm", **own_sample,
    }  # fmt: skip
    rows = tuple((name, printed, sample_here[name]) for name, printed in PRINTED_SAMPLE.items())
    columns = Column("what"), Column("printed"), Column("here")
    return Table(columns, rows, f"{STUDY_TITLE}: its Table II, beside this study")
