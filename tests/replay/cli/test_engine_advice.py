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


def test_json_holds_rows_and_advice_and_a_folder_is_written(session_file, tmp_path, monkeypatch, capsys):
    """Pieces that are kept from earlier commands are not announced."""
    monkeypatch.setattr(piece_store, "cache_folder", lambda: tmp_path)
    (tmp_path / "cut-1.npz").touch()
    out = tmp_path / "runs"
    arguments = ["tradeoff", session_file, "--engine", "unreal", "--format", "json", "--out", str(out), "--no-picture"]
    assert main(arguments) == 0
    reported, err = capsys.readouterr()
    reported = json.loads(reported)
    assert (
        (reported["engine"], reported["version"]) == ("Unreal Engine", "5")
        and reported["advice"]
        and reported["rows"][0]["number"] == 1
    )
    assert (out / "report.html").is_file() and str(out) in err
    assert "cutting meshes" not in err


def test_missing_pieces_are_announced_before_cutting(session_file, tmp_path, monkeypatch, capsys):
    """The folder of kept pieces has none."""
    monkeypatch.setattr(piece_store, "cache_folder", lambda: tmp_path)
    assert main(["tradeoff", session_file, "--engine", "unity"]) == 0
    assert "cutting meshes" in capsys.readouterr().err
