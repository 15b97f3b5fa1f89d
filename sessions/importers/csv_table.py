"""A CSV as typed columns: stamps are exact to the last digit, and an error names line and column.

Rows that are not as long as the header are left out and counted; a file with commas between its cells and in its
numbers is refused. A table ends where, below an empty line, the title of another one begins.
"""

import csv
import io
import json
import re
from collections.abc import Iterator, Sequence
from contextlib import suppress
from decimal import Decimal, InvalidOperation
from itertools import islice, zip_longest
from pathlib import Path
from typing import Any, Final

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv
from numpy.typing import NDArray

from sessions.errors import ImportFileError
from sessions.importers.csv_columns_and_units import (
    CLOCK_NS,
    TEXT,
    VOCABULARY,
    CsvLayout,
    PoseColumns,
    is_row_of_units,
    unit_in_cell,
    unit_in_name,
)
from sessions.importers.csv_missing import EMPTY_CELLS, SENTINELS, sentinel_size
from sessions.importers.importing import PoseTable
from sessions.importers.ledger import Ledger, Numbers, Rows, Stamps
from sessions.importers.wall_clock import past_midnight, wall_clock_ns
from sessions.input_files import nearest, read_utf8_lines

TICKS_1970: Final = 621_355_968_000_000_000  # .NET ticks (100 ns since the year 1) at the Unix epoch
LONGEST_LINE: Final = 1_000_000  # Letters of a line that are read; a header of 12 bodies has a thousand
BLOCK_BYTES: Final = 1 << 22  # Of text that becomes columns at once; no row is longer
MOST_TITLES: Final = 8  # Titles of tables that an error names
NAMED_COLUMNS: Final = 12  # Columns that a note names
RAGGED: Final = "with too few or too many cells"
HEADER_AGAIN: Final = "that repeat the header"
SEPARATOR: Final = re.compile('"?sep=(.)"?', re.IGNORECASE)
"""The line that Excel begins a CSV with to say what stands between its cells."""
NUMBER: Final = re.compile(r"[-+]?(\d+[.,]?\d*|[.,]\d+)([eE][-+]?\d+)?|nan|NaN")
DECIMAL_POINT: Final = re.compile(r"-?[0-9]*\.[0-9]+")
GROUPS: Final = re.compile("[-+]?[0-9]{1,3}([.,'’ ][0-9]{3})+([.,][0-9]*)?")
"""A number with separators between groups of three digits."""
THOUSANDS: Final = "^[-+]?[1-9][0-9]{0,2}([.][0-9]{3})+$"
"""A number whose points may part thousands."""
EMPTY_LINE: Final = re.compile(rb"\n[ \t]*\r?\n")
SPACES: Final = re.compile(rb"[ \t]+")
ENDS_OF_LINES: Final = re.compile(rb"^ | (?=\r?$)", re.MULTILINE)
DECIMALS: Final = {"s": 9, "ms": 6, "us": 3, "ns": 0, "ticks": 0}
"""Unit of a clock -> digits behind the point that reach to the nanosecond, or to the tick."""
LARGEST: Final = 9_000_000_000_000_000_000
"""Nanoseconds that fit 64 bits with room for an offset."""


