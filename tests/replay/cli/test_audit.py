import json

import pytest
from support.small_worlds import cubes

from replay import run
from replay.cli.main import main
from sessions import write_session

PLACES = {"a": [0] * 12, "b": [3, 3, 3, 3, 0.9, 3, 3, 3, 0.9, 0.8, 0.9, 3]}
SLOW = "slow=discrete[rate_hz=20]"


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("session") / "s.mcap"
    write_session(cubes(PLACES), path)
    return str(path)


def test_counts_of_every_detector_are_printed(file, capsys):
    assert main(["audit", file, "--detectors", f"{SLOW},hybrid"]) == 0
    printed = capsys.readouterr().out
    assert "slow" in printed and "hybrid" in printed
    for word in ("matched", "missed", "invented", "split", "merged", "not examined", "between looks 2"):
        assert word in printed


def test_json_holds_the_sums_and_the_runs(file, capsys):
    assert main(["audit", file, file, "--detector", SLOW, "--format", "json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["audit"]["slow"]["episodes"]["missed"] == 2 and len(told["runs"]) == 2 and told["broken"] == []


def test_a_broken_gate_ends_in_4_and_says_which(file, capsys):
    assert main(["audit", file, "--detector", SLOW, "--max-missed", "0.01", "--max-p99-ms", "10000"]) == 4
    assert "slow missed 1 of 2 contacts" in capsys.readouterr().err
    assert main(["audit", file, "--detector", "hybrid", "--max-missed", "0.01"]) == 0
    assert main(["audit", file, "--detector", "hybrid", "--max-p99-ms", "11.1"]) == 4


def test_frames_slower_than_the_gate_end_in_4_and_both_gates_kept_in_0(file, capsys):
    both = ["--max-missed", "0.01", "--max-p99-ms"]
    assert main(["audit", file, "--detector", "discrete", *both, "10000"]) == 0
    capsys.readouterr()
    assert main(["audit", file, "--detector", "discrete", *both, "0.000001"]) == 4
    told = capsys.readouterr().err
    assert "at the 99th percentile" in told and "more than --max-p99-ms 1e-06" in told and "missed" not in told


def test_a_run_folder_is_written_when_asked(file, tmp_path):
    assert main(["audit", file, "--detector", SLOW, "--out", str(tmp_path / "run"), "--no-picture", "--no-faces"]) == 0
    assert {"summary.json", "episodes.parquet"} <= {path.name for path in (tmp_path / "run").iterdir()}


def test_a_long_list_is_cut_in_the_terminal_and_says_so(tmp_path, capsys):
    places = [3, 0.9] * 40
    run(cubes({"a": [0] * 80, "b": places}), detectors="hybrid", oracle="none", out=tmp_path / "a", picture=False)
    run(cubes({"a": [0] * 80, "b": [3, 2] * 40}), detectors="hybrid", oracle="none", out=tmp_path / "b", picture=False)
    assert main(["diff", str(tmp_path / "a"), str(tmp_path / "b")]) == 0
    printed = capsys.readouterr().out
    assert printed.count("hybrid: lost") == 20 and "and 20 more with --format json" in printed


def test_a_folder_that_is_none_ends_in_one_sentence(tmp_path, capsys):
    assert main(["diff", str(tmp_path), str(tmp_path)]) == 1
    assert "is not a run folder" in capsys.readouterr().err
