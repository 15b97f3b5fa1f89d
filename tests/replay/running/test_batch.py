from shutil import rmtree
from unittest.mock import Mock

import numpy as np
import pytest
from support.small_worlds import unit_cubes_on_x

from replay import read
from replay.errors import OutputError
from replay.running.batch import run_batch, run_session
from sessions import write_session

SETTINGS = {"detectors": "hybrid", "oracle": "none", "picture": False}
"""Settings of each run of a batch."""


@pytest.fixture
def three_session_files(tmp_path):
    """The files s0, s1 and s2 of sessions in which a cube comes closer to another, up to 0.8, 0.9 or 1 m."""
    folder = tmp_path / "sessions"
    folder.mkdir()
    files = []
    for number, nearest in enumerate((0.8, 0.9, 1.0)):
        session = unit_cubes_on_x({"a": [0.0] * 20, "b": list(np.linspace(3, nearest, 20))})
        files.append(folder / f"s{number}.mcap")
        write_session(session, files[-1])
    return files


def time_written(run_folder):
    """Nanoseconds at which the summary of a run was last written."""
    return (run_folder / "summary.json").stat().st_mtime_ns


@pytest.mark.slow
def test_two_processes_give_the_digest_of_a_single_process(three_session_files, tmp_path):
    """Two processes get the files in reverse order; a digest is over the answers of all runs.

    No run was there before, so none is kept as it was.
    """
    by_one_process = run_batch(three_session_files, tmp_path / "one", settings=SETTINGS)
    by_two_processes = run_batch(three_session_files[::-1], tmp_path / "two", jobs=2, settings=SETTINGS)
    assert by_one_process.digest == by_two_processes.digest != ""
    assert by_one_process.done == by_two_processes.done == ("s0", "s1", "s2")
    assert not by_one_process.failed and not by_one_process.kept


@pytest.mark.slow
def test_finished_session_is_kept_and_incomplete_is_rerun(three_session_files, tmp_path):
    """The run s2 of a first batch is removed. In its place are a file and a folder of a write that was broken off."""
    out = tmp_path / "runs"
    first = run_batch(three_session_files, out, settings=SETTINGS)
    first_written = time_written(out / "s0")
    rmtree(out / "s2")
    (out / ".s2.deadbeef.partial").touch()
    (out / ".s2.deadbeef.folder").mkdir()
    reported = []
    again = run_batch(three_session_files, out, settings=SETTINGS, on_done=lambda *outcome: reported.append(outcome))
    assert again.digest == first.digest
    assert again.kept == ("s0", "s1")
    assert reported == [("s0", "kept"), ("s1", "kept"), ("s2", "done")]
    assert time_written(out / "s0") == first_written
    assert [*out.glob(".s2.*")] == []


def test_pictures_can_be_added_later_with_the_same_answers(three_session_files, tmp_path):
    """The second batch draws a picture and keeps no run as it was; the digest of all answers is the same.

    Later batches, with pictures or without, keep the run.
    """
    out, session_file, with_pictures = tmp_path / "runs", three_session_files[:1], {**SETTINGS, "picture": True}
    first = run_batch(session_file, out, settings=SETTINGS)
    drawn = run_batch(session_file, out, settings=with_pictures)
    assert drawn.kept == ()
    assert drawn.digest == first.digest
    assert (out / "s0" / "run.rrd").is_file()
    for settings in (SETTINGS, with_pictures):
        assert run_batch(session_file, out, settings=settings).kept == ("s0",)


def test_changed_session_reruns_after_a_killed_batch(three_session_files, tmp_path, monkeypatch):
    """The session s1 is written anew. A batch is interrupted before its first run, and the next one runs s1 alone.

    Its tables have both runs, and its digest, of all answers, is another.
    """
    out, two_files = tmp_path / "runs", three_session_files[:2]
    first = run_batch(two_files, out, settings=SETTINGS)
    write_session(unit_cubes_on_x({"a": [0.0] * 20, "b": [0.5] * 20}), two_files[1])
    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr("replay.running.batch.do_all", Mock(side_effect=KeyboardInterrupt))
        run_batch(two_files, out, settings=SETTINGS)
    again = run_batch(two_files, out, settings=SETTINGS)
    assert again.kept == ("s0",)
    assert again.digest != first.digest
    assert read(out)["metrics"]["run"].to_pylist() == ["s0", "s1"], "a row of each"


def test_session_with_a_lost_reply_is_accepted(three_session_files, tmp_path):
    """A worker runs a session for a request, and its reply is lost: the same request again keeps what it wrote.

    Another request writes the run anew. The outcome is "", done, or "kept".
    """
    session_file, out = three_session_files[0], tmp_path / "s0"
    assert run_session(session_file, out, SETTINGS, "a request") == ""
    first_written = time_written(out)
    assert run_session(session_file, out, SETTINGS, "a request") == "kept"
    assert time_written(out) == first_written
    assert run_session(session_file, out, SETTINGS, "another request") == ""
    assert time_written(out) != first_written


def test_batch_folder_is_refused_after_its_scene_file_changed(tmp_path):
    """The scene file has the same path and another text: runs beside each other would not compare."""
    scene, out = tmp_path / "scene.toml", tmp_path / "runs"
    settings, no_sessions = {**SETTINGS, "scene": str(scene)}, []
    scene.write_text('[scene]\nname = "one"\n')
    run_batch(no_sessions, out, settings=settings)
    scene.write_text('[scene]\nname = "other"\n')
    with pytest.raises(OutputError, match="other settings"):
        run_batch(no_sessions, out, settings=settings)


@pytest.mark.slow
def test_failure_is_reported_and_ends_no_other_session(three_session_files, tmp_path):
    """The file of s1, one of three, is no session; a batch with a failure has no digest."""
    three_session_files[1].write_bytes(b"no session")
    batch = run_batch(three_session_files, tmp_path / "runs", settings=SETTINGS)
    assert batch.done == ("s0", "s2")
    assert batch.digest == ""
    assert set(batch.failed) == {"s1"}
    assert "s1.mcap" in batch.failed["s1"]


def test_batch_writes_into_no_folder_of_something_else(three_session_files, tmp_path):
    """The folder in which runs of three sessions are to stand holds somebody's text."""
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "chapter.txt").write_text("x")
    with pytest.raises(OutputError, match="something else"):
        run_batch(three_session_files, tmp_path / "thesis", settings=SETTINGS)


def test_two_sessions_with_one_file_name_are_refused(three_session_files, tmp_path):
    """Files s0.mcap in two folders would have one run folder."""
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
    """A run folder that was not there when the batch began, and is "kept": a worker of this batch wrote it.

    So it is done; a failure stays one.
    """

    def do_all(work, tasks, jobs, on_done, *_):
        on_done("written", "kept")
        on_done("failed", "it has no poses")
        return {}

    reported = []
    monkeypatch.setattr("replay.running.batch.do_all", do_all)
    run_batch([], tmp_path / "runs", settings=SETTINGS, on_done=lambda *outcome: reported.append(outcome))
    assert reported == [("written", "done"), ("failed", "it has no poses")]
