"""A leg gives the recorded poses at its ends bit for bit and the shortest arc between; its bounds hold.

A leg is the motion of a body between two frames: on a line, with a rotation at a constant rate.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from cdcore.narrow.continuous.motion_segments import ANGLE, leg_bounds, leg_pads, legs_of, pose_at


def leg_between(rotation, position, rotation_after, position_after):
    """The motion from one pose to the next."""
    positions = np.array([position, position_after], dtype=float)
    return legs_of(np.array([rotation, rotation_after]), positions, np.array([1]))[:, 0]


def pose_of(leg, fraction):
    """Rotation and position at a fraction of a leg."""
    pose = np.empty(12)
    pose_at(leg, fraction, pose)
    return pose[:9].reshape(3, 3), pose[9:]


def random_leg(rng, angle=None, size=1.0):
    """A leg between random poses, with a rotation by ``angle`` radians, some ``size`` metres from the origin."""
    first = Rotation.from_rotvec(rng.normal(size=3))
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    rotation = Rotation.from_rotvec(axis * (rng.uniform(0, 3.1) if angle is None else angle))
    return leg_between(
        first.as_matrix(), rng.normal(size=3) * size, (rotation * first).as_matrix(), rng.normal(size=3) * size
    )


each_angle = pytest.mark.parametrize("degrees", [0.0, 1e-13, 1e-6, 0.3, 90.0, 120.0, 179.0, 179.999, 181.0])


def legs_and_their_ends(degrees):
    """Twenty legs, and (rotation, position) of both of their ends; rotations are so many degrees from each other."""
    rng = np.random.default_rng(3)
    start, end = np.array([0.0, 1.0, 2.0]), np.array([1.0, 1.0, 1.0])
    for _ in range(20):
        axis = rng.normal(size=3)
        first = Rotation.from_rotvec(rng.normal(size=3))
        second = Rotation.from_rotvec(np.radians(degrees) * axis / np.linalg.norm(axis)) * first
        yield leg_between(first.as_matrix(), start, second.as_matrix(), end), ((first, start), (second, end))


@pytest.mark.sampled(3)
@each_angle
def test_a_leg_ends_exactly_at_the_recorded_poses(degrees):
    """Twenty legs that rotate by so many degrees about random axes, from (0, 1, 2) to (1, 1, 1) m.

    A rotation beyond 180 degrees goes the other way.
    """
    for leg, ends in legs_and_their_ends(degrees):
        assert leg[ANGLE] == pytest.approx(np.radians(min(degrees, 360 - degrees)), abs=1e-14)
        for fraction, (recorded_rotation, recorded_position) in zip((0.0, 1.0), ends, strict=True):
            rotation, position = pose_of(leg, fraction)
            assert np.array_equal(rotation, recorded_rotation.as_matrix()), fraction
            assert np.array_equal(position, recorded_position), fraction


@pytest.mark.sampled(3)
@each_angle
def test_a_leg_rotates_at_constant_rate_on_a_line(degrees):
    """Twenty legs that rotate by so many degrees about random axes, from (0, 1, 2) to (1, 1, 1) m.

    After an eighth, half and nine tenths of the leg the rotation is that of SciPy's slerp.
    """
    for leg, ((first, start), (second, end)) in legs_and_their_ends(degrees):
        slerp = Slerp([0, 1], Rotation.concatenate([first, second]))
        for fraction in (0.125, 0.5, 0.9):
            rotation, position = pose_of(leg, fraction)
            assert np.abs(rotation - slerp(fraction).as_matrix()).max() < 1e-13, fraction
            assert np.allclose(position, (1 - fraction) * start + fraction * end, atol=1e-15), fraction


@settings(max_examples=max(40, settings.default.max_examples), deadline=None)
@given(seed=st.integers(0, 10**6), start=st.floats(0, 0.9), width=st.floats(0.001, 1.0))
def test_relative_paths_stay_within_the_chord_bound(seed, start, width):
    """The path of a point of body A as seen from B, both on random legs, from ``start`` on for ``width`` of the leg.

    It leaves its chord by at most an eighth of time squared times acceleration; the chord is at most as long as time
    times speed (``leg_bounds``).
    """
    rng, rounding = np.random.default_rng(seed), 1e-13
    leg_a, leg_b = random_leg(rng), random_leg(rng, angle=rng.uniform(0, 1.5))
    reach = rng.uniform(0.01, 2)
    point = rng.normal(size=3)
    point *= reach / np.linalg.norm(point)
    duration = min(1.0, start + width) - start
    (speed,), (acceleration,) = leg_bounds(leg_a[:, None], reach, leg_b[:, None])

    def point_in_frame_of_b(fraction):
        (rotation_a, position_a), (rotation_b, position_b) = pose_of(leg_a, fraction), pose_of(leg_b, fraction)
        return rotation_b.T @ (rotation_a @ point + position_a - position_b)

    first, last = point_in_frame_of_b(start), point_in_frame_of_b(start + duration)
    farthest = max(
        np.linalg.norm(point_in_frame_of_b(start + fraction * duration) - ((1 - fraction) * first + fraction * last))
        for fraction in np.linspace(0, 1, 12)
    )
    assert farthest <= duration**2 / 8 * acceleration + rounding
    assert np.linalg.norm(last - first) <= duration * speed + rounding


# Case -> motion, speed and acceleration of A seen from B, with points of A up to 2 m from its origin; rates in radians
# and metres a leg. A point that turns with A at w, seen from B, about r = 2 m: speed w r, acceleration w^2 r. Where B
# turns at u, a point at distance d that moves at v adds speed u d + v and acceleration u^2 d + 2 u v (centrifugal,
# Coriolis), and the axis of A turns too, which adds w u r.
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
    """Body A reaches 2 m; MOTION_BOUNDS has how both bodies move, and the speed and acceleration of A seen from B.

    Those are closed forms: a body that turns by 0.5 radians a leg moves a point at 2 m by 0.5 * 2 m.
    """
    motion, speed, acceleration = MOTION_BOUNDS[case]
    leg_a, leg_b = (
        leg_of(motion.get(f"start_{k}", (0, 0, 0)), motion.get(f"end_{k}", (0, 0, 0)), motion.get(f"rate_{k}", 0.0))
        for k in "ab"
    )
    (speed_bound,), (acceleration_bound,) = leg_bounds(leg_a, 2.0, leg_b)
    assert speed <= speed_bound <= speed * (1 + 1e-8) + 1e-14
    assert acceleration <= acceleration_bound <= acceleration * (1 + 1e-8) + 1e-14


def test_pad_of_a_leg_grows_with_its_distance():
    """Metres of rounding: some 1e-13 near the origin, at least 10,000 times as many 1,000 km from it."""
    rng = np.random.default_rng(1)
    near, far = random_leg(rng), random_leg(rng, size=1e6)
    legs_a, legs_b = np.array([near, far]).T, np.array([near, near]).T
    pad_near, pad_far = leg_pads(legs_a, reach_a=0.1, legs_b=legs_b, reach_b=0.1)
    assert 1e-14 < pad_near < 1e-11
    assert 1e4 * pad_near < pad_far < np.inf


def test_pad_of_a_leg_of_no_rotations_is_infinite():
    """An entry of the first rotation matrix of a leg is off by 1e-3: there is no bound."""
    rng = np.random.default_rng(1)
    leg, skewed = random_leg(rng)[:, None], random_leg(rng)[:, None]
    skewed[0] += 1e-3
    assert leg_pads(skewed, reach_a=0.1, legs_b=leg, reach_b=0.1).tolist() == [np.inf]


def test_pad_covers_a_stretched_rotation():
    """A rotation stretched by 1e-9: a corner 0.1 m from the body's origin may lie off by 1e-10 m."""
    leg = random_leg(np.random.default_rng(1))[:, None]
    stretched = leg.copy()
    stretched[:9] *= 1.0 + 1e-9
    (pad,) = leg_pads(stretched, reach_a=0.1, legs_b=leg, reach_b=0.1)
    assert 1e-10 < pad < 1e-6


@pytest.mark.parametrize("reaches", [(1e80, 0.1), (0.1, 1e80)], ids=["body A", "body B"])
def test_pad_of_a_body_of_1e80_m_is_infinite(reaches):
    """A body whose points are up to 1e80 m from its origin."""
    leg = random_leg(np.random.default_rng(1))[:, None]
    reach_a, reach_b = reaches
    assert leg_pads(leg, reach_a, leg, reach_b).tolist() == [np.inf]
