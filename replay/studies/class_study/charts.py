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
from replay.studies.class_study.tables import held_constant, result_name

MOST_RESULTS: Final = 12
"""Rows of the chart of results by detector."""

COLOURS: Final = "blue: associated, grey: may be chance"
"""The key of every chart with results that were tested; other charts are drawn as ``UNTESTED``."""

UNTESTED: Final = "untested"

REGRESSIONS: Final = ("simple", "multiple")

EVERYBODY: Final = "all students"


def class_charts(tables: ClassTables, study: Study | None) -> list[Plot]:
    """Return the charts for which there are figures."""
    charts = [_contact_time(tables, study)]
    if study is not None:
        coefficients = _sensitivity(study, REGRESSIONS, "Associations by detector", "standardised coefficient")
        differences = _sensitivity(study, ("groups",), "Groups by detector", "difference of means")
        associations, by_detector = [_associations(study), _reliability(study)], [coefficients, differences]
        first, then = (by_detector, associations) if study.changing else (associations, by_detector)
        charts = [*first, *then, *charts]
    return [chart for chart in charts if chart is not None]


def _sensitivity(study: Study, kinds: tuple[str, ...], title: str, axis: str) -> Plot | None:
    """Results about contacts of some kinds by the detector that counts; detectors with equal figures share a row."""
    by_result: dict[tuple[str, tuple[str, ...]], list[Sensitivity]] = {}
    for row in sorted(study.sensitivity, key=lambda row: not row.changes):
        if row.before.kind in kinds:
            by_result.setdefault((row.before.name, row.before.variables), []).append(row)
    rows: list[IntervalRow] = []
    for others in by_result.values():
        before = others[0].before
        findings = {study.detector: before} | {row.detector: row.after for row in others if row.after is not None}
        equal: dict[IntervalRow, list[str]] = {}
        for detector, finding in findings.items():
            if np.isfinite(finding.beta):
                equal.setdefault(_figures(finding), []).append(detector)
        prefix = f"{result_name(before)}{held_constant(before)}: "
        for figures, detectors in equal.items():
            same = f"the same with {len(detectors)} detectors" if len(equal) == 1 else ", ".join(detectors)
            rows.append(replace(figures, name=f"{prefix}{same}"))
            prefix = ""
    caption = f"Results by the detector that counts contacts, with 95 % intervals; {COLOURS}."
    if not rows:
        return None
    return interval_plot(rows[:MOST_RESULTS], caption, axis, title=title, marks=(0.0,))


def _figures(finding: Finding) -> IntervalRow:
    """Return the row of a result without its name, to the digits printed."""
    undecided = f" {UNDECIDED}" if finding.conclusion.startswith(UNDECIDED) else ""
    label = f"{finding.beta:+.2f}{undecided}, n = {finding.students}"
    value, lower, upper = (round(figure, 2) for figure in (finding.beta, finding.low, finding.high))
    return IntervalRow("", value, lower, upper, label, "right" if finding.associated else "reference")


def _contact_time(tables: ClassTables, study: Study | None) -> Plot | None:
    """Seconds of contact in a minute of each declared group, or of all students where none is declared."""
    groups = {} if study is None else study.group_of
    rows = []
    for group in dict.fromkeys(groups.values()) or [EVERYBODY]:
        members = None if not groups else {student for student, own in groups.items() if own == group}
        estimate = tables.contact_seconds_a_minute(members)
        if estimate.students >= LEAST_IN_CELL and np.isfinite(estimate.value):
            label = f"{estimate.value:.3g} s, n = {estimate.students}"
            name = f"group {group}" if groups else group
            rows.append(IntervalRow(name, estimate.value, estimate.low, estimate.high, label, UNTESTED))
    declared = " Groups are those that the codebook declares." if groups else ""
    caption = f"Time in contact a minute, in seconds, all pairs added up. Bars: 95 % intervals.{declared}"
    if not rows:
        return None
    return interval_plot(rows, caption, "seconds of contact a minute", title="Time in contact", start=0.0)


def _associations(study: Study) -> Plot | None:
    """Standardised coefficients; grey: cannot be distinguished from chance."""
    rows = [replace(_figures(c), name=f"{result_name(c)}{held_constant(c)}") for c in study.coefficients]
    caption = (
        f"Associations with 95 % intervals; {COLOURS}. With one predictor a coefficient is the correlation. A grey bar "
        "can leave out zero: colours follow p after Holm's correction, bars have none."
    )
    if not rows:
        return None
    return interval_plot(rows, caption, "standardised coefficient", title="Associations", marks=(0.0,))


def _reliability(study: Study) -> Plot | None:
    """Cronbach's alpha of each construct, beside the usual limit."""
    rows = [
        IntervalRow(name, own.alpha, own.low, own.high, f"{own.alpha:.2f}, n = {own.students}", UNTESTED)
        for name, own in study.reliabilities.items()
    ]
    limit = words.number(ACCEPTABLE_ALPHA)
    caption = f"Reliability of the questionnaire, with 95 % intervals; the line is {limit}, the usual limit."
    if not rows:
        return None
    title = "Reliability of the questionnaire"
    return interval_plot(rows, caption, "Cronbach's alpha", title=title, marks=(ACCEPTABLE_ALPHA,), end=1.0)
