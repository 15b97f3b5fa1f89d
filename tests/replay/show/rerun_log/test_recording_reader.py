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
    """The Rerun file of a run with two contacts."""
    out = tmp_path_factory.mktemp("reader") / "run"
    return (
        replay.run(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), detectors="slow=discrete[rate_hz=5]", out=out).out
        / "run.rrd"
    )


def reader_process():
    """The process that reads recordings, which the first question starts."""
    (process,) = multiprocessing.active_children()
    return process


@pytest.mark.slow
def test_reader_that_ended_or_hangs_is_replaced(recording, monkeypatch):
    """The process that reads recordings is killed, and later has no time at all: each fails one question."""
    bookmarks = read_bookmarks(recording)
    ended = reader_process()
    monkeypatch.setattr(ended, "is_alive", lambda: True)  # it ends after it was looked at
    ended.kill()
    ended.join()
    with pytest.raises(RunFolderError, match=r"run\.rrd is damaged; run its session again"):
        read_bookmarks(recording)
    assert read_bookmarks(recording) == bookmarks and bookmarks

    hanging = reader_process()
    monkeypatch.setattr(recording_reader, "MOST_READ_S", 0.0)
    with pytest.raises(RunFolderError, match="is damaged"):
        read_bookmarks(recording)
    hanging.join(5.0)
    assert not hanging.is_alive()
