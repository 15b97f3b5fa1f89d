import json

import numpy as np
import pytest
from support.small_worlds import cubes, framed

from replay.cli.main import main
from replay.cli.tradeoff_tables import pareto_table
from replay.tradeoffs import growth
from replay.tradeoffs import sweep as trading
from replay.tradeoffs.settings import TRUST, Setting, steps_of_trust
from sessions import write_session

PLACES = {"a": [0] * 12, "b": [3, 3, 3, 3, 0.9, 3, 3, 3, 0.9, 0.8, 0.9, 3]}


@pytest.fixture
def file(tmp_path, monkeypatch):
    rate = Setting("discrete", "step rate", "20 Hz", {"rate_hz": 20.0})
    monkeypatch.setattr(trading, "settings_list", lambda **_: (Setting("hybrid", "as it comes", ""), rate))
    write_session(cubes(PLACES), tmp_path / "s.mcap")
    return str(tmp_path / "s.mcap")


def test_front_and_advice_are_printed_and_the_folder_is_written(file, tmp_path, capsys):
    assert main(["tradeoff", file, "--out", str(tmp_path / "costs")]) == 0
    out, err = capsys.readouterr()
    assert err.index("outside the time limit: one audit") < err.index("wrote ")
    said = " ".join(out.split())
    assert "The clock's self-check, live: exact timed twice gives" in said and "16 look phases" in said
    assert "Missing nothing costs" in said and "Live: one frame after the other, 12 frames a pass" in said
    assert "hybrid" in out and "To audit a recording" in out and "tradeoff.png" in err
    assert (tmp_path / "costs" / "tradeoff.parquet").is_file()
    assert main(["tradeoff", file, "--out", str(tmp_path / "costs")]) != 0


def test_detectors_replace_the_list_and_the_same_one_twice_is_a_tie(file, capsys):
    assert main(["tradeoff", file, "--detectors", "a=exact,b=exact", "--format", "json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert [row["label"] for row in told["rows"]] == ["a", "b"] and told["clock"]["live"]["passes"] >= 7
    assert told["advice"] and all("take a: " in one or "take b: " in one for one in told["advice"])


def test_the_steps_of_trust_stand_in_their_order_with_what_each_adds(file, capsys):
    assert main(["tradeoff", file, "--steps"]) == 0
    assert "what the step adds" in " ".join(capsys.readouterr().out.split())
    done = trading.tradeoff(cubes(PLACES), settings=steps_of_trust(), repeats=1, time_limit=None)
    shown = pareto_table(done)
    assert [row[:2] for row in shown.rows] == [(adds, label) for label, _, _, adds in TRUST]
    lost = {row["label"]: row["contacts_lost"] for row in done.rows}
    assert lost["exact"] == lost["containment"] == lost["faces"] == 0


@pytest.mark.slow
def test_growth_is_timed_when_asked_for_and_its_picture_is_written(file, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(growth, "SIZES", {"bodies": (1, 2)})
    out = tmp_path / "costs"
    assert main(["tradeoff", file, "--growth", "--no-picture", "--out", str(out)]) == 0
    assert "No size tried takes a complete detector out of its budget" in capsys.readouterr().out
    assert (out / "growth.png").is_file() and "fits up to 4" in (out / "report.html").read_text("utf-8")
    told = json.loads((out / "tradeoff.json").read_text("utf-8"))["growth"]
    assert {one["size"] for one in told} == {2, 4}


def test_what_a_time_limit_cuts_is_said(file, capsys):
    assert main(["tradeoff", file, "--time-limit", "0"]) == 0
    told = capsys.readouterr().err
    assert "1 of 2 settings were not tried" in told and "discrete step rate 20 Hz" in told


def test_help_says_what_the_time_limit_does_not_count(capsys):
    assert main(["tradeoff", "--help"]) == 0
    assert "Not in it: compiling, and the audit for --out" in " ".join(capsys.readouterr().out.split())


@pytest.mark.slow
def test_sources_and_a_folder_without_a_picture_when_asked(file, tmp_path, capsys):
    words = ["tradeoff", file, "-v"]
    assert main([*words, "--no-picture", "--out", str(tmp_path / "costs")]) == 0
    out, err = capsys.readouterr()
    assert out.index("To audit a recording") < out.index("detector hybrid") < out.index("detector discrete")
    assert not (tmp_path / "costs" / "run.rrd").exists() and "replay view" not in err
    assert main([*words, "--format", "json"]) == 0
    assert [*json.loads(capsys.readouterr().out)["sources"]] == ["detector hybrid", "detector discrete"]


def test_a_pose_that_the_policy_drops_is_in_no_row():
    status = [[1, 1]] * 8
    places = [[[0, 0, 0], [x, 0, 0]] for x in (3, 0.9, 0.9, 3, 3, 0.9, 3, 3)]
    turns = np.tile([0.0, 0.0, 0.0, 1.0], (8, 2, 1))
    turns[5, 1] = 0.0
    session = framed(range(0, 80_000_000, 10_000_000), status, places, turns)
    settings = [Setting("hybrid", "as it comes", "")]
    (row,) = trading.tradeoff(session, settings=settings, policy=["zero-quaternion=drop"], repeats=1).rows
    assert (row["both"], row["missed_pair_frames"], row["left_out"]) == (2, 0, 1)
