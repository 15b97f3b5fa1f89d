import sys
import threading
import time
from errno import ENOSPC

import numpy as np
import pytest
from support.second_opinions import read_frames_plainly
from support.session_files import assert_same_frames, random_frames, tetrahedron

from sessions import Event, Interval, LiveContact, Recorder, read_session, recover
from sessions.errors import SessionError, SessionFileError, TornFileError
from sessions.mcap import recorder as recorder_module
from sessions.model.session import Status

UPRIGHT_POSE = ((0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0))


def record_frames(recorder, frames):
    """Feed frames to a recorder row by row."""
    kinds = {Status.LOST: "lost", Status.HELD: "held", Status.INTERPOLATED: "interpolated"}
    for row in range(len(frames)):
        poses, marks, samples = {}, {word: [] for word in kinds.values()}, {}
        for column, name in enumerate(frames.names):
            status = frames.status[row, column]
            if status == Status.ABSENT:
                continue
            poses[name] = (frames.position[row, column], tuple(frames.quaternion_xyzw[row, column]))
            samples[name] = int(frames.sample_ns[row, column])
            if status in kinds:
                marks[kinds[Status(status)]].append(name)
        stamp, log = frames.stamp_ns[row], int(frames.log_ns[row])
        recorder.poses(stamp, poses, marks.pop("lost"), **marks, sample_ns=samples, log_ns=log)


def session_once_written(partial):
    """Waits, for 20 seconds at most, until a partial file holds a frame; what can be recovered from it then."""
    out, deadline = partial.with_name("saved.mcap"), time.monotonic() + 20
    while True:
        try:
            if recover(partial, out, overwrite=True).frames:
                return read_session(out)
        except SessionFileError:
            pass
        assert time.monotonic() < deadline, "nothing reached the file"
        time.sleep(0.02)


def test_recorded_poses_are_read_back_bit_for_bit(tmp_path):
    """120 frames of four bodies are recorded behind a first frame in which all bodies stand.

    A fifth of the poses is absent, some are lost, repeated or interpolated. They are read by this package and by
    a plain loop over the protobuf messages; facts and a mesh are in the file, and no other file is left.
    """
    frames = random_frames(seed=5, count=120, bodies=4, absent=0.2, odd=0.2)
    with Recorder(tmp_path / "s.mcap", meshes={"body 1": tetrahedron()}, facts={"vr_type": "desktop"}) as recorder:
        recorder.poses(int(frames.stamp_ns[0]), dict.fromkeys(frames.names, UPRIGHT_POSE))
        record_frames(recorder, frames)
    session = read_session(tmp_path / "s.mcap")
    assert_same_frames(session.frames.segment(1, len(session.frames)), frames)
    assert_same_frames(session.frames, read_frames_plainly(tmp_path / "s.mcap", frames.names))
    assert session.facts["vr_type"] == "desktop" and list(session.meshes) == ["body 1"]
    assert [path.name for path in tmp_path.iterdir()] == ["s.mcap"]


