import json

import pytest
from support.small_worlds import cubes, framed

from replay.cli.main import main
from sessions import write_session

PLACES = {"a": [0] * 12, "b": [3, 3, 3, 3, 0.9, 3, 3, 3, 0.9, 0.8, 0.9, 3]}
SLOW = "slow=discrete[rate_hz=20]"


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("session") / "s.mcap"
    write_session(cubes(PLACES), path)
    return str(path)


def test_run_writes_the_folder_prints_tables_and_says_how_to_look(file, tmp_path, capsys):
    out = tmp_path / "run"
    assert main(["run", file, "--out", str(out), "--detectors", "slow=discrete[rate_hz=20]", "--oracle", "hybrid"]) == 0
    printed, said = capsys.readouterr()
    words = " ".join(printed.split())
    assert "2 contacts happened." in words and "of 2 contacts missed" in words
    assert f"See it replay view {out} --miss" in words and "replay view" not in said
    assert (out / "run.rrd").is_file() and (out / "summary.json").is_file()


def test_options_reach_the_run_and_json_on_stdout_is_its_summary_and_misses(file, tmp_path, capsys):
    words = ["run", file, "-q", "-o", str(tmp_path / "run"), "--no-picture", "--format", "json", "--oracle", "hybrid"]
    words += ["--start", "0.02", "--end", "0.05", "--seed", "9", "--detector", SLOW, "--detector", "sphere"]
    assert main(words) == 0
    printed, said = capsys.readouterr()
    report = json.loads(printed)
    assert set(report["detectors"]) == {"slow", "sphere", "hybrid"} and said == "\n" * said.count("\n")
    assert [miss["number"] for miss in report["misses"]["slow"]] == [1] and report["seed"] == 9
    assert (report["session"]["frames"], report["detectors"]["hybrid"]["contacts"]) == (4, 1)
    assert report["out"] == str(tmp_path / "run") and not (tmp_path / "run" / "run.rrd").exists()


def test_frames_that_could_not_be_used_end_in_3_and_are_named(tmp_path, capsys):
    session = framed([0, 10, 10, 20], [[1, 1]] * 4)
    write_session(session, tmp_path / "s.mcap")
    code = main(
        ["run", str(tmp_path / "s.mcap"), "--out", str(tmp_path / "run"), "--no-picture", "--detectors", "hybrid"]
    )
    assert code == 3
    assert "note: 1 frame left out: the stamp repeats the one before" in capsys.readouterr().err


def test_audit_is_another_name_of_run_that_no_help_shows(file, capsys):
    words = [file, "--detectors", SLOW, "--max-missed", "0.01", "--format", "json"]
    told = []
    for verb in ("audit", "run"):
        assert main([verb, *words]) == 4
        told.append(json.loads(capsys.readouterr().out))
    assert told[0]["audit"] == told[1]["audit"] and told[0]["broken"] == told[1]["broken"] != []
    assert main(["--help"]) == 0
    assert "audit" not in [line.split()[0] for line in capsys.readouterr().out.splitlines() if line.strip()]


@pytest.mark.parametrize(
    ("detector", "missed", "milliseconds", "code", "words"),
    [
        (SLOW, "0.01", "10000", 4, "slow missed contacts"),
        ("hybrid", "0.01", "10000", 0, ""),
        ("hybrid", "0.01", "0.000001", 4, "more than --max-p99-ms 1e-06"),
        ("continuous", "1", "11.1", 4, "continuous was not timed frame by frame"),
    ],
)
def test_a_broken_gate_ends_in_4_and_says_which(file, capsys, detector, missed, milliseconds, code, words):
    assert main(["run", file, "--detector", detector, "--max-missed", missed, "--max-p99-ms", milliseconds]) == code
    said = capsys.readouterr().err
    assert words in said and ("gate: " in said) == (code == 4)


def test_a_detector_that_decides_nothing_is_told_so_first_and_passes_no_gate(file, capsys):
    words = ["run", file, "--detector", "it=support.planted_detectors:Undecided", "--max-missed", "1"]
    assert main(words) == 4
    printed, said = capsys.readouterr()
    assert "(it): 2 of 2 contacts undecided." in printed
    assert "Not counted: 12 of 12 pair-frames with a pose, which exact or it did not decide." in printed
    assert "gate: --max-missed cannot be checked: it left 4 pair-frames in contact undecided, 2 of 2 contacts" in said
    assert main([*words[:-2], "--max-invented", "1"]) == 4
    assert "it was compared in no pair-frame" in capsys.readouterr().err


@pytest.mark.parametrize(("detector", "what"), [("Raising", "in look, frame 4: ZeroDivisionError"),
                                                ("Unmade", "to be made: KeyError: 'radius'")])  # fmt: skip
def test_a_fault_of_a_users_detector_names_class_frame_file_and_line(file, capsys, detector, what):
    assert main(["run", file, "--detector", f"support.planted_detectors:{detector}"]) == 1
    said = capsys.readouterr().err
    assert f"error: {detector} failed {what}" in said and "planted_detectors.py, line " in said
    assert "please report it" not in said


def test_a_step_rate_is_that_of_the_usual_detectors_and_of_no_named_one(file, capsys):
    assert main(["run", file, "--step-rate", "25", "--format", "json"]) == 0
    assert list(json.loads(capsys.readouterr().out)["detectors"]) == ["hull25", "mesh25", "paper", "exact"]
    assert main(["run", file, "--step-rate", "25", "--detectors", "hybrid"]) == 2
    assert "rate_hz" in capsys.readouterr().err


def test_bodies_without_a_mesh_are_named(tmp_path, capsys):
    session = cubes({"a": [0, 0], "b": [3, 0.9], "wand": [5, 6]})
    del session.meshes["wand"]
    write_session(session, tmp_path / "s.mcap")
    assert main(["run", str(tmp_path / "s.mcap"), "--detectors", "hybrid", "--oracle", "none"]) == 0
    assert "note: no mesh, so not looked at: wand" in capsys.readouterr().err
