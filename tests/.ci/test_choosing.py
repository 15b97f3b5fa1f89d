"""The guide's table of detectors is the one its detectors write."""

import pytest
from support.processes import script

from cdcore.detectors.detector_table import DETECTORS, OPTIONAL, load_detector
from replay.guide.pages import page

command = script("choosing")
BEGIN, END, choosing_table, with_table = command.BEGIN, command.END, command.choosing_table, command.with_table


def test_the_table_of_the_guide_is_current():
    text = page("glossary")
    assert with_table(text, choosing_table()) == text, "run the module that makes the table"


def test_every_detector_has_a_row_with_its_kind():
    rows = choosing_table().splitlines()[2:]
    assert [row.split("`")[1] for row in rows] == list(DETECTORS | OPTIONAL)
    assert {row.replace("\\|", "").count("|") for row in rows} == {5}
    assert {row.split("|")[2].strip() for row in rows} == {"own", "paper", "re-creation", "engine"}


def test_the_page_names_the_detectors_that_cannot_run_live():
    offline = [name for name in DETECTORS | OPTIONAL if not load_detector(name).online]
    assert offline == ["image-space", "continuous"]
    assert "All but `image-space` and `continuous` run frame by frame" in page("glossary")


def test_table_replaces_only_text_between_its_marks():
    assert with_table(f"a\n{BEGIN}\nold\n{END}\nb", "new") == f"a\n{BEGIN}\nnew\n{END}\nb"
    with pytest.raises(ValueError, match="put both where the table belongs"):
        with_table("no marks", "new")
