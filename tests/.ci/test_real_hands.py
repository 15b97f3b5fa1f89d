"""The guide's table of people who drink is that of its command; where the models are absent it says so."""

import os
import re
import shlex
from pathlib import Path

import pytest
from support.processes import script

from replay.guide.pages import page

command = script("real_hands")
MODELS = Path(os.environ.get("REAL_HANDS", "hands"))


def test_published_page_of_real_hands_counts_no_disagreement():
    """Three clips of people who drink: the page has a row for each, with its frames in contact.

    The counts of contact frames are those measured when the page was made; in none of them python-fcl differs.
    """
    text = page("results")
    assert command.HEAD in text
    titles = [clip.title for clip in command.CLIPS]
    rows = [line.strip("| ").split(" | ") for line in text[text.index(command.BEGIN) :].splitlines()]
    rows_of_clips = {cells[0]: cells for cells in rows if cells[0] in titles}
    assert [*rows_of_clips] == titles
    _title, _frames, in_contact, differing, *_ = zip(*rows_of_clips.values(), strict=False)
    assert in_contact == ("256", "733", "275")
    assert differing == ("0", "0", "0")


def test_references_have_commits_and_commands(tmp_path):
    """Each repository that models are from has a commit of 40 hexadecimal digits, and a command that fetches it."""
    commands = [*command.fetch_commands(tmp_path)]
    assert all(shlex.split(line) for line in commands)
    for repository, (commit, _) in command.REPOSITORIES.items():
        assert re.fullmatch("[0-9a-f]{40}", commit), repository
        assert any(repository in line for line in commands), repository


def test_absent_models_are_reported(tmp_path, capsys):
    """The folder of models is empty: the script says whose are missing, and that they can be fetched."""
    command.write_page(tmp_path)
    assert "lacks the models of MyoDM; fetch them" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.skipif(not command.is_complete(MODELS), reason="no models of MyoDM; .ci/real_hands.py fetches them")
@pytest.mark.parametrize("clip", command.CLIPS, ids=lambda clip: clip.vessel)
def test_row_of_the_page_is_reproduced(clip):
    """The script counts contacts of a clip anew from the models; the row that it makes is on the page."""
    assert command.row(clip, MODELS) in page("results")
