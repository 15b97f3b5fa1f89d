"""The compiled parity is never wrong: it agrees with the exact one or says that it is uncertain."""

from __future__ import annotations

import numpy as np
import pytest
from shapes import ball_mesh, beaker_mesh, box_mesh, merged, random_rotations

from cdcore.narrow.containment import _Solid
from cdcore.narrow.containment_kernels import (
    INSIDE,
    OUTSIDE,
    UNCERTAIN,
    edge_side,
    point_seen_from,
    points_in_box,
    ray_parity,
    triangle_crossed,
)
from cdcore.narrow.ray_parity import point_inside

MESHES = {
    "box": box_mesh(),
    "ball": ball_mesh(0.5, 12, 20),
    "beaker": beaker_mesh(0.5, 1.0, 0.05),
    "shells": merged(ball_mesh(0.5), ball_mesh(0.3), ball_mesh(0.1)),
}


def parity(mesh, point, axis, margin=1e-14):
    grid = _Solid(mesh).grid
    cells = (grid.low[axis], grid.scale[axis], grid.grow, grid.cells, grid.start[axis], grid.items[axis])
    return ray_parity(point, mesh.triangles, axis, *cells, margin)


@pytest.mark.parametrize("shape", MESHES)
@pytest.mark.parametrize("axis", range(3))
def test_a_certain_answer_is_the_exact_answer(shape, axis):
    mesh = MESHES[shape]
    rng = np.random.default_rng(axis)
    box = _Solid(mesh).box
    points = [*rng.uniform(box[0], box[1], (150, 3)), *mesh.vertices[:20] * 0.999, *np.zeros((1, 3))]
    answers = [parity(mesh, point, axis) for point in points]
    for point, answer in zip(points, answers, strict=True):
        if answer != UNCERTAIN:
            assert (answer == INSIDE) == point_inside(point, mesh.triangles)
    assert answers[:150].count(UNCERTAIN) <= 2


def test_a_ray_along_an_edge_or_through_a_vertex_is_uncertain():
    assert parity(box_mesh(), np.zeros(3), 0) == UNCERTAIN
    ball = MESHES["ball"]
    assert parity(ball, np.array([0.0, 0, 0.1]), 2) == UNCERTAIN


def test_a_larger_margin_only_makes_answers_uncertain():
    rng = np.random.default_rng(3)
    mesh = MESHES["beaker"]
    box = _Solid(mesh).box
    lost = 0
    for point in rng.uniform(box[0], box[1], (100, 3)):
        sharp, blunt = parity(mesh, point, 0, 1e-14), parity(mesh, point, 0, 3e-4)
        assert blunt in (sharp, UNCERTAIN)
        lost += blunt != sharp
    assert lost > 0
    assert parity(mesh, np.array([0.47, 0.01, 0.5]), 0, 1.0) == UNCERTAIN


@pytest.mark.parametrize("margin", [1e-12, 1e-6, 1e-2])
def test_points_moved_by_the_margin_never_contradict_a_certain_crossing(margin):
    rng = np.random.default_rng(4)
    certain = 0
    for _ in range(400):
        triangle, point = rng.uniform(-1, 1, (3, 3)), rng.uniform(-1, 1, 3)
        answer = triangle_crossed(triangle, point, 1, 2, 0, margin)
        if answer == UNCERTAIN:
            continue
        certain += 1
        for _ in range(10):
            shaken = triangle + rng.uniform(-margin, margin, (3, 3))
            assert triangle_crossed(shaken, point + rng.uniform(-margin, margin, 3), 1, 2, 0, 0.0) in (
                answer,
                UNCERTAIN,
            )
    assert certain > 200


def test_the_side_of_an_edge_is_its_orientation_or_open():
    a, b = np.array([0.0, 0, 0]), np.array([0.0, 1, 0])
    assert edge_side(a, b, np.array([0, 0.5, 0.1]), 1, 2, 1e-9) == 1
    assert edge_side(a, b, np.array([0, 0.5, -0.1]), 1, 2, 1e-9) == -1
    assert edge_side(a, b, np.array([0, 0.5, 1e-10]), 1, 2, 1e-9) == 0


def test_a_point_is_seen_from_the_other_body():
    rng = np.random.default_rng(5)
    (ra, rb), (ta, tb), point = random_rotations(rng, 2), rng.normal(size=(2, 3)), rng.normal(size=3)
    seen = np.empty(3)
    point_seen_from(point, ra, ta, rb, tb, seen)
    assert np.allclose(seen, rb.T @ (ra @ point + ta - tb), atol=1e-14)


def test_one_point_outside_the_box_is_enough():
    still = (np.eye(3), np.zeros(3))
    box = np.array([[-1.0, -1, -1], [1, 1, 1]])
    assert points_in_box(np.array([[1.0, 1, 1], [-1, 0, 0]]), *still, *still, box, 0.0)
    assert not points_in_box(np.array([[0.0, 0, 0], [-1.1, 0, 0]]), *still, *still, box, 0.0)
    assert OUTSIDE == 0
    assert INSIDE == 1
