"""The figures of ``replay bench`` for a terminal: the race, then how cost grows and where it goes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rich import box
from rich.console import Group
from rich.table import Table
from rich.text import Text

from replay.bench.race import Growth, Row


def bench_tables(rows: Sequence[Row], growth: Sequence[Growth], figures: Mapping[str, Any]) -> Group:
    """Machine, race and growth."""
    where, packages = figures["machine"], figures["versions"]
    head = f"{where['system']} {where['processor']}, {where['cores']} cores, one used; Python {packages['python']}; "
    head += f"seed {figures['seed']}, {figures['frames']:,} frames"
    return Group(Text(head), Text(), race_table(rows), Text(), growth_table(growth))


def race_table(rows: Sequence[Row]) -> Table:
    """A row per engine and question."""
    words = ("faces", "question", "engine", "seconds", "speed", "contacts", "digest", "wrong")
    table = _table("beside python-fcl, trees kept", words)
    for row in rows:
        table.add_row(
            f"{row.faces:,}", row.what, row.engine, f"{row.seconds:.4f}", f"{row.speed:.1f}", f"{row.contacts:,}",
            row.digest, str(row.wrong),
        )  # fmt: skip
    return table


def growth_table(growth: Sequence[Growth]) -> Table:
    """A row per size: seconds, time per pair-frame, and the stage and the counter that weigh most."""
    table = _table(
        "growth of exact", ("grows", "size", "pair-frames", "seconds", "ns each", "skipped", "blocks", "most time in")
    )
    for one in growth:
        share = one.work.get("skipped", 0) / max(1, one.pair_frames)
        most = max(one.stages, key=lambda name: one.stages[name], default="")
        table.add_row(
            one.grows, f"{one.size:,}", f"{one.pair_frames:,}", f"{one.seconds:.4f}",
            f"{1e9 * one.seconds / max(1, one.pair_frames):.0f}", f"{share:.0%}", f"{one.work.get('blocks', 0):,}",
            most,
        )  # fmt: skip
    return table


def _table(title: str, words: Sequence[str]) -> Table:
    table = Table(box=box.SIMPLE_HEAD, title=title, title_justify="left", pad_edge=False, header_style="dim")
    for word in words:
        table.add_column(word, justify="left" if word in ("question", "engine", "grows", "digest") else "right")
    return table