def test_recorded_events_hands_gaze_and_scalars_are_read_back(tmp_path):
    """Each stream of a session file is recorded once or twice, at nanosecond stamps, and read back as it was given.

    The stage begun at 12 ns is not ended: it lasts until the last frame at 50 ns, and is marked as unclosed.
    """
    with Recorder(tmp_path / "s.mcap") as recorder:
        recorder.poses(10, {"wand": UPRIGHT_POSE})
        task = recorder.begin(11, "task", "pour", {"by": "anna"})
        recorder.begin(12, "stage", "virtual reality")
        for number, who in enumerate(("anna", "ben")):
            recorder.hand(20 + number, who, "left", trigger=0.5, grip=0.25 * number, buttons={"a": bool(number)})
        recorder.event(30, "drop", "the glass fell", body="glass", level="warning")
        recorder.contact(31, "wand", "glass", "enter", (1.0, 2.0, 3.0))
        recorder.samples("wand", [1, 2, 3], np.zeros((3, 3)), np.ones((3, 4)), [True, False, True])
        for number in range(2):
            recorder.gaze(20 + number, "anna", (0, 1.7, 0), (0, 0, -1), valid=number > 0, body="glass" * number)
            recorder.scalar(20 + number, "heart rate", 70 + number, "1/min")
        recorder.end(task, 40)
        recorder.interval(1, 2, "feature", "immersion")
        recorder.poses(50, {"wand": UPRIGHT_POSE})
    session = read_session(tmp_path / "s.mcap")
    assert session.events == (Event(30, "drop", "the glass fell", "glass", "warning"),)
    assert session.live_contacts == (LiveContact(31, "wand", "glass", "enter", (1.0, 2.0, 3.0)),)
    assert {*map(str, session.intervals)} == {
        str(Interval(11, 40, "task", "pour", {"by": "anna"})),
        str(Interval(12, 50, "stage", "virtual reality", {"unclosed": "true"})),
        str(Interval(1, 2, "feature", "immersion")),
    }
    hand, gaze, heart = session.hands["ben/left"], session.gaze["anna"], session.scalars["heart rate"]
    assert [*session.hands] == ["anna/left", "ben/left"] and (hand.grip, hand.pressed) == (0.25, True)
    assert session.fast_tracks["wand"].valid.tolist() == [True, False, True]
    assert (gaze.valid.tolist(), gaze.bodies) == ([False, True], ("", "glass"))
    assert (gaze.origins[1].tolist(), gaze.directions[0].tolist()) == ([0, 1.7, 0], [0, 0, -1])
    assert (heart.values.tolist(), heart.times_ns.tolist(), heart.unit) == ([70, 71], [20, 21], "1/min")


def test_several_threads_lose_nothing(tmp_path):
    """Three threads, of anna, ben and cleo, record 150 poses of a head and 150 samples of a hand each into one file."""
    with Recorder(tmp_path / "s.mcap") as recorder:

        def run(who):
            for number in range(150):
                recorder.poses(number, {f"{who}/head": UPRIGHT_POSE})
                recorder.hand(number, who, "left", trigger=number)

        threads = [threading.Thread(target=run, args=(who,)) for who in ("anna", "ben", "cleo")]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    session = read_session(tmp_path / "s.mcap")
    assert len(session.frames) == 450
    for column in range(3):
        stamps_of_body = session.frames.stamp_ns[session.frames.status[:, column] == Status.VALID]
        assert stamps_of_body.tolist() == list(range(150)), column
    assert [len(hand) for hand in session.hands.values()] == [150, 150, 150]


def test_open_recording_is_in_the_partial_file(tmp_path):
    """A frame at 7 ns can be recovered before the recorder is closed; the partial file itself is refused as cut short.

    Once the recorder is closed there is no partial file.
    """
    recorder = Recorder(tmp_path / "s.mcap")
    recorder.poses(7, {"wand": UPRIGHT_POSE})
    session = session_once_written(tmp_path / "s.mcap.partial")
    assert session.names == ("wand",)
    assert session.frames.stamp_ns.tolist() == [7]
    with pytest.raises(TornFileError, match="replay recover"):
        read_session(tmp_path / "s.mcap.partial")
    recorder.close()
    assert not (tmp_path / "s.mcap.partial").exists()


def test_closed_recorder_may_be_closed_and_records_nothing(tmp_path):
    """A recorder has a frame at 7 ns; a call with a number for a body's name is refused and adds none."""
    recorder = Recorder(tmp_path / "s.mcap")
    recorder.poses(7, {"wand": UPRIGHT_POSE})
    with pytest.raises(SessionError, match="not all named by text"):
        recorder.poses(8, {3: UPRIGHT_POSE})
    recorder.close()
    recorder.close()
    with pytest.raises(SessionError, match="closed"):
        recorder.poses(9, {"wand": UPRIGHT_POSE})
    assert read_session(tmp_path / "s.mcap").frames.stamp_ns.tolist() == [7]


