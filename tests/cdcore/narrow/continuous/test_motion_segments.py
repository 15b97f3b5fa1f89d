"""A leg gives the recorded poses at its ends bit for bit and the shortest arc between; its bounds hold."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from cdcore.narrow.continuous.motion_segments import ANGLE, leg_bounds, leg_pads, legs_of, pose_at
from cdcore.poses.kernels import relative_row


def leg_between(matrix, position, rotation_after, position_after):
    """The motion from one pose to the next."""
    positions = np.array([position, position_after], dtype=float)
    return legs_of(np.array([matrix, rotation_after]), positions, np.array([1]))[:, 0]


def pose_of(leg, fraction):
    """Rotation and position at a fraction of a leg."""
    pose = np.empty(12)
    pose_at(leg, fraction, pose)
    return pose[:9].reshape(3, 3), pose[9:]


def random_segment(rng, angle=None, size=1.0):
    """A leg of random poses, its rotation by ``angle`` radians."""
    first = Rotation.from_rotvec(rng.normal(size=3))
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    matrix = Rotation.from_rotvec(axis * (rng.uniform(0, 3.1) if angle is None else angle))
    return leg_between(
        first.as_matrix(), rng.normal(size=3) * size, (matrix * first).as_matrix(), rng.normal(size=3) * size
    )


@pytest.mark.sampled(3)
@pytest.mark.parametrize("degrees", [0.0, 1e-13, 1e-6, 0.3, 90.0, 120.0, 179.0, 179.999, 181.0])
def test_legs_rotate_at_constant_rate_between_exact_ends(degrees):
    """Rotations beyond 180 degrees take the other way; in between against SciPy's slerp."""
    rng = np.random.default_rng(3)
    for _ in range(20):
        axis = rng.normal(size=3)
        first = Rotation.from_rotvec(rng.normal(size=3))
        second = Rotation.from_rotvec(np.radians(degrees) * axis / np.linalg.norm(axis)) * first
        leg = leg_between(first.as_matrix(), [0, 1, 2], second.as_matrix(), [1, 1, 1])
        assert leg[ANGLE] == pytest.approx(np.radians(min(degrees, 360 - degrees)), abs=1e-14)
        for end, rotation, position in ((0.0, first, [0, 1, 2]), (1.0, second, [1, 1, 1])):
            assert np.array_equal(np.column_stack(pose_of(leg, end)), np.column_stack([rotation.as_matrix(), position]))
        slerp = Slerp([0, 1], Rotation.concatenate([first, second]))
        for fraction in (0.125, 0.5, 0.9):
            matrix, position = pose_of(leg, fraction)
            assert np.abs(matrix - slerp(fraction).as_matrix()).max() < 1e-13
            assert np.allclose(position, [fraction, 1, 2 - fraction], atol=1e-15)


@settings(max_examples=max(40, settings.default.max_examples), deadline=None)
@given(seed=st.integers(0, 10**6), start=st.floats(0, 0.9), width=st.floats(0.001, 1.0))
def test_relative_paths_stay_within_the_chord_bound(seed, start, width):
    """Between two instants a path leaves its chord by at most an eighth of time squared times acceleration.

    The chord is at most as long as time times speed.
    """
    rng = np.random.default_rng(seed)
    segment_a, segment_b = random_segment(rng), random_segment(rng, angle=rng.uniform(0, 1.5))
    reach = rng.uniform(0.01, 2)
    point = rng.normal(size=3)
    point *= reach / np.linalg.norm(point)
    stop = min(1.0, start + width)
    speed, acceleration = (bound[0] for bound in leg_bounds(segment_a[:, None], reach, segment_b[:, None]))

    def sample(fraction):
        pose_a, pose_b, relative = np.empty(12), np.empty(12), np.empty(12)
        pose_at(segment_a, fraction, pose_a)
        pose_at(segment_b, fraction, pose_b)
        relative_row(pose_b, pose_a, relative)
        return relative[:9].reshape(3, 3) @ point + relative[9:]

    ends = sample(start), sample(stop)
    allowed = (stop - start) ** 2 / 8 * acceleration
    farthest = 0.0
    for component in np.linspace(0, 1, 12):
        off = sample(start + component * (stop - start)) - ((1 - component) * ends[0] + component * ends[1])
        farthest = max(farthest, np.linalg.norm(off))
    assert farthest <= allowed + 1e-13
    assert np.linalg.norm(ends[1] - ends[0]) <= (stop - start) * speed + 1e-13


