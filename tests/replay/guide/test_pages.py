"""The index leads to every page; a word finds its page; what a terminal cannot show becomes what it can."""

import re

import pytest

from replay.guide.pages import FOLDER, INDEX, find_topic, for_terminal, page, topics


def test_the_index_links_every_page_once_and_no_other():
    assert sorted(topics()) == sorted(path.stem for path in FOLDER.glob("*.md") if path.stem != INDEX)
    assert topics()[0] == "your-recording" and topics()[-1] == "glossary"


@pytest.mark.parametrize("topic", [INDEX, *topics()])
def test_page_starts_with_title_and_keeps_code_in_a_terminal(topic):
    block = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
    assert page(topic).startswith("# ")
    assert block.findall(for_terminal(page(topic))) == block.findall(page(topic))


def test_a_word_means_the_topic_or_the_only_match():
    known = dict.fromkeys(["audit", "paper", "class-study", "paper-plane"], "") | {"recording": "# R\n## From Unity\n"}
    text = ("audit", "Study", "paper", "p", "unity", "nonsense")
    assert [find_topic(word, known) for word in text] == ["audit", "class-study", "paper", None, "recording", None]


@pytest.mark.parametrize(
    ("word", "topic"),
    [
        ("unity", "your-recording"), ("csv", "your-recording"), ("noise", "what-is-wrong"), ("ship", "what-to-ship"),
        ("build", "in-a-build"), ("sql", "many-sessions"), ("cluster", "many-sessions"),
        ("chemistry", "scenes-and-effects"),
        ("personal", "files-and-promises"), ("hard", "hard-cases"), ("class", "class-study"), ("verdicts", "glossary"),
        ("real-hands", "results"), ("tracked-hands", "your-recording"),
    ],
)  # fmt: skip
def test_a_word_of_a_reader_leads_to_its_page(word, topic):
    assert find_topic(word, {name: page(name) for name in topics()}) == topic


def test_a_link_becomes_the_command_that_prints_its_page():
    text = (
        "![picture](a.png)\n\n<!-- mark -->\n[audit](audit.md), [all](README.md), [file](../a.md), [web](https://a.b)"
    )
    assert for_terminal(text) == ("audit (`replay guide audit`), all (`replay guide`), file, [web](https://a.b)")
