"""A recording is complete or an error: a full disk is one sentence and exit 1, and nothing hangs."""

import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest
import rerun as rr
import rerun.blueprint as rrb
from rerun.chunk import RrdReader
from support.processes import environment
from support.small_worlds import unit_cubes_on_x

from replay.show.rerun_log import recording_file as module
from replay.show.rerun_log.recording_file import RecordingClock, RecordingWriter, recording_file, require_complete
from sessions import write_session

RUN_WITH_FILE_SIZE_LIMIT = """
import resource, sys
from replay.cli.main import main
from replay.show.rerun_log import recording

def limited(result, path, write=recording.write_recording, **settings):
    resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[1]),) * 2)  # not earlier: the compiler keeps files too
    write(result, path, **settings)

recording.write_recording = limited
sys.exit(main(sys.argv[2:]))
"""


def write(path, count=30):
    """A recording file of so many clouds of 100 points."""
    with recording_file("test", path, rrb.Blueprint(rrb.Spatial3DView(origin="/"))) as stream:
        for k in range(count):
            stream.log(f"p{k}", rr.Points3D(np.ones((100, 3))))


def test_a_recording_ends_in_a_footer_and_reads_back(tmp_path):
    """The file holds one recording and the layout of its views (blueprint)."""
    write(tmp_path / "x.rrd")
    require_complete((tmp_path / "x.rrd").read_bytes())
    reader = RrdReader(tmp_path / "x.rrd")
    assert len(reader.recordings()) == len(reader.blueprints()) == 1


@pytest.mark.parametrize(
    "cut",
    [lambda whole: whole[:-1], lambda whole: whole[: len(whole) // 2], lambda whole: b"", lambda whole: whole[40:]],
)
def test_a_cut_recording_is_refused(cut, tmp_path):
    """``cut``: what is left of a whole file: without its last byte, half, nothing, without its head."""
    write(tmp_path / "x.rrd")
    with pytest.raises(OSError, match="has no end"):
        require_complete(cut((tmp_path / "x.rrd").read_bytes()))


def test_an_encoder_that_does_not_end_is_an_error(tmp_path, monkeypatch):
    """Rerun's encoder says that its time is over; no file is left."""

    def hanging(self, *, flush, flush_timeout_sec):
        raise RuntimeError("Flush timed out")

    monkeypatch.setattr(rr.BinaryStream, "read", hanging)
    with pytest.raises(OSError, match=f"within {module.ENCODED_WITHIN_S:g} s"):
        write(tmp_path / "x.rrd")
    assert not (tmp_path / "x.rrd").exists()


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no limit of file sizes")
@pytest.mark.parametrize("kilobytes", [8, 100])
def test_picture_too_large_for_the_disk_exits_1(kilobytes, tmp_path):
    """The picture of 1,000 contacts takes megabytes: its head fits into 8 kB, and some of its data into 100."""
    contact_in_every_second_frame = {"a": [0] * 2000, "b": np.tile([3, 0.9], 1000)}
    write_session(unit_cubes_on_x(contact_in_every_second_frame), tmp_path / "s.mcap")
    words = ["run", tmp_path / "s.mcap", "--out", tmp_path / "run", "--detectors", "sphere", "--oracle", "hybrid"]
    command = [sys.executable, "-c", RUN_WITH_FILE_SIZE_LIMIT, str(kilobytes * 1024), *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, env=environment(), timeout=300)
    assert done.returncode == 1 and "cannot be written" in done.stderr and "File too large" in done.stderr
    assert not (tmp_path / "run").exists() and [path.name for path in tmp_path.iterdir()] == ["s.mcap"]


def test_clock_counts_from_the_session_not_from_the_window():
    """A window that begins 2 s into a session, 7 s after the zero of its stamps."""
    stamps = np.array([7_000_000_000, 7_010_000_000, 7_030_000_000])
    motion = SimpleNamespace(times=np.array([2.0, 2.01, 2.03]))
    clock = RecordingClock.of(SimpleNamespace(stamp_ns=stamps, motion=motion), moments=[2, 1, 2], limit=2)
    assert clock.ns.tolist() == [2_000_000_000, 2_010_000_000, 2_030_000_000]
    assert clock.moments.tolist() == [1, 2] and clock.drawn_frames.tolist() == [0, 1, 2]
    assert RecordingWriter(None, clock).session_ns((1, 5)) == 2_010_000_005


@pytest.mark.parametrize(("when", "ns"), [([0, 2], [0, 30]), ([(0, 3), (2, 4)], [3, 34])])
def test_rows_stand_at_their_frames_or_nanoseconds_after(when, ns, monkeypatch):
    """Frames are at 0, 10 and 30 ns; ``when``: frames, or (frame, nanoseconds after it)."""
    writer = RecordingWriter(None, RecordingClock(np.array([0, 10, 30]), np.arange(3), np.arange(0)))
    rows = []
    monkeypatch.setattr(writer, "session_rows", lambda path, times, columns, counts: rows.append(times.tolist()))
    writer.rows("a", when, [])
    assert rows == [ns]
