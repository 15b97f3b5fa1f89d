"""Finds the column of a long table that tells its bodies apart: a row per body and time, as ``id,time,x,y,z,...``."""

from collections.abc import Collection
from typing import Final

import numpy as np

from sessions.errors import ImportFileError
from sessions.importers.csv_head import is_date_or_time
from sessions.importers.csv_table import CsvTable
from sessions.importers.ledger import Numbers, Rows, Stamps, is_large_loss, rows_lost

MOST_VALUES: Final = 100
"""Different values of a column that may be names of bodies."""
LEAST_ROWS: Final = 3
"""Rows of each body in the mean; a column of other numbers has more values."""
WORTH_A_COLUMN: Final = 2 / 3
"""Fraction of the lost rows that a column leaves at most, if it tells bodies apart and stamps repeat within them."""
JUMPS: Final = 4.0
"""Bodies whose rows take turns are so many times as far apart as a body moves from one of its rows to the next."""


def column_of_bodies(table: CsvTable, stamps: Stamps, used: Collection[str]) -> str:
    """The column of few values within each of which stamps increase; "" where there is none.

    Columns of text come before columns of numbers. Where stamps repeat within every column's values, it is the column
    that loses the fewest rows, if these are at most two thirds of those lost without a column. ``used`` are columns
    that hold something else.
    """
    fewest, best = WORTH_A_COLUMN * rows_lost(stamps, [np.ones(len(table), dtype=np.bool_)]), ""
    for column in _candidates(table, used):
        lost = rows_lost(stamps, table.rows_by_text(column).values())
        if not is_large_loss(lost, len(table)):
            return column
        if lost <= fewest:
            fewest, best = lost, column
    return best


def _candidates(table: CsvTable, used: Collection[str]) -> list[str]:
    """Columns of few values that are no dates, those of text first."""
    most = min(MOST_VALUES, len(table) // LEAST_ROWS)
    free = [column for column in table.columns if column not in used and 2 <= table.count_different(column) <= most]
    names = [column for column in free if not is_date_or_time(table.first_text(column))]
    return sorted(names, key=table.holds_numbers)


def is_interleaved(table: CsvTable, column: str) -> bool:
    """Whether rows of different values of a column take turns, as those of bodies do and those of trials do not."""
    codes = np.zeros(len(table), dtype=np.int64)
    for code, rows in enumerate(table.rows_by_text(column).values()):
        codes[rows] = code
    return bool(np.count_nonzero(np.diff(codes)) > len(codes) // 2)


def column_of_separate_bodies(table: CsvTable, position: Collection[str], used: Collection[str]) -> str:
    """Returns the column whose values take turns while the position jumps between them; "" where there is none.

    Stamps cannot tell bodies apart whose rows are never of the same time.
    """
    try:
        positions = table.numbers([*position])
    except ImportFileError:  # the import by the mapping says which cell is no number
        return ""
    for column in _candidates(table, used):
        if is_interleaved(table, column) and _jumps_between_groups(positions, [*table.rows_by_text(column).values()]):
            return column
    return ""


def _jumps_between_groups(positions: Numbers, groups: Collection[Rows]) -> bool:
    """Whether positions (n, 3) jump from a row to the next much farther than from a row of a group to its next."""
    steps_within = np.concatenate([_step_lengths(positions[rows]) for rows in groups])
    return bool(np.nanmedian(_step_lengths(positions)) > JUMPS * np.nanmedian(steps_within))


def _step_lengths(positions: Numbers) -> Numbers:
    present = positions[np.isfinite(positions).all(axis=1)]
    lengths: Numbers = np.linalg.norm(np.diff(present, axis=0), axis=1)
    return lengths


def repeats_within(table: CsvTable, stamps: Stamps, names: str, used: Collection[str]) -> str:
    """A sentence on rows that repeat a stamp of the same body, and its cure; "" where hardly any does.

    ``names``: the column of bodies.
    """
    distinct = table.distinct_rows()
    bodies = {name: rows & distinct for name, rows in table.rows_by_text(names).items()}
    lost = rows_lost(stamps, bodies.values())
    if not is_large_loss(lost, len(table)):
        return ""
    repeated = sum(int(rows.sum()) - len(np.unique(stamps[rows])) for rows in bodies.values())
    if not is_large_loss(repeated, len(table)):
        return f"{lost:,} of {len(table):,} rows would be dropped: they go back in time; sort the rows by their stamps"
    cure = "keep one row of each body and stamp in the file"
    for column in _candidates(table, {*used, names}):
        values = table.rows_by_text(column).values()
        if not is_large_loss(rows_lost(stamps, [rows & own for rows in bodies.values() for own in values]), len(table)):
            cure = f"keep the rows of one value of column {column!r} in the file"
            break
    return f"{lost:,} of {len(table):,} rows would be dropped: they repeat a stamp of the same body, or go back; {cure}"


def order_of(values: np.ndarray[tuple[int], np.dtype[np.float64]]) -> Stamps:
    """Whole numbers in the order of some times of any unit, (n,); what is no time comes last."""
    ranks: Stamps = np.unique(np.nan_to_num(values, nan=np.inf), return_inverse=True)[1].astype(np.int64)
    return ranks
