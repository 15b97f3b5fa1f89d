"""A CSV as typed columns: stamps are exact to the last digit, and an error names line and column."""

import calendar
import csv
import json
from array import array
from collections.abc import Iterator, Sequence
from contextlib import suppress
from datetime import datetime
from decimal import Decimal, InvalidOperation
from itertools import islice, zip_longest
from pathlib import Path
from typing import Any, Final

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from sessions.errors import ImportFileError
from sessions.importers.csv_mapping import CLOCK_NS, TEXT, CsvLayout, PoseColumns
from sessions.importers.ledger import Ledger
from sessions.importers.pose_table import PoseTable
from sessions.importers.stamps import Numbers, Rows, Stamps
from sessions.scene_files.toml_table import nearest

EMPTY: Final = ["", "nan", "NaN", "NAN", "null", "NULL", "None", "N/A", "n/a", "-"]  # Cells that say: no number here

TICKS_1970: Final = 621_355_968_000_000_000  # .NET ticks (100 ns since the year 1) at the Unix epoch

NO_YEAR: Final = 1900  # What strptime says of a time of day without a date

LONGEST_LINE: Final = 1_000_000  # Letters of a line that are read; a header of 12 bodies has a thousand

ROWS_AT_ONCE: Final = 10_000  # Rows that are lists of text before they become columns: some 10 MB

DELIMITERS: Final = ",;\t"  # Of a file that no mapping describes the one that its header has most

RAGGED: Final = "with too few or too many cells"

TRUE_WORDS: Final = ("1", "1.0", "true", "True", "TRUE", "yes", "valid")


