"""Rows grouped by their column, whatever their order."""

import numpy as np
import pytest

from cdcore.narrow.pair_frames import rows_of_columns


@pytest.mark.parametrize(
    ("columns", "rows_by_column"),
    [
        pytest.param([], {}, id="no rows"),
        pytest.param([0, 0, 2], {0: [0, 1], 2: [2]}, id="ascending"),
        pytest.param([2, 1, 0], {0: [2], 1: [1], 2: [0]}, id="descending"),
        pytest.param([1, 0, 1], {0: [1], 1: [0, 2]}, id="mixed"),
    ],
)
def test_columns_ascend_and_so_do_the_rows_of_each(columns, rows_by_column):
    """``columns``: the column of each row 0, 1, 2; they are grouped, column -> its rows."""
    groups = rows_of_columns(np.array(columns, dtype=np.int64))
    assert [(column, rows.tolist()) for column, rows in groups] == list(rows_by_column.items())
