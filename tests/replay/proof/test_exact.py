import numpy as np
import pytest
from support.motions import degenerate, lattice
from support.small_worlds import cube

from cdcore import triangles_intersect
from cdcore.narrow.containment.ray_parity import point_inside
from cdcore.numerics import place_points
from replay.proof.exact import inside, meeting, placed, triangles_meet


def pairs_of(kind, rng):
    if kind == "any":
        return rng.random((2000, 2, 3, 3))
    if kind == "lattice":
        return lattice(rng, 600).reshape(-1, 2, 3, 3)
    if kind == "flat":
        return np.concatenate([rng.integers(-9, 9, (300, 2, 3, 2)), np.zeros((300, 2, 3, 1))], axis=3)
    if kind == "points and segments":
        return np.concatenate([degenerate(rng) for _ in range(20)]).reshape(-1, 2, 3, 3)
    if kind == "tiny":
        return (rng.random((300, 2, 3, 3)) - 0.5) * 2.0**-500
    return (rng.random((300, 2, 3, 3)) - 0.5) * 2.0**400


@pytest.mark.parametrize("kind", ["any", "lattice", "flat", "points and segments", "tiny", "huge"])
def test_two_triangles_meet_where_the_core_says_so(kind):
    pairs = np.ascontiguousarray(pairs_of(kind, np.random.default_rng(7)))
    assert np.array_equal(meeting(pairs[:, 0], pairs[:, 1])[0], triangles_intersect(pairs))


@pytest.mark.parametrize("kind", ["any", "lattice", "points and segments"])
def test_integers_alone_agree_with_the_filter(kind):
    pairs = pairs_of(kind, np.random.default_rng(8))[:200]
    answer, _ = meeting(pairs[:, 0], pairs[:, 1])
    assert [triangles_meet(a, b) for a, b in pairs] == answer.tolist()


def test_points_are_inside_where_the_core_says_so_corners_and_edges_in_the_way_included():
    mesh = cube(2.0)
    surface = np.asarray(mesh.vertices)[np.asarray(mesh.faces)]
    grid = np.stack(np.meshgrid(*[[-1.5, -0.5, 0.0, 0.25, 0.5, 1.5]] * 3), axis=-1).reshape(-1, 3)
    assert [inside(point, surface) for point in grid] == [point_inside(point, surface) for point in grid]
    assert sum(inside(point, surface) for point in grid) == 4**3


def test_points_are_placed_to_the_bit_as_the_reference_vertices():
    rng = np.random.default_rng(0)
    points, turn, place = rng.normal(size=(50, 3)), rng.normal(size=(3, 3)), rng.normal(size=3)
    assert np.array_equal(placed(points, turn, place), place_points(points, turn, place))