# Of A seen from B, with points of A up to 2 m from its origin; rates in rad and metres per unit of the leg.
# A point that turns with A at w, seen from B, about r = 2 m: speed w r, acceleration w^2 r. Where B turns at u, a place
# at distance d that moves at v adds speed u d + v and acceleration u^2 d + 2 u v (centrifugal, Coriolis), and the axis
# of A turns too, which adds w u r.
MOTION_BOUNDS = {
    "A moves 5 m": ({"end_a": (3, 4, 0)}, 5.0, 0.0),
    "B moves 5 m": ({"end_b": (3, 4, 0)}, 5.0, 0.0),
    "both move 5 m": ({"end_a": (3, 4, 0), "end_b": (3, 4, 0)}, 0.0, 0.0),
    "A turns": ({"rate_a": 0.5}, 0.5 * 2, 0.25 * 2),
    "A turns, 7 m from B": ({"rate_a": 0.5, "start_a": (0, 7, 0), "end_a": (0, 7, 0)}, 0.5 * 2, 0.25 * 2),
    "B turns": ({"rate_b": 0.5}, 0.5 * 2, 0.25 * 2 + 0.5 * 0.5 * 2),
    "B turns, 7 m from A": (
        {"rate_b": 0.5, "start_a": (0, 7, 0), "end_a": (0, 7, 0)},
        0.5 * (2 + 7),
        2 * 0.25 * 2 + 0.25 * 7,
    ),
    "B turns 2 m from the origin, 7 m from A": (
        {"rate_b": 0.5, "start_a": (0, 9, 0), "end_a": (0, 9, 0), "start_b": (0, 2, 0), "end_b": (0, 2, 0)},
        0.5 * (2 + 7),
        2 * 0.25 * 2 + 0.25 * 7,
    ),
    "B turns, A comes nearer": (
        {"rate_b": 0.5, "start_a": (0, 7, 0), "end_a": (0, 3, 0)},
        0.5 * (2 + 7) + 4,
        2 * 0.25 * 2 + 0.25 * 7 + 2 * 0.5 * 4,
    ),
    "both turn alike": ({"rate_a": 0.5, "rate_b": 0.5}, 1e-15, 0.0),  # rounding may still turn them a little
    "both turn against each other": ({"rate_a": 0.5, "rate_b": -0.5}, 1.0 * 2, (1.0 + 0.5) * 2),
}


def leg_of(start, end, rate):
    """A leg (28, 1) from one place to another, with a rotation of ``rate`` radians about z."""
    after = Rotation.from_rotvec([0.0, 0.0, rate]).as_matrix()
    return leg_between(np.eye(3), start, after, end)[:, None]


@pytest.mark.parametrize("case", MOTION_BOUNDS)
def test_motion_bounds_exceed_simple_motions_by_rounding_only(case):
    """Body a has radius 2 m; speed and acceleration of each motion are known in closed form."""
    motion, speed, acceleration = MOTION_BOUNDS[case]
    leg_a, leg_b = (
        leg_of(motion.get(f"start_{k}", (0, 0, 0)), motion.get(f"end_{k}", (0, 0, 0)), motion.get(f"rate_{k}", 0.0))
        for k in "ab"
    )
    bounds = [float(bound[0]) for bound in leg_bounds(leg_a, 2.0, leg_b)]
    for bound, exact in zip(bounds, (speed, acceleration), strict=True):
        assert exact <= bound <= exact * (1 + 1e-8) + 1e-14


def test_pad_grows_with_size_to_infinity():
    """Pads of rounding: near the origin, 1,000 km away, and of a matrix that is no rotation: no bound.

    Bodies that reach 1e80 m from their origins have none either.
    """
    rng = np.random.default_rng(1)
    near, far, skewed = random_segment(rng), random_segment(rng, size=1e6), random_segment(rng)
    skewed[0] += 1e-3
    legs, other = np.array([near, far, skewed]).T, np.array([near, near, far]).T
    small, large, unknown = leg_pads(legs, reach_a=0.1, legs_b=other, reach_b=0.1)
    assert 1e-14 < small < 1e-11
    assert 1e4 * small < large < unknown == np.inf
    scaled = near[:, None].copy()
    scaled[:9] *= 1.0 + 1e-9  # a corner at 0.1 m may lie off by 1e-10 m
    assert 1e-10 < leg_pads(scaled, 0.1, near[:, None], 0.1)[0] < 1e-6
    for reaches in ((1e80, 0.1), (0.1, 1e80)):
        assert (leg_pads(legs, reaches[0], other, reaches[1]) == np.inf).all()
