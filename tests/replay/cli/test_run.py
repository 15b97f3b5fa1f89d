import json

import pytest
from support.small_worlds import cubes, framed

from replay.cli.main import main
from sessions import write_session

PLACES = {"a": [0] * 12, "b": [3, 3, 3, 3, 0.9, 3, 3, 3, 0.9, 0.8, 0.9, 3]}


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("session") / "s.mcap"
    write_session(cubes(PLACES), path)
    return path


def test_run_writes_the_folder_prints_tables_and_says_how_to_look(file, tmp_path, capsys):
    out = tmp_path / "run"
    assert (
        main(["run", str(file), "--out", str(out), "--detectors", "slow=discrete[rate_hz=20]", "--oracle", "hybrid"])
        == 0
    )
    printed, said = capsys.readouterr()
    assert "missed 1 of 2 contacts here" in printed
    assert f"replay view {out}" in said and "replay view" not in printed
    assert (out / "run.rrd").is_file() and (out / "summary.json").is_file()


def test_json_on_stdout_is_the_summary_and_the_misses(file, tmp_path, capsys):
    arguments = [
        "--format",
        "json",
        "--detector",
        "slow=discrete[rate_hz=20]",
        "--detector",
        "sphere",
        "--oracle",
        "hybrid",
    ]
    assert main(["run", str(file), "-o", str(tmp_path / "run"), "--no-picture", *arguments]) == 0
    report = json.loads(capsys.readouterr().out)
    assert set(report["detectors"]) == {"slow", "sphere", "hybrid"}
    assert [miss["number"] for miss in report["misses"]["slow"]] == [1, 2]
    assert report["out"] == str(tmp_path / "run") and not (tmp_path / "run" / "run.rrd").exists()


def test_start_and_end_and_seed_reach_the_run(file, tmp_path, capsys):
    where = [
        "run",
        str(file),
        "--out",
        str(tmp_path / "run"),
        "--no-picture",
        "--format",
        "json",
        "--detectors",
        "hybrid",
    ]
    assert main([*where, "--start", "0.02", "--end", "0.05", "--seed", "9", "--oracle", "none"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert (report["session"]["frames"], report["seed"], report["detectors"]["hybrid"]["contacts"]) == (4, 9, 1)


def test_quiet_says_nothing_on_stderr(file, tmp_path, capsys):
    assert main(["run", str(file), "--out", str(tmp_path / "run"), "--no-picture", "-q", "--detectors", "hybrid"]) == 0
    assert capsys.readouterr().err == ""


def test_frames_that_could_not_be_used_end_in_3_and_are_named(tmp_path, capsys):
    session = framed([0, 10, 10, 20], [[1, 1]] * 4)
    write_session(session, tmp_path / "s.mcap")
    code = main(
        ["run", str(tmp_path / "s.mcap"), "--out", str(tmp_path / "run"), "--no-picture", "--detectors", "hybrid"]
    )
    assert code == 3
    assert "note: 1 frame left out: the stamp repeats the one before" in capsys.readouterr().err


def test_a_folder_in_the_way_is_refused_and_force_replaces_it(file, tmp_path, capsys):
    where = ["run", str(file), "--out", str(tmp_path / "run"), "--no-picture", "--detectors", "hybrid"]
    assert main(where) == 0
    capsys.readouterr()
    assert main(where) == 1
    assert "replace it with --force" in capsys.readouterr().err
    assert main([*where, "--force"]) == 0


def test_cite_prints_the_sources_of_the_detectors_that_looked(file, tmp_path, capsys):
    plain = ["run", str(file), "--no-picture", "--detectors", "sphere", "--oracle", "hybrid"]
    assert main([*plain, "-o", str(tmp_path / "one"), "--cite"]) == 0
    printed = capsys.readouterr().out
    assert "detector sphere" in printed and "equation (21)" in printed and "FCL" in printed
    assert main([*plain, "-o", str(tmp_path / "two"), "--cite", "--format", "json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert set(report["sources"]) == {"detector sphere", "detector hybrid"}
    assert main([*plain, "-o", str(tmp_path / "three")]) == 0
    assert "equation (21)" not in capsys.readouterr().out
