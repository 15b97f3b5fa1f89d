"""Exact parity is right on vertices, edges and axes, where a careless ray counts a crossing twice or not at all."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.shapes import ball_mesh, beaker_mesh, box_mesh, merged, random_rotations

from cdcore.narrow.containment.ray_parity import (
    INSIDE,
    OUTSIDE,
    UNCERTAIN,
    build_inside_grid,
    point_inside,
    point_state,
    triangle_crossed,
)
from cdcore.numerics import place_points

BOX = box_mesh((2, 2, 2))
grid = st.integers(-6, 6).map(lambda k: k / 4)


@given(st.tuples(grid, grid, grid))
def test_a_box_knows_its_inside_even_on_lines_through_its_corners_and_edges(point):
    distance = max(abs(value) for value in point)
    if distance == 1:
        return
    assert point_inside(np.array(point), BOX.triangles) == (distance < 1)


@pytest.mark.parametrize("seed", range(6))
def test_a_lattice_of_cubes_through_all_permutations_and_signs_agrees(seed):
    rng = np.random.default_rng(seed)
    ball = ball_mesh(1.0, 6, 8)
    order, sign = rng.permutation(3), rng.choice([-1.0, 1.0], 3)
    turned = (ball.vertices * sign)[:, order]
    points = np.concatenate([rng.uniform(-1, 1, (40, 3)), ball.vertices * 0.5, ball.vertices * 1.5])
    for point in points:
        expected = point_inside(point, ball.triangles)
        assert point_inside((point * sign)[order], turned[ball.faces]) == expected


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=50)
def test_inside_a_convex_mesh_means_behind_all_its_faces(seed):
    rng = np.random.default_rng(seed)
    ball = ball_mesh(1.0, 4, 6)
    vertices = place_points(ball.vertices, random_rotations(rng), rng.normal(size=3))
    triangles, centre = vertices[ball.faces], vertices.mean(axis=0)
    point = centre + rng.normal(size=3) * 0.5
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    side = np.einsum("fk,fk->f", normal, point - triangles[:, 0])
    middle = np.einsum("fk,fk->f", normal, centre - triangles[:, 0])
    if np.abs(side).min() > 1e-9:
        assert point_inside(point, triangles) == bool((side * middle > 0).all())


MESHES = {
    "box": box_mesh(),
    "ball": ball_mesh(0.5, 12, 20),
    "beaker": beaker_mesh(0.5, 1.0, 0.05),
    "shells": merged(ball_mesh(0.5), ball_mesh(0.3), ball_mesh(0.1)),
}


def parity(mesh, points, axis, margin=1e-14):
    inside_grid = build_inside_grid(mesh.triangles)
    return np.array([point_state(inside_grid, point, margin, axis) for point in np.atleast_2d(points).astype(float)])


def crossed(triangles, points, margin):
    return np.array([triangle_crossed(*pair, margin, 0) for pair in zip(triangles, points, strict=True)])


def points_around(mesh, count, seed):
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    return np.random.default_rng(seed).uniform(low, high, (count, 3))


@pytest.mark.parametrize("shape", MESHES)
@pytest.mark.parametrize("axis", range(3))
def test_a_certain_answer_is_the_exact_answer(shape, axis):
    mesh = MESHES[shape]
    points = np.concatenate([points_around(mesh, 150, axis), mesh.vertices[:20] * 0.999, np.zeros((1, 3))])
    answers = parity(mesh, points, axis)
    for point, answer in zip(points, answers.tolist(), strict=True):
        if answer != UNCERTAIN:
            assert (answer == INSIDE) == point_inside(point, mesh.triangles)
    assert (answers[:150] == UNCERTAIN).sum() <= 2


def test_a_ray_along_an_edge_or_through_a_vertex_is_uncertain():
    assert parity(box_mesh(), np.zeros(3), 0).tolist() == [UNCERTAIN]
    assert parity(MESHES["ball"], [0.0, 0, 0.1], 2).tolist() == [UNCERTAIN]


@pytest.mark.parametrize("margin", [1e-12, 1e-6, 1e-2])
def test_points_moved_by_the_margin_never_contradict_a_certain_crossing(margin):
    rng = np.random.default_rng(4)
    triangles, points = rng.uniform(-1, 1, (2000, 3, 3)), rng.uniform(-1, 1, (2000, 3))
    answers = crossed(triangles, points, margin)
    certain = answers != UNCERTAIN
    assert certain.sum() > 1000
    assert set(answers.tolist()) >= {OUTSIDE, INSIDE}
    for _ in range(20):
        shaken = triangles + rng.uniform(-margin, margin, (2000, 3, 3))
        after = crossed(shaken, points + rng.uniform(-margin, margin, (2000, 3)), 0.0)
        assert ((after == answers) | (after == UNCERTAIN))[certain].all()
