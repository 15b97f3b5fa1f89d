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


def write_clouds(path, count=30):
    """Writes a recording of so many clouds of 100 points."""
    with recording_file("test", path, rrb.Blueprint(rrb.Spatial3DView(origin="/"))) as stream:
        for k in range(count):
            stream.log(f"p{k}", rr.Points3D(np.ones((100, 3))))


def test_a_recording_ends_in_a_footer_and_reads_back(tmp_path):
    """The file of 30 clouds of points has its end, one recording, and one layout of views (blueprint)."""
    write_clouds(tmp_path / "x.rrd")
    require_complete((tmp_path / "x.rrd").read_bytes())
    reader = RrdReader(tmp_path / "x.rrd")
    assert len(reader.recordings()) == 1
    assert len(reader.blueprints()) == 1


@pytest.mark.parametrize(
    "cut",
    [
        pytest.param(lambda whole: whole[:-1], id="without its last byte"),
        pytest.param(lambda whole: whole[: len(whole) // 2], id="first half"),
        pytest.param(lambda whole: b"", id="empty"),
        pytest.param(lambda whole: whole[40:], id="without its first 40 bytes"),
    ],
)
def test_a_cut_recording_is_refused(cut, tmp_path):
    """A whole file of 30 clouds of points, of which ``cut`` leaves a part."""
    write_clouds(tmp_path / "x.rrd")
    with pytest.raises(OSError, match="has no end"):
        require_complete(cut((tmp_path / "x.rrd").read_bytes()))


def test_an_encoder_that_does_not_end_is_an_error(tmp_path, monkeypatch):
    """Rerun's encoder raises that its time, which the message names, is over; no file is left."""

    def time_out(self, *, flush, flush_timeout_sec):
        raise RuntimeError("Flush timed out")

    monkeypatch.setattr(rr.BinaryStream, "read", time_out)
    with pytest.raises(OSError, match=f"within {module.ENCODED_WITHIN_S:g} s"):
        write_clouds(tmp_path / "x.rrd")
    assert not (tmp_path / "x.rrd").exists()


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no limit of file sizes")
@pytest.mark.parametrize(
    "kilobytes", [pytest.param(8, id="room for its head"), pytest.param(100, id="room for some of its data")]
)
def test_picture_too_large_for_the_disk_exits_1(kilobytes, tmp_path):
    """The command ``replay run`` in a process that may write files of so many kB from the picture on.

    The picture of 1,000 contacts takes megabytes. The command says why it failed and leaves no run folder.
    """
    contact_in_every_second_frame = {"a": [0] * 2000, "b": np.tile([3, 0.9], 1000)}
    write_session(unit_cubes_on_x(contact_in_every_second_frame), tmp_path / "s.mcap")
    arguments = ["run", tmp_path / "s.mcap", "--out", tmp_path / "run", "--detectors", "sphere", "--oracle", "hybrid"]
    command = [sys.executable, "-c", RUN_WITH_FILE_SIZE_LIMIT, str(kilobytes * 1024), *map(str, arguments)]
    ended = subprocess.run(command, capture_output=True, text=True, env=environment(), timeout=300)
    assert ended.returncode == 1
    assert "cannot be written" in ended.stderr
    assert "File too large" in ended.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["s.mcap"]


@pytest.fixture
def clock_of_window():
    """The clock of three frames, 2, 2.01 and 2.03 s after a session began at the stamp 5 s; moments are 1 and 2.

    Room is left for two frames.
    """
    stamps = np.array([7_000_000_000, 7_010_000_000, 7_030_000_000])
    motion = SimpleNamespace(times=np.array([2.0, 2.01, 2.03]))
    return RecordingClock.of(SimpleNamespace(stamp_ns=stamps, motion=motion), moments=[2, 1, 2], limit=2)


def test_clock_counts_from_the_session_not_from_the_window(clock_of_window):
    """The replayed window begins 2 s into a session, 7 s after the zero of its stamps; frame 1 is at 2.01 s.

    A moment (1, 5) is 5 ns after frame 1.
    """
    assert clock_of_window.ns.tolist() == [2_000_000_000, 2_010_000_000, 2_030_000_000]
    assert RecordingWriter(None, clock_of_window).session_ns((1, 5)) == 2_010_000_005


def test_clock_draws_strided_frames_and_all_moments(clock_of_window):
    """A clock of three frames with room to draw two.

    Every second is drawn, 0 and 2, and moments, 1 and 2, each once.
    """
    assert clock_of_window.moments.tolist() == [1, 2]
    assert clock_of_window.drawn_frames.tolist() == [0, 1, 2]


@pytest.mark.parametrize(
    ("when", "ns"),
    [
        pytest.param([0, 2], [0, 30], id="frames"),
        pytest.param([(0, 3), (2, 4)], [0 + 3, 30 + 4], id="frames and nanoseconds after"),
    ],
)
def test_rows_stand_at_their_frames_or_nanoseconds_after(when, ns, monkeypatch):
    """Frames are at 0, 10 and 30 ns; rows of an entity are sent for two moments, and get these times."""
    clock = RecordingClock(ns=np.array([0, 10, 30]), drawn_frames=np.arange(3), moments=np.arange(0))
    writer = RecordingWriter(None, clock)
    sent_times = []
    monkeypatch.setattr(writer, "session_rows", lambda path, times, columns, counts: sent_times.append(times.tolist()))
    writer.rows("a", when, [])
    assert sent_times == [ns]
