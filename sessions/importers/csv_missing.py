"""Cells of a CSV that hold no number: words such as ``n/a``, and numbers such as -9999 that stand for one."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from sessions.importers.csv_columns_and_units import VOCABULARY
from sessions.importers.ledger import Numbers

EMPTY_CELLS: Final = frozenset(
    spelling for word in VOCABULARY["empty_cells"] for spelling in (word, word.lower(), word.upper(), word.capitalize())
)
"""Cells that say: no number here."""
SENTINELS: Final = (999.0, 9999.0, 99999.0, -999.0, -9999.0, -99999.0)
"""Numbers that programs write in place of a missing one."""
SENTINEL_RATIO: Final = 3.0
"""A sentinel is so many times as large as every other number of its column."""
LARGEST_POSSIBLE: Final = 999.0
"""A column may hold this size and nothing else, in millimetres; a column of 9999 alone holds nothing."""


def sentinel_size(values: Numbers) -> float:
    """Returns the size of what stands for missing numbers in a column (n,), with either sign, or NaN: nothing does."""
    sizes = np.abs(values[np.isfinite(values)])
    largest = float(sizes.max(initial=0.0))
    if largest not in SENTINELS:
        return np.nan
    others = sizes[sizes < largest]
    is_far_off = largest > SENTINEL_RATIO * float(others.max()) if len(others) else largest > LARGEST_POSSIBLE
    return largest if is_far_off else np.nan


def without_sentinels(values: Sequence[float]) -> list[float]:
    """Returns the numbers of a column that are no sentinel."""
    size = sentinel_size(np.array(values, dtype=np.float64))
    return [value for value in values if abs(value) != size]
