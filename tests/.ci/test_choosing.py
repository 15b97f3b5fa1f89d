"""The guide's table of detectors is the one its detectors write."""

import pytest
from support.scripts import script

from cdcore.detectors import DETECTORS, OPTIONAL
from replay.guide.pages import page

command = script("choosing")
BEGIN, END, choosing_table, with_table = command.BEGIN, command.END, command.choosing_table, command.with_table


def test_the_table_of_the_guide_is_current():
    text = page("detectors")
    assert with_table(text, choosing_table()) == text, "run the module that makes the table"


def test_every_detector_has_one_row_of_six_cells_that_says_whose_answer_it_is_and_if_it_can_be_asked_live():
    rows = choosing_table().splitlines()[2:]
    assert [row.split("`")[1] for row in rows] == list(DETECTORS | OPTIONAL)
    assert {row.replace("\\|", "").count("|") for row in rows} == {7}
    offline = [row.split("`")[1] for row in rows if row.split("|")[3].strip() == "no"]
    assert offline == ["image-space", "continuous"]
    assert {row.split("|")[2].strip() for row in rows} == {"own", "paper", "re-creation", "engine"}


def test_only_what_stands_between_the_marks_is_replaced():
    assert with_table(f"a\n{BEGIN}\nold\n{END}\nb", "new") == f"a\n{BEGIN}\nnew\n{END}\nb"
    with pytest.raises(ValueError, match="put both where the table belongs"):
        with_table("no marks", "new")
