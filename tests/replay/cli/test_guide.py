"""``replay guide``: a page, a section or a sentence; Markdown where the output is no terminal, rendered where it is."""

import re
import sys

import pytest

from replay.cli.main import main
from replay.guide.pages import INDEX_PAGE, page, topics


def test_piped_a_page_is_its_markdown(capsys):
    """`replay guide hard-cases` prints the page of that name, and without a name the list of pages."""
    assert main(["guide", "hard-cases"]) == 0
    assert capsys.readouterr().out == page("hard-cases")
    assert main(["guide"]) == 0
    assert capsys.readouterr().out == page(INDEX_PAGE)


@pytest.mark.sampled(12)
@pytest.mark.parametrize("topic", topics())
def test_page_fits_80_columns_without_markup(topic, capsys, monkeypatch):
    """``topic``: every page of the guide, rendered on a terminal; codes of colours do not count as columns."""
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", "80")
    assert main(["guide", topic]) == 0
    printed = re.sub(r"\x1b\[[\d;]*m", "", capsys.readouterr().out)
    assert max(map(len, printed.splitlines())) <= 80
    assert "](" not in printed and "<!--" not in printed


def test_guide_prints_a_section_and_lists_other_sections(capsys):
    """No page is called godot: the section about it is printed, and a list of others with their pages."""
    assert main(["guide", "godot"]) == 0
    printed = capsys.readouterr().out
    assert printed.startswith("# Your recording\n\n## From Unreal, Godot or any CSV\n")
    _, others = printed.split("Other sections, and the page to open:\n\n")
    assert "- Colliders to ship: `replay guide what-to-ship`\n" in others
    assert "## From Python" not in printed and "Not in this section" not in printed


def test_a_name_in_several_arguments_is_the_page(capsys):
    """`replay guide hard cases` is the page ``hard-cases``, whose hyphen is not typed."""
    assert main(["guide", "hard", "cases"]) == 0
    assert capsys.readouterr().out == page("hard-cases")


def test_guide_query_names_terms_missing_from_its_section(capsys):
    """The section with "doctor" of "doctor qqqqqq" is printed; its first line names the other word."""
    assert main(["guide", "doctor", "qqqqqq"]) == 0
    printed = capsys.readouterr().out
    assert printed.startswith("Not in this section: qqqqqq.\n\n# Your recording\n\n## Can you trust the recording?")


def test_guide_query_with_weak_match_lists_nearest_pages(capsys):
    """A section has one word of three, which would mislead: instead a list of the nearest pages is printed.

    No line starts a section, as "#" would.
    """
    assert main(["guide", "doctor", "qqqqqq", "wwwwww"]) == 0
    printed = capsys.readouterr().out
    assert printed.startswith("No section holds qqqqqq, wwwwww. The nearest, and the page to open:\n\n- ")
    assert "`replay guide your-recording`" in printed and "\n#" not in printed


def test_no_match_suggests_near_spellings_or_the_list(capsys):
    """Words that are in no section are a wrong call (2): "oss" is near "loss", and "qqqqqq ???" near nothing."""
    assert main(["guide", "oss"]) == 2
    assert "the guide has no section about 'oss'; near words: loss" in capsys.readouterr().err
    assert main(["guide", "qqqqqq", "???"]) == 2
    assert "no section about 'qqqqqq ???'; `replay guide` lists its pages" in capsys.readouterr().err


@pytest.mark.parametrize("query", ["import", "colliders", "missed", "time"])
def test_section_fits_80_columns(query, capsys, monkeypatch):
    """``query``: a word to which a section answers, on a terminal; codes of colours do not count as columns."""
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", "80")
    assert main(["guide", query]) == 0
    printed = re.sub(r"\x1b\[[\d;]*m", "", capsys.readouterr().out)
    assert max(map(len, printed.splitlines())) <= 80


def test_scripts_are_written_once_and_never_over_another_file(tmp_path, monkeypatch, capsys):
    """The page about Unity has two scripts, which ``--script`` writes to the current folder, and may write again.

    Where another text has the name of one of them the command fails and leaves it.
    """
    monkeypatch.chdir(tmp_path)
    assert main(["guide", "unity", "--script"]) == 0
    recorder = tmp_path / "VrLabRecorder.cs"
    assert "class VrLabRecorder" in recorder.read_text() and (tmp_path / "VrLabColliders.cs").is_file()
    assert main(["guide", "unity", "--script"]) == 0
    recorder.write_text("mine")
    assert main(["guide", "unity", "--script"]) == 1
    assert "VrLabRecorder.cs is there already and differs" in " ".join(capsys.readouterr().err.split())
    assert recorder.read_text() == "mine"


def test_page_without_scripts_names_a_page_with_them(capsys):
    """The glossary has no script; the page your-recording has."""
    assert main(["guide", "glossary", "--script"]) == 1
    assert "your-recording" in capsys.readouterr().err
