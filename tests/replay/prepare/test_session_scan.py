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
    """The first moves by 1e-12 m; the second only in a lost sample; the third never."""
    position = np.zeros((3, 3, 3))
    position[2, 0, 0] = 1e-12
    position[1, 1, 0] = 5.0
    session = session_of_frames(
        [0, 10, 20], [[VALID, VALID, ABSENT], [VALID, LOST, VALID], [VALID, VALID, VALID]], position
    )
    assert scan_session(session).moves.tolist() == [True, False, False]


@pytest.mark.parametrize(
    ("position", "quaternion", "text"),
    [
        ([np.nan, 0, 0], [0, 0, 0, 1], "position [nan, 0.0, 0.0] is not finite"),
        ([0, 0, 0], [0, 0, 0, 0], "quaternion [0.0, 0.0, 0.0, 0.0] has norm 0, not 1"),
        ([0, 0, 0], [0, 0, 0, 1.002], "has norm 1.002, not 1"),
        ([0, 0, 0], [np.nan, 0, 0, 1], "has norm nan, not 1"),
        ([0, 0, 0], [1e200, 0, 0, 1], "has norm inf, not 1"),
    ],
)
def test_invalid_pose_is_refused_with_frame_time_and_body(position, quaternion, text, monkeypatch):
    """The pose of body b in frame 3 of five, 20 ms after the first, is replaced; flagged as lost it is accepted."""
    where = np.zeros((5, 2, 3))
    rotation = np.tile([0.0, 0.0, 0.0, 1.0], (5, 2, 1))
    where[3, 1], rotation[3, 1] = position, quaternion
    status = np.full((5, 2), VALID)
    stamps = np.array([50, 60, 60, 70, 70]) * MILLISECOND_NS
    for module in (session_scan, corrupt_poses):
        monkeypatch.setattr(module, "BLOCK_FRAMES", 2)
    with pytest.raises(InvalidPoseError) as refused:
        scan_session(session_of_frames(stamps, status, where, rotation))
    assert str(refused.value).startswith("frame 3 (0.020000 s), body b: ")
    assert text in str(refused.value)
    status[3, 1] = LOST
    assert len(scan_session(session_of_frames(stamps, status, where, rotation)).stamp_ns) == 3


@given(st.lists(st.integers(0, 30), min_size=1, max_size=40), st.integers(1, 9))
def test_frames_with_repeated_or_earlier_stamps_are_dropped_and_counted(stamps, block):
    """Random stamps in blocks of frames; a walk over them keeps those later than all before."""
    session = session_of_frames(stamps, np.ones((len(stamps), 1)))
    expected, repeated, backwards, latest = [], 0, 0, -1
    for stamp in stamps:
        repeated += stamp == latest
        backwards += stamp < latest
        if stamp > latest:
            expected.append(stamp)
            latest = stamp
    kept = [piece.stamp_ns for piece in in_order(session.blocks(block))]
    recorded = scan_session(session)
    assert np.concatenate(kept).tolist() == expected == recorded.stamp_ns.tolist()
    assert (recorded.repeated, recorded.backwards) == (repeated, backwards)
    assert recorded.duration == (max(stamps) - stamps[0]) / 1e9
    counts = ((repeated, "repeats the one before"), (backwards, "lies before one already read"))
    assert recorded.notes() == tuple(
        f"{count} frame{'s' * (count > 1)} left out: the stamp {what}" for count, what in counts if count
    )
