"""A CSV as typed columns: stamps are exact to the last digit, and an error names line and column."""

import calendar
import csv
import json
import re
from collections.abc import Sequence
from datetime import datetime
from decimal import Decimal, InvalidOperation
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sessions.errors import ImportFileError
from sessions.importers.csv_mapping import CLOCK_NS, ROW_TIME, TEXT
from sessions.scene_files.toml_table import nearest

EMPTY: Final = ["", "nan", "NaN", "NAN", "null", "NULL", "None", "N/A", "n/a", "-"]  # Cells that say: no number here

TICKS_1970: Final = 621_355_968_000_000_000  # .NET ticks (100 ns since the year 1) at the Unix epoch

NO_YEAR: Final = 1900  # What strptime says of a time of day without a date

LONGEST_LINE: Final = 1_000_000  # Letters of a line that are read; a header of 12 bodies has a thousand

DELIMITERS: Final = ",;\t"  # Of a file that no mapping describes the one that its header has most

TRUE_WORDS: Final = ("1", "1.0", "true", "True", "TRUE", "yes", "valid")


Rows = NDArray[np.bool_]


class CsvTable:
    """The cells of one file; every column is text until it is asked for.

    Without a ``delimiter`` the header tells it, and beside semicolons and tabs numbers may have decimal commas.
    ``skip_lines`` come before the header; of several ``header_lines`` a column's name is all its words. A file without
    a header gets ``columns``, one without a clock a column ``ROW_TIME`` by its rows at ``rate_hz``. Errors name
    keys of the mapping where the file is ``mapped``.
    """

    def __init__(
        self, source: Path, delimiter: str = "", decimal: str = ".", skip_lines: int = 0, header_lines: int = 1,
        columns: Sequence[str] = (), rate_hz: float = 0.0, mapped: bool = False,
    ) -> None:  # fmt: skip
        import pyarrow as pa
        from pyarrow import csv as arrow_csv

        self.source, self.skipped, self._mapped = source, 0, mapped
        self.format, self.offset_ns = "", 0
        self._widest = 0
        header_lines = 0 if columns else header_lines
        if not delimiter:
            delimiter = _delimiter(source)
            decimal = "." if delimiter == "," else ","
        self._delimiter, self._decimal, self._above = delimiter, decimal, skip_lines + header_lines
        self.heads = [list(columns)] if columns else _heads(source, delimiter, skip_lines, header_lines)
        header = _names(self.heads)
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
                arrow_csv.ParseOptions(delimiter=delimiter, invalid_row_handler=self._skip),
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
        if rate_hz > 0.0:
            clock = [format(row / rate_hz, ".9f").replace(".", decimal) for row in range(len(self))]
            self._table = self._table.append_column(ROW_TIME, pa.array(clock, pa.string()))
            self.columns = (*header, ROW_TIME)
        self.every: Rows = np.ones(len(self), dtype=np.bool_)
        self.cut_short = _is_cut_short(source, delimiter, len(header))

    def _skip(self, row: Any) -> str:
        """A row with too few or too many cells, such as a last line cut short, is counted and left out."""
        self.skipped += 1
        self._widest = max(self._widest, row.actual_columns)
        return "skip"

    def __len__(self) -> int:
        return int(self._table.num_rows)

    def column(self, name: str) -> Any:
        """The cells of a column as Arrow text."""
        if name not in self.columns:
            if len(self.columns) == 1 and (other := [letter for letter in ",;\t|" if letter in self.columns[0]]):
                raise ImportFileError(
                    f"{self.source}: line {self._above}: no column {name!r}, for nothing stands between "
                    f"{self._delimiter!r}; write delimiter = {json.dumps(other[0])} into the mapping"
                )
            raise ImportFileError(f"{self.source}: line {self._above}: no column {name!r}{nearest(name, self.columns)}")
        return self._table.column(name)

    def texts(self, column: str, rows: Rows | None = None) -> NDArray[np.object_]:
        """The cells of a column, of some rows or all, as text, (n,)."""
        chosen = self.column(column) if rows is None else self._chosen(column, rows)
        return chosen.to_numpy(zero_copy_only=False)

    def words(self, column: str, rows: Rows) -> list[str]:
        """The different texts in some rows of a column, in the order they come in."""
        return self._chosen(column, rows).unique().to_pylist()

    def rows_of(self, column: str, word: str) -> Rows:
        """Which rows have exactly this text in a column, (n,)."""
        import pyarrow.compute as pc

        return pc.equal(self.column(column), word).to_numpy(zero_copy_only=False).astype(np.bool_)

    def numbers(self, columns: Sequence[str], rows: Rows) -> NDArray[np.float64]:
        """The cells of some columns and rows as float64, (n, columns); an empty cell is NaN."""
        return np.column_stack([self._floats(column, rows) for column in columns]) if columns else np.zeros((0, 0))

    def holds_numbers(self, column: str) -> bool:
        """Whether every cell of a column is a number or empty, and one is a number."""
        try:
            return bool(np.isfinite(self._floats(column, self.every)).any())
        except ImportFileError:
            return False

    def _chosen(self, column: str, rows: Rows) -> Any:
        import pyarrow as pa

        cells = self.column(column)
        return cells if rows.all() else cells.filter(pa.array(rows))

    def _floats(self, column: str, rows: Rows) -> NDArray[np.float64]:
        import pyarrow as pa
        import pyarrow.compute as pc

        cells = pc.utf8_trim_whitespace(self._chosen(column, rows))
        if self._decimal != ".":
            cells = pc.replace_substring(cells, self._decimal, ".")
        cells = pc.if_else(pc.is_in(cells, pa.array(EMPTY)), pa.scalar(None, pa.string()), cells)
        try:
            values: NDArray[np.float64] = cells.cast(pa.float64()).to_numpy(zero_copy_only=False)
        except pa.ArrowInvalid:
            raise self._no_number(column, rows) from None
        return values.astype(np.float64)

    def _no_number(self, column: str, rows: Rows) -> ImportFileError:
        """Name the first cell that is no number."""
        cells = self.texts(column)
        for row in np.flatnonzero(rows).tolist():
            cell = str(cells[row]).strip()
            try:
                float("nan" if cell in EMPTY else cell.replace(self._decimal, "."))
            except ValueError:
                cure = 'write decimal = "," into the mapping' if self._mapped else "export it with decimal points"
                cure = cure if cell.count(",") == 1 else "repair the cell"
                return self._wrong(row, column, f"{cell[:40]!r} is no number; {cure}")
        return ImportFileError(f"{self.source}: column {column!r} holds something that is no number; repair it")

    def _wrong(self, row: int, column: str, message: str) -> ImportFileError:
        return ImportFileError(f"{self.source}: line {self._line_of(row)}, column {column!r}: {message}")

    def _line_of(self, row: int) -> int:
        """The line of the file that a row stands in: blank and skipped lines are counted."""
        kept = -1
        with self.source.open(encoding="utf-8-sig", newline="") as file:
            for number, line in enumerate(file, start=1):
                kept += number > self._above and _cells(line, self._delimiter) == len(self.columns)
                if kept == row:
                    return number
        return row + 2

    def stamps(self, column: str, unit: str, rows: Rows) -> NDArray[np.int64]:
        """The clock as int64 nanoseconds, (n,)."""
        if unit == TEXT:
            return self._wall_clock(column, rows) + self.offset_ns
        values = self._floats(column, rows)
        if not np.isfinite(values).all():
            row = int(np.flatnonzero(rows)[np.flatnonzero(~np.isfinite(values))[0]])
            raise self._wrong(row, column, "the time is missing; remove the row")
        stamps = self._exact_stamps(column, unit, rows) + self.offset_ns
        if len(stamps) and stamps.min() < 0:
            row = int(np.flatnonzero(rows)[int(stamps.argmin())])
            cell = str(self.texts(column)[row])[:40]
            raise self._wrong(
                row, column, f"{cell} is before 0; add it under [time] of the mapping: offset = {cell.lstrip('-')}"
            )
        return stamps

    def _exact_stamps(self, column: str, unit: str, rows: Rows) -> NDArray[np.int64]:
        scale, offset = Decimal(CLOCK_NS[unit]), Decimal(TICKS_1970 if unit == "ticks" else 0)
        try:
            exact = [
                int(((Decimal(cell.strip().replace(self._decimal, ".")) - offset) * scale).to_integral_value())
                for cell in self._chosen(column, rows).to_pylist()
            ]
            return np.array(exact, dtype=np.int64)
        except (InvalidOperation, OverflowError):
            raise ImportFileError(
                f"{self.source}: column {column!r}: a time is outside the years that nanoseconds reach; "
                f"check the unit, which is {unit!r}"
            ) from None

    def _wall_clock(self, column: str, rows: Rows) -> NDArray[np.int64]:
        """Stamps of dates and times in text; without a zone they count as UTC."""
        stamps = np.empty(int(rows.sum()), dtype=np.int64)
        for place, cell in enumerate(self._chosen(column, rows).to_pylist()):
            try:
                stamps[place] = _nanoseconds(cell.strip(), self.format)
            except ValueError:
                wanted = f"of the format {self.format!r}" if self.format else "in ISO 8601; say its format under [time]"
                row = int(np.flatnonzero(rows)[place])
                raise self._wrong(row, column, f"{cell[:40]!r} is no date and time {wanted}") from None
        return stamps

    def flags(self, column: str, rows: Rows) -> Rows:
        """Whether each cell says yes, (n,)."""
        import pyarrow as pa
        import pyarrow.compute as pc

        cells = pc.utf8_trim_whitespace(self._chosen(column, rows))
        return pc.is_in(cells, pa.array(TRUE_WORDS)).to_numpy(zero_copy_only=False).astype(np.bool_)


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
    moment = moment.replace(microsecond=0)
    seconds = calendar.timegm(moment.utctimetuple())
    return seconds * 1_000_000_000 + int(digits[:9].ljust(9, "0") or 0)


