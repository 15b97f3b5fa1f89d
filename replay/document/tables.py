"""A table over raw values: Parquet and JSON carry them as they are; a screen shows columns as people read them.

The renderers are ``replay.cli.terminal`` (rich), ``parts.html`` in ``replay.show.report`` and ``markdown`` here.
"""

import re
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cached_property
from importlib.resources import files
from typing import TYPE_CHECKING, Any, Final

from replay.words import safe_text

if TYPE_CHECKING:
    import pyarrow as pa


class Output(StrEnum):
    """The two kinds of output of a table, where a column is in one of them alone."""

    SCREENS = "screens"
    """Terminal, Markdown, report, notebook and picture."""
    FILES = "files"
    """Parquet, CSV, Excel and JSON."""


class Holds(StrEnum):
    """Things that the values of a column refer to: a reader of a run folder checks them."""

    DETECTOR = "detector"
    """Labels of detectors of the run."""
    BODY = "body"
    """Names of bodies of the session."""
    FRAME = "frame"
    """Frames of the session, from 0."""
    NUMBER = "number"
    """Numbers of contacts and faults, from 1."""


STRONG, FAINT = "strong", "faint"
IN_RED, PARTLY, IN_BLUE, IN_YELLOW = "missed", "partly", "found", "invented"
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


@dataclass(frozen=True)
class Column:
    """One column: what a row has there, and how people read it. A value that nobody measured is ``None``.

    Numbers are right-aligned, even where a cell is shown in words; ``whole`` cells are not broken over lines.
    """

    name: str
    dtype: type = str
    meaning: str = ""
    of: str | Callable[[Any], Any] = ""  # where a row has it: attributes, keys and places with dots; ``""``: its name
    unit: str = ""  # of the values in files
    show: Callable[[Any], Cell] | str = ""  # what people read of a value, or its format: ``.3f``
    mark: str = ""  # of cells that are neither 0 nor empty
    whole: bool = False
    head: str | None = None  # shorter name above a column of a terminal; ``None``: its name
    short: str = ""  # shorter name in a picture; ``""``: its name
    wide: bool = False  # shown only where all columns find room
    names_row: bool = False  # whether it says what a row is about, rather than a value
    only: Output | None = None  # the outputs that have it; ``None``: all
    stored: str = ""  # its name in files; ``""``: its name in lower case, without blanks
    number: Callable[[Any], float | None] | str = ""  # of a row: its number in files; ``""``: the value itself
    scale: float = 1.0  # multiplies a value in files, where the name has another unit: 1000 of seconds in a ``ms``
    empty_is_null: bool = False  # whether an empty text says that there is no value
    required: bool = False  # whether every row of a file has it
    holds: Holds | None = None  # what its values refer to

    @property
    def words(self) -> bool:
        """Whether it is aligned as words are."""
        return self.dtype not in (int, float)

    def value(self, record: Any) -> Any:
        """Value of a row in this column; ``None`` if a step of the path is ``None`` or the value is NaN."""
        if callable(self.of):
            return self.of(record)
        current = record
        for path_step in (self.of or self.name).split("."):
            if current is None:
                return None
            if isinstance(current, Mapping):
                current = current[path_step]
            else:
                current = current[int(path_step)] if path_step.isdigit() else getattr(current, path_step)
        if current != current or (self.empty_is_null and current == ""):
            return None
        return current

    @cached_property
    def for_files(self) -> "Column":
        """The column as files have it: a name without spaces, numbers, and texts."""
        name = self.stored or self.name.lower().replace("%", "percent").replace(" ", "_")
        if self.number:
            return replace(self, name=name, of=self.number, dtype=float, show="")
        if self.dtype is str and self.show:
            return replace(self, name=name, of=self._text, show="")
        if self.scale != 1.0:
            return replace(self, name=name, of=self._scaled, show="")
        return replace(self, name=name, of=self.of or self.name, show="")

    def _text(self, record: Any) -> str | None:
        value = self.value(record)
        return None if value is None else text_of(self.cell(value))

    def _scaled(self, record: Any) -> float | None:
        value = self.value(record)
        return None if value is None else self.scale * value

    def cell(self, value: Any) -> Cell:
        """A value as people read it; ``None`` as nothing."""
        if callable(self.show):
            return self.show(value)
        if self.show and value is not None:
            return f"{value:{self.show}}"
        return value if value is None or isinstance(value, int | Marked) else str(value)


