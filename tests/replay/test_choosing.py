"""The guide's table of detectors is the one its detectors write."""

import pytest

from cdcore import DETECTORS
from replay.choosing import BEGIN, END, choosing_table, with_table
from replay.guide.pages import page


def test_the_table_of_the_guide_is_current():
    text = page("detectors")
    assert with_table(text, choosing_table()) == text, "run the module that makes the table"


def test_every_detector_has_one_row_of_four_cells():
    rows = choosing_table().splitlines()[2:]
    assert [row.split("`")[1] for row in rows] == list(DETECTORS)
    assert {row.replace("\\|", "").count("|") for row in rows} == {5}


def test_only_what_stands_between_the_marks_is_replaced():
    assert with_table(f"a\n{BEGIN}\nold\n{END}\nb", "new") == f"a\n{BEGIN}\nnew\n{END}\nb"
    with pytest.raises(ValueError, match="put both where the table belongs"):
        with_table("no marks", "new")
