"""A table as plain data. It is built once; terminal, page and picture each render it in their own way.

The renderers are ``replay.cli.terminal`` (rich), ``replay.outputs.report.markup`` (HTML) and ``markdown`` here.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

from replay.base.shown import shown

STRONG, FAINT = "strong", "faint"
IN_RED, PARTLY, FOUND, INVENTED = "missed", "partly", "found", "invented"
WARNING, ERROR, GOOD = "warning", "error", "good"
"""Marks: what a cell means. Each renderer decides how that looks, or ignores it."""


@dataclass(frozen=True)
class Marked:
    """A cell with emphasis; ``below`` is a lesser remark under it; on a page a link ``to`` an address."""

    text: str
    mark: str = ""
    below: str = ""
    to: str = ""


Cell = str | int | None | Marked
Row = tuple[Cell, ...]


@dataclass(frozen=True)
class Column:
    """One column: left-aligned ``words``, or numbers; ``mark`` is the mark of its cells that are neither 0 nor empty.

    ``whole`` cells are not broken over lines.
    """

    name: str
    words: bool = False
    mark: str = ""
    whole: bool = False


@dataclass(frozen=True)
class Table:
    """Title, columns, rows; ``notes`` below them, a sentence each."""

    title: str
    columns: tuple[Column, ...]
    rows: tuple[Row, ...]
    notes: tuple[str, ...] = ()

    def only(self, *names: str) -> "Table":
        """The columns of these names, in this order; a name without a column is left out."""
        place = {column.name: k for k, column in enumerate(self.columns)}
        chosen = [place[name] for name in names if name in place]
        rows = tuple(tuple(row[k] for k in chosen) for row in self.rows)
        return replace(self, columns=tuple(self.columns[k] for k in chosen), rows=rows)

    def beside(self, name: str, words: Sequence[str]) -> "Table":
        """With a column of words in front."""
        rows = tuple((word, *row) for word, row in zip(words, self.rows, strict=True))
        return replace(self, columns=(Column(name, True), *self.columns), rows=rows)

    def first(self, most: int, more: str) -> "Table":
        """The first rows; where there are others, a note says how many: ``more`` with their number in its braces."""
        rest = len(self.rows) - most
        return self if rest <= 0 else replace(self, rows=self.rows[:most], notes=(*self.notes, more.format(rest)))

    def headed(self, heads: Mapping[str, str]) -> "Table":
        """The same table with other words above the columns of these names."""
        columns = (replace(column, name=heads.get(column.name, column.name)) for column in self.columns)
        return replace(self, columns=tuple(columns))

    def titled(self, title: str, *notes: str) -> "Table":
        """The same table below another title, with further notes."""
        return replace(self, title=title, notes=(*self.notes, *notes))


NO_MARKS: Final[Mapping[str, str]] = {}


def table(
    title: str,
    head: Sequence[str],
    rows: Iterable[Sequence[Any]],
    *,
    words: int | Sequence[str] = 1,
    whole: Sequence[str] | None = None,
    marks: Mapping[str, str] = NO_MARKS,
    notes: Sequence[str] = (),
) -> Table:
    """A table.

    ``words`` are names of the columns of words, or how many come first; ``whole`` names the columns that are never
    broken over lines, the first one if nothing is said; ``marks`` is column -> mark.
    """
    worded = set(head[:words] if isinstance(words, int) else words)
    unbroken = set(head[:1] if whole is None else whole)
    columns = tuple(Column(name, name in worded, marks.get(name, ""), name in unbroken) for name in head)
    return Table(title, columns, tuple(tuple(row) for row in rows), tuple(notes))


def text_of(cell: Cell) -> str:
    """A cell as plain text; numbers with separators of thousands."""
    if isinstance(cell, Marked):
        return shown(cell.text)
    return "" if cell is None else f"{cell:,}" if isinstance(cell, int) else shown(cell)


MARKDOWN_MARKS: Final = {STRONG: "**"}


def markdown(table: Table, level: int = 0) -> str:
    """A table below its title, a heading of this level; without a level there is no title."""
    heading = [f"{'#' * level} {table.title}", ""] if level else []
    lines = [_line([column.name for column in table.columns]), "|---" * len(table.columns) + "|"]
    lines += [_line([_cell(cell) for cell in row]) for row in table.rows]
    notes = [line for note in table.notes for line in ("", note)]
    return "\n".join([*heading, *lines, *notes])


def markdown_words(text: str) -> str:
    """Words of a recording as they may stand in Markdown: no tag, link or picture comes of a name."""
    return re.sub(r"<|(?<=\])\(", r"\\\g<0>", shown(text))


def _line(cells: list[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _cell(cell: Cell) -> str:
    around = MARKDOWN_MARKS.get(cell.mark, "") if isinstance(cell, Marked) else ""
    words = text_of(cell) if around else markdown_words(text_of(cell))
    return around + words.replace("|", "\\|") + around
