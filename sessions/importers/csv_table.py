"""A CSV as typed columns: numbers stay numbers to the last digit of the clock, and a bad cell is named."""

from __future__ import annotations

from collections.abc import Sequence
from decimal import Decimal, InvalidOperation
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sessions.errors import ImportFileError
from sessions.importers.csv_mapping import CLOCK_NS
from sessions.toml_table import nearest

EMPTY: Final = ["", "nan", "NaN", "NAN", "null", "NULL", "None", "N/A", "n/a", "-"]
"""Cells that say: no number here."""

EXACT_SECONDS: Final = 4.0e6
"""Up to here float64 seconds hold a nanosecond; beyond, the text of the stamp is read digit by digit."""

TICKS_1970: Final = 621_355_968_000_000_000
""".NET ticks (100 ns since the year 1) at the Unix epoch."""

TRUE_WORDS: Final = ("1", "1.0", "true", "True", "TRUE", "yes", "valid")


class CsvTable:
    """The cells of one file; every column is text until it is asked for."""

    def __init__(self, source: Path, delimiter: str, decimal: str) -> None:
        import pyarrow as pa
        from pyarrow import csv

        self.source, self.skipped = source, 0
        self._decimal = decimal
        header = _header(source, delimiter)
        repeated = {name for name in header if header.count(name) > 1}
        if repeated:
            raise ImportFileError(f"{source}: line 1: column {sorted(repeated)[0]!r} occurs twice; rename one")
        try:
            self._table = csv.read_csv(
                source,
                csv.ReadOptions(column_names=header, skip_rows=1, use_threads=False),
                csv.ParseOptions(delimiter=delimiter, invalid_row_handler=self._skip),
                csv.ConvertOptions(column_types=dict.fromkeys(header, pa.string()), strings_can_be_null=False),
            )
        except (pa.ArrowInvalid, pa.ArrowKeyError, UnicodeDecodeError) as error:
            raise ImportFileError(f"{source}: this is no CSV ({_first_line(error)}); save it again as UTF-8") from None
        self.columns = tuple(header)

    def _skip(self, _row: Any) -> str:
        """A row with too few or too many cells, such as a last line cut short, is counted and left out."""
        self.skipped += 1
        return "skip"

    def __len__(self) -> int:
        return int(self._table.num_rows)

    def texts(self, column: str) -> NDArray[np.object_]:
        """The cells of a column as text, (n,)."""
        if column not in self.columns:
            raise ImportFileError(f"{self.source}: line 1: no column {column!r}{nearest(column, self.columns)}")
        cells: NDArray[np.object_] = self._table.column(column).to_numpy(zero_copy_only=False)
        return cells

    def numbers(self, columns: Sequence[str], rows: NDArray[np.bool_]) -> NDArray[np.float64]:
        """The cells of some columns and rows as float64, (n, columns); an empty cell is NaN."""
        return np.column_stack([self._floats(column, rows) for column in columns]) if columns else np.zeros((0, 0))

    def _floats(self, column: str, rows: NDArray[np.bool_]) -> NDArray[np.float64]:
        import pyarrow as pa
        import pyarrow.compute as pc

        self.texts(column)
        cells = pc.utf8_trim_whitespace(self._table.column(column)).filter(pa.array(rows))
        if self._decimal != ".":
            cells = pc.replace_substring(cells, self._decimal, ".")
        cells = pc.if_else(pc.is_in(cells, pa.array(EMPTY)), pa.scalar(None, pa.string()), cells)
        try:
            values: NDArray[np.float64] = cells.cast(pa.float64()).to_numpy(zero_copy_only=False)
        except pa.ArrowInvalid:
            raise self._no_number(column, rows) from None
        return values.astype(np.float64)

    def _no_number(self, column: str, rows: NDArray[np.bool_]) -> ImportFileError:
        """Name the first cell that is no number."""
        for row in np.flatnonzero(rows).tolist():
            cell = str(self.texts(column)[row]).strip()
            try:
                float("nan" if cell in EMPTY else cell.replace(self._decimal, "."))
            except ValueError:
                # The header is line 1; skipped rows and line breaks in quotes are not counted.
                return ImportFileError(
                    f"{self.source}: line {row + 2}, column {column!r}: {cell[:40]!r} is no number; repair the cell"
                )
        return ImportFileError(f"{self.source}: column {column!r} holds something that is no number; repair it")

    def stamps(self, column: str, unit: str, rows: NDArray[np.bool_]) -> NDArray[np.int64]:
        """The clock as int64 nanoseconds, (n,)."""
        values = self._floats(column, rows)
        if not np.isfinite(values).all():
            row = int(np.flatnonzero(rows)[np.flatnonzero(~np.isfinite(values))[0]])
            raise ImportFileError(
                f"{self.source}: line {row + 2}, column {column!r}: the time is missing; remove the row"
            )
        factor = CLOCK_NS[unit]
        if unit != "ticks" and np.abs(values).max(initial=0.0) <= EXACT_SECONDS * 1e9 / factor:
            return np.rint(values * factor).astype(np.int64)
        return self._exact_stamps(column, unit, rows)

    def _exact_stamps(self, column: str, unit: str, rows: NDArray[np.bool_]) -> NDArray[np.int64]:
        scale, offset = Decimal(CLOCK_NS[unit]), Decimal(TICKS_1970 if unit == "ticks" else 0)
        try:
            exact = [
                int(((Decimal(cell.strip().replace(self._decimal, ".")) - offset) * scale).to_integral_value())
                for cell in self.texts(column)[rows].tolist()
            ]
            return np.array(exact, dtype=np.int64)
        except (InvalidOperation, OverflowError):
            raise ImportFileError(
                f"{self.source}: column {column!r}: a time is outside the years that nanoseconds reach; "
                f"check the unit, which is {unit!r}"
            ) from None

    def flags(self, column: str, rows: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Whether each cell says yes, (n,)."""
        words = np.array([str(cell).strip() for cell in self.texts(column)[rows].tolist()], dtype=object)
        return np.isin(words, TRUE_WORDS)


def _header(source: Path, delimiter: str) -> list[str]:
    try:
        with source.open(encoding="utf-8-sig", newline="") as file:
            line = file.readline(1_000_000)
    except (OSError, UnicodeDecodeError):
        raise ImportFileError(f"{source}: this is not UTF-8 text; save it as UTF-8") from None
    names = [name.strip().strip('"') for name in line.rstrip("\r\n").split(delimiter)]
    if not any(names):
        raise ImportFileError(f"{source}: the file is empty; there is no header in line 1")
    return names


def _first_line(error: Exception) -> str:
    return str(error).splitlines()[0][:160] if str(error) else type(error).__name__
