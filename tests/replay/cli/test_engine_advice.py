import json

import pytest
from support.small_worlds import unit_cubes_on_x

from replay.cli.main import main
from replay.cutting import piece_store
from replay.running import advisor
from sessions import write_session

POSITIONS = {"a": [0] * 12, "b": [3, 3, 0.9, 3, 3, 3, 3, 3, 0.9, 0.8, 0.9, 3]}


@pytest.fixture
def session_file(tmp_path, monkeypatch):
    """A session of two cubes, on a machine without any engine."""
    monkeypatch.setattr(advisor, "find_spec", lambda name: None)
    write_session(unit_cubes_on_x(POSITIONS), tmp_path / "s.mcap")
    return str(tmp_path / "s.mcap")


def test_json_has_rows_and_advice_and_a_folder_is_written(session_file, tmp_path, monkeypatch, capsys):
    """`replay tradeoff --engine unreal` of a session of two cubes: advice which colliders to use there.

    Convex pieces of meshes are stored from an earlier command (cut-1.npz), so that none are announced to be cut.
    """
    monkeypatch.setattr(piece_store, "cache_folder", lambda: tmp_path)
    (tmp_path / "cut-1.npz").touch()
    out = tmp_path / "runs"
    arguments = ["tradeoff", session_file, "--engine", "unreal", "--format", "json", "--out", str(out), "--no-picture"]
    assert main(arguments) == 0
    printed, progress = capsys.readouterr()
    reported = json.loads(printed)
    assert (reported["engine"], reported["version"]) == ("Unreal Engine", "5")
    assert reported["advice"]
    assert reported["rows"][0]["number"] == 1
    assert (out / "report.html").is_file() and str(out) in progress
    assert "cutting meshes" not in progress


def test_missing_pieces_are_announced_before_cutting(session_file, tmp_path, monkeypatch, capsys):
    """Advice for an engine needs convex pieces of meshes, and the folder in which they are stored has none."""
    monkeypatch.setattr(piece_store, "cache_folder", lambda: tmp_path)
    assert main(["tradeoff", session_file, "--engine", "unity"]) == 0
    assert "cutting meshes" in capsys.readouterr().err
