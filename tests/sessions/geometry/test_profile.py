import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sessions.geometry.profile import Arc, Line, clipped, level_holding, offset, rounded, sampled, solved, volume_below

CONE = [(0.0, 0.001), (0.03, 0.001), (0.01, 0.08), (0.01, 0.12)]


def profile(segments=20):
    return sampled(rounded(CONE, [0.008, 0.01]), segments)


@given(st.integers(0, 200))
def test_a_sampled_profile_has_the_segments_asked_for_or_its_fewest(segments):
    fewest = len(profile(0)) - 1
    assert len(profile(segments)) - 1 == max(segments, fewest)


def test_roundings_touch_their_lines_and_keep_the_ends():
    points = profile(400)
    assert points[0].tolist() == [0.0, 0.001]
    assert points[-1].tolist() == [0.01, 0.12]
    direction = np.diff(points, axis=0)
    turns = np.diff(np.unwrap(np.arctan2(direction[:, 1], direction[:, 0])))
    assert np.abs(turns).max() < 0.12


@given(st.integers(10, 60), st.floats(0.0005, 0.004))
def test_every_segment_of_an_offset_is_parallel_at_the_distance(segments, distance):
    inner = profile(segments)
    outer = offset(inner, distance)
    along = np.diff(inner, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    normal = np.column_stack([along[:, 1], -along[:, 0]])
    for ends in (slice(None, -1), slice(1, None)):
        assert np.einsum("ij,ij->i", (outer - inner)[ends], normal) == pytest.approx(distance, rel=1e-6)


def test_an_offset_start_on_the_axis_stays_on_the_axis():
    ball = sampled([Arc((0.0, 0.02), 0.01, -np.pi / 2, 0.0)], 6)
    assert ball[0].tolist() == [0.0, 0.01]
    assert offset(ball, 0.002)[0, 0] == 0.0
    assert offset(ball, 0.002)[0, 1] < 0.008


def test_volumes_are_those_of_cylinders_cones_and_balls():
    cylinder = sampled([Line((0.0, 0.0), (0.02, 0.0)), Line((0.02, 0.0), (0.02, 0.1))], 2)
    assert volume_below(cylinder, 0.07) == pytest.approx(np.pi * 0.02**2 * 0.07)
    cone = sampled([Line((0.0, 0.0), (0.05, 0.1))], 1)
    assert volume_below(cone, 0.08) == pytest.approx(np.pi * 0.04**2 * 0.08 / 3)
    ball = sampled([Arc((0.0, 0.0), 0.03, -np.pi / 2, np.pi / 2)], 3000)
    assert volume_below(ball, 0.03) == pytest.approx(4 / 3 * np.pi * 0.03**3, rel=1e-6)


@given(st.floats(1e-7, 7e-5))
def test_the_level_found_holds_the_volume_asked_for(volume):
    assert volume_below(profile(), level_holding(profile(), volume)) == pytest.approx(volume, rel=1e-9)


def test_clipping_ends_at_the_level_and_leaves_no_needle():
    points = profile()
    assert clipped(points, 0.05)[-1, 1] == pytest.approx(0.05)
    just_above = float(points[8, 1]) + 1e-8
    cut = clipped(points, just_above)
    assert np.linalg.norm(np.diff(cut, axis=0), axis=1).min() > 1e-6


def test_a_root_is_found_to_the_last_bits():
    assert solved(lambda x: x * x - 2.0, 0.0, 2.0) == pytest.approx(np.sqrt(2.0), rel=1e-15)
