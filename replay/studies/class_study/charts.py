"""The three charts of a class: time in contact by group, associations, and reliability, each with its intervals."""

from typing import Final

import numpy as np

from replay import words
from replay.show.plots import IntervalRow, Plot, interval_plot
from replay.studies.class_study.analysis import Study
from replay.studies.class_study.class_tables import ClassTables
from replay.studies.class_study.refusals import LEAST_IN_CELL
from replay.studies.class_study.tables import readable_name

ACCEPTABLE_ALPHA: Final = 0.7
"""Cronbach's alpha from which on a scale is commonly called reliable."""

EVERYBODY: Final = "all students"


def class_charts(tables: ClassTables, study: Study | None) -> list[Plot]:
    """Return the charts for which there are figures."""
    charts = [_contact_time(tables, study)]
    if study is not None:
        charts += [_associations(study), _reliability(study)]
    return [chart for chart in charts if chart is not None]


def _contact_time(tables: ClassTables, study: Study | None) -> Plot | None:
    """Seconds of contact in a minute of each declared group, or of all students where none is declared."""
    groups = {} if study is None else study.group_of
    rows = []
    for group in dict.fromkeys(groups.values()) or [EVERYBODY]:
        members = None if not groups else {student for student, own in groups.items() if own == group}
        estimate = tables.contact_seconds_a_minute(members)
        if estimate.students >= LEAST_IN_CELL and np.isfinite(estimate.value):
            label = f"{estimate.value:.3g} s, n = {estimate.students}"
            rows.append(IntervalRow(group, estimate.value, estimate.low, estimate.high, label, "right"))
    caption = "Time in contact a minute, in seconds; what several pairs touch at a time adds up. Bars: 95 % intervals."
    return interval_plot(rows, caption, "seconds of contact a minute", start=0.0) if rows else None


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
    held = " *: the other predictors held equal." if any(c.kind == "multiple" for c in study.coefficients) else ""
    caption = f"Associations, standardised, with 95 % intervals; blue: associated, grey: may be chance.{held}"
    return interval_plot(rows, caption, "standardised coefficient", marks=(0.0,)) if rows else None


def _reliability(study: Study) -> Plot | None:
    """Cronbach's alpha of each construct, beside the usual limit."""
    rows = [
        IntervalRow(name, own.alpha, own.low, own.high, f"{own.alpha:.2f}, n = {own.students}", "right")
        for name, own in study.reliabilities.items()
    ]
    limit = words.number(ACCEPTABLE_ALPHA)
    caption = f"Reliability of the questionnaire, with 95 % intervals; the line is {limit}, the usual limit."
    return interval_plot(rows, caption, "Cronbach's alpha", marks=(ACCEPTABLE_ALPHA,), end=1.0) if rows else None
