import json
from dataclasses import replace

import pytest
from support.small_worlds import cubes, framed

from replay.cli.main import main
from sessions import MeshData, write_session

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
    for word in ("matched", "missed", "false", "split", "merged", "not examined", "between looks 2"):
        assert word in printed


def test_json_holds_the_sums_and_the_runs(file, capsys):
    assert main(["audit", file, file, "--detector", SLOW, "--format", "json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["audit"]["slow"]["episodes"]["missed"] == 2 and len(told["runs"]) == 2 and told["broken"] == []


@pytest.mark.slow
def test_sessions_in_two_processes_are_told_one_by_one_and_answered_as_in_one(file, capsys):
    told = []
    for jobs in ("1", "2"):
        assert main(["audit", file, file, "--detector", SLOW, "--jobs", jobs, "--format", "json"]) == 0
        printed, said = capsys.readouterr()
        told.append(json.loads(printed)["audit"])
        assert ("2 of 2" in said) == (jobs == "2")
    assert told[0] == told[1]


def test_pairs_whose_containment_is_refused_are_told_in_one_sentence_of_80_columns(tmp_path, capsys, monkeypatch):
    session, path = cubes({name: [2 * k, 2.01 * k, 2 * k] for k, name in enumerate("abcdef")}), tmp_path / "s.mcap"
    ajar = {name: MeshData(mesh.vertices, mesh.faces[1:]) for name, mesh in session.meshes.items() if name != "f"}
    write_session(replace(session, meshes=session.meshes | ajar), path)
    monkeypatch.setenv("COLUMNS", "80")
    assert main(["audit", str(path), "--detector", "hybrid"]) == 0
    lines = capsys.readouterr().out.splitlines()
    first = next(k for k, words in enumerate(lines) if "containment" in words)
    assert max(map(len, lines)) <= 80
    assert [words.rstrip() for words in lines[first : first + 3]] == [
        "exact: containment refused for 15 of 15 pairs: a and b are open; a and c are",
        "open; a and d are open; a and e are open; 11 more in summary.json.",
        "",
    ]


def test_a_broken_gate_ends_in_4_and_says_which(file, capsys):
    assert main(["audit", file, "--detector", SLOW, "--max-missed", "0.01", "--max-p99-ms", "10000"]) == 4
    assert "slow missed 1 of 2 contacts" in capsys.readouterr().err
    assert main(["audit", file, "--detector", "hybrid", "--max-missed", "0.01"]) == 0
    assert main(["audit", file, "--detector", "hybrid", "--offline", "--max-p99-ms", "11.1"]) == 4
    assert "hybrid was not timed frame by frame" in capsys.readouterr().err


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


def test_a_detector_that_decides_nothing_is_told_so_first_and_passes_no_gate(file, capsys):
    words = ["audit", file, "--detector", "it=support.planted_detectors:Undecided", "--max-missed", "1"]
    assert main(words) == 4
    printed, said = capsys.readouterr()
    assert printed.split("\n")[1].startswith("it left 2 of 2 contacts undecided ")
    assert "12 of 12 pair-frames with a pose are undecided by exact or it: nothing is known of them." in printed
    assert "gate: --max-missed cannot be checked: it left 4 pair-frames in contact undecided, 2 of 2 contacts" in said
    assert main([*words[:-2], "--max-invented", "1"]) == 4
    assert "it was compared in no pair-frame" in capsys.readouterr().err


@pytest.mark.parametrize(("detector", "what"), [("Raising", "in look, frame 4: ZeroDivisionError"),
                                                ("Unmade", "to be made: KeyError: 'radius'")])  # fmt: skip
def test_a_fault_of_a_users_detector_names_class_frame_file_and_line(file, capsys, detector, what):
    assert main(["audit", file, "--detector", f"support.planted_detectors:{detector}"]) == 1
    said = capsys.readouterr().err
    assert f"error: {detector} failed {what}" in said and "planted_detectors.py, line " in said
    assert "please report it" not in said


@pytest.mark.parametrize("verb", ["audit", "run"])
@pytest.mark.parametrize("limit", [["--max-missed", "nan"], ["--max-missed", "50"], ["--max-invented", "-0.1"],
                                   ["--max-p99-ms", "nan"], ["--max-p99-ms", "inf"], ["--tau", "nan"],
                                   ["--end", "1e308"], ["--start", "soon"], ["--tau", "1e99"]])  # fmt: skip
def test_a_limit_that_is_no_limit_is_a_wrong_use(file, tmp_path, capsys, verb, limit):
    out = ["--out", str(tmp_path / "run")]
    assert main([verb, file, "--detector", SLOW, *out, *limit]) == 2
    said = capsys.readouterr().err
    assert limit[0] in said and "range." not in said and not (tmp_path / "run").exists()


@pytest.mark.parametrize("verb", ["audit", "run"])
def test_inventions_are_gated_by_audit_and_run(file, tmp_path, capsys, verb):
    words = [verb, file, "--detector", SLOW, "--out", str(tmp_path / "run"), "--no-picture", "--max-invented"]
    assert main([*words, "0.1"]) == 4
    assert "gate: slow invented " in capsys.readouterr().err
    assert main([*words, "1", "--force"]) == 0


def test_of_a_slow_rate_the_looks_are_held_to_the_limit_and_not_the_frames_between(tmp_path, capsys):
    path = tmp_path / "long.mcap"
    write_session(cubes({"a": [0.0] * 300, "b": [3 + k / 300 for k in range(300)]}), path)
    words = ["audit", str(path), "--detector", "rare=discrete[rate_hz=0.5]", "--max-p99-ms", "0.000001"]
    assert main(words) == 4
    assert "rare takes" in capsys.readouterr().err


def test_the_missed_contacts_are_listed_with_their_causes_and_the_sources_when_asked(file, capsys):
    assert main(["audit", file, "--detector", SLOW, "--cite"]) == 0
    printed = capsys.readouterr().out
    rows = [line.split() for line in printed.partition("missed by slow")[2].splitlines()]
    assert ["1", "0.040", "a", "-", "b", "1", "never", "found"] in [row[:8] for row in rows]
    assert "between looks" in printed and printed.index("detector discrete") > printed.index("missed by slow")
    assert main(["audit", file, file, "--detector", SLOW, "--cite", "--format", "json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert [len(run["misses"]["slow"]) for run in told["runs"]] == [2, 2]
    assert [*told["sources"]] == ["detector discrete", "detector exact"]


@pytest.mark.parametrize("verb", ["run", "audit", "tradeoff"])
def test_a_policy_decides_what_becomes_of_doubtful_poses_under_every_verb_that_replays(tmp_path, capsys, verb):
    status = [[1, 1]] * 6 + [[1, 2]] * 2 + [[1, 1]] * 4
    write_session(framed([10 * k for k in range(12)], status), tmp_path / "s.mcap")
    words = [verb, str(tmp_path / "s.mcap"), "--out", str(tmp_path / "run"), "--policy"]
    assert main([*words, "tracking-lost=refuse"]) == 1
    assert "the policy refuses it" in capsys.readouterr().err
    assert main([*words, "tracking-lost=wish"]) == 1
    assert "tracking-lost cannot be met with 'wish'" in capsys.readouterr().err
    assert not (tmp_path / "run").exists()
