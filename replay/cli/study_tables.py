"""A study and a check of printed tables, as a terminal shows them."""

from __future__ import annotations

from collections.abc import Sequence

from rich import box
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from replay.study.analysis import Study, associated
from replay.study.page import CAVEAT, headlines, words
from replay.study.published import AGREES, INCONSISTENT, Remark

COLOURS = {INCONSISTENT: "bold yellow", "weak": "cyan", AGREES: "dim"}


def study_tables(study: Study) -> Group:
    """What was found, every coefficient, and what is not said."""
    parts: list[RenderableType] = [Text()]
    parts += [Text(f" {line}", style="bold") for line in headlines(study)]
    if study.regressions:
        parts += [Text(), _coefficients(study)]
    if study.reliabilities:
        parts += [Text(), _reliability(study)]
    changed = [row for row in study.sensitivity if row.changes]
    for row in changed:
        parts.append(
            Text(f" another conclusion with {row.detector}: {words(row.predictor)} with {words(row.outcome)}", "yellow")
        )
    parts += [Text(f" not given: {refused}", style="yellow") for refused in study.refusals]
    parts += [Text(f" {warning}", style="yellow") for warning in study.warnings]
    return Group(*parts, Text(), Text(f" {CAVEAT}", style="dim"))


def check_table(remarks: Sequence[Remark]) -> Group:
    """What contradicts itself first, then what is weak, then what agrees."""
    order = list(COLOURS)
    table = Table("", "table", "row", "recomputed from the printed figures", box=box.SIMPLE_HEAD, pad_edge=False)
    for one in sorted(remarks, key=lambda remark: order.index(remark.kind)):
        table.add_row(Text(one.kind, COLOURS[one.kind]), one.table, one.row, one.message)
    wrong = sum(one.kind == INCONSISTENT for one in remarks)
    said = f" {wrong} of {len(remarks)} checks contradict the print" if wrong else " every printed figure agrees"
    return Group(Text(), Text(said, style="bold"), Text(), table)


def _coefficients(study: Study) -> Table:
    recall = "" if study.recall is None else f", recall {study.recall:.1%}"
    behind = f", contacts by {study.detector}{recall}" if study.detector else ""
    table = Table(
        "outcome", "predictor", "regression", title=f"associations  n = {study.students}{behind}",
        box=box.SIMPLE_HEAD, title_justify="left", title_style="bold", pad_edge=False,
    )  # fmt: skip
    for name in ("beta", "95 % interval", "p (Holm)", "adj. R²"):
        table.add_column(name, justify="right")
    for one in study.regressions:
        for c in one.coefficients:
            p = "none" if c.p_holm is None else "< 0.001" if c.p_holm < 0.001 else f"{c.p_holm:.3f}"
            cells = (f"{c.beta:+.3f}", f"{c.low:+.2f} to {c.high:+.2f}", p, f"{one.adjusted_r2:.3f}")
            table.add_row(words(one.outcome), words(c.name), one.kind, *cells, style="bold" if associated(c) else "")
    return table


def _reliability(study: Study) -> Table:
    table = Table("construct", title="questionnaire", box=box.SIMPLE_HEAD, title_justify="left", title_style="bold",
                  pad_edge=False)  # fmt: skip
    for name in ("items", "n", "alpha", "95 % interval"):
        table.add_column(name, justify="right")
    for construct, r in study.reliabilities.items():
        table.add_row(construct, f"{r.items}", f"{r.students}", f"{r.alpha:.3f}", f"{r.low:.3f} to {r.high:.3f}")
    return table
