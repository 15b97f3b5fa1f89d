"""A CSV as typed columns: stamps are exact to the last digit, and an error names line and column."""

import calendar
import csv
import json
import re
from collections.abc import Sequence
from datetime import datetime
from decimal import Decimal, InvalidOperation
from itertools import zip_longest
from pathlib import Path
from typing import Any, Final

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from pyarrow import csv as arrow_csv

from sessions.errors import ImportFileError
from sessions.importers.csv_mapping import CLOCK_NS, ROW_TIME, TEXT, CsvLayout, PoseColumns
from sessions.importers.pose_table import Numbers, PoseTable, Rows, Stamps
from sessions.scene_files.toml_table import nearest

EMPTY: Final = ["", "nan", "NaN", "NAN", "null", "NULL", "None", "N/A", "n/a", "-"]  # Cells that say: no number here

TICKS_1970: Final = 621_355_968_000_000_000  # .NET ticks (100 ns since the year 1) at the Unix epoch

NO_YEAR: Final = 1900  # What strptime says of a time of day without a date

LONGEST_LINE: Final = 1_000_000  # Letters of a line that are read; a header of 12 bodies has a thousand

DELIMITERS: Final = ",;\t"  # Of a file that no mapping describes the one that its header has most

TRUE_WORDS: Final = ("1", "1.0", "true", "True", "TRUE", "yes", "valid")


class CsvTable:
    """The cells of one file; every column is text until it is asked for, for all rows or those of a mask (n,).

    Without a ``layout`` the header tells the delimiter, and beside semicolons and tabs numbers may have decimal commas.
    A file without a clock gets a column ``ROW_TIME``. Errors name keys of the mapping where the file is ``mapped``.
    """

    def __init__(self, source: Path, layout: CsvLayout | None = None, *, mapped: bool = False) -> None:
        self.source, self.skipped, self._mapped, self._widest = source, 0, mapped, 0
        self._layout = layout = layout or _layout_of(source)
        header_lines = 0 if layout.columns else layout.header_lines
        self._above = layout.skip_lines + header_lines
        self.heads = [list(layout.columns)] if layout.columns else _heads(source, layout)
        header = [" ".join(filter(None, words)) for words in zip(*self.heads, strict=True)]
        repeated = {name for name in header if header.count(name) > 1}
        if repeated and header_lines < 2:
            raise ImportFileError(
                f"{source}: line {self._above}: column {sorted(repeated)[0]!r} occurs twice; rename one"
            )
        header = [f"{name} (column {at})" if name in repeated else name for at, name in enumerate(header, start=1)]
        try:
            self._table = arrow_csv.read_csv(
                source,
                arrow_csv.ReadOptions(column_names=header, skip_rows=self._above, use_threads=False),
                arrow_csv.ParseOptions(delimiter=layout.delimiter, invalid_row_handler=self._skip),
                arrow_csv.ConvertOptions(column_types=dict.fromkeys(header, pa.string()), strings_can_be_null=False),
            )
        except (pa.ArrowInvalid, pa.ArrowKeyError, UnicodeDecodeError) as error:
            why = str(error).splitlines()[0][:160] if str(error) else type(error).__name__
            raise ImportFileError(f"{source}: this is no CSV ({why}); save it again as UTF-8") from None
        if len(self) < self.skipped and 1 < len(header) < self._widest:
            many = "most rows have" if len(self) else "every row has"
            cure = "export numbers with decimal points, or semicolons between the cells"
            cure = "check delimiter and skip_lines of the mapping" if mapped else cure
            raise ImportFileError(
                f"{source}: {many} more cells than line {self._above}, which has {len(header)}; {cure}"
            )
        self.columns = tuple(header)
        if layout.rate_hz > 0.0:
            clock = [format(row / layout.rate_hz, ".9f").replace(".", layout.decimal) for row in range(len(self))]
            self._table = self._table.append_column(ROW_TIME, pa.array(clock, pa.string()))
            self.columns = (*header, ROW_TIME)
        self.cut_short = _is_cut_short(source, layout.delimiter, len(header))

    def _skip(self, row: Any) -> str:
        """A row with too few or too many cells, such as a last line cut short, is counted and left out."""
        self.skipped += 1
        self._widest = max(self._widest, row.actual_columns)
        return "skip"

    def __len__(self) -> int:
        return int(self._table.num_rows)

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
        """The cells of a column as text."""
        return self._cells(column, rows).to_pylist()

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
        try:
            values: Numbers = cells.cast(pa.float64()).to_numpy(zero_copy_only=False)
        except pa.ArrowInvalid:
            raise self._no_number(column, rows) from None
        return values.astype(np.float64)

    def _no_number(self, column: str, rows: Rows | None) -> ImportFileError:
        """Name the first cell that is no number."""
        for place, text in enumerate(self.texts(column, rows)):
            cell = text.strip()
            try:
                float("nan" if cell in EMPTY else cell.replace(self._layout.decimal, "."))
            except ValueError:
                cure = 'write decimal = "," into the mapping' if self._mapped else "export it with decimal points"
                cure = cure if cell.count(",") == 1 else "repair the cell"
                return self._wrong(column, rows, place, f"{cell[:40]!r} is no number; {cure}")
        return ImportFileError(f"{self.source}: column {column!r} holds something that is no number; repair it")

    def _wrong(self, column: str, rows: Rows | None, place: int, message: str) -> ImportFileError:
        """What is wrong with a cell, by its place among some rows: blank and skipped lines of the file are counted."""
        row = place if rows is None else int(np.flatnonzero(rows)[place])
        line, kept = row + 2, -1
        with self.source.open(encoding="utf-8-sig", newline="") as file:
            for number, text in enumerate(file, start=1):
                kept += number > self._above and _width(text, self._layout.delimiter) == len(self.heads[0])
                if kept == row:
                    line = number
                    break
        return ImportFileError(f"{self.source}: line {line}, column {column!r}: {message}")

    def stamps(self, column: str, unit: str, rows: Rows | None = None) -> Stamps:
        """The clock as int64 nanoseconds, (n,)."""
        if unit == TEXT:
            return self._wall_clock(column, rows) + self._layout.offset_ns
        missing = np.flatnonzero(~np.isfinite(self._floats(column, rows)))
        if len(missing):
            raise self._wrong(column, rows, int(missing[0]), "the time is missing; remove the row")
        cells = self.texts(column, rows)
        scale, start = Decimal(CLOCK_NS[unit]), TICKS_1970 if unit == "ticks" else 0
        try:
            exact = [
                int(((Decimal(cell.strip().replace(self._layout.decimal, ".")) - start) * scale).to_integral_value())
                for cell in cells
            ]
            stamps = np.array(exact, dtype=np.int64) + self._layout.offset_ns
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
                stamps.append(_nanoseconds(cell.strip(), form))
            except ValueError:
                wanted = f"of the format {form!r}" if form else "in ISO 8601; say its format under [time]"
                raise self._wrong(column, rows, place, f"{cell[:40]!r} is no date and time {wanted}") from None
        return np.array(stamps, dtype=np.int64)

    def flags(self, column: str, rows: Rows | None = None) -> Rows:
        """Whether each cell says yes, (n,); without a column all do."""
        if not column:
            return np.ones(len(self) if rows is None else int(rows.sum()), dtype=np.bool_)
        cells = pc.utf8_trim_whitespace(self._cells(column, rows))
        return pc.is_in(cells, pa.array(TRUE_WORDS)).to_numpy(zero_copy_only=False).astype(np.bool_)

    def poses(self, columns: PoseColumns, stamps: Stamps, rows: Rows | None = None) -> PoseTable:
        """The poses of some rows; the last of a file that may be cut short is flagged as lost."""
        numbers = self.numbers(columns.numbers, rows)
        valid = self.flags(columns.valid, rows)
        if self.cut_short and (rows is None or rows[-1:].any()):
            valid[-1:] = False
        return PoseTable(stamps, numbers[:, :3], columns.quaternions(numbers[:, 3:]), valid)


