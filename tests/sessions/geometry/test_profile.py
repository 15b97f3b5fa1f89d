import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from sessions.geometry import rotations
from sessions.geometry.profile import (
    Arc,
    Line,
    clipped_polyline,
    level_holding,
    offset,
    rounded_strokes,
    sampled_polyline,
    solve_rising,
    volume_below,
)


def test_root_is_exact_to_the_last_bits():
    """The root of 2, and rounded to three decimals."""
    assert solve_rising(lambda x: x * x - 2.0, lower=0.0, upper=2.0) == pytest.approx(np.sqrt(2.0), rel=1e-15, abs=0)
    assert solve_rising(lambda x: x * x - 2.0, lower=0.0, upper=2.0, decimals=3) == 1.414


def test_segments_are_shared_among_lines_by_their_length():
    """Eight segments along lines of 1 and 3 m, far from the origin: each is half a metre long."""
    polyline = sampled_polyline([Line((10.0, 20.0), (11.0, 20.0)), Line((11.0, 20.0), (11.0, 23.0))], 8)
    assert np.linalg.norm(np.diff(polyline, axis=0), axis=1) == pytest.approx([0.5] * 8)


def test_volume_of_cylinder_and_cone_cup_matches_closed_form():
    """Radius 1 up to height 2, growing to 2 at height 3, and 2 up to 4; volumes in units of pi.

    The profile is also clipped at a level between its corners, and its wall and floor offset by 0.1.
    """
    cup = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 2.0], [2.0, 3.0], [2.0, 4.0]])
    for level, volume in ((0.5, 0.5), (2.0, 2.0), (2.5, 2.0 + (1.5**3 - 1.0) / 3.0), (3.5, 2.0 + 7.0 / 3.0 + 2.0)):
        assert volume_below(cup, level) == pytest.approx(np.pi * volume, rel=1e-14, abs=0)
        assert level_holding(cup, np.pi * volume) == pytest.approx(level, rel=1e-14, abs=0)
    assert clipped_polyline(cup, 2.5).tolist() == [[0.0, 0.0], [1.0, 0.0], [1.0, 2.0], [1.5, 2.5]]
    assert clipped_polyline(cup, 2.0 + 1e-7)[-2:, 1].tolist() == pytest.approx([0.0, 2.0 + 1e-7])
    wall = np.array([[0.0, -0.1], [1.1, -0.1], [1.1, 2.0]])
    assert offset(cup[:3], 0.1) == pytest.approx(wall)


def test_rounded_corner_is_a_tangent_quarter_circle():
    """The corner at (2, 1) is rounded by a radius of 0.5; the weight of a stroke is its length."""
    first, arc, last = rounded_strokes([(1.0, 1.0), (2.0, 1.0, 0.5), (2.0, 4.0)])
    assert (first.end, arc.centre, last.start) == (pytest.approx((1.5, 1.0)), (1.5, 1.5), pytest.approx((2.0, 1.5)))
    assert arc.weight == pytest.approx(0.25 * np.pi) and arc.finish == pytest.approx(0.0, abs=1e-15)
    assert Arc((0.0, 0.0), radius=2.0, begin=1.0, finish=3.0).weight == pytest.approx(4.0)


seeds = st.integers(0, 2**32 - 1)


def random_scipy_rotations(seed, count=20):
    """Twenty random rotations, by SciPy."""
    return Rotation.random(count, rng=np.random.default_rng(seed))


@given(seeds)
def test_products_rotations_and_inverses_agree_with_scipy(seed):
    """Random rotations as quaternions (x, y, z, w)."""
    a, b = random_scipy_rotations(seed), random_scipy_rotations(seed + 1)
    product = Rotation.from_quat(rotations.quaternion_product(a.as_quat(), b.as_quat()))
    np.testing.assert_allclose(product.as_matrix(), (a * b).as_matrix(), atol=1e-14)
    v = np.random.default_rng(seed).normal(size=(20, 3))
    np.testing.assert_allclose(rotations.rotated_vectors(a.as_quat(), v), a.apply(v), atol=1e-13)
    np.testing.assert_allclose(
        rotations.rotated_vectors(rotations.quaternion_inverse(a.as_quat()), a.apply(v)), v, atol=1e-13
    )


@given(seeds)
def test_matrices_and_vectors_give_their_rotation(seed):
    """A random rotation as a matrix and as a rotation vector, by SciPy; w of the quaternion is not negative."""
    rotation = random_scipy_rotations(seed, count=1)[0]
    from_matrix = rotations.quaternion_from_matrix(rotation.as_matrix())
    np.testing.assert_allclose(Rotation.from_quat(from_matrix).as_matrix(), rotation.as_matrix(), atol=1e-13)
    assert from_matrix[3] >= 0.0
    from_vector = rotations.quaternion_from_vector(rotation.as_rotvec())
    np.testing.assert_allclose(Rotation.from_quat(from_vector).as_matrix(), rotation.as_matrix(), atol=1e-13)


@pytest.mark.parametrize("angle", [0.0, 1e-6, 0.1, 3.1])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_slerp_takes_the_shorter_arc_as_scipy_does(angle, sign):
    """Also between equal rotations, and where one is written with all signs turned."""
    start = Rotation.from_euler("xyz", [0.3, -1.0, 0.2])
    end = start * Rotation.from_rotvec([0.0, angle, 0.0])
    fractions = np.array([0.0, 0.25, 1.0])
    expected = Slerp([0.0, 1.0], Rotation.concatenate([start, end]))(fractions)
    blended = Rotation.from_quat(rotations.slerp(start.as_quat(), sign * end.as_quat(), fractions))
    np.testing.assert_allclose(blended.as_matrix(), expected.as_matrix(), atol=1e-12)


def test_facing_rotates_minus_z_forward_and_keeps_up_up():
    """Facing (1, -0.4, 0.3): -Z turns there, Y stays nearly up and X level. Straight up has no such rotation."""
    q = rotations.quaternion_facing((1.0, -0.4, 0.3))
    forward = np.array([1.0, -0.4, 0.3]) / np.linalg.norm([1.0, -0.4, 0.3])
    np.testing.assert_allclose(rotations.rotated_vectors(q, (0.0, 0.0, -1.0)), forward, atol=1e-14)
    assert rotations.rotated_vectors(q, (0.0, 1.0, 0.0))[1] > 0.9
    assert abs(rotations.rotated_vectors(q, (1.0, 0.0, 0.0))[1]) < 1e-14
    with pytest.raises(ValueError, match="vertical"):
        rotations.quaternion_facing((0.0, 1.0, 0.0))
