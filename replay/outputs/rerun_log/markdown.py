"""Tables for the text views of the picture, in Markdown."""

from __future__ import annotations

from typing import Final

from replay.outputs.tables import CODE, STRONG, Cell, Marked, Table, text_of

MARKS: Final = {STRONG: "**", CODE: "`"}


def markdown(table: Table, level: int = 0) -> str:
    """A table below its title, a heading of this level; without a level there is no title."""
    heading = [f"{'#' * level} {table.title}", ""] if level else []
    lines = [_line([column.name for column in table.columns]), "|---" * len(table.columns) + "|"]
    lines += [_line([_cell(cell) for cell in row]) for row in table.rows]
    notes = [line for note in table.notes for line in ("", note)]
    return "\n".join([*heading, *lines, *notes])


def _line(cells: list[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _cell(cell: Cell) -> str:
    around = MARKS.get(cell.mark, "") if isinstance(cell, Marked) else ""
    return around + text_of(cell).replace("|", "\\|") + around