NO_HEADS: Final[Mapping[str, str]] = {}

ARROW_TYPES: Final[Mapping[type, str]] = {str: "string", int: "int64", float: "float64", bool: "bool"}
"""Type of Python -> type of a column of Arrow; every column may hold null."""


@dataclass(frozen=True)
class Table:
    """Columns, the values of each row below them, and ``notes`` at the end, a sentence each."""

    columns: tuple[Column, ...]
    rows: tuple[tuple[Any, ...], ...]
    title: str = ""
    notes: tuple[str, ...] = ()
    key: str = ""  # a short name, where it is one of several

    @staticmethod
    def of(columns: Iterable[Column], rows: Iterable[Any], title: str = "", notes: Iterable[str] = ()) -> "Table":
        """Every column of every row."""
        column_tuple = tuple(columns)
        return Table(
            column_tuple,
            tuple(tuple(column.value(row) for column in column_tuple) for row in rows),
            title,
            tuple(notes),
        )

    @property
    def head(self) -> list[str]:
        """Names of the columns."""
        return [column.name for column in self.columns]

    def column(self, name: str) -> list[Any]:
        """The values below a name."""
        index = self.head.index(name)
        return [row[index] for row in self.rows]

    def where(self, **values: Any) -> "Table":
        """The rows with these values."""
        indices = {self.head.index(name): value for name, value in values.items()}
        rows = (row for row in self.rows if all(row[index] == value for index, value in indices.items()))
        return replace(self, rows=tuple(rows))

    def only(self, *names: str, heads: Mapping[str, str] = NO_HEADS) -> "Table":
        """The columns of these names, in this order, some below other words; one that is not there is left out."""
        index = {name: k for k, name in enumerate(self.head)}
        column_indices = [index[name] for name in names if name in index]
        columns = (
            replace(self.columns[k], name=heads.get(self.columns[k].name, self.columns[k].name)) for k in column_indices
        )
        return replace(
            self, columns=tuple(columns), rows=tuple(tuple(row[k] for k in column_indices) for row in self.rows)
        )

    def narrow(self) -> "Table":
        """The columns that find room on every screen."""
        return self.only(*(column.name for column in self.columns if not column.wide))

    def with_heads(self) -> "Table":
        """The same columns below their shorter names."""
        return replace(
            self,
            columns=tuple(
                replace(column, name=column.name if column.head is None else column.head) for column in self.columns
            ),
        )

    def values(self) -> "Table":
        """The columns that do not say what a row is about."""
        return self.only(*(column.name for column in self.columns if not column.names_row))

    def first(self, most: int, more: str) -> "Table":
        """The first rows; where there are others, a note says how many: ``more`` with their number in its braces."""
        hidden_rows = len(self.rows) - most
        return (
            self
            if hidden_rows <= 0
            else replace(self, rows=self.rows[:most], notes=(*self.notes, more.format(hidden_rows)))
        )

    def cells(self) -> list[tuple[Cell, ...]]:
        """The rows as people read them."""
        return [tuple(column.cell(value) for column, value in zip(self.columns, row, strict=True)) for row in self.rows]

    def plain(self) -> list[dict[str, Any]]:
        """The rows as JSON has them, column -> value."""
        return [dict(zip(self.head, row, strict=True)) for row in self.rows]

    def to_arrow(self) -> "pa.Table":
        """All columns, each of its type."""
        import pyarrow as pa

        # Not by rows as JSON has them: 68,000 contacts of two hours would take 80 MB for a moment.
        values = {column.name: [row[k] for row in self.rows] for k, column in enumerate(self.columns)}
        kinds = types_of(self.columns)
        return pa.table(
            {name: pa.array(column_values, ARROW_TYPES[kinds[name]]) for name, column_values in values.items()}
        )

    def to_pandas(self) -> Any:
        """All columns as a data frame; needs pandas."""
        return self.to_arrow().to_pandas()