class CsvTable:
    """The cells of one file; every column is text until it is asked for, for all rows or those of a mask (n,).

    Rows that cannot be read are dropped in the account of ``rows`` of ``body``. Errors name keys of the mapping where
    the file is ``mapped``.
    """

    def __init__(
        self, source: Path, ledger: Ledger, layout: CsvLayout, *, mapped: bool = False, body: str = ""
    ) -> None:
        self.source, self._layout, self._mapped = source, layout, mapped
        self._units = dict[str, str]()
        self._has_other_table = False
        self._times_of_day = dict[str, Stamps]()
        self._passes_midnight = False
        self._sentinel_columns = dict[float, list[str]]()
        try:
            text = self._below_head(read_utf8_lines(source))
        except (UnicodeDecodeError, csv.Error) as error:
            raise ImportFileError(f"{source}: this is no CSV text in UTF-8 ({error}); save it as UTF-8") from None
        self._text, below = self._split_tables(text)
        self._ragged_rows, self._widest_ragged = 0, 0
        """How many rows are not as long as the header, and most cells of such a row."""
        self._has_decimal_commas = False
        self._table = self._parse_rows(self._text)
        self._check_ragged()
        repeated = self._drop_repeated_headers()
        dropped = {RAGGED: self._ragged_rows, **below}
        lost = sum(dropped.values())
        ledger.book("rows", body, read=lost + repeated, kept=0, dropped=dropped, merged={HEADER_AGAIN: repeated})
        self._is_cut_short = self._last_row_is_whole() and not self._text.endswith((b"\n", b"\r"))
        """Whether the last number of the last row may lack digits."""

    def _below_head(self, text: bytes) -> bytes:
        """Take in the header; the text of the rows below it."""
        layout = self._layout
        text, lines_above = self._below_title(text)
        stream, skip_lines = io.BytesIO(text), layout.skip_lines
        if not skip_lines and excel_separator(text[:20].partition(b"\n")[0].decode("utf-8", errors="replace")):
            skip_lines = 1
        lines = iter(lambda: stream.readline(LONGEST_LINE).decode("utf-8"), "")
        for _ in islice(lines, skip_lines):
            pass
        header_lines = 0 if layout.columns else layout.header_lines
        self._above = lines_above + skip_lines + header_lines
        if layout.columns:
            heads = [list(layout.columns)]
        elif layout.delimiter == " ":
            heads = split_lines(list(islice(lines, header_lines)), " ")
        else:
            heads = list(islice(csv.reader(lines, delimiter=layout.delimiter), header_lines))
        if not any(map(any, heads)):
            raise ImportFileError(f"{self.source}: the file is empty; there is no header in line {self._above}")
        self._name_columns(heads)
        start = stream.tell()
        units = split_lines([stream.readline(LONGEST_LINE).decode("utf-8")], layout.delimiter)
        if not layout.columns and units and len(units[0]) == len(self.columns) and is_row_of_units(units[0]):
            self._above += 1
            self._units = dict(zip(self.columns, units[0], strict=True))
            start = stream.tell()
        rows = text[start:]
        if not layout.columns and units and self._lacks_last_name(units[0]):
            self._add_unnamed_column()
        if layout.delimiter == " ":
            return ENDS_OF_LINES.sub(b"", SPACES.sub(b" ", rows))
        return rows

    def _below_title(self, text: bytes) -> tuple[bytes, int]:
        """The text below the title of the table to read, and how many lines are above it; without a title all of it."""
        if not self._layout.table:
            return text, 0
        titles = []
        lines = text.splitlines(keepends=True)
        for number, line in enumerate(lines, start=1):
            title = self._title_in(line)
            if title == self._layout.table:
                return b"".join(lines[number:]), number
            titles += [title] if title else []
        named = ", ".join(repr(title[:40]) for title in titles[:MOST_TITLES]) or "none"
        raise ImportFileError(f"{self.source}: no table {self._layout.table!r}; there are: {named}")

    def _title_in(self, line: bytes) -> str:
        """The title of a table that a line is: a first cell that is no number, and no other; else nothing."""
        cells = [cell for row in split_lines([line.decode("utf-8")], self._layout.delimiter) for cell in row]
        is_alone = bool(cells) and not any(cells[1:])
        return cells[0] if is_alone and not NUMBER.fullmatch(cells[0]) else ""

    def stated_unit(self, column: str) -> str:
        """The unit that a name or the row of units states; nothing where a mapping names the columns."""
        return "" if self._layout.columns else unit_in_name(column) or self.unit(column)

    def unit(self, column: str) -> str:
        """The unit that the row of units gives a column, as a mapping writes it, or nothing."""
        return unit_in_cell(self._units.get(column, ""))

    def _name_columns(self, heads: list[list[str]]) -> None:
        cells = [[word.strip() for word in column] for column in zip_longest(*heads, fillvalue="")]
        self.heads = list(map(list, zip(*cells, strict=True)))
        names = [" ".join(filter(None, column)) for column in cells]
        repeated = sorted(name for name in {*names} if names.count(name) > 1)
        if repeated and len(heads) < 2:
            raise ImportFileError(
                f"{self.source}: line {self._above}: column {repeated[0]!r} occurs twice; rename one, or name the "
                "columns by several lines: header_lines in a mapping"
            )
        names = [f"{name} (column {at})" if name in repeated else name for at, name in enumerate(names, start=1)]
        self.columns = tuple(names)

    def _lacks_last_name(self, row: Sequence[str]) -> bool:
        """Whether a delimiter stands behind the last cell of a row, but not behind the header."""
        return len(row) == len(self.columns) + 1 and bool(self.columns[-1]) and ends_empty(row)

    def _add_unnamed_column(self) -> None:
        self.columns = (*self.columns, "")
        self.heads = [[*head, ""] for head in self.heads]

    def _split_tables(self, text: bytes) -> tuple[bytes, dict[str, int]]:
        """The rows of the first table, and how many lines of another one stand below it, by the reason to leave them.

        Another table begins with its title: a line of one cell that is no number, below an empty line. Where the
        mapping names the table to read, its user left the others out, and none is counted.
        """
        if len(self.columns) < 2:
            return text, {}
        for gap in EMPTY_LINE.finditer(text):
            title, _, _ = text[gap.end() : gap.end() + LONGEST_LINE].partition(b"\n")
            name = self._title_in(title)
            if name and self._layout.table:
                return text[: gap.start() + 1], {}
            if name:
                self._has_other_table = True
                line = self._above + 1 + text.count(b"\n", 0, gap.end())
                lines = sum(1 for row in text[gap.end() :].splitlines() if row.strip())
                return text[: gap.start() + 1], {f"of another table, {name[:40]!r}, from line {line}": lines}
        return text, {}

    def _parse_rows(self, text: bytes) -> Any:
        """The rows that are as long as the header, as Arrow text."""
        schema = pa.schema([(name, pa.string()) for name in self.columns])
        if not text or text.isspace():
            return schema.empty_table()
        try:
            return pa.csv.read_csv(
                pa.BufferReader(text),
                # Threads would read blocks out of order, and a row would have no number.
                read_options=pa.csv.ReadOptions(use_threads=False, column_names=self.columns, block_size=BLOCK_BYTES),
                parse_options=pa.csv.ParseOptions(
                    delimiter=self._layout.delimiter,
                    newlines_in_values=b'"' in text,
                    invalid_row_handler=self._note_ragged,
                ),
                convert_options=pa.csv.ConvertOptions(
                    column_types=schema, strings_can_be_null=False, quoted_strings_can_be_null=False
                ),
            )
        except pa.ArrowInvalid as error:
            why = str(error).splitlines()[0][:100]
            raise ImportFileError(f"{self.source}: this is no CSV text ({why}); repair or export it again") from None

    def _note_ragged(self, row: Any) -> str:
        """Leave out a row that is not as long as the header."""
        self._ragged_rows += 1
        self._widest_ragged = max(self._widest_ragged, row.actual_columns)
        if not self._has_decimal_commas and self._layout.delimiter == ",":
            self._has_decimal_commas = has_decimal_commas(row.text, len(self.columns))
        return "skip"

    def _check_ragged(self) -> None:
        """Refuse a file whose rows show commas in numbers, or most of whose rows have too many cells."""
        width = len(self.columns)
        where = f"{self.source}: rows have more cells than line {self._above}, which has {width}"
        if self._has_decimal_commas:
            line, cells = next(
                (line, len(row)) for line, row in self._rows_with_lines() if has_decimal_commas(",".join(row), width)
            )
            raise ImportFileError(
                f"{self.source}: line {line} has {cells} cells, the header {width}: commas are between the cells and "
                "in the numbers; export numbers with decimal points, or semicolons between the cells"
            )
        if len(self._table) < self._ragged_rows and 1 < width < self._widest_ragged:
            cure = "give every cell of a row a column in that line"
            cure = "check delimiter and skip_lines of the mapping" if self._mapped else cure
            raise ImportFileError(f"{where}; {cure}")

    def _drop_repeated_headers(self) -> int:
        """Leave out rows that are the header again, as where files were put together; how many they were."""
        header = list(self.heads[-1])
        if self._layout.columns or not len(self._table):
            return 0
        again = pc.equal(self._table.column(0), text_scalar(header[0]))
        if not pc.any(again).as_py():
            return 0
        for index, word in enumerate(header):
            again = pc.and_(again, pc.equal(pc.utf8_trim_whitespace(self._table.column(index)), text_scalar(word)))
        self._kept_rows = np.flatnonzero(~bool_values(again))
        self._table = self._table.filter(pc.invert(again))
        return int(pc.sum(again).as_py() or 0)

    _kept_rows: Any = None
    """Numbers of the rows that are no header, (n,), where some are."""

    def _last_row_is_whole(self) -> bool:
        rows = self._text.rstrip(b"\r\n")
        line = rows[rows.rfind(b"\n") + 1 :].decode("utf-8")
        with suppress(csv.Error):
            return [len(row) for row in csv.reader([line], delimiter=self._layout.delimiter)] == [len(self.columns)]
        return False

    def _rows_with_lines(self) -> Iterator[tuple[int, list[str]]]:
        """Every row that is not empty, and the line that it ends in."""
        text = io.TextIOWrapper(io.BytesIO(self._text), encoding="utf-8", newline="")
        reader = csv.reader(text, delimiter=self._layout.delimiter)
        for row in reader:
            if row:
                yield self._above + reader.line_num, row

    @property
    def notes(self) -> list[str]:
        """Irregularities of the rows, a sentence each."""
        notes = []
        if self._is_cut_short:
            notes.append("the last line has no line break and may be cut short: its pose is flagged as lost")
        if self._has_other_table:
            notes.append('of several tables the first is read; the mapping may name one: table = "TITLE"')
        if self._passes_midnight:
            notes.append("the time of day passes midnight, and goes on in the next day")
        for sentinel, columns in self._sentinel_columns.items():
            more = " and others" if len(columns) > NAMED_COLUMNS else ""
            notes.append(f"{sentinel:g} counts as a missing number in {', '.join(columns[:NAMED_COLUMNS])}{more}")
        return notes

    def __len__(self) -> int:
        return len(self._table)

    def _cells(self, column: str, rows: Rows | None = None) -> Any:
        """The cells of a column as Arrow text, without spaces around it."""
        if column not in self.columns:
            where = f"{self.source}: line {self._above}: no column {column!r}"
            if len(self.columns) == 1 and (other := [letter for letter in ",;\t|" if letter in self.columns[0]]):
                raise ImportFileError(
                    f"{where}, for nothing stands between {self._layout.delimiter!r}; "
                    f"write delimiter = {json.dumps(other[0])} into the mapping"
                )
            raise ImportFileError(f"{where}{nearest(column, self.columns)}")
        cells = self._table.column(column)
        return pc.utf8_trim_whitespace(cells if rows is None else cells.filter(bool_array(rows)))

    def texts(self, column: str, rows: Rows | None = None) -> list[str]:
        """The cells of a column as text, without spaces around it."""
        texts: list[str] = self._cells(column, rows).to_pylist()
        return texts

    def rows_by_text(self, column: str, rows: Rows | None = None) -> dict[str, Rows]:
        """The different texts of a column, in the order they come in, and the rows of each, (n,)."""
        cells = self._cells(column)
        rows_of = {}
        for word in self._cells(column, rows).unique().to_pylist():
            has = bool_values(pc.equal(cells, text_scalar(word)))
            rows_of[word] = has if rows is None else has & rows
        return rows_of

    def first_text(self, column: str) -> str:
        """The first cell of a column that is not empty, or nothing."""
        return next(filter(None, self._cells(column).unique().to_pylist()), "")

    def distinct_rows(self) -> Rows:
        """Mask (n,) of the rows that no earlier row equals in all cells."""
        texts = pc.binary_join_element_wise(*self._table.columns, text_scalar("\0")).combine_chunks()
        codes = np.from_dlpack(texts.dictionary_encode().indices)
        is_first = np.zeros(len(self), dtype=np.bool_)
        is_first[np.unique(codes, return_index=True)[1]] = True
        return is_first

    def count_different(self, column: str) -> int:
        """How many different texts a column holds."""
        return int(pc.count_distinct(self._cells(column)).as_py())

    def numbers(self, columns: Sequence[str], rows: Rows | None = None) -> Numbers:
        """The cells of some columns as float64, (n, columns); an empty cell is NaN."""
        return np.column_stack([self._floats(column, rows) for column in columns])

    def measurements(self, columns: Sequence[str], rows: Rows | None = None) -> Numbers:
        """The numbers of some columns, (n, columns), in which a number that stands for missing ones is NaN."""
        numbers = self.numbers(columns, rows)
        for column, values in zip(columns, numbers.T, strict=True):
            is_sentinel = np.abs(values) == sentinel_size(values)
            for sentinel in sorted({*values[is_sentinel].tolist()}):
                named = self._sentinel_columns.setdefault(sentinel, [])
                named += [] if column in named else [column]
            values[is_sentinel] = np.nan
        return numbers

    def holds_numbers(self, column: str) -> bool:
        """Whether every cell of a column is a number or empty, and one is a number."""
        try:
            return bool(np.isfinite(self._floats(column)).any())
        except ImportFileError:
            return False

    def _number_cells(self, column: str, rows: Rows | None) -> Any:
        """The cells of a column with decimal points, null where one says that there is no number."""
        cells = self._cells(column, rows)
        if self._layout.decimal != ".":
            self._refuse_two_decimals(column, cells, rows)
            cells = pc.replace_substring(cells, self._layout.decimal, ".")
        return pc.if_else(pc.is_in(cells, EMPTY_TEXTS), NO_TEXT, cells)

    def _floats(self, column: str, rows: Rows | None = None) -> Numbers:
        cells = self._number_cells(column, rows)
        with suppress(pa.ArrowInvalid):
            return float_values(cells)
        values = []
        for row, cell in enumerate(pc.fill_null(cells, text_scalar("nan")).to_pylist()):
            try:
                values.append(_number(cell))
            except ValueError:
                text = self.texts(column, rows)[row]
                message = f"{text[:40]!r} is no number; {self._cure_of_number(text)}"
                raise self._cell_error(column, rows, row, message) from None
        return np.array(values)

    def _cure_of_number(self, text: str) -> str:
        """Returns the cure of a cell that is no number."""
        if text in self.columns:
            return "the line names columns again, in another order; split the file there"
        separators = re.findall("[.,'’ ]", text)
        if GROUPS.fullmatch(text) and (len(separators) > 1 or separators[0] not in ".,"):
            return "export numbers without separators of thousands"
        if text.count(",") != 1:
            return "repair the cell"
        return 'write decimal = "," into the mapping' if self._mapped else "export it with decimal points"

    def _refuse_two_decimals(self, column: str, cells: Any, rows: Rows | None) -> None:
        """Refuse decimal commas beside points, and points alone that may part thousands, as in ``1.500``."""
        has_point = bool_values(pc.match_substring(cells, "."))
        if not has_point.any():
            return
        row = int(has_point.argmax())
        text = self.texts(column, rows)[row]
        if pc.any(pc.match_substring(cells, self._layout.decimal)).as_py():
            message = f"{text[:40]!r} has a point, and other cells of the column decimal commas; export one of them"
            raise self._cell_error(column, rows, row, message)
        may_be_grouped = pc.match_substring_regex(cells, THOUSANDS)
        if bool_values(may_be_grouped)[has_point].all():
            message = f"{text[:40]!r} is of two readings where decimals have commas; export it without a point"
            raise self._cell_error(column, rows, row, message)

    def _cell_error(self, column: str, rows: Rows | None, index: int, message: str) -> ImportFileError:
        """The error of a cell, by its index among some rows."""
        row = index if rows is None else int(np.flatnonzero(rows)[index])
        row = row if self._kept_rows is None else int(self._kept_rows[row])
        whole = (line for line, cells in self._rows_with_lines() if len(cells) == len(self.columns))
        return ImportFileError(
            f"{self.source}: line {next(islice(whole, row, None), '?')}, column {column!r}: {message}"
        )

    def stamps(self, column: str, unit: str, rows: Rows | None = None, *, form: str = "") -> Stamps:
        """The clock as int64 nanoseconds, (n,); without a column it is that of the rows' rate.

        ``form``: the format of a clock in text, where that is not the layout's.
        """
        offset_ns = self._layout.offset_ns
        if not column:
            clock = np.rint(np.arange(len(self)) * (1e9 / self._layout.rate_hz)).astype(np.int64) + offset_ns
            return clock if rows is None else clock[rows]
        if unit == TEXT:
            return self._wall_clock(column, rows, form or self._layout.format) + offset_ns
        cells = self._number_cells(column, rows)
        stamps = _exact_stamps(cells, unit)
        if stamps is None:
            stamps = self._rounded_stamps(column, unit, rows)
        stamps = stamps + offset_ns
        if len(stamps) and stamps.min() < 0:
            row = int(stamps.argmin())
            cell = self.texts(column, rows)[row][:40]
            if float(cell.replace(self._layout.decimal, ".")) in SENTINELS:
                raise self._cell_error(column, rows, row, f"the time is missing, for it is {cell}; remove the row")
            message = f"{cell} is before 0; add it under [time] of the mapping: offset = {cell.lstrip('-')}"
            raise self._cell_error(column, rows, row, message)
        return stamps

    def _rounded_stamps(self, column: str, unit: str, rows: Rows | None) -> Stamps:
        """Stamps with digits beyond the nanosecond, or with a cell that is no time, which an error names."""
        missing = np.flatnonzero(~np.isfinite(self._floats(column, rows)))
        if len(missing):
            cell = self.texts(column, rows)[int(missing[0])]
            message = "the time is missing" if cell in EMPTY_CELLS else f"{cell[:40]!r} is no time"
            raise self._cell_error(column, rows, int(missing[0]), f"{message}; remove the row")
        scale, start = Decimal(CLOCK_NS[unit]), TICKS_1970 if unit == "ticks" else 0
        try:
            exact = [
                int(((Decimal(cell.replace(self._layout.decimal, ".")) - start) * scale).to_integral_value())
                for cell in self.texts(column, rows)
            ]
            if exact and not -LARGEST < min(exact) <= max(exact) < LARGEST:
                raise OverflowError
            return np.array(exact, dtype=np.int64)
        except (InvalidOperation, OverflowError):
            raise ImportFileError(
                f"{self.source}: column {column!r}: a time is outside the years that nanoseconds reach; "
                f"check the unit, which is {unit!r}"
            ) from None

    def _wall_clock(self, column: str, rows: Rows | None, form: str) -> Stamps:
        """Stamps of dates and times in text; without a zone they count as UTC.

        Times of day without a date go on past midnight, by the order of all rows.
        """
        if form and not re.search("%[dj]", form):
            if column not in self._times_of_day:
                times = self._stamps_of_texts(column, None, form)
                self._times_of_day[column] = past_midnight(times)
                self._passes_midnight |= not np.array_equal(self._times_of_day[column], times)
            return self._times_of_day[column] if rows is None else self._times_of_day[column][rows]
        return self._stamps_of_texts(column, rows, form)

    def _stamps_of_texts(self, column: str, rows: Rows | None, form: str) -> Stamps:
        stamps = []
        for row, cell in enumerate(self.texts(column, rows)):
            try:
                stamps.append(wall_clock_ns(cell, form))
            except ValueError:
                expected = f"of the format {form!r}" if form else "in ISO 8601; say its format under [time]"
                raise self._cell_error(column, rows, row, f"{cell[:40]!r} is no date and time {expected}") from None
        return np.array(stamps, dtype=np.int64)

    def flags(self, column: str, rows: Rows | None = None) -> Rows:
        """Whether each cell says yes, (n,).

        Raises ImportFileError: a cell says neither yes nor no, such as a number other than 0 and 1.
        """
        cells = self._cells(column, rows)
        answers = {text: is_yes(text) for text in cells.unique().to_pylist()}
        if (unclear := next((text for text, answer in answers.items() if answer is None), None)) is not None:
            row = self.texts(column, rows).index(unclear)
            cure = "write true or false there, or leave valid out of the mapping"
            raise self._cell_error(column, rows, row, f"{unclear[:40]!r} does not say whether a pose is valid; {cure}")
        return bool_values(pc.is_in(cells, text_array([text for text, answer in answers.items() if answer])))

    def poses(self, columns: PoseColumns, stamps: Stamps, rows: Rows | None = None) -> PoseTable:
        """The poses of some rows; the last of a file that may be cut short is flagged as lost."""
        numbers = self.measurements(columns.numbers, rows)
        valid = self.flags(columns.valid, rows) if columns.valid else np.ones(len(numbers), dtype=np.bool_)
        if self._is_cut_short and (rows is None or rows[-1:].any()):
            valid[-1:] = False
        return PoseTable(stamps, numbers[:, :3], columns.quaternions(numbers[:, 3:]), valid)


