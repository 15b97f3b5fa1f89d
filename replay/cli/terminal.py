"""Tables for a terminal: every mark has a style, a count of zero is a dot, and no cell is cut off."""

from typing import Final

from rich import box
from rich.console import Group, RenderableType
from rich.padding import Padding
from rich.table import Table as RichTable
from rich.text import Text

from replay.base.shown import shown
from replay.outputs import palette, tables
from replay.outputs.tables import Cell, Column, Marked, Table, text_of

STYLES: Final = {
    tables.STRONG: "bold",
    tables.FAINT: "dim",
    tables.CODE: "",
    tables.IN_RED: f"bold {palette.hex_of(palette.MISSED)}",
    tables.PARTLY: palette.hex_of(palette.MISSED),
    tables.FOUND: palette.hex_of(palette.SERIES[0]),
    tables.INVENTED: palette.hex_of(palette.INVENTED),
    tables.WARNING: "yellow",
    tables.ERROR: "bold magenta",  # not red: that is for misses
    tables.GOOD: "bold green",
    "": "",
}
"""Mark -> style."""


def terminal(*parts: Table | RenderableType) -> Group:
    """Parts below each other, an empty line before each table; a ``str`` is text of no mark-up."""
    below: list[RenderableType] = []
    for part in parts:
        if isinstance(part, Table):
            # Not as rich's title: that would be folded to the width of the table, however narrow it is.
            title = [Text(shown(part.title), style="bold")] if part.title else []
            below += [Text(), *title, rendered(part)]
            below += [Text(shown(note, lines=True), style="dim") for note in part.notes]
        else:
            below.append(Text(shown(part)) if isinstance(part, str) else part)
    return Group(*below)


def plain(text: str, style: str = "") -> Text:
    """Text of a recording, whatever is in it."""
    return Text(shown(text), style=style)


def line(text: str, mark: str = "") -> Padding:
    """A sentence, indented by one column on each of its lines."""
    return Padding(Text(shown(text, lines=True), style=STYLES[mark]), (0, 0, 0, 1), expand=False)


def rendered(table: Table) -> RichTable:
    """One table as rich draws it, without its title and notes."""
    made = RichTable(
        box=box.SIMPLE_HEAD, header_style="dim", pad_edge=False,
        collapse_padding=True, show_edge=False, show_footer=bool(table.foot),
    )  # fmt: skip
    for k, column in enumerate(table.columns):
        foot = _cell(table.foot[k], column) if table.foot else ""
        justify = "left" if column.words else "right"
        made.add_column(column.name, foot, justify=justify, no_wrap=column.whole, overflow="fold")  # type: ignore[arg-type]
    for row in table.rows:
        made.add_row(*(_cell(cell, column) for cell, column in zip(row, table.columns, strict=True)))
    return made


def _cell(cell: Cell, column: Column) -> Text:
    if cell == 0:
        return Text("·", style="dim")
    mark = cell.mark if isinstance(cell, Marked) and cell.mark else column.mark
    text = Text(text_of(cell), style=STYLES[mark])
    if isinstance(cell, Marked) and cell.below:
        text.append(f"\n{shown(cell.below)}", style="dim")
    return text
