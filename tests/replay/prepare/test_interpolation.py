import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp
from support.small_worlds import session_of_frames

from replay.prepare.assembly import PoseOrigin
from replay.prepare.interpolation import fill_frames, interpolate_poses
from sessions import Status

ABSENT, VALID, LOST, HELD, INTERPOLATED = (
    int(s) for s in (Status.ABSENT, Status.VALID, Status.LOST, Status.HELD, Status.INTERPOLATED)
)
NO_POSE, RECORDED_POSE, LAST_POSE, INTERPOLATED_POSE, _ = (int(origin) for origin in PoseOrigin)
MILLISECOND_NS, NO_POSITION = 1_000_000, np.nan
NANOSECOND_IN_MS = 1e-6


@pytest.mark.parametrize(
    ("status", "milliseconds", "origin", "x"),
    [
        # At 10 and 30 of 40 ms between x = 0 and 3 m: 0.75 and 2.25 m.
        pytest.param(
            [VALID, ABSENT, ABSENT, VALID],
            [0, 10, 30, 40],
            [RECORDED_POSE, INTERPOLATED_POSE, INTERPOLATED_POSE, RECORDED_POSE],
            [0.0, 0.75, 2.25, 3.0],
            id="linear between near samples",
        ),
        # A neighbour counts up to 50 ms and not a nanosecond longer.
        pytest.param(
            [VALID, ABSENT, VALID],
            [0, 20, 70],
            [RECORDED_POSE, INTERPOLATED_POSE, RECORDED_POSE],
            [0.0, 2 * 20 / 70, 2.0],
            id="next sample after 50 ms",
        ),
        pytest.param(
            [VALID, ABSENT, VALID],
            [0, 20, 70 + NANOSECOND_IN_MS],
            [RECORDED_POSE, LAST_POSE, RECORDED_POSE],
            [0.0, 0.0, 2.0],
            id="next sample after more than 50 ms",
        ),
        pytest.param([VALID, ABSENT], [0, 50], [RECORDED_POSE, LAST_POSE], [0.0, 0.0], id="last sample 50 ms ago"),
        pytest.param(
            [VALID, ABSENT],
            [0, 50 + NANOSECOND_IN_MS],
            [RECORDED_POSE, NO_POSE],
            [0.0, NO_POSITION],
            id="last sample more than 50 ms ago",
        ),
        pytest.param(
            [VALID, HELD, INTERPOLATED],
            [0, 10, 20],
            [RECORDED_POSE, LAST_POSE, INTERPOLATED_POSE],
            [0.0, 1.0, 2.0],
            id="stand-ins of the recording keep their names",
        ),
        pytest.param(
            [VALID, ABSENT, LOST, ABSENT, VALID],
            [0, 10, 20, 30, 40],
            [RECORDED_POSE, LAST_POSE, NO_POSE, NO_POSE, RECORDED_POSE],
            [0.0, 0.0, NO_POSITION, NO_POSITION, 4.0],
            id="nothing stands in across a lost sample",
        ),
    ],
)
def test_frame_without_a_sample_is_interpolated_from_near_neighbours(status, milliseconds, origin, x):
    """A body whose sample of frame k is at x = k m; ``milliseconds``: of the frames, after 5 s.

    A frame without a sample (ABSENT) has a place between both neighbours, or that of the last one, or none; ``origin``
    says which.
    """
    stamps_ns = 5_000 * MILLISECOND_NS + np.round(np.array(milliseconds) * MILLISECOND_NS).astype(np.int64)
    session = session_of_frames(stamps_ns, np.array(status)[:, None])
    more_than_all_frames = 100
    blocks = list(fill_frames(session.blocks(more_than_all_frames)))
    actual_origin, position, rotation = (
        np.concatenate([getattr(block, name)[:, 0] for block in blocks])
        for name in ("origin", "position", "quaternion_xyzw")
    )
    assert actual_origin.tolist() == origin
    assert np.allclose(position[:, 0], x, rtol=1e-12, equal_nan=True)
    assert np.isnan(rotation).all(axis=1).tolist() == np.isnan(x).tolist(), "no rotation without a position"


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=50, deadline=None)
def test_interpolation_is_straight_and_rotates_as_scipys_slerp(seed):
    """Five random fractions of the way from (1, 0, 0) to (0, 1, 0) and between two random rotations.

    The quaternion of the second is written with the other sign and a length of 1.0005, as another program may do.
    """
    rng = np.random.default_rng(seed)
    rotations, fraction = Rotation.random(2, rng=rng), rng.uniform(size=5)
    first_quaternion, second_quaternion = rotations.as_quat()
    start = np.tile([1.0, 0.0, 0.0, *first_quaternion], (5, 1))
    end = np.tile([0.0, 1.0, 0.0, *(-1.0005 * second_quaternion)], (5, 1))
    actual = interpolate_poses(start, end, fraction)
    assert np.allclose(actual[:, :3], np.stack([1 - fraction, fraction, 0 * fraction], axis=1))
    angle_to_slerp = (Rotation.from_quat(actual[:, 3:]) * Slerp([0, 1], rotations)(fraction).inv()).magnitude()
    assert angle_to_slerp.max() < 1e-7


def test_recording_without_frames_is_filled_with_nothing():
    """There is no block of frames, or one block without a frame."""
    empty_block = session_of_frames([], np.zeros((0, 1))).source
    assert list(fill_frames([])) == []
    assert list(fill_frames([empty_block])) == []
