"""Poses that a run holds of a recording: all, decoded once; of one that is too long the window it needs."""

from dataclasses import replace

import numpy as np
import pytest
from support.small_worlds import swinging_cubes, unit_cubes_on_x

from replay.engine import compute
from replay.errors import AssemblyError
from replay.prepare import holding_poses
from replay.prepare.holding_poses import decoded_once, load_beginning
from sessions import Frames, Status, read_session, write_session

POSITIONS = {"a": range(50), "b": [70] * 50}
FRAMES = 2_000


class Counted:
    """A source that counts how often its frames are read."""

    def __init__(self, source):
        self.source, self.names, self.passes = source, source.names, 0

    def blocks(self, frames):
        self.passes += 1
        return self.source.blocks(frames)


def test_file_is_decoded_once_while_its_frames_fit(monkeypatch):
    """50 frames of two bodies are 100 poses: with room for 99 each pass reads the file again."""
    session = unit_cubes_on_x(POSITIONS)
    assert decoded_once(session) is session
    source = Counted(session.source)
    kept = decoded_once(replace(session, source=source))
    passes = [Frames.join(list(kept.blocks(size))) for size in (20, 3, 64)]
    assert source.passes == 1 and max(map(len, kept.blocks(7))) == 7
    for again in passes:
        assert np.array_equal(again.position, session.frames.position, equal_nan=True)
    monkeypatch.setattr(holding_poses, "DECODED_POSES", 99)
    long = decoded_once(replace(session, source=source))
    assert [sum(map(len, long.blocks(20))) for _ in range(2)] == [50, 50] and source.passes == 3


def two_cubes(lost=()):
    """A long recording of two cubes, the second without a pose in the frames ``lost``."""
    session = swinging_cubes(frames=FRAMES, start=1_700_000_000 * 10**9)
    status = session.frames.status.copy()
    status[list(lost), 1] = Status.LOST
    return replace(session, source=replace(session.frames, status=status))


@pytest.fixture
def too_long(monkeypatch):
    """Every recording of more than 1,000 frames of two bodies is too long."""
    monkeypatch.setattr(holding_poses, "MOST_POSES", 2_000)
    monkeypatch.setattr(holding_poses, "DECODED_POSES", 1_000)


def results_between(result, earliest, latest):
    """Verdicts, poses and flags between two seconds."""
    assembly = result.assembly
    rows = (assembly.motion.times >= earliest) & (assembly.motion.times <= latest)
    flags = [(span.kind, span.start, span.end) for span in result.repaired.spans if earliest <= span.start <= latest]
    findings = [
        (item.code, item.start) for item in result.repaired.findings if item.start and earliest <= item.start <= latest
    ]
    return (
        assembly.motion.times[rows].tolist(),
        assembly.motion.translations[rows].tolist(),
        assembly.stamp_ns[rows].tolist(),
        assembly.origin[rows].tolist(),
        {label: matches.verdict[rows].tolist() for label, matches in result.detections.items()},
        flags,
        findings,
    )


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["file", "memory"])
def test_window_of_a_recording_beyond_memory_is_answered_equally(tmp_path, monkeypatch, kind):
    """From 7.6 to 9 s of 2,000 frames of two bodies, with room in memory for all their 4,000 poses and for 2,000.

    The second cube is lost in four frames, of which three in two stretches lie in the window: two flags.
    """
    session, piece = two_cubes(lost=(700, 701, 760, 1500)), (7.6, 9.0)
    if kind == "file":
        write_session(session, tmp_path / "long.mcap")
        session = read_session(tmp_path / "long.mcap")
    requested = {"detectors": "hybrid,slow=discrete[rate_hz=7.5]", "oracle": "exact"}
    whole = compute(session, **requested, start=piece[0], end=piece[1])
    monkeypatch.setattr(holding_poses, "MOST_POSES", 2_000)
    alone = compute(session, **requested, start=piece[0], end=piece[1])
    assert results_between(alone, *piece) == results_between(whole, *piece)
    *_, flags, _ = results_between(whole, *piece)
    assert len(flags) == 2
    assert alone.episodes == whole.episodes and alone.misses == whole.misses


def test_only_the_window_of_a_file_is_read(tmp_path, too_long):
    """Frame 1500 of 2000, 16.7 s at 90 Hz, holds no numbers: it is refused in a window around it and in no other."""
    session = two_cubes()
    position = session.frames.position.copy()
    position[1_500, 1] = np.nan
    write_session(replace(session, source=replace(session.frames, position=position)), tmp_path / "long.mcap")
    file = read_session(tmp_path / "long.mcap")
    with pytest.raises(Exception, match=r"frame 1500 \(16\.66"):
        compute(file, detectors="exact", start=12, end=20)
    assert len(compute(file, detectors="exact", start=2, end=10).assembly.motion) == (10 - 2) * 90


@pytest.mark.parametrize("requested", [{}, {"start": 1.0}, {"end": 20.0}])
def test_too_long_recording_is_refused_with_the_replayable_length(too_long, requested):
    """Room for 2,000 poses is room for 1,000 frames of two bodies: 11 s at 90 Hz. The recording has 2,000, 22 s."""
    with pytest.raises(AssemblyError, match=r"frames of 2 bodies.*at most 11 s with --start and --end") as refusal:
        compute(two_cubes(), detectors="exact", **requested)
    assert f"{FRAMES:,} frames" in str(refusal.value) or requested


@pytest.mark.parametrize(("most_poses", "frames"), [(101, 50), (100, 50), (99, 49), (60, 30)])
def test_beginning_of_a_recording_holds_as_many_poses_as_fit(monkeypatch, most_poses, frames):
    """50 frames of two bodies are 100 poses."""
    monkeypatch.setattr(holding_poses, "MOST_POSES", most_poses)
    session = unit_cubes_on_x(POSITIONS)
    assert load_beginning(session).stamps().tolist() == session.stamps()[:frames].tolist()
