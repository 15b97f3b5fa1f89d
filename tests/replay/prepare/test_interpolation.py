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


@pytest.mark.parametrize(
    ("status", "stamps", "origin", "positions"),
    [
        # Between near samples the place is linear in time. A sample recorded at second k lies at k metres.
        (
            [VALID, ABSENT, ABSENT, VALID],
            [0, 10, 30, 40],
            [RECORDED_POSE, INTERPOLATED_POSE, INTERPOLATED_POSE, RECORDED_POSE],
            [0.0, 0.75, 2.25, 3.0],
        ),
        # A neighbour counts up to 50 ms and not a nanosecond longer.
        (
            [VALID, ABSENT, VALID],
            [0, 20, 70],
            [RECORDED_POSE, INTERPOLATED_POSE, RECORDED_POSE],
            [0.0, 2 * 20 / 70, 2.0],
        ),
        ([VALID, ABSENT, VALID], [0, 20, 70 + 1e-6], [RECORDED_POSE, LAST_POSE, RECORDED_POSE], [0.0, 0.0, 2.0]),
        ([VALID, ABSENT], [0, 50], [RECORDED_POSE, LAST_POSE], [0.0, 0.0]),
        ([VALID, ABSENT], [0, 50 + 1e-6], [RECORDED_POSE, NO_POSE], [0.0, NO_POSITION]),
        # What the source held keeps that name, and nothing is held or interpolated across a lost sample.
        ([VALID, HELD, INTERPOLATED], [0, 10, 20], [RECORDED_POSE, LAST_POSE, INTERPOLATED_POSE], [0.0, 1.0, 2.0]),
        (
            [VALID, ABSENT, LOST, ABSENT, VALID],
            [0, 10, 20, 30, 40],
            [RECORDED_POSE, LAST_POSE, NO_POSE, NO_POSE, RECORDED_POSE],
            [0.0, 0.0, NO_POSITION, NO_POSITION, 4.0],
        ),
    ],
)
def test_frame_without_a_sample_is_interpolated_from_near_neighbours(status, stamps, origin, positions):
    """``stamps``: milliseconds after 5 s; a sample of frame k is at x = k m; ``origin``: kinds of their poses."""
    stamps_ns = 5_000 * MILLISECOND_NS + np.round(np.array(stamps) * MILLISECOND_NS).astype(np.int64)
    session = session_of_frames(stamps_ns, np.array(status)[:, None])
    pieces = list(fill_frames(session.blocks(100)))
    actual, position, rotation = (
        np.concatenate([getattr(piece, name)[:, 0] for piece in pieces])
        for name in ("origin", "position", "quaternion_xyzw")
    )
    assert actual.tolist() == origin and np.allclose(position[:, 0], positions, rtol=1e-12, equal_nan=True)
    assert np.isnan(rotation).all(axis=1).tolist() == np.isnan(positions).tolist()


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=50, deadline=None)
def test_interpolation_is_straight_and_rotates_as_scipys_slerp(seed):
    """From (1, 0, 0) to (0, 1, 0) between two random rotations."""
    rng = np.random.default_rng(seed)
    ends, fraction = Rotation.random(2, rng=rng), rng.uniform(size=5)
    start, end = (np.tile([*position, *q], (5, 1)) for position, q in zip(np.eye(3)[:2], ends.as_quat(), strict=True))
    end[:, 3:] *= -1.0005  # as another program may have written it
    actual = interpolate_poses(start, end, fraction)
    assert (Rotation.from_quat(actual[:, 3:]) * Slerp([0, 1], ends)(fraction).inv()).magnitude().max() < 1e-7
    assert np.allclose(actual[:, :3], np.outer(1 - fraction, [1, 0, 0]) + np.outer(fraction, [0, 1, 0]))


def test_recording_without_frames_is_filled_with_nothing():
    """No block of frames, and one block without a frame."""
    empty_block = session_of_frames([], np.zeros((0, 1))).source
    assert list(fill_frames([])) == list(fill_frames([empty_block])) == []