@pytest.mark.skipif(sys.platform == "win32", reason="there the system itself refuses to remove an open file")
def test_two_recorders_never_write_the_same_file(tmp_path):
    """A second recorder of the same file is refused while the first records, even if it may overwrite it.

    A link to a precious file has the name of the partial file (the one written until the end): it is not followed.
    """
    path, precious = tmp_path / "s.mcap", tmp_path / "thesis"
    precious.write_text("years")
    (tmp_path / "s.mcap.partial").symlink_to(precious)
    with Recorder(path, overwrite=True) as recorder:
        recorder.poses(0, {"a": ((0, 0, 0), (0, 0, 0, 1))})
        with pytest.raises(SessionFileError, match="holds a recording that goes on"):
            Recorder(path, overwrite=True)
    assert len(read_session(path).frames) == 1 and precious.read_text() == "years"


def test_nothing_that_was_recorded_is_overwritten_by_accident(tmp_path):
    """A whole recording, or what a recording that was cut short left (.partial), stays unless ``overwrite`` says so.

    With it the second recording takes the place of what was left, and the third that of the whole second.
    """
    path = tmp_path / "s.mcap"
    with Recorder(path) as recorder:
        recorder.poses(1, {"wand": UPRIGHT_POSE})
    with pytest.raises(SessionFileError, match=r"s.mcap is there already.*overwrite=True"):
        Recorder(path)
    path.rename(tmp_path / "s.mcap.partial")
    with pytest.raises(SessionFileError, match=r"cut short.*replay recover"):
        Recorder(path)
    for stamp in (2, 3):
        with Recorder(path, overwrite=True) as recorder:
            recorder.poses(stamp, {"wand": UPRIGHT_POSE})
        assert read_session(path).frames.stamp_ns.tolist() == [stamp]


def test_recorder_in_a_missing_folder_is_refused(tmp_path):
    """The folder of the file is not there."""
    with pytest.raises(SessionFileError, match="check the folder"):
        Recorder(tmp_path / "nowhere" / "s.mcap")


def test_slow_disk_blocks_recording_with_bounded_memory(tmp_path, monkeypatch):
    """A thread writes what is recorded, and each write takes 30 ms: the program that records has to wait.

    Of 3,000 frames at most FRAMES_WAITING (512) wait, and as many are being written; none is lost.
    """
    written, waiting = [], []
    write_frames = recorder_module.SessionWriter.frames

    def write_slowly(self, frames):
        time.sleep(0.03)
        written.append(len(frames))
        write_frames(self, frames)

    monkeypatch.setattr(recorder_module.SessionWriter, "frames", write_slowly)
    with Recorder(tmp_path / "s.mcap") as recorder:
        for number in range(3000):
            recorder.poses(number, {"cup": UPRIGHT_POSE})
            waiting.append(number + 1 - sum(written))
    assert max(waiting) <= 2 * recorder_module.FRAMES_WAITING
    assert len(read_session(tmp_path / "s.mcap").frames) == 3000


def test_full_disk_is_reported_by_next_call_and_keeps_data(tmp_path, monkeypatch):
    """The disk is full after one frame. A thread writes what the program records: the error comes with a later call.

    Here that is within 10 seconds; closing raises it too, and the frame can be recovered.
    """
    recorder = Recorder(tmp_path / "s.mcap")
    recorder.poses(1, {"cup": UPRIGHT_POSE})
    session_once_written(tmp_path / "s.mcap.partial")

    def raise_disk_full(self, frames):
        raise OSError(ENOSPC, "No space left on device")

    monkeypatch.setattr(recorder_module.SessionWriter, "frames", raise_disk_full)
    with pytest.raises(SessionFileError, match=r"s.mcap.partial cannot be written \(No space left.*replay recover"):
        for _ in range(1000):
            recorder.poses(2, {"cup": UPRIGHT_POSE})
            time.sleep(0.01)
    with pytest.raises(SessionFileError, match="No space left"):
        recorder.close()
    assert len(session_once_written(tmp_path / "s.mcap.partial").frames) == 1