def _delimiter(source: Path) -> str:
    with source.open(encoding="utf-8-sig", errors="replace") as file:
        return max(DELIMITERS, key=file.readline(LONGEST_LINE).count)


def _heads(source: Path, delimiter: str, skip_lines: int, header_lines: int) -> list[list[str]]:
    """The cells of the lines that name columns, as many in each."""
    try:
        with source.open(encoding="utf-8-sig", newline="") as file:
            lines = [file.readline(LONGEST_LINE) for _ in range(skip_lines + header_lines)][skip_lines:]
            # Of a row left out that is no UTF-8, Arrow would print a traceback.
            while file.read(LONGEST_LINE):
                pass
        rows = [[cell.strip() for cell in row] for row in csv.reader(lines, delimiter=delimiter)]
    except (OSError, UnicodeDecodeError, csv.Error):
        raise ImportFileError(f"{source}: this is not UTF-8 text; save it as UTF-8") from None
    if not any(map(any, rows)):
        raise ImportFileError(f"{source}: the file is empty; there is no header in line {skip_lines + header_lines}")
    wide = max(map(len, rows))
    return [row + [""] * (wide - len(row)) for row in rows]


def _names(heads: list[list[str]]) -> list[str]:
    return [" ".join(filter(None, words)) for words in zip(*heads, strict=True)]


def _cells(line: str, delimiter: str) -> int:
    """How many cells a line has; 0 for a blank one."""
    text = line.rstrip("\r\n")
    try:
        return len(next(csv.reader([text], delimiter=delimiter))) if text else 0
    except csv.Error:
        return 0


def _is_cut_short(source: Path, delimiter: str, columns: int) -> bool:
    """Whether the last line has all its cells but no line break, so that its last number may lack digits."""
    with source.open("rb") as file:
        file.seek(max(0, source.stat().st_size - LONGEST_LINE))
        tail = file.read()
    if tail.endswith((b"\n", b"\r")):
        return False
    last = tail.replace(b"\r", b"\n").rsplit(b"\n", 1)[-1].decode("utf-8", errors="replace")
    return _cells(last, delimiter) == columns
