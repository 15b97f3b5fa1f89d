"""The charts of a class, with intervals: results by detector, time in contact by group, associations, reliability."""

from typing import Final

import numpy as np

from replay import words
from replay.show.plots import IntervalRow, Plot, interval_plot
from replay.studies.class_study.analysis import Sensitivity, Study
from replay.studies.class_study.class_tables import ClassTables
from replay.studies.class_study.refusals import LEAST_IN_CELL
from replay.studies.class_study.regression import Finding
from replay.studies.class_study.tables import readable_name, result_name

ACCEPTABLE_ALPHA: Final = 0.7
"""Cronbach's alpha from which on a scale is commonly called reliable."""

MOST_RESULTS: Final = 12
"""Rows of the chart of results by detector."""

EVERYBODY: Final = "all students"


def class_charts(tables: ClassTables, study: Study | None) -> list[Plot]:
    """Return the charts for which there are figures."""
    charts = [_contact_time(tables, study)]
    if study is not None:
        charts = [_sensitivity(study), *charts, _associations(study), _reliability(study)]
    return [chart for chart in charts if chart is not None]


def _sensitivity(study: Study) -> Plot | None:
    """Each result about contacts with the detector of the study, and with every other one below it."""
    by_result: dict[tuple[str, str], list[Sensitivity]] = {}
    for row in sorted(study.sensitivity, key=lambda row: not row.changes):
        by_result.setdefault((row.before.name, row.before.outcome), []).append(row)
    rows: list[IntervalRow] = []
    for others in by_result.values():
        before = others[0].before
        rows.append(_result_row(f"{result_name(before)}: {study.detector}", before, "reference"))
        for row in others:
            if row.after is not None and np.isfinite(row.after.beta):
                rows.append(_result_row(row.detector, row.after, "false" if row.changes else "right"))
    caption = (
        "The headline: each result about contacts by the detector that found them, with 95 % intervals. Grey: the "
        "detector of this page, blue: the same conclusion, yellow: another one."
    )
    if not rows:
        return None
    title = "Results about contacts by detector"
    return interval_plot(rows[:MOST_RESULTS], caption, "coefficient or difference", title=title, marks=(0.0,))


def _result_row(name: str, finding: Finding, kind: str) -> IntervalRow:
    label = f"{finding.beta:+.2f}, n = {finding.students}"
    return IntervalRow(name, finding.beta, finding.low, finding.high, label, kind)


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
            rows.append(IntervalRow(name, estimate.value, estimate.low, estimate.high, label, "right"))
    declared = " Groups are those that the codebook declares." if groups else ""
    caption = f"Time in contact a minute, in seconds, all pairs added up. Bars: 95 % intervals.{declared}"
    if not rows:
        return None
    return interval_plot(rows, caption, "seconds of contact a minute", title="Time in contact", start=0.0)


def _associations(study: Study) -> Plot | None:
    """Standardised coefficients; grey: cannot be distinguished from chance."""
    rows = [
        IntervalRow(
            f"{readable_name(c.name)} with {readable_name(c.outcome)}{'' if c.kind == 'simple' else ' *'}",
            c.beta,
            c.low,
            c.high,
            f"{c.beta:+.2f}, n = {c.students}",
            "right" if c.associated else "reference",
        )
        for c in study.coefficients
    ]
    held = (
        " *: with the other predictors held constant." if any(c.kind == "multiple" for c in study.coefficients) else ""
    )
    caption = (
        "Associations, standardised, with 95 % intervals; blue: associated, grey: may be chance. A grey bar can leave "
        f"out zero: colours follow p after Holm's correction, bars have none.{held}"
    )
    if not rows:
        return None
    return interval_plot(rows, caption, "standardised coefficient", title="Associations", marks=(0.0,))


def _reliability(study: Study) -> Plot | None:
    """Cronbach's alpha of each construct, beside the usual limit."""
    rows = [
        IntervalRow(name, own.alpha, own.low, own.high, f"{own.alpha:.2f}, n = {own.students}", "right")
        for name, own in study.reliabilities.items()
    ]
    limit = words.number(ACCEPTABLE_ALPHA)
    caption = f"Reliability of the questionnaire, with 95 % intervals; the line is {limit}, the usual limit."
    if not rows:
        return None
    title = "Reliability of the questionnaire"
    return interval_plot(rows, caption, "Cronbach's alpha", title=title, marks=(ACCEPTABLE_ALPHA,), end=1.0)
