import json
from pathlib import Path
from types import SimpleNamespace

import pytest
from support.small_worlds import cubes, framed

from replay.cli.main import main
from replay.cli.many_sessions import session_table
from sessions import write_session

PLACES = {"a": [0] * 12, "b": [3, 3, 3, 3, 0.9, 3, 3, 3, 0.9, 0.8, 0.9, 3]}
SLOW = ["--detectors", "slow=discrete[rate_hz=20]", "--no-picture"]


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sessions")
    write_session(cubes({"a": [0] * 12, "b": [3.0 + k / 10 for k in range(12)]}), folder / "apart.mcap")
    write_session(cubes(PLACES), folder / "missed.mcap")
    return [str(folder / name) for name in ("apart.mcap", "missed.mcap")]


@pytest.fixture(scope="module")
def replayed(files, tmp_path_factory):
    out = tmp_path_factory.mktemp("batch") / "runs"
    assert main(["run", *files, "-o", str(out), *SLOW]) == 0
    return out


def rows(printed):
    """Session -> the cells of its row in the last table."""
    last = printed.partition("sessions, the most missed")[2].splitlines()[2:]
    return {line.split()[0]: line.split()[1:] for line in last if line.split()}


def test_several_sessions_get_a_folder_each_and_one_last_table_the_most_missed_first(files, replayed, capsys):
    assert main(["run", *files, "-o", str(replayed), *SLOW]) == 0
    printed, said = capsys.readouterr()
    assert {path.name for path in replayed.iterdir()} == {"apart", "missed", "batch.json", "batch.tables"}
    found = rows(printed)
    assert [name for name in found if name in ("apart", "missed", "all")] == ["missed", "apart", "all"]
    assert found["missed"] == ["12", "2", "1"] and found["all"] == ["24", "2", "1"]
    assert found["apart"][0] == "12" and f"2 of 2 sessions are in {replayed}" in printed
    assert "1 of 2  apart: kept" in said and "2 of 2  missed: kept" in said


@pytest.mark.parametrize(("count", "notes"), [(20, ()), (22, ("… and 2 more",))])
def test_of_many_sessions_twenty_are_listed(count, notes):
    run = {"session": {"frames": 3, "dropped_frames": {}}, "audit": {}}
    made = session_table(SimpleNamespace(audit={}, runs={f"s{k}": run for k in range(count)}))
    assert len(made.rows) == 21 and tuple(made.notes) == notes and made.rows[-1][1] == 3 * count


def test_without_a_folder_nothing_is_written_and_the_figures_are_the_same(
    files, replayed, tmp_path, capsys, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    told = {}
    for where in ([], ["-o", str(replayed)]):
        assert main(["run", *files, *where, *SLOW, "--format", "json"]) == 0
        told[bool(where)] = json.loads(capsys.readouterr().out)
    assert told[False].pop("out") is None and [*tmp_path.iterdir()] == []
    assert told[False]["audit"] == told[True]["audit"] and told[False]["digest"] == told[True]["digest"]
    assert main(["run", *files, *SLOW]) == 0
    assert "with --out DIR each gets a run folder" in capsys.readouterr().out


def test_a_folder_stands_for_the_session_files_in_it(files, tmp_path, capsys):
    assert main(["run", str(Path(files[0]).parent), "-o", str(tmp_path / "runs"), *SLOW]) == 0
    assert "2 of 2 sessions are in" in capsys.readouterr().out
    (tmp_path / "one").mkdir()
    write_session(cubes(PLACES), tmp_path / "one" / "s.mcap")
    assert main(["run", str(tmp_path / "one"), "-o", str(tmp_path / "of one"), *SLOW]) == 0
    assert (tmp_path / "of one" / "s" / "summary.json").is_file()
    (tmp_path / "empty").mkdir()
    assert main(["run", str(tmp_path / "empty"), *SLOW]) == 2
    assert "holds no session files" in capsys.readouterr().err


def test_one_session_that_cannot_be_read_is_named_and_the_exit_code_is_three(files, tmp_path, capsys):
    (tmp_path / "broken.mcap").write_bytes(b"no session")
    given = [str(tmp_path / "broken.mcap"), files[0], "-o", str(tmp_path / "runs"), "--detectors", "hybrid"]
    assert main(["run", *given, "--oracle", "none", "--no-picture"]) == 3
    printed = capsys.readouterr().out
    assert "1 of 2 sessions are in" in printed and "failed: broken: " in printed and "digest: none" in printed
    assert "contacts" not in printed.partition("sessions\n")[2]


def test_poses_that_were_left_out_are_counted_and_the_exit_code_is_three(tmp_path, capsys):
    stamps = [10 * k for k in range(12)]
    write_session(framed([*stamps[:-1], stamps[-2]], [[1, 1]] * 12), tmp_path / "twice.mcap")
    write_session(cubes(PLACES), tmp_path / "good.mcap")
    given = [str(tmp_path / name) for name in ("twice.mcap", "good.mcap")]
    assert main(["run", *given, "-o", str(tmp_path / "runs"), *SLOW]) == 3
    printed = capsys.readouterr().out
    assert "frames left out" in printed and rows(printed)["twice"][-1] == "1"


def test_other_settings_need_another_folder_or_force(files, tmp_path, capsys):
    words = ["run", *files, "-o", str(tmp_path / "runs"), "--no-picture", "--oracle", "none", "--detectors", "hybrid"]
    assert main(words) == 0 and main([*words, "--seed", "1"]) == 1
    assert "other settings" in capsys.readouterr().err
    assert main([*words, "--seed", "1", "--force"]) == 0
    assert capsys.readouterr().err.count("done") == 2
    assert main([*words, "--seed", "1"]) == 0
    assert capsys.readouterr().err.count("kept") == 2
