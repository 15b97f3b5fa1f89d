import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp
from support.small_worlds import framed

from replay.prepare.assembly import PoseOrigin
from replay.prepare.interpolation import fill_frames, interpolate_poses
from sessions import Status

A, V, L, H, I = (int(s) for s in (Status.ABSENT, Status.VALID, Status.LOST, Status.HELD, Status.INTERPOLATED))  # noqa: E741
NONE, VISIBLE, GRASPED, BETWEEN, _ = (int(origin) for origin in PoseOrigin)
MS, NO = 1_000_000, np.nan


@pytest.mark.parametrize(
    ("status", "stamps", "origin", "positions"),
    [
        # Between near samples the place is linear in time. A sample recorded at second k lies at k metres.
        ([V, A, A, V], [0, 10, 30, 40], [VISIBLE, BETWEEN, BETWEEN, VISIBLE], [0.0, 0.75, 2.25, 3.0]),
        # A neighbour counts up to 50 ms and not a nanosecond longer.
        ([V, A, V], [0, 20, 70], [VISIBLE, BETWEEN, VISIBLE], [0.0, 2 * 20 / 70, 2.0]),
        ([V, A, V], [0, 20, 70 + 1e-6], [VISIBLE, GRASPED, VISIBLE], [0.0, 0.0, 2.0]),
        ([V, A], [0, 50], [VISIBLE, GRASPED], [0.0, 0.0]),
        ([V, A], [0, 50 + 1e-6], [VISIBLE, NONE], [0.0, NO]),
        # What the source held keeps that name, and nothing is held or interpolated across a lost sample.
        ([V, H, I], [0, 10, 20], [VISIBLE, GRASPED, BETWEEN], [0.0, 1.0, 2.0]),
        ([V, A, L, A, V], [0, 10, 20, 30, 40], [VISIBLE, GRASPED, NONE, NONE, VISIBLE], [0.0, 0.0, NO, NO, 4.0]),
    ],
)
def test_frame_without_a_sample_is_interpolated_from_near_neighbours(status, stamps, origin, positions):
    session = framed(np.round(np.array(stamps) * MS), np.array(status)[:, None])
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
    rng = np.random.default_rng(seed)
    ends, fraction = Rotation.random(2, rng=rng), rng.uniform(size=5)
    start, end = (np.tile([*position, *q], (5, 1)) for position, q in zip(np.eye(3)[:2], ends.as_quat(), strict=True))
    end[:, 3:] *= -1.0005  # as another program may have written it
    actual = interpolate_poses(start, end, fraction)
    assert (Rotation.from_quat(actual[:, 3:]) * Slerp([0, 1], ends)(fraction).inv()).magnitude().max() < 1e-7
    assert np.allclose(actual[:, :3], np.outer(1 - fraction, [1, 0, 0]) + np.outer(fraction, [0, 1, 0]))
