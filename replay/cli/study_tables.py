"""A study and a check of printed tables, as a terminal shows them."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Group, RenderableType
from rich.text import Text

from replay.cli.terminal import line, terminal
from replay.outputs.tables import FAINT, FOUND, STRONG, WARNING, Marked, Table, table
from replay.studies.class_study.analysis import Study, associated
from replay.studies.class_study.page import OBSERVED_ONLY, headlines, words
from replay.studies.class_study.published import AGREES, INCONSISTENT, Remark

MARKS = {INCONSISTENT: WARNING, "weak": FOUND, AGREES: FAINT}
"""Kind of a remark -> its mark, the worst kind first."""


def study_tables(study: Study) -> Group:
    """What was found, every coefficient, and what is not said."""
    parts: list[Table | RenderableType] = [Text(), *(line(words_, STRONG) for words_ in headlines(study))]
    parts += [_coefficients(study)] if study.regressions else []
    parts += [_reliability(study)] if study.reliabilities else []
    said = [
        f"another conclusion with {row.detector}: {words(row.predictor)} with {words(row.outcome)}"
        for row in study.sensitivity
        if row.changes
    ]
    said += [*(f"not given: {refused}" for refused in study.refusals), *map(str, study.warnings)]
    return terminal(*parts, *(line(one, WARNING) for one in said), Text(), line(OBSERVED_ONLY, FAINT))


def check_table(remarks: Sequence[Remark]) -> Group:
    """What contradicts itself first, then what is weak, then what agrees."""
    ordered = sorted(remarks, key=lambda remark: list(MARKS).index(remark.kind))
    rows = [(Marked(one.kind, MARKS[one.kind]), one.table, one.row, one.message) for one in ordered]
    wrong = sum(one.kind == INCONSISTENT for one in remarks)
    said = f"{wrong} of {len(remarks)} checks contradict the print" if wrong else "every printed figure agrees"
    head = ("", "table", "row", "recomputed from the printed figures")
    return terminal(Text(), line(said, STRONG), table("", head, rows, words=4))


def _coefficients(study: Study) -> Table:
    recall = "" if study.recall is None else f", recall {study.recall:.1%}"
    behind = f", contacts by {study.detector}{recall}" if study.detector else ""
    rows = []
    for one in study.regressions:
        for c in one.coefficients:
            p = "none" if c.p_holm is None else "< 0.001" if c.p_holm < 0.001 else f"{c.p_holm:.3f}"
            cells = (
                words(one.outcome), words(c.name), one.kind, f"{c.beta:+.3f}", f"{c.low:+.2f} to {c.high:+.2f}", p,
                f"{one.adjusted_r2:.3f}",
            )  # fmt: skip
            rows.append([Marked(cell, STRONG if associated(c) else "") for cell in cells])
    head = ("outcome", "predictor", "regression", "beta", "95 % interval", "p (Holm)", "adj. R²")
    return table(f"associations  n = {study.students}{behind}", head, rows, words=3)


def _reliability(study: Study) -> Table:
    rows = [
        (construct, r.items, r.students, f"{r.alpha:.3f}", f"{r.low:.3f} to {r.high:.3f}")
        for construct, r in study.reliabilities.items()
    ]
    return table("questionnaire", ("construct", "items", "n", "alpha", "95 % interval"), rows)
