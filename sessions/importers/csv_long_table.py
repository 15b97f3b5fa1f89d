"""Finds the column of a long table that tells its bodies apart: a row per body and time, as ``id,time,x,y,z,...``."""

from collections.abc import Collection, Iterable
from typing import Final

import numpy as np

from sessions.importers.csv_table import CsvTable
from sessions.importers.ledger import LARGEST_UNREPORTED_LOSS
from sessions.importers.stamps import Rows, Stamps, longest_increasing

MOST_VALUES: Final = 100
"""Different values of a column that may be names of bodies."""
LEAST_ROWS: Final = 3
"""Rows of each body in the mean; a column of other numbers has more values."""


def rows_lost(stamps: Stamps, groups: Iterable[Rows]) -> int:
    """How many rows an import would drop because stamps repeat or go back, where each group is a body."""
    return sum(int((~longest_increasing(stamps[rows])).sum()) for rows in groups)


def is_large(lost: int, rows: int) -> bool:
    """Whether so many rows may not be lost without a word."""
    return lost > LARGEST_UNREPORTED_LOSS * rows


def column_of_bodies(table: CsvTable, stamps: Stamps, used: Collection[str]) -> str:
    """The column of few values within each of which stamps increase; "" where there is none.

    Columns of text come before columns of numbers. ``used`` are columns that hold something else.
    """
    candidates = [column for column in table.columns if column not in used]
    candidates.sort(key=table.holds_numbers)
    for column in candidates:
        if not 2 <= table.count_different(column) <= min(MOST_VALUES, len(table) // LEAST_ROWS):
            continue
        if not is_large(rows_lost(stamps, table.rows_by_text(column).values()), len(table)):
            return column
    return ""


def order_of(values: np.ndarray[tuple[int], np.dtype[np.float64]]) -> Stamps:
    """Whole numbers in the order of some times of any unit, (n,); what is no time comes last."""
    ranks: Stamps = np.unique(np.nan_to_num(values, nan=np.inf), return_inverse=True)[1].astype(np.int64)
    return ranks
