"""The charts of a class, with intervals: results by detector, time in contact by group, associations, reliability."""

from dataclasses import replace
from typing import Final

import numpy as np

from replay import words
from replay.show.plots import IntervalRow, Plot, interval_plot
from replay.studies.class_study.analysis import Sensitivity, Study
from replay.studies.class_study.class_tables import ClassTables
from replay.studies.class_study.refusals import LEAST_IN_CELL
from replay.studies.class_study.regression import UNDECIDED, Finding
from replay.studies.class_study.reliability import ACCEPTABLE_ALPHA
from replay.studies.class_study.tables import condition_text, p_relation, result_name

MOST_RESULTS: Final = 12
"""Rows of the chart of results by detector."""

COLOURS_KEY: Final = (
    "blue: associated, grey: may be chance, by p after Holm's correction, though a bar may leave out zero"
)
"""The key of every chart with results that were tested; other charts are drawn as ``UNTESTED_MARK``."""

UNTESTED_MARK: Final = "untested"

REGRESSIONS: Final = ("simple", "multiple")

ALL_STUDENTS: Final = "all students"


def class_charts(class_tables: ClassTables, study: Study | None) -> list[Plot]:
    """Return the charts for which there are figures."""
    charts = [_contact_time_chart(class_tables, study)]
    if study is not None:
        coefficients = _sensitivity_chart(study, REGRESSIONS, "Associations by detector", "standardised coefficient")
        differences_chart = _sensitivity_chart(study, ("groups",), "Groups by detector", "difference of means")
        association_charts, detector_charts = (
            [_associations_chart(study), _reliability_chart(study)],
            [coefficients, differences_chart],
        )
        leading_charts, second_charts = (
            (detector_charts, association_charts) if study.changing_detectors else (association_charts, detector_charts)
        )
        charts = [*leading_charts, *second_charts, *charts]
    return [chart for chart in charts if chart is not None]


def _sensitivity_chart(study: Study, result_kinds: tuple[str, ...], title: str, axis: str) -> Plot | None:
    """Results about contacts of some kinds by the detector that counts; detectors with equal figures share a row."""
    by_result: dict[tuple[str, tuple[str, ...]], list[Sensitivity]] = {}
    for row in sorted(study.sensitivity, key=lambda row: not row.changes):
        if row.before.kind in result_kinds:
            by_result.setdefault((row.before.name, row.before.variables), []).append(row)
    interval_rows: list[IntervalRow] = []
    for sensitivities in by_result.values():
        original_finding = sensitivities[0].before
        findings = {study.detector: original_finding} | {
            row.detector: row.after for row in sensitivities if row.after is not None
        }
        detectors_by_row: dict[IntervalRow, list[str]] = {}
        for detector, finding in findings.items():
            if np.isfinite(finding.beta):
                detectors_by_row.setdefault(_interval_row(finding), []).append(detector)
        prefix = f"{result_name(original_finding)}{condition_text(original_finding)}: "
        for row_figures, detectors in detectors_by_row.items():
            detectors_text = (
                f"the same with {len(detectors)} detectors" if len(detectors_by_row) == 1 else ", ".join(detectors)
            )
            interval_rows.append(replace(row_figures, name=f"{prefix}{detectors_text}"))
            prefix = ""
    caption = f"Results by the detector that counts contacts, with 95 % intervals; {COLOURS_KEY}."
    if not interval_rows:
        return None
    return interval_plot(interval_rows[:MOST_RESULTS], caption, axis, title=title, marked_values=(0.0,))


def _interval_row(finding: Finding) -> IntervalRow:
    """Return the row of a result without its name, to the digits printed."""
    undecided_mark = f" {UNDECIDED}" if finding.conclusion.startswith(UNDECIDED) else ""
    p = "" if finding.p_holm is None else f", p {p_relation(finding.p_holm)}"
    label = f"{finding.beta:+.2f}{undecided_mark}{p}, n = {finding.students}"
    value, lower, upper = (round(bound, 2) for bound in (finding.beta, finding.low, finding.high))
    return IntervalRow("", value, lower, upper, label, "right" if finding.associated else "reference")


def _contact_time_chart(class_tables: ClassTables, study: Study | None) -> Plot | None:
    """Seconds of contact in a minute of each declared group, or of all students where none is declared."""
    groups = {} if study is None else study.group_of
    interval_rows = []
    for group in dict.fromkeys(groups.values()) or [ALL_STUDENTS]:
        group_members = None if not groups else {student for student, own_value in groups.items() if own_value == group}
        estimate = class_tables.contact_seconds_a_minute(group_members)
        if estimate.students >= LEAST_IN_CELL and np.isfinite(estimate.value):
            label = f"{estimate.value:.3g} s, n = {estimate.students}"
            row_name = f"group {group}" if groups else group
            interval_rows.append(
                IntervalRow(row_name, estimate.value, estimate.low, estimate.high, label, UNTESTED_MARK)
            )
    groups_note = " Groups are those that the codebook declares." if groups else ""
    caption = f"Time in contact a minute, in seconds, all pairs added up. Bars: 95 % intervals.{groups_note}"
    if not interval_rows:
        return None
    return interval_plot(interval_rows, caption, "seconds of contact a minute", title="Time in contact", start=0.0)


def _associations_chart(study: Study) -> Plot | None:
    """Standardised coefficients; grey: cannot be distinguished from chance."""
    interval_rows = [replace(_interval_row(c), name=f"{result_name(c)}{condition_text(c)}") for c in study.coefficients]
    caption = f"Associations with 95 % intervals; {COLOURS_KEY}. With one predictor a coefficient is the correlation."
    if not interval_rows:
        return None
    return interval_plot(interval_rows, caption, "standardised coefficient", title="Associations", marked_values=(0.0,))


def _reliability_chart(study: Study) -> Plot | None:
    """Cronbach's alpha of each construct, beside the usual limit."""
    interval_rows = [
        IntervalRow(
            name,
            own_value.alpha,
            own_value.low,
            own_value.high,
            f"{own_value.alpha:.2f}, n = {own_value.students}",
            UNTESTED_MARK,
        )
        for name, own_value in study.reliabilities.items()
    ]
    limit_text = words.number(ACCEPTABLE_ALPHA)
    caption = f"Reliability of the questionnaire, with 95 % intervals; the line is {limit_text}, the usual limit."
    if not interval_rows:
        return None
    title = "Reliability of the questionnaire"
    return interval_plot(
        interval_rows, caption, "Cronbach's alpha", title=title, marked_values=(ACCEPTABLE_ALPHA,), end=1.0
    )
