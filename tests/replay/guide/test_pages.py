"""The index leads to every page; what a terminal cannot show becomes what it can."""

import re

import pytest

from replay.errors import OutputError
from replay.guide.pages import INDEX_PAGE, PAGES_FOLDER, for_terminal, page, topics, write_scripts


def test_guide_index_links_every_page_exactly_once():
    """The index is a Markdown page too; it links the others in reading order, from a recording to the glossary."""
    pages = [path.stem for path in PAGES_FOLDER.glob("*.md") if path.stem != INDEX_PAGE]
    assert sorted(topics()) == sorted(pages)
    first, *_, last = topics()
    assert (first, last) == ("your-recording", "glossary")


@pytest.mark.parametrize("topic", [INDEX_PAGE, *topics()])
def test_page_starts_with_a_title(topic):
    """Every page of the guide is Markdown, and begins with a heading of the first level."""
    assert page(topic).startswith("# ")


@pytest.mark.parametrize("topic", [INDEX_PAGE, *topics()])
def test_page_keeps_its_code_in_a_terminal(topic):
    """Blocks of code, between lines of three backticks, are the same in the text for a terminal."""
    block = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
    assert block.findall(for_terminal(page(topic))) == block.findall(page(topic))


def test_a_link_becomes_the_command_that_prints_its_page():
    """Links to a page, to the index, to another file and to the web; pictures and comments are left out."""
    markdown = (
        "![picture](a.png)\n\n<!-- mark -->\n[audit](audit.md), [all](README.md), [file](../a.md), [web](https://a.b)"
    )
    assert for_terminal(markdown) == "audit (`replay guide audit`), all (`replay guide`), file, [web](https://a.b)"


def test_scripts_of_a_page_are_copied(tmp_path):
    """The page *your-recording* has C# scripts for Unity; written twice, since the same files may be there already."""
    written = write_scripts("your-recording", tmp_path)
    assert written
    assert [path.read_bytes() for path in written] == [(PAGES_FOLDER / path.name).read_bytes() for path in written]
    assert write_scripts("your-recording", tmp_path) == written


def test_scripts_of_a_page_replace_no_other_file(tmp_path):
    """A user has changed one of the scripts since they were written."""
    *_, script = write_scripts("your-recording", tmp_path)
    script.write_text("my own")
    with pytest.raises(OutputError, match="is there already and differs"):
        write_scripts("your-recording", tmp_path)
    assert script.read_text() == "my own"


def test_scripts_of_a_page_without_any_are_refused(tmp_path):
    """The glossary has no scripts."""
    with pytest.raises(OutputError, match="has no scripts"):
        write_scripts("glossary", tmp_path)
