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
        pytest.param(
            "replay/cli/commands.py", "Save what is left of a torn or damaged session file.", id="help of a verb"
        ),
        pytest.param("replay/cli/share.py", "Send the whole folder.", id="string of code"),
        pytest.param(
            "replay/show/report/run.html", "One card per pair of bodies, with its worst fault.", id="template"
        ),
        pytest.param("sessions/doctor/findings.toml", "check line of sight and base stations", id="catalogue"),
        pytest.param("replay/cli/demo.py", "This class is made up; ...", id="string with a field"),
    ],
)
def test_sentences_are_read_from_help_templates_and_catalogues(printed_sentences, file, text):
    """A sentence that ``file`` prints today is among those that the script collects; a field is three dots."""
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
    """A riddle and a plain sentence: only the riddle is listed, with its file and line, once for each reason."""
    plain = "The detector missed 2 of 18 contacts."
    lines = command.riddles([("a.py", 3, riddle), ("a.py", 4, plain)])
    assert lines
    assert all(line.startswith("a.py:3: ") and line.endswith(f": {riddle}") for line in lines)


def test_docstrings_are_not_collected_as_printed_sentences(printed_sentences):
    """The first line of a module's docstring has words enough for a sentence, but is not among those collected."""
    docstring = ast.get_docstring(ast.parse((command.ROOT / "replay/document/headline.py").read_text("utf-8")))
    first_line = docstring.splitlines()[0]
    assert len(first_line.split()) > command.LEAST_WORDS
    assert not any(first_line in text for _, _, text in printed_sentences)