def _nanoseconds(text: str, form: str) -> int:
    """Nanoseconds since 1970 of a date and time; ISO 8601 keeps every digit of its second."""
    if form:
        moment = datetime.strptime(text, form)
        digits = f"{moment.microsecond:06d}"
        if moment.year == NO_YEAR:  # a time of day counts from midnight
            moment = moment.replace(year=1970)
    else:
        fraction = re.search(r"(?<=\d)[.,](\d+)", text)
        digits = fraction[1] if fraction else ""
        moment = datetime.fromisoformat(text.replace(fraction[0], "", 1) if fraction else text)
    seconds = calendar.timegm(moment.utctimetuple())
    return seconds * 1_000_000_000 + int(digits[:9].ljust(9, "0"))


def _layout_of(source: Path) -> CsvLayout:
    with source.open(encoding="utf-8-sig", errors="replace") as file:
        delimiter = max(DELIMITERS, key=file.readline(LONGEST_LINE).count)
    return CsvLayout(delimiter, "." if delimiter == "," else ",")


def _heads(source: Path, layout: CsvLayout) -> list[list[str]]:
    """The cells of the lines that name columns, as many in each."""
    last = layout.skip_lines + layout.header_lines
    try:
        with source.open(encoding="utf-8-sig", newline="") as file:
            lines = [file.readline(LONGEST_LINE) for _ in range(last)][layout.skip_lines :]
            # Of a row left out that is no UTF-8, Arrow would print a traceback.
            while file.read(LONGEST_LINE):
                pass
        rows = [[cell.strip() for cell in row] for row in csv.reader(lines, delimiter=layout.delimiter)]
    except (OSError, UnicodeDecodeError, csv.Error):
        raise ImportFileError(f"{source}: this is not UTF-8 text; save it as UTF-8") from None
    if not any(map(any, rows)):
        raise ImportFileError(f"{source}: the file is empty; there is no header in line {last}")
    return list(map(list, zip(*zip_longest(*rows, fillvalue=""), strict=True)))


def _width(line: str, delimiter: str) -> int:
    """How many cells a line has; 0 for a blank one."""
    try:
        return len(next(csv.reader([line.rstrip("\r\n")], delimiter=delimiter), ()))
    except csv.Error:
        return 0


def _is_cut_short(source: Path, delimiter: str, columns: int) -> bool:
    """Whether the last line has all its cells but no line break, so that its last number may lack digits."""
    with source.open("rb") as file:
        file.seek(max(0, source.stat().st_size - LONGEST_LINE))
        tail = file.read()
    last = tail.replace(b"\r", b"\n").rsplit(b"\n", 1)[-1].decode("utf-8", errors="replace")
    return bool(last) and _width(last, delimiter) == columns
