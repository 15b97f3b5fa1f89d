import numpy as np
import pytest

from sessions.errors import SessionError
from sessions.mcap_format.frame_batch import FrameBatch, nanoseconds, pose_values
from sessions.model.frames import Status


def test_frames_hold_what_was_added_and_nothing_else():
    batch = FrameBatch(("a", "b", "c"), 3)
    assert batch.knows(("c", "a")) and not batch.knows(("a", "d"))
    batch.add(("c", "a"), np.arange(14.0).reshape(2, 7), 5, 6, {"a": Status.LOST}, {"c": 4})
    frames = batch.frames()
    assert len(frames) == 1 and not batch.full
    assert frames.status.tolist() == [[Status.LOST, Status.ABSENT, Status.VALID]]
    assert frames.sample_ns.tolist() == [[5, 0, 4]] and (frames.stamp_ns[0], frames.log_ns[0]) == (5, 6)
    assert frames.position[0, 2].tolist() == [0, 1, 2] and frames.quaternion_xyzw[0, 0].tolist() == [10, 11, 12, 13]
    assert np.isnan(frames.position[0, 1]).all()


def test_it_is_full_when_no_frame_fits():
    batch = FrameBatch((), 2)
    assert batch.knows(())
    for _ in range(2):
        assert not batch.full
        batch.add((), pose_values({}), 1, 1)
    assert batch.full and len(batch.frames()) == 2


@pytest.mark.parametrize(
    "pose", [((0, 1), (0, 0, 0, 1)), ((0, 1, 2, 3), (0, 0, 0)), None, (1, 2), ("abc", "abcd"), ((0, 0, 0),)]
)
def test_a_pose_that_is_not_seven_numbers_names_its_body(pose):
    with pytest.raises(SessionError, match=r"pose of 'bad' is .*give a position"):
        pose_values({"good": ((0, 0, 0), (0, 0, 0, 1)), "bad": pose})


@pytest.mark.parametrize("value", [-1, 1.0, None, "5", 2**63])
def test_a_stamp_that_is_no_time_is_refused(value):
    with pytest.raises(SessionError, match="is no time; give integer nanoseconds"):
        nanoseconds(value)


def test_a_numpy_integer_is_a_stamp():
    assert nanoseconds(np.int64(7)) == 7 and type(nanoseconds(np.int64(7))) is int
