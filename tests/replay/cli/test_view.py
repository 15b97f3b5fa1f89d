from functools import partial

import pytest
from support.small_worlds import cubes

import replay
from replay.cli.main import main
from sessions import write_session

PLACES = {"a": [0] * 8, "b": [3, 3, 0.9, 3, 3, 3, 0.9, 3]}


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("runs") / "run"
    return replay.run(cubes(PLACES), detectors="slow=discrete[rate_hz=20]", oracle="hybrid", out=out).out


class Viewer:
    """Stands in for a window: notes what it was opened with, and that somebody waited for its end."""

    def __init__(self, opened, *runs, miss, false, by):
        opened.append((*runs, miss, false, by))
        self.opened, self.process = opened, self

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.opened.append("closed")

    def wait(self):
        self.opened.append("waited")


@pytest.fixture
def opened(monkeypatch):
    noted = []
    monkeypatch.setattr("replay.outputs.rerun_log.viewer.open_viewer", partial(Viewer, noted))
    return noted


def test_view_opens_the_run_at_the_miss_and_waits_for_the_window(run_folder, opened, capsys):
    assert main(["view", str(run_folder), "--miss", "1"]) == 0
    assert opened == [(run_folder / "run.rrd", 1, None, ""), "waited", "closed"]
    said = capsys.readouterr().err
    assert "at miss 1" in said and "the next run" not in said
    assert main(["view", str(run_folder), "--false", "2", "--by", "slow"]) == 0
    assert opened[3] == (run_folder / "run.rrd", None, 2, "slow")
    assert "at false contact 2" in capsys.readouterr().err


def test_view_opens_several_runs_in_one_viewer(run_folder, tmp_path, opened, capsys):
    bare, other = tmp_path / "bare", tmp_path / "other"
    for out, picture in ((bare, False), (other, True)):
        replay.run(cubes(PLACES), detectors="sphere", oracle="none", out=out, picture=picture)
    assert main(["view", str(run_folder), str(bare)]) == 1 and opened == []
    assert f"{bare} holds no picture" in capsys.readouterr().err
    assert main(["view", str(run_folder), str(other), "--miss", "1"]) == 0
    assert opened == [(run_folder / "run.rrd", other / "run.rrd", 1, None, ""), "waited", "closed"]
    told = " ".join(capsys.readouterr().err.split())
    assert f"{run_folder} and {other} at miss 1" in told and "the next run" in told


def test_view_draws_a_session_that_was_never_run(tmp_path, opened, capsys):
    write_session(cubes(PLACES), tmp_path / "made.mcap")
    assert main(["view", str(tmp_path / "made.mcap")]) == 0
    shown = opened[0][0]
    assert shown.parent.name == "made" and opened[1:] == ["waited", "closed"] and not shown.exists()
    assert "made.mcap as it was recorded" in capsys.readouterr().err
    (tmp_path / "none.mcap").write_bytes(b"nothing")
    assert main(["view", str(tmp_path / "none.mcap")]) == 1
