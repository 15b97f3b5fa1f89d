"""The index leads to every page; what a terminal cannot show becomes what it can."""

import re

import pytest

from replay.errors import OutputError
from replay.guide.pages import INDEX_PAGE, PAGES_FOLDER, for_terminal, page, topics, write_scripts


def test_guide_index_links_every_page_exactly_once():
    assert sorted(topics()) == sorted(path.stem for path in PAGES_FOLDER.glob("*.md") if path.stem != INDEX_PAGE)
    assert topics()[0] == "your-recording" and topics()[-1] == "glossary"


@pytest.mark.parametrize("topic", [INDEX_PAGE, *topics()])
def test_page_starts_with_title_and_keeps_code_in_a_terminal(topic):
    block = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
    assert page(topic).startswith("# ")
    assert block.findall(for_terminal(page(topic))) == block.findall(page(topic))


def test_a_link_becomes_the_command_that_prints_its_page():
    text = (
        "![picture](a.png)\n\n<!-- mark -->\n[audit](audit.md), [all](README.md), [file](../a.md), [web](https://a.b)"
    )
    assert for_terminal(text) == ("audit (`replay guide audit`), all (`replay guide`), file, [web](https://a.b)")


def test_scripts_of_a_page_replace_no_other_file(tmp_path):
    written = write_scripts("your-recording", tmp_path)
    assert [path.read_bytes() for path in written] == [(PAGES_FOLDER / path.name).read_bytes() for path in written]
    assert write_scripts("your-recording", tmp_path) == written, "the same files may be there already"
    written[-1].write_text("my own")
    with pytest.raises(OutputError, match="is there already and differs"):
        write_scripts("your-recording", tmp_path)
    assert written[-1].read_text() == "my own"
    with pytest.raises(OutputError, match="has no scripts"):
        write_scripts("glossary", tmp_path)
