import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from sessions.geometry import rotations
from sessions.geometry.profile import Arc, Line, level_holding, offset, rounded, sampled, solved, volume_below
from sessions.geometry.rings import even_angles, sewn, turned, turned_solid
from sessions.mesh_data import is_closed

CONE = [(0.0, 0.001), (0.03, 0.001), (0.01, 0.08), (0.01, 0.12)]


def profile(segments=20):
    return sampled(rounded(CONE, [0.008, 0.01]), segments)


@given(st.integers(0, 200))
def test_a_sampled_profile_has_the_segments_asked_for_or_its_fewest(segments):
    fewest = len(profile(0)) - 1
    assert len(profile(segments)) - 1 == max(segments, fewest)


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


def test_a_root_is_found_to_the_last_bits():
    assert solved(lambda x: x * x - 2.0, 0.0, 2.0) == pytest.approx(np.sqrt(2.0), rel=1e-15)


CYLINDER = np.array([(0.0, 0.0), (0.02, 0.0), (0.02, 0.1), (0.0, 0.1)])


@given(st.integers(3, 200))
def test_a_turned_polygon_has_the_volume_of_the_round_solid(sections):
    solid = turned_solid(CYLINDER, sections)
    assert is_closed(solid)
    assert solid.volume == pytest.approx(np.pi * 0.02**2 * 0.1, rel=1e-5)


def test_the_order_of_the_rings_does_not_turn_the_surface_inside_out():
    rings = turned(CYLINDER, even_angles(12))
    assert sewn(rings).volume == pytest.approx(sewn(rings[::-1]).volume)
    assert sewn(rings).volume > 0


def test_a_ring_sewn_around_is_a_closed_torus():
    outline = np.array([(0.05, 0.0), (0.06, 0.0), (0.06, 0.01), (0.05, 0.01)])
    torus = sewn(turned(outline, even_angles(40)), around=True)
    assert is_closed(torus)
    edges = len(torus.faces) * 3 // 2
    assert len(torus.vertices) - edges + len(torus.faces) == 0
    assert torus.volume == pytest.approx(2 * np.pi * 0.055 * 1e-4, rel=1e-3)


seeds = st.integers(0, 2**32 - 1)


def some(seed, count=20):
    return Rotation.random(count, rng=np.random.default_rng(seed))


@given(seeds)
def test_products_turns_and_inverses_agree_with_scipy(seed):
    a, b = some(seed), some(seed + 1)
    product = Rotation.from_quat(rotations.quaternion_product(a.as_quat(), b.as_quat()))
    np.testing.assert_allclose(product.as_matrix(), (a * b).as_matrix(), atol=1e-14)
    v = np.random.default_rng(seed).normal(size=(20, 3))
    np.testing.assert_allclose(rotations.rotated(a.as_quat(), v), a.apply(v), atol=1e-13)
    np.testing.assert_allclose(rotations.rotated(rotations.quaternion_inverse(a.as_quat()), a.apply(v)), v, atol=1e-13)


@given(seeds, st.floats(0.0, 1.0))
def test_slerp_agrees_with_scipy_whatever_the_signs(seed, share):
    pair = some(seed, 2)
    q = pair.as_quat() * np.where(np.random.default_rng(seed).random(2) < 0.5, -1.0, 1.0)[:, None]
    expected = Slerp([0.0, 1.0], pair)(share).as_matrix()
    np.testing.assert_allclose(Rotation.from_quat(rotations.slerp(q[0], q[1], share)).as_matrix(), expected, atol=1e-7)


@given(seeds)
def test_matrices_and_vectors_give_their_rotation(seed):
    turn = some(seed, 1)[0]
    from_matrix = rotations.quaternion_from_matrix(turn.as_matrix())
    np.testing.assert_allclose(Rotation.from_quat(from_matrix).as_matrix(), turn.as_matrix(), atol=1e-13)
    from_vector = rotations.quaternion_from_vector(turn.as_rotvec())
    np.testing.assert_allclose(Rotation.from_quat(from_vector).as_matrix(), turn.as_matrix(), atol=1e-13)


def test_facing_turns_minus_z_forward_and_keeps_up_up():
    q = rotations.quaternion_facing((1.0, -0.4, 0.3))
    forward = np.array([1.0, -0.4, 0.3]) / np.linalg.norm([1.0, -0.4, 0.3])
    np.testing.assert_allclose(rotations.rotated(q, (0.0, 0.0, -1.0)), forward, atol=1e-14)
    assert rotations.rotated(q, (0.0, 1.0, 0.0))[1] > 0.9
    assert abs(rotations.rotated(q, (1.0, 0.0, 0.0))[1]) < 1e-14
    with pytest.raises(ValueError, match="vertical"):
        rotations.quaternion_facing((0.0, 1.0, 0.0))
