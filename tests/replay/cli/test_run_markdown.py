"""The answer for the page of a build."""

import pytest
from support.small_worlds import cubes

from replay.base.tables import markdown, table
from replay.cli.main import main
from sessions import write_session

HOSTILE = "a](http://x.y)<img src=x>|b"


@pytest.fixture
def file(tmp_path):
    write_session(cubes({"a": [0] * 12, "b": [3, 3, 3, 3, 0.9, 3, 3, 3, 0.9, 0.8, 0.9, 3]}), tmp_path / "s.mcap")
    return str(tmp_path / "s.mcap")


def test_one_session_has_its_failed_gates_before_the_answer_and_the_ranking(file, capsys):
    asked = ["--detectors", "slow=discrete[rate_hz=20],sphere", "--max-missed", "0", "--format", "markdown"]
    assert main(["run", file, *asked]) == 4
    printed, said = capsys.readouterr()
    places = ("- **gate failed:** slow missed", "are worst: ", "| slow |")
    gate, answer, ranking = (printed.index(words) for words in places)
    assert gate < answer < ranking and "gate: slow missed" in said
    assert main(["run", file, "--detectors", "hybrid", "--max-missed", "0", "--format", "markdown"]) == 0
    assert "gate failed" not in capsys.readouterr().out


def test_a_session_that_cannot_be_read_is_named_among_several(file, tmp_path, capsys):
    (tmp_path / "broken.mcap").write_bytes(b"no session")
    words = ["run", file, str(tmp_path / "broken.mcap"), "--detectors", "hybrid", "--format", "markdown"]
    assert main(words) == 3
    printed = capsys.readouterr().out
    assert "failed: broken: " in printed and "| s | 12 | 2 | 0 |" in printed


def test_no_name_becomes_a_tag_a_link_or_a_further_cell():
    lines = markdown(table("", ("pair", "frames"), [(HOSTILE, 1), ("all", 1234)])).splitlines()
    assert lines[2:] == [r"| a]\(http://x.y)\<img src=x>\|b | 1 |", "| all | 1,234 |"]
