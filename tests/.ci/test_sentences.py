"""Sentences of the tool are found in code, templates and catalogues, and none reads as a riddle."""

import ast

import pytest
from support.processes import script

command = script("sentences")


FOLDERS = ("replay/cli", "replay/show/report", "sessions/doctor", "replay/document")
"""Folders with help of verbs, templates of pages, a catalogue, and docstrings that nobody prints.

`.ci/lint` reads the sentences of the whole tool.
"""


@pytest.fixture(scope="module")
def printed_sentences():
    """Every sentence that the sources may print, with its file and line."""
    return list(command.sentences(FOLDERS))


@pytest.mark.parametrize(
    ("file", "text"),
    [
        ("replay/cli/commands.py", "Save what is left of a torn or damaged session file."),
        ("replay/cli/share.py", "Send the whole folder."),
        ("replay/show/report/run.html", "One card per pair of bodies, with its worst fault."),
        ("sessions/doctor/findings.toml", "check line of sight and base stations"),
        ("replay/cli/demo.py", "This class is made up; ..."),
    ],
)
def test_sentences_are_read_from_help_templates_and_catalogues(printed_sentences, file, text):
    assert any(name == file and text in sentence for name, _, sentence in printed_sentences)


@pytest.mark.parametrize(
    "riddle",
    [
        "No association was told from chance in 24 students",
        "Of a detector at 1 Hz it is 0.",
        "A row is a link to one recording, and no figure of it",
        "frames that the detector looks at",
        "Detectors that can be asked live",
        "On the front is what is surely quicker",
    ],
)
def test_a_riddle_is_recognised(riddle):
    lines = command.riddles([("a.py", 3, riddle), ("a.py", 4, "The detector missed 2 of 18 contacts.")])
    assert lines and all(line.startswith("a.py:3: ") and line.endswith(f": {riddle}") for line in lines)


def test_docstrings_are_not_collected_as_printed_sentences(printed_sentences):
    docstring = ast.get_docstring(ast.parse((command.ROOT / "replay/document/headline.py").read_text("utf-8")))
    first_line = docstring.splitlines()[0]
    assert len(first_line.split()) > command.LEAST_WORDS
    assert not any(first_line in text for _, _, text in printed_sentences)
