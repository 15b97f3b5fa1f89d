"""The tables of ``replay paper`` for a terminal: the same cells as in its files."""

from __future__ import annotations

from collections.abc import Sequence

from rich import box
from rich.console import Group
from rich.table import Table
from rich.text import Text

from replay.paper.tables import PaperTable, shown


def paper_tables(tables: Sequence[PaperTable]) -> Group:
    """All tables, each below its title."""
    return Group(*(part for one in tables for part in (_table(one), Text(one.note, style="dim"), Text())))


def _table(one: PaperTable) -> Table:
    made = Table(title=f"{one.key}: {one.title}", box=box.SIMPLE_HEAD, title_justify="left")
    for place, heading in enumerate(one.head):
        words = any(isinstance(row[place], str) for row in one.rows)
        made.add_column(heading, justify="left" if words else "right", overflow="fold")
    for row in one.rows:
        made.add_row(*(shown(cell) for cell in row))
    return made
