"""The guide's table of detectors is the one its detectors write."""

import pytest
from support.processes import script

from cdcore.detectors.detector_table import DETECTORS, OPTIONAL, load_detector
from replay.guide.pages import page

command = script("choosing")
BEGIN, END, choosing_table, with_table = command.BEGIN, command.END, command.choosing_table, command.with_table


def test_the_table_of_the_guide_is_current():
    """The table of detectors on the page "glossary" is the one that the script writes today."""
    text = page("glossary")
    assert with_table(text, choosing_table()) == text, "run the module that makes the table"


def test_every_detector_has_a_row_with_its_kind():
    """Below two lines of heading: a row of four cells for each detector of the table, those of extras last.

    The first cell is its name in backticks, the second its kind; a bar within a cell is escaped.
    """
    _, _, *rows = choosing_table().splitlines()
    assert [row.split("`")[1] for row in rows] == list(DETECTORS | OPTIONAL)
    bars_of_four_cells = 5
    assert {row.replace("\\|", "").count("|") for row in rows} == {bars_of_four_cells}
    assert {row.split("|")[2].strip() for row in rows} == {"own", "paper", "re-creation", "engine"}


def test_the_page_names_the_detectors_that_cannot_run_live():
    """The page "glossary" names image-space and continuous, whose class says that it needs a whole motion.

    Their ``online`` is false, that of every other detector true.
    """
    offline = [name for name in DETECTORS | OPTIONAL if not load_detector(name).online]
    assert offline == ["image-space", "continuous"]
    assert "All but `image-space` and `continuous` run frame by frame" in page("glossary")


def test_table_replaces_only_text_between_its_marks():
    """Text before the first mark and after the second stays; a text without marks is refused."""
    assert with_table(f"a\n{BEGIN}\nold\n{END}\nb", "new") == f"a\n{BEGIN}\nnew\n{END}\nb"
    with pytest.raises(ValueError, match="put both where the table belongs"):
        with_table("no marks", "new")
