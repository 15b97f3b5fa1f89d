"""Every row is handed out once, with its own column, whatever the order of the columns."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cdcore.narrow.pair_frames import rows_of_columns


@given(st.lists(st.integers(0, 5), max_size=40))
def test_each_column_comes_once_with_all_its_rows_in_order(columns):
    given_columns = np.array(columns, dtype=np.int64)
    for order in (given_columns, np.sort(given_columns)):
        found = {column: rows.tolist() for column, rows in rows_of_columns(order)}
        expected = {k: np.flatnonzero(order == k).tolist() for k in sorted(set(columns))}
        assert found == expected
        assert list(found) == sorted(found)
