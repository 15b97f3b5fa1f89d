"""Tables for other programs: CSV and Excel, with units in the heading; no cell becomes a formula."""

import csv
from collections.abc import Iterable, Iterator, Mapping, Sequence
from math import isfinite
from pathlib import Path
from typing import Any, Final

import pyarrow as pa
import pyarrow.parquet as pq
from msgspec import structs

from replay.document.coding import json_of
from replay.document.columns import FILE_TABLES
from replay.errors import OutputError
from replay.show.results.parquet import read_table
from replay.show.results.run_folder import SUMMARY_FILE, read_run_folder
from sessions.whole_files import whole_file

CSV, PARQUET, XLSX = "csv", "parquet", "xlsx"
TABLE_FORMS: Final = (CSV, PARQUET, XLSX)

WORKBOOK_FILE: Final = "tables.xlsx"
NO_XLSXWRITER: Final = 'Excel tables need XlsxWriter: pip install "vrlab-replay[excel]"'

COLUMN_UNITS: Final = {
    name: {column.name: column.unit for column in table.columns if column.unit} for name, table in FILE_TABLES.items()
}
"""Table of a run folder -> the units of its columns; a name that ends in ``/`` stands for all that begin so."""

FILE_OF: Final = {table.joined: name for name, table in FILE_TABLES.items() if table.joined}
"""Table over many runs -> the table of a run folder that it joins."""

FORMULA_STARTS: Final = ("=", "+", "-", "@", "\t", "\r", "\n", "\uff1d", "\uff0b", "\uff0d", "\uff20")
"""First characters of a text that a spreadsheet may run; the last four are wide forms, which some take for the same."""

MOST_ROWS: Final = 1_048_575
"""Rows of an Excel sheet below its heading."""

MOST_CHARACTERS: Final = 32_767
"""Letters of an Excel cell."""

LARGEST_EXACT: Final = 10**15
"""Integers up to this one survive Excel, which keeps 15 digits; larger ones are written as text."""


def require_form(form: str) -> None:
    """Raise ``OutputError`` where the package that writes a form is not installed."""
    if form == XLSX:
        try:
            import xlsxwriter  # noqa: F401
        except ImportError as error:
            raise OutputError(NO_XLSXWRITER) from error


def write_tables(tables: Mapping[str, pa.Table], folder: Path, form: str) -> list[str]:
    """Write tables to a folder: a CSV file each, or a sheet each of one workbook; sentences on those left out."""
    if form == CSV:
        for name, table in tables.items():
            _write_csv(name, table, folder / f"{name}.csv")
    if form == PARQUET:
        for name, table in tables.items():
            pq.write_table(table, folder / f"{name}.parquet", compression="zstd")
    if form == XLSX:
        return _write_workbook(tables, folder / WORKBOOK_FILE)
    return []


def write_run_tables(folder: Path, form: str) -> list[str]:
    """Write the Parquet tables of a run folder once more in another form; sentences on those left out.

    The summary lists the new files, so that a run that replaces the folder takes them away.
    """
    if form == PARQUET:
        return []
    tables = {file.stem: read_table(file) for file in sorted(folder.glob("*.parquet"))}
    left_out = write_tables(tables, folder, form)
    written_files = [WORKBOOK_FILE] if form == XLSX else [f"{name}.csv" for name in tables]
    document = read_run_folder(folder).document
    new_document = structs.replace(document, files=tuple(sorted({*document.files, *written_files})))
    with whole_file(folder / SUMMARY_FILE, OutputError) as stream:
        stream.write(json_of(new_document).encode())
    return left_out


def headings(names: Iterable[str], table: str) -> list[str]:
    """Return names of columns of a table with their units: ``start [s]``."""
    units = COLUMN_UNITS.get(FILE_OF.get(table, table), {})
    with_units = []
    for name in names:
        name_prefix, separator, _ = name.partition("/")
        unit = units.get(name_prefix + separator)
        with_units.append(f"{name} [{unit}]" if unit else name)
    return with_units


def inert_value(value: Any) -> Any:
    """Return a value that no spreadsheet runs: a text that begins like a formula gets an apostrophe before it."""
    if isinstance(value, str):
        # Blanks and invisible characters before a formula may be dropped.
        first_visible = next(
            (k for k, letter in enumerate(value) if letter in FORMULA_STARTS or _is_visible(letter)), len(value)
        )
        if value.startswith(FORMULA_STARTS, first_visible):
            return f"'{value}"
    return value


def _is_visible(letter: str) -> bool:
    return letter.isprintable() and not letter.isspace()


def _rows(table: pa.Table) -> Iterator[Sequence[Any]]:
    """Yield the rows of a table, some thousand in memory at a time."""
    for batch in table.to_batches(max_chunksize=10_000):
        yield from zip(*(column.to_pylist() for column in batch.columns), strict=True)


def _write_csv(name: str, table: pa.Table, path: Path) -> None:
    """Write a table in UTF-8 with the mark by which Excel knows it."""
    with path.open("w", encoding="utf-8-sig", newline="") as file:
        writer = csv.writer(file, lineterminator="\r\n")
        writer.writerow([inert_value(heading) for heading in headings(table.column_names, name)])
        writer.writerows([inert_value(value) for value in row] for row in _rows(table))


def _write_workbook(tables: Mapping[str, pa.Table], path: Path) -> list[str]:
    require_form(XLSX)
    from xlsxwriter import Workbook

    left_out = []
    with Workbook(str(path), {"constant_memory": True, "strings_to_formulas": False, "strings_to_urls": False}) as book:
        bold = book.add_format({"bold": True})
        for name, table in tables.items():
            if len(table) > MOST_ROWS:
                left_out.append(f"{name} has {len(table):,} rows, more than an Excel sheet holds: use its Parquet file")
                continue
            sheet = book.add_worksheet(name[:31])
            sheet.freeze_panes(1, 0)
            for column, heading in enumerate(headings(table.column_names, name)):
                sheet.write_string(0, column, heading, bold)
            for number, row in enumerate(_rows(table), 1):
                for column, value in enumerate(row):
                    _write_cell(sheet, number, column, value)
    return left_out


def _write_cell(sheet: Any, row: int, column: int, value: Any) -> None:
    """Write a cell by its type; what is not there or is no number stays empty."""
    if value is None:
        return
    if isinstance(value, bool):
        sheet.write_boolean(row, column, value)
    elif isinstance(value, int | float) and isfinite(value) and abs(value) < LARGEST_EXACT:
        sheet.write_number(row, column, value)
    elif isinstance(value, float):
        return
    else:
        sheet.write_string(row, column, str(value)[:MOST_CHARACTERS])