def _number(cell: str) -> float:
    """The number in a cell; ValueError: it is none, such as ``1_0``, which Python reads as 10."""
    if "_" in cell:
        raise ValueError(cell)
    return float(cell)


def is_yes(text: str) -> bool | None:
    """Whether a cell says yes; ``None``: it says neither yes nor no."""
    word = text.lower()
    if word in VOCABULARY["valid_cells"]:
        return True
    if word in VOCABULARY["lost_cells"] or text in EMPTY_CELLS:
        return False
    with suppress(ValueError):
        return {1.0: True, 0.0: False}.get(float(word))
    return None


def excel_separator(line: str) -> str:
    """Returns the character that Excel's first line ``sep=;`` names, or ``""``."""
    match = SEPARATOR.fullmatch(line.strip("\r\n \ufeff"))
    return match[1] if match else ""


def split_lines(lines: Sequence[str], delimiter: str) -> list[list[str]]:
    """Returns the cells of lines, without spaces around them; spaces between cells may be several."""
    texts = (" ".join(line.split()) for line in lines) if delimiter == " " else lines
    return [[cell.strip() for cell in row] for row in csv.reader(texts, delimiter=delimiter)]


def ends_empty(row: Sequence[str]) -> bool:
    """Whether a delimiter stands behind the last cell of a row, as some loggers write it below a header without."""
    return len(row) > 1 and not row[-1]


