"""The figures of ``replay bench`` for a terminal: the race, where time goes, and how cost grows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

from rich import box
from rich.console import Group
from rich.table import Table
from rich.text import Text

from replay.bench.growth import Growth
from replay.bench.race import Row
from replay.bench.stages import STAGES, Stages

WORDS: Final = ("question", "engine", "where", "grows", "digest", "workload")
"""Columns of words; all others are numbers."""


def bench_tables(
    rows: Sequence[Row], spent: Sequence[Stages], growth: Sequence[Growth], figures: Mapping[str, Any]
) -> Group:
    """Machine, race, stages and growth."""
    where, packages = figures["machine"], figures["versions"]
    head = f"{where['system']}, {where['processor']}, {where['cores']} cores, one used; Python {packages['python']}; "
    head += f"seed {figures['seed']}, {figures['frames']:,} frames"
    return Group(Text(head), Text(), race_table(rows), Text(), stage_table(spent), Text(), growth_table(growth))


def race_table(rows: Sequence[Row]) -> Table:
    """A row an engine and question."""
    words = ("faces", "question", "engine", "build", "seconds", "speed", "contacts", "digest", "wrong")
    table = _table("beside python-fcl's plain loop, trees kept; wrong: pair-frames that differ from it", words)
    for row in rows:
        table.add_row(
            f"{row.faces:,}", row.what, row.engine, f"{row.build:.3f}", f"{row.seconds:.4f}", f"{row.speed:.2f}",
            f"{row.contacts:,}", row.digest, f"{row.wrong:,}",
        )  # fmt: skip
    return table


def stage_table(spent: Sequence[Stages]) -> Table:
    """A row a workload: milliseconds of every stage."""
    table = _table("where the time of exact goes, milliseconds", ("workload", "faces each", "question", *STAGES, "all"))
    for one in spent:
        told = [f"{1e3 * one.seconds[name]:.2f}" if name in one.seconds else "in trees" for name in STAGES]
        all_ = f"{1e3 * sum(one.seconds.values()):.2f}"
        table.add_row(one.workload, f"{one.faces:,}", one.what, *told, all_)
    return table


def growth_table(growth: Sequence[Growth]) -> Table:
    """A row a size; x is the figure before it over that of the row above, whose size is smaller."""
    words = ("where", "grows", "size", "pair-frames", "seconds", "x", "reading", "search", "x", "tests", "x", "skipped")
    table = _table("growth of exact: reading poses is linear, the search need not be", words)
    before: Growth | None = None
    for one in growth:
        last = before if before is not None and (before.where, before.grows) == (one.where, one.grows) else None
        table.add_row(
            one.where, one.grows, f"{one.size:,}", f"{one.pair_frames:,}",
            f"{one.seconds:.4f}", _times(one.seconds, last.seconds if last else None), f"{one.reading:.4f}",
            f"{one.search:.5f}", _times(one.search, last.search if last else None),
            f"{one.tests:,}", _times(one.tests, last.tests if last else None),
            f"{one.work.get('skipped', 0) / max(1, one.pair_frames):.1%}",
        )  # fmt: skip
        before = one
    return table


def _times(value: float, before: float | None) -> str:
    return f"{value / before:.1f}" if before else ""


def _table(title: str, words: Sequence[str]) -> Table:
    table = Table(box=box.SIMPLE_HEAD, title=title, title_justify="left", pad_edge=False, header_style="dim")
    for word in words:
        table.add_column(word, justify="left" if word in WORDS else "right")
    return table
