"""A table is plain data whose cells a reader sees with four digits."""

import pytest

from replay.outputs.paper_table import PaperTable, shown


@pytest.mark.parametrize(
    ("cell", "text"),
    [(None, "-"), (1234, "1,234"), (0.123456, "0.1235"), (1.0, "1"), ("a", "a"), (2e-9, "2e-09"),
     (21850.4, "21,850"), (999.96, "1000")],
)  # fmt: skip
def test_a_cell_is_shown_as(cell, text):
    assert shown(cell) == text


def test_a_column_is_found_by_its_heading():
    one = PaperTable("T", "title", ("a", "b"), ((1, 2), (3, 4)))
    assert one.column("b") == [2, 4] and one.as_json()["rows"] == ((1, 2), (3, 4))