def has_decimal_commas(row: str, width: int) -> bool:
    """Whether a row has more cells than ``width`` because commas are in its numbers, too: ``0,039`` is 0 and 039.

    No row that has a number with a decimal point does.
    """
    cells = [cell.strip() for cell in row.split(",")]
    if any(map(DECIMAL_POINT.fullmatch, cells)):
        return False
    pairs, position = 0, 0
    while position < len(cells) - 1:
        whole, fraction = cells[position], cells[position + 1]
        is_number = whole.removeprefix("-").isdecimal() and fraction.isdecimal()
        pairs += is_number
        position += 1 + is_number
    return 0 < len(cells) - width <= pairs


def _exact_stamps(cells: Any, unit: str) -> Stamps | None:
    """Nanoseconds of decimals in a unit of the clock, exact; ``None`` where one is no decimal of so few digits.

    Arrow's 128-bit decimals hold the digits as an integer, which at the right scale is the nanoseconds.
    """
    if unit not in DECIMALS:
        return None
    try:
        decimals = cells.cast(pa.decimal128(38, DECIMALS[unit]))
    except pa.ArrowInvalid:
        return None
    if decimals.null_count:
        return None
    chunks = [np.zeros((0, 2), dtype=np.int64)]
    for chunk in filter(len, decimals.chunks):
        values = np.frombuffer(chunk.buffers()[1], dtype=np.int64).reshape(-1, 2)
        chunks.append(values[chunk.offset : chunk.offset + len(chunk)])
    values = np.concatenate(chunks)
    stamps = values[:, 0]
    if (values[:, 1] != stamps >> 63).any():
        return None
    if unit == "ticks":
        stamps = stamps - TICKS_1970
        if not _fits(stamps, LARGEST // 100):
            return None
        stamps = stamps * 100
    return stamps if _fits(stamps, LARGEST) else None


def _fits(stamps: Stamps, largest: int) -> bool:
    return not len(stamps) or bool(-largest < stamps.min() and stamps.max() < largest)


# Values go by buffers: ``pyarrow.array``, ``pyarrow.scalar`` and ``to_numpy`` import pandas where it is installed, to
# ask whether their input is of pandas. That takes as long as the rest of an import of a minute (0.27 of 0.55 s).


def bool_array(values: NDArray[np.bool_]) -> pa.BooleanArray:
    """Returns flags (n,) as an Arrow array, which holds eight of them in a byte."""
    bits = np.packbits(values, bitorder="little")
    return pa.Array.from_buffers(pa.bool_(), len(values), [None, pa.py_buffer(bits)])


def text_array(texts: Sequence[str]) -> pa.StringArray:
    """Returns texts as an Arrow array."""
    encoded = [text.encode("utf-8") for text in texts]
    ends = np.cumsum([0, *map(len, encoded)], dtype=np.int32)
    return pa.StringArray.from_buffers(len(encoded), pa.py_buffer(ends), pa.py_buffer(b"".join(encoded)))


def text_scalar(text: str | None) -> pa.StringScalar:
    """Returns one text as an Arrow scalar; ``None``: the one that is missing."""
    return pa.nulls(1, pa.string())[0] if text is None else text_array([text])[0]


# Made once: for each column again they took a quarter of the time in which a column of few rows is read.
EMPTY_TEXTS: Final = text_array([*EMPTY_CELLS])
NO_TEXT: Final = text_scalar(None)
NAN: Final = text_scalar("nan").cast(pa.float64())
ZERO: Final = text_scalar("0").cast(pa.uint8())


def float_values(cells: pa.ChunkedArray) -> NDArray[np.float64]:
    """Returns numbers of Arrow as float64 (n,); what is missing is NaN."""
    return _values(pc.fill_null(cells.cast(pa.float64()), NAN), np.float64)


def bool_values(flags: pa.ChunkedArray) -> NDArray[np.bool_]:
    """Returns flags of Arrow (n,); what is missing is no."""
    return _values(pc.fill_null(flags.cast(pa.uint8()), ZERO), np.uint8).astype(np.bool_)


def _values(cells: pa.ChunkedArray, dtype: type[np.generic]) -> NDArray[Any]:
    chunks = [np.from_dlpack(chunk) for chunk in cells.chunks]
    return np.concatenate(chunks) if chunks else np.zeros(0, dtype=dtype)
