"""Sentences of the tool are found in code, templates and catalogues, and none reads as a riddle."""

import re

import pytest
from support.processes import script

command = script("sentences")


@pytest.fixture(scope="module")
def printed():
    return list(command.sentences())


def test_no_sentence_of_the_tool_is_a_riddle(printed):
    assert command.riddles(printed) == []


@pytest.mark.parametrize(
    ("file", "text"),
    [
        ("replay/cli/commands.py", "Save what is left of a torn or damaged session file."),
        ("replay/cli/share.py", "Send the whole folder."),
        ("replay/show/report/run.html", "One card per pair of bodies, with its worst fault."),
        ("sessions/doctor/findings.toml", "check line of sight and base stations"),
        ("replay/studies/class_study/tables.py", "could be distinguished from chance in ... students"),
    ],
)
def test_sentences_are_read_from_help_templates_and_catalogues(printed, file, text):
    assert any(name == file and text in sentence for name, _, sentence in printed)


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
    assert any(re.search(pattern, riddle) for pattern in command.RIDDLES.values())


def test_docstrings_are_not_collected_as_printed_sentences(printed):
    assert not any("Every sentence about a run in one place" in text for _, _, text in printed)
    assert len(printed) > 1500
