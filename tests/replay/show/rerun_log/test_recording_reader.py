"""A recording that ends the process which reads it, or hangs it, is refused, and the next one is read."""

import pytest
from support.small_worlds import TWO_BUMPS, cubes

import replay
from replay.errors import RunFolderError
from replay.show.rerun_log import recording_reader
from replay.show.rerun_log.moments import read_bookmarks


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    out = tmp_path_factory.mktemp("reader") / "run"
    return replay.run(cubes(TWO_BUMPS), detectors="slow=discrete[rate_hz=5]", out=out).out / "run.rrd"


def test_reader_that_ended_is_started_again(recording, monkeypatch):
    bookmarks = read_bookmarks(recording)
    reader = recording_reader._reader
    monkeypatch.setattr(reader.process, "is_alive", lambda: True)
    reader.process.kill()
    reader.process.join()
    with pytest.raises(RunFolderError, match=r"run\.rrd is damaged; run its session again"):
        read_bookmarks(recording)
    assert read_bookmarks(recording) == bookmarks and bookmarks


def test_reader_that_hangs_is_ended(recording, monkeypatch):
    bookmarks = read_bookmarks(recording)
    hanging = recording_reader._reader
    monkeypatch.setattr(recording_reader, "MOST_READ_S", 0.0)
    with pytest.raises(RunFolderError, match="is damaged"):
        read_bookmarks(recording)
    monkeypatch.undo()
    hanging.process.join(5.0)
    assert not hanging.process.is_alive()
    assert read_bookmarks(recording) == bookmarks
