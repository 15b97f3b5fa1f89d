from shutil import rmtree

import numpy as np
import pytest
from support.small_worlds import unit_cubes_on_x

from replay import read
from replay.errors import OutputError
from replay.running.batch import run_batch, run_session
from sessions import write_session

SETTINGS = {"detectors": "hybrid", "oracle": "none", "picture": False}


@pytest.fixture
def three_session_files(tmp_path):
    """Three sessions in which a cube comes closer to another, up to 0.8, 0.9 or 1 m."""
    folder = tmp_path / "sessions"
    folder.mkdir()
    for k in range(3):
        write_session(
            unit_cubes_on_x({"a": [0.0] * 20, "b": list(np.linspace(3, 0.8 + 0.1 * k, 20))}), folder / f"s{k}.mcap"
        )
    return sorted(folder.glob("*.mcap"))


@pytest.mark.slow
def test_two_processes_give_the_digest_of_a_single_process(three_session_files, tmp_path):
    """Two processes get the files in reverse order.

    No run was there before, so none is kept; the digest is not empty.
    """
    by_single_process = run_batch(three_session_files, tmp_path / "one", settings=SETTINGS)
    by_two_processes = run_batch(three_session_files[::-1], tmp_path / "two", jobs=2, settings=SETTINGS)
    assert by_single_process.digest == by_two_processes.digest != ""
    assert by_single_process.done == by_two_processes.done == ("s0", "s1", "s2")
    assert not by_single_process.failed and not by_single_process.kept


@pytest.mark.slow
def test_finished_session_is_kept_and_incomplete_is_rerun(three_session_files, tmp_path):
    """The run s2 of a first batch is removed. In its place are a file and a folder of a write that was broken off."""
    out = tmp_path / "runs"
    first = run_batch(three_session_files, out, settings=SETTINGS)
    when = (out / "s0" / "summary.json").stat().st_mtime_ns
    rmtree(out / "s2")
    (out / ".s2.deadbeef.partial").touch()
    (out / ".s2.deadbeef.folder").mkdir()
    on_done = []
    again = run_batch(three_session_files, out, settings=SETTINGS, on_done=lambda *outcome: on_done.append(outcome))
    assert again.digest == first.digest and again.kept == ("s0", "s1")
    assert on_done == [("s0", "kept"), ("s1", "kept"), ("s2", "done")]
    assert (out / "s0" / "summary.json").stat().st_mtime_ns == when and not list(out.glob(".s2.*"))


def test_pictures_can_be_added_later_with_the_same_answers(three_session_files, tmp_path):
    """The second batch draws pictures and keeps no run as it was; the digest is the same.

    Later batches keep both runs.
    """
    out = tmp_path / "runs"
    first = run_batch(three_session_files[:2], out, settings=SETTINGS)
    drawn = run_batch(three_session_files[:2], out, settings={**SETTINGS, "picture": True})
    assert drawn.kept == () and drawn.digest == first.digest and (out / "s0" / "run.rrd").is_file()
    for settings in (SETTINGS, {**SETTINGS, "picture": True}):
        assert run_batch(three_session_files[:2], out, settings=settings).kept == ("s0", "s1")
    assert read(out)["metrics"]["run"].to_pylist() == ["s0", "s1"]


def test_changed_session_reruns_after_a_killed_batch(three_session_files, tmp_path, monkeypatch):
    """The session s1 is written anew. A batch is interrupted before its first run, and the next one runs s1 alone."""
    first = run_batch(three_session_files, tmp_path / "runs", settings=SETTINGS)
    write_session(unit_cubes_on_x({"a": [0.0] * 20, "b": [0.5] * 20}), three_session_files[1])
    with monkeypatch.context() as killed, pytest.raises(KeyboardInterrupt):
        killed.setattr("replay.running.batch.do_all", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
        run_batch(three_session_files, tmp_path / "runs", settings=SETTINGS)
    again = run_batch(three_session_files, tmp_path / "runs", settings=SETTINGS)
    assert again.kept == ("s0", "s2") and again.digest != first.digest


def test_session_with_a_lost_reply_is_accepted(three_session_files, tmp_path):
    """A second run with the same request ("asked") keeps the files of the first; another request writes them anew."""
    result = []
    for after in ("", "kept"):
        assert run_session(three_session_files[0], tmp_path / "s0", SETTINGS, "asked") == after
        result.append(when := (tmp_path / "s0" / "summary.json").stat().st_mtime_ns)
    assert result == [when, when]
    assert run_session(three_session_files[0], tmp_path / "s0", SETTINGS, "asked otherwise") == ""
    assert (tmp_path / "s0" / "summary.json").stat().st_mtime_ns != when


def test_batch_folder_is_refused_after_its_scene_file_changed(tmp_path):
    """The scene's path is the same, what it says is another name."""
    scene, runs = tmp_path / "scene.toml", tmp_path / "runs"
    settings = {**SETTINGS, "scene": str(scene)}
    scene.write_text('[scene]\nname = "one"\n')
    run_batch([], runs, settings=settings)
    scene.write_text('[scene]\nname = "other"\n')
    with pytest.raises(OutputError, match="other settings"):
        run_batch([], runs, settings=settings)


@pytest.mark.slow
def test_failure_is_reported_and_ends_no_other_session(three_session_files, tmp_path):
    """The file of s1 is no session; a batch with a failure has no digest."""
    three_session_files[1].write_bytes(b"no session")
    batch = run_batch(three_session_files, tmp_path / "runs", settings=SETTINGS)
    assert set(batch.failed) == {"s1"} and batch.done == ("s0", "s2") and batch.digest == ""
    assert "s1.mcap" in batch.failed["s1"]


def test_unrelated_folder_and_equal_file_names_are_refused(three_session_files, tmp_path):
    """A folder with a text of somebody's, and two files s0.mcap in different folders."""
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "chapter.txt").write_text("x")
    with pytest.raises(OutputError, match="something else"):
        run_batch(three_session_files, tmp_path / "thesis", settings=SETTINGS)
    other = tmp_path / "s0.mcap"
    other.write_bytes(three_session_files[0].read_bytes())
    with pytest.raises(OutputError, match="different names"):
        run_batch([*three_session_files, other], tmp_path / "runs", settings=SETTINGS)


@pytest.mark.parametrize("name", ["..mcap", "batch.json.mcap", "Batch.Tables.mcap"])
def test_session_named_like_a_batch_file_is_refused(name, tmp_path):
    """The run folder has the file's name without .mcap, which here is one the batch writes itself, or is no name."""
    with pytest.raises(OutputError, match="a run folder cannot be called"):
        run_batch([tmp_path / name], tmp_path / "runs", settings=SETTINGS)


def test_outcome_of_a_worker_whose_answer_was_lost_is_done(tmp_path, monkeypatch):
    """A run folder that was not there at the start, and is kept: a worker wrote it; a failure stays one."""
    reported = []

    def do_all(work, tasks, jobs, on_done, *_):
        on_done("written", "kept")
        on_done("failed", "it has no poses")
        return {}

    monkeypatch.setattr("replay.running.batch.do_all", do_all)
    run_batch([], tmp_path / "runs", settings=SETTINGS, on_done=lambda *outcome: reported.append(outcome))
    assert reported == [("written", "done"), ("failed", "it has no poses")]
