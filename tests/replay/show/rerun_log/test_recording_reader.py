"""A recording that ends the process which reads it, or hangs it, is refused, and the next one is read."""

import multiprocessing

import pytest
from support.small_worlds import MEET_IN_4_AND_8_TO_10, unit_cubes_on_x

import replay
from replay.errors import RunFolderError
from replay.show.rerun_log import recording_reader
from replay.show.rerun_log.moments import read_bookmarks


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """The Rerun file of a run with two contacts, both of which a detector of 5 Hz misses."""
    out = tmp_path_factory.mktemp("reader") / "run"
    result = replay.run(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), detectors="slow=discrete[rate_hz=5]", out=out)
    return result.out / "run.rrd"


def reader_process():
    """The process that reads recordings, which the first question to it starts."""
    (process,) = multiprocessing.active_children()
    return process


@pytest.mark.slow
def test_reader_that_ended_is_replaced(recording, monkeypatch):
    """Recordings are read in a process of its own, since a damaged one can end it; here it is killed.

    It dies after it was last seen alive, so that the next question fails; the one after that gets its answer.
    """
    bookmarks = read_bookmarks(recording)
    ended = reader_process()
    monkeypatch.setattr(ended, "is_alive", lambda: True)
    ended.kill()
    ended.join()
    with pytest.raises(RunFolderError, match=r"run\.rrd is damaged; run its session again"):
        read_bookmarks(recording)
    assert bookmarks
    assert read_bookmarks(recording) == bookmarks


@pytest.mark.slow
def test_reader_that_hangs_is_ended(recording, monkeypatch):
    """The process that reads recordings has no time at all (usually seconds): the question fails, the process ends."""
    read_bookmarks(recording)
    hanging = reader_process()
    monkeypatch.setattr(recording_reader, "MOST_READ_S", 0.0)
    with pytest.raises(RunFolderError, match="is damaged"):
        read_bookmarks(recording)
    hanging.join(timeout=5.0)
    assert not hanging.is_alive()
