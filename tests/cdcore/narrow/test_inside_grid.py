"""Parity over a grid is never wrong: it agrees with the exact one or says that it is uncertain."""

from __future__ import annotations

import numpy as np
import pytest
from shapes import ball_mesh, beaker_mesh, box_mesh, merged

from cdcore.narrow.inside_grid import INSIDE, MOST_POINTS, OUTSIDE, UNCERTAIN, InsideGrid, triangles_crossed
from cdcore.narrow.ray_parity import point_inside

MESHES = {
    "box": box_mesh(),
    "ball": ball_mesh(0.5, 12, 20),
    "beaker": beaker_mesh(0.5, 1.0, 0.05),
    "shells": merged(ball_mesh(0.5), ball_mesh(0.3), ball_mesh(0.1)),
}


def parity(mesh, points, axis, margin=1e-14):
    points = np.atleast_2d(points)
    return InsideGrid(mesh.triangles).parity(points, np.full(len(points), margin), axis)


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


def test_a_larger_margin_only_makes_answers_uncertain():
    mesh = MESHES["beaker"]
    points = points_around(mesh, 300, 3)
    sharp, blunt = parity(mesh, points, 0, 1e-14), parity(mesh, points, 0, 3e-4)
    assert (blunt[blunt != sharp] == UNCERTAIN).all()
    assert (blunt != sharp).any()
    assert parity(mesh, [0.47, 0.01, 0.5], 0, 1.0).tolist() == [UNCERTAIN]


def test_a_point_beside_the_grid_is_uncertain():
    assert parity(box_mesh(), [[0.1, 9.0, 0.2], [0.1, 0.2, -9.0]], 0).tolist() == [UNCERTAIN, UNCERTAIN]


@pytest.mark.parametrize("margin", [1e-12, 1e-6, 1e-2])
def test_points_moved_by_the_margin_never_contradict_a_certain_crossing(margin):
    rng = np.random.default_rng(4)
    triangles, points = rng.uniform(-1, 1, (2000, 3, 3)), rng.uniform(-1, 1, (2000, 3))
    answers = triangles_crossed(triangles, points, np.full(2000, margin), 0)
    certain = answers != UNCERTAIN
    assert certain.sum() > 1000
    assert set(answers.tolist()) >= {OUTSIDE, INSIDE}
    for _ in range(20):
        shaken = triangles + rng.uniform(-margin, margin, (2000, 3, 3))
        after = triangles_crossed(shaken, points + rng.uniform(-margin, margin, (2000, 3)), np.zeros(2000), 0)
        assert ((after == answers) | (after == UNCERTAIN))[certain].all()


def test_many_points_at_once_give_the_answers_of_few():
    mesh = MESHES["shells"]
    points = points_around(mesh, 2 * MOST_POINTS + 7, 5)
    together = parity(mesh, points, 1)
    assert together.shape == (len(points),)
    for k in (0, MOST_POINTS - 1, MOST_POINTS, 2 * MOST_POINTS + 6):
        assert parity(mesh, points[k], 1)[0] == together[k]
    assert parity(mesh, np.zeros((0, 3)), 0).shape == (0,)
