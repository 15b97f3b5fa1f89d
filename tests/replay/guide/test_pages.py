"""The index leads to every page, a word finds its page, and the table of detectors is the one they write."""

import re

import pytest

from cdcore import DETECTORS
from replay.guide.choosing import BEGIN, END, choosing_table, with_table
from replay.guide.pages import FOLDER, INDEX, find_topic, for_terminal, page, topics
from replay.studies.synthetic_sessions import made_up_names, made_up_session
from sessions.errors import SessionError


def test_the_index_links_every_page_once_and_no_other():
    assert sorted(topics()) == sorted(path.stem for path in FOLDER.glob("*.md") if path.stem != INDEX)
    assert topics()[0] == "audit" and topics()[-1] == "glossary"


@pytest.mark.parametrize("topic", [INDEX, *topics()])
def test_a_page_begins_with_its_title_and_keeps_its_code_in_a_terminal(topic):
    block = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
    assert page(topic).startswith("# ")
    assert block.findall(for_terminal(page(topic))) == block.findall(page(topic))
    assert max(map(len, (line for line in block.sub("", page(topic)).split("\n") if "|" not in line))) <= 120


def test_a_word_means_the_topic_or_the_only_one_that_contains_it():
    known = ["audit", "paper", "class-study", "paper-plane"]
    assert [find_topic(word, known) for word in ("audit", "Study", "paper", "p", "nonsense")] == [
        "audit", "class-study", "paper", None, None,
    ]  # fmt: skip


def test_a_link_becomes_the_command_that_prints_its_page():
    text = (
        "![picture](a.png)\n\n<!-- mark -->\n[audit](audit.md), [all](README.md), [file](../a.md), [web](https://a.b)"
    )
    assert for_terminal(text) == ("audit (`replay guide audit`), all (`replay guide`), file, [web](https://a.b)")


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


def test_an_analytic_session_is_made_by_its_name_and_seed():
    assert "fast-ball" in made_up_names()
    one, same, other = (made_up_session("fast-ball", seed)[0] for seed in (1, 1, 2))
    assert one.frames.position.tobytes() == same.frames.position.tobytes()
    assert one.frames.position.tobytes() != other.frames.position.tobytes()


def test_an_unknown_name_is_answered_with_those_there_are():
    with pytest.raises(SessionError, match="no made-up session 'bench'; there are: bench-bumps"):
        made_up_session("bench")