def package_toml(file_name: str) -> dict[str, Any]:
    """Contents of a TOML file of this package."""
    return tomllib.loads(files("replay").joinpath(file_name).read_text(encoding="utf-8"))


def columns_of(
    file_name: str, extra_functions: Mapping[str, Callable[[Any], Any]] | None = None
) -> dict[str, tuple[Column, ...]]:
    """Lists of columns, declared in a TOML file of this package; a word stands for the columns of a list above it.

    ``extra_functions`` are the functions that ``show`` and ``number`` name there, and ``of`` where it ends in ``_of``:
    a row may have a value of the same name.
    """
    columns_of_list: dict[str, tuple[Column, ...]] = {}
    functions = dict(extra_functions or {})
    functions_of_rows = {name: function for name, function in functions.items() if name.endswith("_of")}
    type_of_name = {kind.__name__: kind for kind in ARROW_TYPES}
    rows_of_list = {name: rows for name, rows in package_toml(file_name).items() if isinstance(rows, list)}
    for name, rows in rows_of_list.items():
        columns: list[Column] = []
        for row in rows:
            if isinstance(row, str):
                columns.extend(columns_of_list[row])
                continue
            row["dtype"] = type_of_name[row.get("dtype", "str")]
            row |= {key: kind(row[key]) for key, kind in (("only", Output), ("holds", Holds)) if key in row}
            row |= {key: functions.get(row[key], row[key]) for key in ("show", "number") if key in row}
            row |= {"of": functions_of_rows.get(row.get("of", ""), row.get("of", ""))}
            columns.append(Column(**row))
        columns_of_list[name] = tuple(columns)
    return columns_of_list


def types_of(columns: Iterable[Column]) -> dict[str, type]:
    """Column -> type."""
    return {column.name: column.dtype for column in columns}


NO_MARKS: Final[Mapping[str, str]] = {}


def table(
    title: str,
    column_names: Sequence[str],
    cell_rows: Iterable[Sequence[Any]],
    *,
    words: int | Sequence[str] = 1,
    marks: Mapping[str, str] = NO_MARKS,
    notes: Iterable[str] = (),
) -> Table:
    """A table of cells as people read them.

    ``words`` are names of the columns of words, or how many come first; the first column is never broken over lines;
    ``marks`` is column -> mark.
    """
    text_column_names = column_names[:words] if isinstance(words, int) else words
    columns = (
        Column(
            name, str if name in text_column_names else float, mark=marks.get(name, ""), whole=name == column_names[0]
        )
        for name in column_names
    )
    return Table(tuple(columns), tuple(tuple(row) for row in cell_rows), title, tuple(notes))


def text_of(cell: Cell) -> str:
    """A cell as plain text; numbers with separators of thousands."""
    if isinstance(cell, Marked):
        return safe_text(cell.text)
    return "" if cell is None else f"{cell:,}" if isinstance(cell, int) else safe_text(cell)


MARKDOWN_MARKS: Final = {STRONG: "**"}


def markdown(table: Table, level: int = 0) -> str:
    """A table below its title, a heading of this level; without a level there is no title."""
    heading = [f"{'#' * level} {table.title}", ""] if level else []
    lines = [_line(table.head), "|---" * len(table.columns) + "|"]
    lines += [_line([_cell(cell) for cell in row]) for row in table.cells()]
    notes = [line for note in table.notes for line in ("", note)]
    return "\n".join([*heading, *lines, *notes])


def markdown_text(text: str) -> str:
    """Words of a recording as they may stand in Markdown: no tag, link or picture comes of a name."""
    return re.sub(r"<|(?<=\])\(", r"\\\g<0>", safe_text(text))


def _line(cell_texts: list[str]) -> str:
    return f"| {' | '.join(cell_texts)} |"


def _cell(cell: Cell) -> str:
    markdown_mark = MARKDOWN_MARKS.get(cell.mark, "") if isinstance(cell, Marked) else ""
    text = text_of(cell) if markdown_mark else markdown_text(text_of(cell))
    return markdown_mark + text.replace("|", "\\|") + markdown_mark
