"""Tables for a terminal: every mark has a style, and no word is cut at any width."""

from dataclasses import dataclass
from textwrap import fill
from typing import Final

from rich import box
from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, Group, RenderableType, RenderResult
from rich.table import Table as RichTable
from rich.text import Text

from replay.document import tables
from replay.document.tables import Cell, Column, Marked, Table, text_of
from replay.show import palette
from replay.words import safe_text

MARK_STYLES: Final = {
    tables.STRONG: "bold",
    tables.FAINT: "dim",
    tables.IN_RED: f"bold {palette.hex_of(palette.MISSED)}",
    tables.PARTLY: palette.hex_of(palette.LATE),
    tables.IN_BLUE: palette.hex_of(palette.SERIES_COLOURS[0]),
    tables.IN_YELLOW: palette.hex_of(palette.FALSE_CONTACT),
    tables.WARNING: "yellow",
    tables.ERROR: "bold magenta",  # not red: that is for misses
    tables.GOOD: "bold green",
    "": "",
}
"""Mark -> style."""


def stacked(*contents: Table | RenderableType) -> Group:
    """Parts below each other, an empty line before each table; a ``str`` is text of no mark-up."""
    stacked_contents: list[RenderableType] = []
    for content in contents:
        if isinstance(content, Table):
            # Not as rich's title: that would be folded to the width of the table, however narrow it is.
            title = [Text(safe_text(content.title), style="bold")] if content.title else []
            stacked_contents += [Text(), *title, Fitted(content)]
            stacked_contents += [Text(safe_text(note), style="dim") for note in content.notes]
        else:
            stacked_contents.append(Text(safe_text(content)) if isinstance(content, str) else content)
    return Group(*stacked_contents)


def plain_text(text: str, style: str = "") -> Text:
    """Text of a recording, whatever is in it."""
    return Text(safe_text(text), style=style)


def line(text: str, mark: str = "") -> Text:
    """A sentence; its words are not broken."""
    return Text(safe_text(text), style=MARK_STYLES[mark])


PARAGRAPH_COLUMNS: Final = 80
"""Columns of a sentence at most, however wide the terminal: what a mail or a second pane shows whole."""


@dataclass(frozen=True)
class Paragraph:
    """A sentence folded between words, its label before it, its later lines below the first."""

    label: str
    text: str
    style: str = ""

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """Wraps the text to the terminal, at most ``PARAGRAPH_COLUMNS`` wide."""
        del console
        indent = " " * len(self.label)
        line_width = max(min(options.max_width, PARAGRAPH_COLUMNS), len(indent) + 20)
        text = fill(
            safe_text(self.text),
            line_width,
            initial_indent=self.label,
            subsequent_indent=indent,
            break_long_words=False,
            break_on_hyphens=False,
        )
        yield Text(text, style=self.style, no_wrap=True, overflow="ignore")


@dataclass(frozen=True)
class Command:
    """A command to be copied, below the text of a label; a long one is continued before an option.

    An option too long for a line is continued after a comma, from the first column: a shell joins such lines as they
    are, in double quotes too, so that indentation would become part of the argument.
    """

    text: str

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """On one line where it fits, else with ``\\`` at the end of each but the last."""
        del console
        indent, line_width = " " * 8, min(options.max_width, PARAGRAPH_COLUMNS)
        command = safe_text(self.text)
        if len(indent) + len(command) <= line_width:
            yield Text(indent + command, no_wrap=True, overflow="ignore")
            return
        lines = (indent + command).replace(" --", f" \\\n{indent}  --").split("\n")
        pieces = [piece for line in lines for piece in _continuation_lines(line, line_width)]
        yield Text("\n".join(pieces), no_wrap=True, overflow="ignore")


def _continuation_lines(line: str, line_width: int) -> list[str]:
    """Pieces of a line of a command, each at most as wide as the room where commas allow it."""
    pieces = []
    while len(line) > line_width:
        comma = line.rfind(",", 0, line_width - 1)
        if comma < 0:
            break
        pieces.append(line[: comma + 1] + "\\")
        line = line[comma + 1 :]
    return [*pieces, line]


COLUMN_GAP: Final = 2
"""Columns between two columns of a table."""


class Fitted:
    """A table in as many blocks below each other as the terminal needs; each begins with the first column.

    So no word and no number is broken over lines, as long as there is room for one beside the first column.
    """

    def __init__(self, table: Table) -> None:
        self.table = table
        columns = [*zip(*table.cells(), strict=True)] if table.rows else [()] * len(table.columns)
        self._cells = [
            [_cell(cell, column) for cell in cells] for column, cells in zip(table.columns, columns, strict=True)
        ]
        widths = [self._widths(k) for k in range(len(table.columns))]
        self._least_widths, self._greatest_widths = [column[0] for column in widths], [column[1] for column in widths]

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """The blocks, as wide as there is room."""
        del console
        for number, block in enumerate(self._blocks(options.max_width)):
            if number:
                yield Text()
            yield self._rich_table(block, options.max_width)

    def _widths(self, k: int) -> tuple[int, int]:
        """Least and greatest width of a column: its longest word, where words may stand below each other."""
        column = self.table.columns[k]
        cell_texts = [text.plain for text in self._cells[k]]
        unbreakable = [
            word for text in cell_texts for word in (text.split() if column.words and not column.whole else [text])
        ]
        return (
            max(map(cell_len, [*unbreakable, *column.name.split(), ""])),
            max(cell_len(word) for text in [*cell_texts, column.name] for word in (text.splitlines() or [""])),
        )

    def _blocks(self, terminal_width: int) -> list[list[int]]:
        blocks, used_width = [[0]], self._least_widths[0]
        for k in range(1, len(self.table.columns)):
            used_width += COLUMN_GAP + self._least_widths[k]
            if used_width > terminal_width and len(blocks[-1]) > 1:
                blocks.append([0])
                used_width = self._least_widths[0] + COLUMN_GAP + self._least_widths[k]
            blocks[-1].append(k)
        return blocks

    def _rich_table(self, block: list[int], terminal_width: int) -> RichTable:
        rich_table = RichTable(
            box=box.SIMPLE_HEAD,
            header_style="dim",
            pad_edge=False,
            collapse_padding=True,
            show_edge=False,
        )
        spare_width = terminal_width - COLUMN_GAP * (len(block) - 1) - sum(self._least_widths[k] for k in block)
        widths = {}
        # Those who want least come first, so that what they leave goes to the long sentences.
        for column_number, k in enumerate(
            sorted(block, key=lambda k: self._greatest_widths[k] - self._least_widths[k])
        ):
            extra_width = min(
                self._greatest_widths[k] - self._least_widths[k], max(0, spare_width) // (len(block) - column_number)
            )
            widths[k], spare_width = self._least_widths[k] + extra_width, spare_width - extra_width
        if spare_width < 0:
            widths[block[-1]] = max(1, widths[block[-1]] + spare_width)
        for k in block:
            column = self.table.columns[k]
            side = "left" if column.words else "right"
            rich_table.add_column(column.name, justify=side, width=widths[k], overflow="fold")  # type: ignore[arg-type]
        for row in zip(*(self._cells[k] for k in block), strict=True):
            rich_table.add_row(*row)
        return rich_table


def _cell(cell: Cell, column: Column) -> Text:
    if cell == 0:
        return Text("0", style="dim")
    mark = cell.mark if isinstance(cell, Marked) and cell.mark else column.mark
    text = Text(text_of(cell), style=MARK_STYLES[mark])
    if isinstance(cell, Marked) and cell.below:
        text.append(f"\n{safe_text(cell.below)}", style="dim")
    return text
