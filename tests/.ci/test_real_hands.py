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
    """Three clips of people who drink; python-fcl differs in no frame."""
    text = page("results")
    rows = [line.strip("| ").split(" | ") for line in text[text.index(command.BEGIN) :].splitlines()]
    rows = {cells[0]: cells for cells in rows if cells[0] in {clip.title for clip in command.CLIPS}}
    assert [*rows] == [clip.title for clip in command.CLIPS] and command.HEAD in text
    _title, _frames, in_contact, differing, *_ = zip(*rows.values(), strict=False)
    assert in_contact == ("256", "733", "275") and differing == ("0", "0", "0")


def test_references_have_commits_and_commands(tmp_path):
    lines = [*command.fetch_commands(tmp_path)]
    assert all(shlex.split(line) for line in lines)
    for repository, (commit, _) in command.REPOSITORIES.items():
        assert re.fullmatch("[0-9a-f]{40}", commit) and any(repository in line for line in lines)


def test_absent_models_are_said(tmp_path, capsys):
    command.write_page(tmp_path)
    assert "lacks the models of MyoDM; fetch them" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.skipif(not command.is_complete(MODELS), reason="no models of MyoDM; .ci/real_hands.py fetches them")
@pytest.mark.parametrize("clip", command.CLIPS, ids=lambda clip: clip.vessel)
def test_row_of_the_page_is_reproduced(clip):
    assert command.row(clip, MODELS) in page("results")
