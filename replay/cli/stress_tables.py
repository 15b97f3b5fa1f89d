"""The answers of ``replay stress`` for a terminal: sums and a row per family, then what changed under relations."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from rich import box
from rich.console import Group
from rich.table import Table
from rich.text import Text

from replay.stress.flips import Flips
from replay.stress.runner import StressResult, Tally
from replay.stress.system import CaseTally

COLUMNS: Final = {
    "missed": "missed",
    "invented": "invented",
    "within": "within tolerance",
    "refused": "refused",
    "unconfirmed": "unconfirmed",
}
"""Field of a tally -> heading."""

NONE: Final = "·"


def stress_tables(result: StressResult) -> Group:
    """The sums of each detector; below them where they come from, and the files that were written."""
    rows = dict(result.by_detector())
    parts: list[Table | Text] = [Text(f"seed {result.seed}, tau {result.tau:g} m")]
    if rows:
        parts = [Text(f"seed {result.seed}, {result.pairs:,} pairs of each family, tau {result.tau:g} m"), Text()]
    if len(rows) == 1:
        parts.append(family_table(next(iter(rows.values()))))
    elif rows:
        parts += [sum_table(rows), Text(), cross_table(rows)]
    if result.flips:
        parts += [Text(), flip_table(result.flips)]
    if result.cases:
        parts += [Text(), case_table(result.cases)]
    files = (
        [one.file for one in result.cases] + [one.file for one in result.tallies] + [one.file for one in result.flips]
    )
    parts += [Text(f"  {file}", overflow="fold") for file in files if file]
    return Group(*parts)


def sum_table(rows: dict[str, list[Tally]]) -> Table:
    """A row per detector, summed over the families."""
    table = _table("all families", "detector")
    table.add_column("pairs", justify="right")
    for heading in COLUMNS.values():
        table.add_column(heading, justify="right")
    for name, tallies in rows.items():
        table.add_row(name, f"{sum(one.pairs for one in tallies):,}", *(_count(_sum(tallies, at)) for at in COLUMNS))
    return table


def family_table(tallies: Sequence[Tally]) -> Table:
    """A row per family of one detector, and the sums."""
    table = _table(tallies[0].detector, "family", show_footer=len(tallies) > 1, footer="all")
    for field, heading in COLUMNS.items():
        table.add_column(heading, justify="right", footer=_count(_sum(tallies, field)))
    for tally in tallies:
        table.add_row(_label(tally), *(_count(getattr(tally, field)) for field in COLUMNS))
    return table


def cross_table(rows: dict[str, list[Tally]]) -> Table:
    """A row per family in which anybody failed, a column per detector that failed anywhere."""
    failing = {name: tallies for name, tallies in rows.items() if any(one.failed for one in tallies)}
    table = _table("missed + invented, ~ within tolerance, ! refused; nobody else failed anywhere", "family")
    table.columns[0].no_wrap = True
    for name in failing:
        table.add_column(name, justify="right")
    for tallies in zip(*failing.values(), strict=True):
        if any(one.failed for one in tallies):
            table.add_row(_label(tallies[0]), *(_cell(tally) for tally in tallies))
    return table


def flip_table(flips: Sequence[Flips]) -> Table:
    """A row per detector, a column per relation, and the families with any."""
    pairs = flips[0].pairs * len({one.number for one in flips})
    table = _table(f"answers changed by what changes nothing, of {pairs:,} pairs", "detector")
    relations = list(dict.fromkeys(one.relation for one in flips))
    for relation in relations:
        table.add_column(relation, justify="right")
    table.add_column("in families")
    for name in dict.fromkeys(one.detector for one in flips):
        of = [one for one in flips if one.detector == name]
        cells = [_flip_cell([one for one in of if one.relation == relation]) for relation in relations]
        families = sorted({one.number for one in of if one.flips or one.refused})
        table.add_row(name, *cells, " ".join(f"{number:02d}" for number in families) or NONE)
    return table


def case_table(cases: Sequence[CaseTally]) -> Table:
    """A row for each case and for each answer that detectors gave to it."""
    table = _table("cases of whole bodies", "case")
    table.add_column("asked", justify="right")
    table.add_column("result")
    table.add_column("detectors")
    table.add_column("why")
    asked_any = {one.detector for one in cases if one.applies}
    for number in sorted({one.number for one in cases}):
        of = [one for one in cases if one.number == number and (one.detector in asked_any or not asked_any)]
        answers = list(dict.fromkeys((one.words, one.asked, one.reason) for one in of))
        for place, (words, asked, reason) in enumerate(answers):
            names = [one.detector for one in of if (one.words, one.asked, one.reason) == (words, asked, reason)]
            who = ", ".join(names) if len(names) < len(of) or len(of) == 1 else "all"
            label = f"{number} {of[0].name}" if place == 0 else ""
            table.add_row(label, _count(asked), words, who, reason)
    never = {one.detector: one.reason for one in cases if asked_any and one.detector not in asked_any}
    for name, reason in never.items():
        table.add_row("all of them", NONE, "does not apply", name, reason)
    return table


def _flip_cell(flips: Sequence[Flips]) -> str:
    refused = sum(one.refused for one in flips)
    return _count(sum(one.flips for one in flips)) + (f"  ! {refused:,}" if refused else "")


def _cell(tally: Tally) -> str:
    parts = [f"{tally.missed:,} + {tally.invented:,}"] if tally.missed or tally.invented else []
    parts += [f"{sign} {count:,}" for sign, count in (("~", tally.within), ("!", tally.refused)) if count]
    return "  ".join(parts) or NONE


def _label(tally: Tally) -> str:
    return f"{tally.number:02d} {tally.name}"


def _sum(tallies: Sequence[Tally], field: str) -> int:
    return sum(getattr(tally, field) for tally in tallies)


def _count(count: int) -> str:
    return f"{count:,}" if count else NONE


def _table(title: str, first: str, *, show_footer: bool = False, footer: str = "") -> Table:
    table = Table(
        box=box.SIMPLE_HEAD, title=title, title_justify="left", title_style="bold", pad_edge=False,
        header_style="dim", show_footer=show_footer,
    )  # fmt: skip
    table.add_column(first, footer=footer)
    return table