class CsvTable:
    """The cells of one file; every column is text until it is asked for, for all rows or those of a mask (n,).

    Without a ``layout`` the header tells the delimiter, and beside semicolons and tabs numbers may have decimal commas.
    Rows with too few or too many cells are left out and counted as ``skipped``. Errors name keys of the mapping where
    the file is ``mapped``.
    """

    def __init__(
        self, source: Path, ledger: Ledger, layout: CsvLayout | None = None, *, mapped: bool = False, body: str = ""
    ) -> None:
        self.source, self.skipped, self._widest, self._mapped = source, 0, 0, mapped
        self._layout = layout or _layout_of(source)
        self._lines, self._last_is_whole = array("q"), False
        """The line of each row."""
        try:
            with source.open(encoding="utf-8-sig", newline="") as file:
                self._read(iter(lambda: file.readline(LONGEST_LINE), ""))
        except (OSError, UnicodeDecodeError, csv.Error) as error:
            raise ImportFileError(f"{source}: this is no CSV text in UTF-8 ({error}); save it as UTF-8") from None
        width = len(self.columns)
        if len(self) < self.skipped and 1 < width < self._widest:
            cure = "export numbers with decimal points, or semicolons between the cells"
            cure = "check delimiter and skip_lines of the mapping" if mapped else cure
            raise ImportFileError(f"{source}: rows have more cells than line {self._above}, which has {width}; {cure}")
        self._is_cut_short = self._last_is_whole and not self._line.endswith(("\n", "\r"))
        """Whether the last number of the last row may lack digits."""
        ledger.book("rows", body, read=self.skipped, kept=0, dropped={RAGGED: self.skipped})

    def _read(self, text: Iterator[str]) -> None:
        """Take in the header, and then the rows that have as many cells."""
        layout = self._layout
        header_lines = 0 if layout.columns else layout.header_lines
        self._above = layout.skip_lines + header_lines
        reader = csv.reader(islice(self._followed(text), layout.skip_lines, None), delimiter=layout.delimiter)
        heads = [list(layout.columns)] if layout.columns else list(islice(reader, header_lines))
        if not any(map(any, heads)):
            raise ImportFileError(f"{self.source}: the file is empty; there is no header in line {self._above}")
        words = [[word.strip() for word in column] for column in zip_longest(*heads, fillvalue="")]
        self.heads = list(map(list, zip(*words, strict=True)))
        names = [" ".join(filter(None, column)) for column in words]
        repeated = sorted(name for name in {*names} if names.count(name) > 1)
        if repeated and header_lines < 2:
            raise ImportFileError(f"{self.source}: line {self._above}: column {repeated[0]!r} occurs twice; rename one")
        names = [f"{name} (column {at})" if name in repeated else name for at, name in enumerate(names, start=1)]
        self.columns, schema = tuple(names), pa.schema([(name, pa.string()) for name in names])
        batches = []
        while rows := list(islice(self._whole(reader), ROWS_AT_ONCE)):
            batches.append(pa.record_batch(list(map(pa.array, zip(*rows, strict=True))), schema))
        self._table = pa.Table.from_batches(batches, schema)

    def _followed(self, text: Iterator[str]) -> Iterator[str]:
        for self._line in text:
            yield self._line

    def _whole(self, reader: Any) -> Iterator[list[str]]:
        """The rows that have as many cells as the header; blank lines are none."""
        for row in reader:
            self._last_is_whole = len(row) == len(self.columns)
            if self._last_is_whole:
                self._lines.append(self._layout.skip_lines + reader.line_num)
                yield row
            elif row:
                self.skipped += 1
                self._widest = max(self._widest, len(row))

    @property
    def notes(self) -> list[str]:
        """What is not as it should be in its rows, a sentence each."""
        notes = []
        if self._is_cut_short:
            notes.append("the last line has no line break and may be cut short: its pose is flagged as lost")
        return notes

    def __len__(self) -> int:
        return len(self._lines)

    def _cells(self, column: str, rows: Rows | None = None) -> Any:
        """The cells of a column as Arrow text."""
        if column not in self.columns:
            where = f"{self.source}: line {self._above}: no column {column!r}"
            if len(self.columns) == 1 and (other := [letter for letter in ",;\t|" if letter in self.columns[0]]):
                raise ImportFileError(
                    f"{where}, for nothing stands between {self._layout.delimiter!r}; "
                    f"write delimiter = {json.dumps(other[0])} into the mapping"
                )
            raise ImportFileError(f"{where}{nearest(column, self.columns)}")
        cells = self._table.column(column)
        return cells if rows is None else cells.filter(pa.array(rows))

    def texts(self, column: str, rows: Rows | None = None) -> list[str]:
        """The cells of a column as text, without spaces around it."""
        return pc.utf8_trim_whitespace(self._cells(column, rows)).to_pylist()

    def words(self, column: str, rows: Rows | None = None) -> dict[str, Rows]:
        """The different texts of a column, in the order they come in, and the rows of each, (n,)."""
        every = self._cells(column)
        found = {}
        for word in self._cells(column, rows).unique().to_pylist():
            has = pc.equal(every, word).to_numpy(zero_copy_only=False).astype(np.bool_)
            found[word] = has if rows is None else has & rows
        return found

    def numbers(self, columns: Sequence[str], rows: Rows | None = None) -> Numbers:
        """The cells of some columns as float64, (n, columns); an empty cell is NaN."""
        return np.column_stack([self._floats(column, rows) for column in columns])

    def holds_numbers(self, column: str) -> bool:
        """Whether every cell of a column is a number or empty, and one is a number."""
        try:
            return bool(np.isfinite(self._floats(column)).any())
        except ImportFileError:
            return False

    def _floats(self, column: str, rows: Rows | None = None) -> Numbers:
        cells = pc.utf8_trim_whitespace(self._cells(column, rows))
        if self._layout.decimal != ".":
            cells = pc.replace_substring(cells, self._layout.decimal, ".")
        cells = pc.if_else(pc.is_in(cells, pa.array(EMPTY)), pa.scalar(None, pa.string()), cells)
        with suppress(pa.ArrowInvalid):
            return np.asarray(cells.cast(pa.float64()).to_numpy(zero_copy_only=False), dtype=np.float64)
        values = []
        for place, cell in enumerate(cells.fill_null("nan").to_pylist()):
            try:
                values.append(float(cell))
            except ValueError:
                text = self.texts(column, rows)[place]
                cure = 'write decimal = "," into the mapping' if self._mapped else "export it with decimal points"
                cure = cure if text.count(",") == 1 else "repair the cell"
                raise self._wrong(column, rows, place, f"{text[:40]!r} is no number; {cure}") from None
        return np.array(values)

    def _wrong(self, column: str, rows: Rows | None, place: int, message: str) -> ImportFileError:
        """What is wrong with a cell, by its place among some rows."""
        row = place if rows is None else int(np.flatnonzero(rows)[place])
        return ImportFileError(f"{self.source}: line {self._lines[row]}, column {column!r}: {message}")

    def stamps(self, column: str, unit: str, rows: Rows | None = None) -> Stamps:
        """The clock as int64 nanoseconds, (n,); without a column it is that of the rows' rate."""
        offset_ns = self._layout.offset_ns
        if not column:
            clock = np.rint(np.arange(len(self)) * (1e9 / self._layout.rate_hz)).astype(np.int64) + offset_ns
            return clock if rows is None else clock[rows]
        if unit == TEXT:
            return self._wall_clock(column, rows) + offset_ns
        missing = np.flatnonzero(~np.isfinite(self._floats(column, rows)))
        if len(missing):
            raise self._wrong(column, rows, int(missing[0]), "the time is missing; remove the row")
        cells = self.texts(column, rows)
        scale, start = Decimal(CLOCK_NS[unit]), TICKS_1970 if unit == "ticks" else 0
        try:
            exact = [
                int(((Decimal(cell.replace(self._layout.decimal, ".")) - start) * scale).to_integral_value())
                for cell in cells
            ]
            stamps = np.array(exact, dtype=np.int64) + offset_ns
        except (InvalidOperation, OverflowError):
            raise ImportFileError(
                f"{self.source}: column {column!r}: a time is outside the years that nanoseconds reach; "
                f"check the unit, which is {unit!r}"
            ) from None
        if len(stamps) and stamps.min() < 0:
            place = int(stamps.argmin())
            cell = cells[place][:40]
            message = f"{cell} is before 0; add it under [time] of the mapping: offset = {cell.lstrip('-')}"
            raise self._wrong(column, rows, place, message)
        return stamps

    def _wall_clock(self, column: str, rows: Rows | None) -> Stamps:
        """Stamps of dates and times in text; without a zone they count as UTC."""
        form, stamps = self._layout.format, []
        for place, cell in enumerate(self.texts(column, rows)):
            try:
                stamps.append(_nanoseconds(cell, form))
            except ValueError:
                wanted = f"of the format {form!r}" if form else "in ISO 8601; say its format under [time]"
                raise self._wrong(column, rows, place, f"{cell[:40]!r} is no date and time {wanted}") from None
        return np.array(stamps, dtype=np.int64)

    def flags(self, column: str, rows: Rows | None = None) -> Rows:
        """Whether each cell says yes, (n,)."""
        return np.isin(self.texts(column, rows), TRUE_WORDS)

    def poses(self, columns: PoseColumns, stamps: Stamps, rows: Rows | None = None) -> PoseTable:
        """The poses of some rows; the last of a file that may be cut short is flagged as lost."""
        numbers = self.numbers(columns.numbers, rows)
        valid = self.flags(columns.valid, rows) if columns.valid else np.ones(len(numbers), dtype=np.bool_)
        if self._is_cut_short and (rows is None or rows[-1:].any()):
            valid[-1:] = False
        return PoseTable(stamps, numbers[:, :3], columns.quaternions(numbers[:, 3:]), valid)


def _nanoseconds(text: str, form: str) -> int:
    """Nanoseconds since 1970 of a date and time, to the microsecond; a time of day counts from midnight."""
    moment = datetime.strptime(text, form) if form else datetime.fromisoformat(text)
    if moment.year == NO_YEAR:
        moment = moment.replace(year=1970)
    return calendar.timegm(moment.utctimetuple()) * 1_000_000_000 + moment.microsecond * 1000


def _layout_of(source: Path) -> CsvLayout:
    with source.open(encoding="utf-8-sig", errors="replace") as file:
        delimiter = max(DELIMITERS, key=file.readline(LONGEST_LINE).count)
    return CsvLayout(delimiter, "." if delimiter == "," else ",")
