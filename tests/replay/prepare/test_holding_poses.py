"""Poses that a run holds of a recording: all, decoded once; of one that is too long the window it needs."""

from dataclasses import replace

import numpy as np
import pytest
from support.small_worlds import swinging_cubes, unit_cubes_on_x

from cdcore.errors import InvalidPoseError
from replay.engine import compute, prepare
from replay.errors import AssemblyError
from replay.prepare import holding_poses
from replay.prepare.holding_poses import decoded_once, load_beginning
from sessions import Frames, Status, read_session, write_session

POSITIONS = {"a": range(50), "b": [70] * 50}
"""X of two unit cubes in 50 frames: 100 poses."""
FRAMES = 2_000
"""Frames of a recording of two swinging cubes: 4,000 poses, 22.2 s at 90 Hz."""


class Counted:
    """A source that counts how often its frames are read."""

    def __init__(self, source):
        self.source, self.names, self.passes = source, source.names, 0

    def blocks(self, frames):
        self.passes += 1
        return self.source.blocks(frames)


def test_session_in_memory_is_not_copied():
    """A file is decoded once, not to be read again; this session is no file, and its frames are arrays already."""
    session = unit_cubes_on_x(POSITIONS)
    assert decoded_once(session) is session


def test_file_is_decoded_once_while_its_frames_fit():
    """50 frames are read three times, in blocks of 20, 3 and 64 frames: the file itself is read once."""
    session = unit_cubes_on_x(POSITIONS)
    file = Counted(session.source)
    decoded = decoded_once(replace(session, source=file))
    for size in (20, 3, 64):
        blocks = list(decoded.blocks(size))
        assert max(map(len, blocks)) <= size
        assert np.array_equal(Frames.join(blocks).position, session.frames.position, equal_nan=True)
    assert file.passes == 1


def test_file_is_read_again_where_its_frames_do_not_fit(monkeypatch):
    """There is room for 99 of 100 poses: each of two passes over all 50 frames reads the file."""
    monkeypatch.setattr(holding_poses, "DECODED_POSES", 99)
    session = unit_cubes_on_x(POSITIONS)
    file = Counted(session.source)
    long = decoded_once(replace(session, source=file))
    assert [sum(map(len, long.blocks(20))) for _ in range(2)] == [50, 50]
    assert file.passes == 2


def two_cubes(lost=()):
    """A recording of FRAMES frames of two cubes at 90 Hz, the second without a pose in the frames ``lost``."""
    session = swinging_cubes(frames=FRAMES, start=1_700_000_000 * 10**9)
    status = session.frames.status.copy()
    status[list(lost), 1] = Status.LOST
    return replace(session, source=replace(session.frames, status=status))


@pytest.fixture
def room_for_1000_frames(monkeypatch):
    """Every recording of more than 1,000 frames of two bodies is too long."""
    monkeypatch.setattr(holding_poses, "MOST_POSES", 2_000)
    monkeypatch.setattr(holding_poses, "DECODED_POSES", 1_000)


def results_between(result, earliest, latest):
    """Times, poses, verdicts, flags and findings of a run between two seconds."""
    assembly = result.assembly
    rows = (assembly.motion.times >= earliest) & (assembly.motion.times <= latest)
    repair = result.repaired
    flags = [(span.kind, span.start, span.end) for span in repair.spans if earliest <= span.start <= latest]
    findings = [(item.code, item.start) for item in repair.findings if item.start and earliest <= item.start <= latest]
    return {
        "times": assembly.motion.times[rows].tolist(),
        "positions": assembly.motion.translations[rows].tolist(),
        "stamps": assembly.stamp_ns[rows].tolist(),
        "origins": assembly.origin[rows].tolist(),
        "verdicts": {label: matches.verdict[rows].tolist() for label, matches in result.detections.items()},
        "flags": flags,
        "findings": findings,
    }


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["file", "memory"])
def test_window_of_a_recording_beyond_memory_is_answered_equally(tmp_path, monkeypatch, kind):
    """From 7.6 to 9 s of 2,000 frames of two bodies, with room in memory for all their 4,000 poses and for 2,000.

    The second cube is lost in frames 700, 701 and 760, 7.8 and 8.4 s, in the window, two flags, and in frame 1500.
    """
    session = two_cubes(lost=(700, 701, 760, 1500))
    if kind == "file":
        write_session(session, tmp_path / "long.mcap")
        session = read_session(tmp_path / "long.mcap")
    window = {"start": 7.6, "end": 9.0, "detectors": "hybrid,slow=discrete[rate_hz=7.5]", "oracle": "exact"}
    with_all_in_memory = compute(session, **window)
    monkeypatch.setattr(holding_poses, "MOST_POSES", 2_000)
    with_room_for_half = compute(session, **window)
    expected = results_between(with_all_in_memory, 7.6, 9.0)
    assert len(expected["flags"]) == 2
    assert results_between(with_room_for_half, 7.6, 9.0) == expected
    assert with_room_for_half.episodes == with_all_in_memory.episodes
    assert with_room_for_half.misses == with_all_in_memory.misses


def test_only_the_window_of_a_file_is_read(tmp_path, room_for_1000_frames):
    """Frame 1500 of 2000, at 16.7 s of 90 Hz, has a position that is no number: the window from 12 to 20 s is refused.

    That from 2 to 10 s is prepared, 8 s and so 720 frames: no more than the 1,000 for which there is room.
    """
    session = two_cubes()
    position = session.frames.position.copy()
    position[1_500, 1] = np.nan
    write_session(replace(session, source=replace(session.frames, position=position)), tmp_path / "long.mcap")
    file = read_session(tmp_path / "long.mcap")
    with pytest.raises(InvalidPoseError, match=r"frame 1500 \(16\.66"):
        prepare(file, start=12, end=20)
    assert len(prepare(file, start=2, end=10).assembly.motion) == (10 - 2) * 90


@pytest.mark.parametrize(
    ("window", "its_frames"),
    [
        pytest.param({}, FRAMES, id="all"),
        pytest.param({"start": 1.0}, FRAMES - 91, id="all but a second"),  # frame 90 comes 10 ns before it
        pytest.param({"end": 20.0}, 20 * 90 + 1, id="20 s"),
    ],
)
def test_too_long_recording_is_refused_with_the_replayable_length(room_for_1000_frames, window, its_frames):
    """Room for 2,000 poses is room for 1,000 frames of two bodies: 11 s at 90 Hz. The recording has 2,000, 22 s.

    The error says how many frames the window has, and that 11 s of them can be replayed.
    """
    with pytest.raises(AssemblyError, match=r"frames of 2 bodies.*at most 11 s with --start and --end") as refusal:
        compute(two_cubes(), detectors="exact", **window)
    assert f"{its_frames:,} frames" in str(refusal.value)


@pytest.mark.parametrize(
    ("most_poses", "frames"),
    [
        pytest.param(101, 50, id="room for more than all"),
        pytest.param(100, 50, id="room for all"),
        pytest.param(99, 49, id="room for all but one"),
        pytest.param(60, 30, id="room for 30 frames"),
    ],
)
def test_beginning_of_a_recording_holds_as_many_poses_as_fit(monkeypatch, most_poses, frames):
    """50 frames of two bodies are 100 poses; only whole frames are read, the first ones."""
    monkeypatch.setattr(holding_poses, "MOST_POSES", most_poses)
    session = unit_cubes_on_x(POSITIONS)
    assert load_beginning(session).stamps().tolist() == session.stamps()[:frames].tolist()
