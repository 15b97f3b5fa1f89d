import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.small_worlds import session_of_frames

from cdcore.errors import InvalidPoseError
from replay.prepare import corrupt_poses, session_scan
from replay.prepare.session_scan import in_order, scan_session
from sessions import Status

VALID, LOST, ABSENT = int(Status.VALID), int(Status.LOST), int(Status.ABSENT)
MILLISECOND_NS = 1_000_000


def test_body_moves_when_two_usable_samples_differ():
    """Three bodies in three frames: one moves by 1e-12 m, one by 5 m only in a lost sample, one never."""
    moves, moves_while_lost = 0, 1  # and 2 rests
    position = np.zeros((3, 3, 3))
    position[2, moves, 0] = 1e-12
    position[1, moves_while_lost, 0] = 5.0
    status_by_frame = [[VALID, VALID, ABSENT], [VALID, LOST, VALID], [VALID, VALID, VALID]]
    scan = scan_session(session_of_frames([0, 10, 20], status_by_frame, position))
    assert np.flatnonzero(scan.moves).tolist() == [moves]


def session_with_pose_in_frame_3(position, quaternion, status):
    """Five frames of two bodies at rest; b has this pose and status in frame 3, 20 ms after the first.

    Frames 2 and 4 repeat the stamp before them, so that three frames are left.
    """
    b = 1
    positions = np.zeros((5, 2, 3))
    quaternions = np.tile([0.0, 0.0, 0.0, 1.0], (5, 2, 1))
    statuses = np.full((5, 2), VALID)
    positions[3, b], quaternions[3, b], statuses[3, b] = position, quaternion, status
    stamps = np.array([50, 60, 60, 70, 70]) * MILLISECOND_NS
    return session_of_frames(stamps, statuses, positions, quaternions)


@pytest.mark.parametrize(
    ("position", "quaternion", "text"),
    [
        pytest.param([np.nan, 0, 0], [0, 0, 0, 1], "position [nan, 0.0, 0.0] is not finite", id="position of NaN"),
        pytest.param([0, 0, 0], [0, 0, 0, 0], "quaternion [0.0, 0.0, 0.0, 0.0] has norm 0, not 1", id="no length"),
        pytest.param([0, 0, 0], [0, 0, 0, 1.002], "has norm 1.002, not 1", id="0.2 % too long"),
        pytest.param([0, 0, 0], [np.nan, 0, 0, 1], "has norm nan, not 1", id="quaternion of NaN"),
        pytest.param([0, 0, 0], [1e200, 0, 0, 1], "has norm inf, not 1", id="square overflows"),
    ],
)
def test_invalid_pose_is_refused_with_frame_time_and_body(position, quaternion, text, monkeypatch):
    """Body b has such a pose in frame 3 of five, 20 ms after the first; flagged as lost, nobody looks at it.

    Frames are read in blocks of two, so that frame 3 is the second of its block.
    """
    for module in (session_scan, corrupt_poses):
        monkeypatch.setattr(module, "BLOCK_FRAMES", 2)
    with pytest.raises(InvalidPoseError) as refused:
        scan_session(session_with_pose_in_frame_3(position, quaternion, VALID))
    assert str(refused.value).startswith("frame 3 (0.020000 s), body b: ")
    assert text in str(refused.value)
    scan = scan_session(session_with_pose_in_frame_3(position, quaternion, LOST))
    assert scan.stamp_ns.tolist() == [50 * MILLISECOND_NS, 60 * MILLISECOND_NS, 70 * MILLISECOND_NS]


@given(st.lists(st.integers(0, 30), min_size=1, max_size=40), st.integers(1, 9))
def test_frames_with_repeated_or_earlier_stamps_are_dropped_and_counted(stamps, frames_per_block):
    """Random stamps, read in blocks; a walk over them takes those later than all before and counts the others.

    A note says how many repeat the stamp before, and how many lie before it.
    """
    session = session_of_frames(stamps, np.ones((len(stamps), 1)))
    expected, repeated, backwards, latest = [], 0, 0, -1
    for stamp in stamps:
        repeated += stamp == latest
        backwards += stamp < latest
        if stamp > latest:
            expected.append(stamp)
            latest = stamp
    read_in_order = np.concatenate([block.stamp_ns for block in in_order(session.blocks(frames_per_block))])
    scan = scan_session(session)
    assert read_in_order.tolist() == expected == scan.stamp_ns.tolist()
    assert (scan.repeated, scan.backwards) == (repeated, backwards)
    assert scan.duration == (max(stamps) - stamps[0]) / 1e9

    notes = []
    for count, reason in ((repeated, "repeats the one before"), (backwards, "lies before one already read")):
        if count:
            notes.append(f"{count} frame{'s' if count > 1 else ''} left out: the stamp {reason}")
    assert list(scan.notes()) == notes
