"""Rows grouped by their column, whatever their order."""

import numpy as np
import pytest

from cdcore.narrow.pair_frames import rows_of_columns


@pytest.mark.parametrize(
    ("columns", "rows"),
    [
        ([], {}),
        ([0, 0, 2], {0: [0, 1], 2: [2]}),
        ([2, 1, 0], {0: [2], 1: [1], 2: [0]}),
        ([1, 0, 1], {0: [1], 1: [0, 2]}),
    ],
)
def test_columns_ascend_and_so_do_the_rows_of_each(columns, rows):
    """``columns``: one for each row; ``rows``: of each column."""
    grouped = rows_of_columns(np.array(columns, dtype=np.int64))
    assert [(column, row_numbers.tolist()) for column, row_numbers in grouped] == list(rows.items())
