"""Exact parity is right on vertices, edges and axes, where a careless ray counts a crossing twice or not at all."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.shapes import ball_mesh, beaker_mesh, box_mesh, merge_meshes, random_rotations

from cdcore.containment.ray_parity import (
    INSIDE,
    OUTSIDE,
    UNCERTAIN,
    build_inside_grid,
    edge_side,
    plane_side,
    point_inside,
    states_of_points,
    triangle_crossed,
)
from cdcore.poses import place_points

BOX = box_mesh((2, 2, 2))
grid = st.integers(-6, 6).map(lambda k: k / 4)


@given(st.tuples(grid, grid, grid))
def test_parity_holds_on_rays_through_corners_and_edges(point):
    """Points of a grid of 0.25 m in and around a box of side 2; those on its surface, at distance 1, are left out."""
    distance = max(abs(value) for value in point)
    if distance == 1:
        return
    assert point_inside(np.array(point), BOX.triangles) == (distance < 1)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=50)
def test_inside_a_convex_mesh_means_behind_all_its_faces(seed):
    """Points within 1e-9 of a face's plane are left out."""
    rng = np.random.default_rng(seed)
    ball = ball_mesh(1.0, rings=4, sides=6)
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
    "ball": ball_mesh(0.5, rings=12, sides=20),
    "beaker": beaker_mesh(radius=0.5, height=1.0, wall=0.05),
    "shells": merge_meshes(ball_mesh(0.5), ball_mesh(0.3), ball_mesh(0.1)),
}


@pytest.mark.sampled(3)
@pytest.mark.parametrize("shape", MESHES)
def test_certain_inside_answers_agree_with_exact_ray_parity(shape):
    """At most 2 of 300 points stay uncertain; with a margin of 1 m, more than cells overlap, the middle does."""
    mesh, inside_grid = MESHES[shape], build_inside_grid(MESHES[shape].triangles)
    lower, upper = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    anywhere = np.random.default_rng(0).uniform(lower, upper, (300, 3))
    points = np.concatenate([anywhere, mesh.vertices[:20] * 0.999, np.zeros((1, 3))])
    answers = states_of_points(inside_grid, points, 1e-14)
    for point, answer in zip(points, answers.tolist(), strict=True):
        if answer != UNCERTAIN:
            assert (answer == INSIDE) == point_inside(point, mesh.triangles)
    assert (answers[:300] == UNCERTAIN).sum() <= 2
    assert states_of_points(inside_grid, np.zeros((1, 3)), 1.0) == [UNCERTAIN], (
        "a margin larger than the cells' overlap"
    )


def test_a_ray_through_an_edge_is_uncertain():
    """From the middle of a box the ray along +x meets the diagonal that two triangles of its face share."""
    middle, margin = np.zeros(3), 1e-14
    assert states_of_points(build_inside_grid(box_mesh().triangles), middle[None], margin) == [UNCERTAIN]


@pytest.mark.slow
@pytest.mark.parametrize("margin", [1e-12, 1e-6, 1e-2])
def test_points_moved_by_the_margin_never_contradict_a_certain_crossing(margin):
    """Whether a point's ray crosses a triangle, within a margin, and again after coordinates moved by it."""
    rng = np.random.default_rng(4)
    triangles, points = rng.uniform(-1, 1, (2000, 3, 3)), rng.uniform(-1, 1, (2000, 3))

    def crossed(corners, origins, margin):
        return np.array([triangle_crossed(*pair, margin) for pair in zip(corners, origins, strict=True)])

    answers = crossed(triangles, points, margin)
    certain = answers != UNCERTAIN
    assert certain.sum() > 1000
    assert set(answers.tolist()) >= {OUTSIDE, INSIDE}
    for _ in range(20):
        shaken = triangles + rng.uniform(-margin, margin, (2000, 3, 3))
        after = crossed(shaken, points + rng.uniform(-margin, margin, (2000, 3)), 0.0)
        assert ((after == answers) | (after == UNCERTAIN))[certain].all()


def shaken(rng, corners, point, margin):
    """Copies of a triangle (n, 3, 3) and a point (n, 3), each coordinate off by the margin up or down."""
    signs = rng.choice([-margin, margin], size=(300, 4, 3))
    return corners + signs[:, :3], point + signs[:, 3]


def edge_products(corners, points):
    """Cross products in y and z of the edge from corner 0 to 1 and of the way from corner 0 to a point, (n,)."""
    edge, offset = (corners[:, 1] - corners[:, 0])[:, 1:], (points - corners[:, 0])[:, 1:]
    return edge[:, 0] * offset[:, 1] - edge[:, 1] * offset[:, 0]


def volumes(corners, points):
    """Determinants of both edges at corner 0 and the way from there to a point, (n,)."""
    return np.linalg.det(np.stack([corners[:, 1], corners[:, 2], points], axis=1) - corners[:, :1])


@pytest.mark.parametrize(
    ("side_of", "products"),
    [
        (lambda corners, point, margin: edge_side(corners, 0, 1, point, margin), edge_products),
        (plane_side, volumes),
    ],
    ids=["edge", "plane"],
)
def test_certain_side_survives_every_error_within_the_margin(side_of, products):
    """A side is left open only where errors matter: the bound is below 60 times the largest of 300."""
    rng, certain, unsure = np.random.default_rng(6), 0, 0
    for _ in range(300):
        corners = rng.normal(size=(3, 3)) * rng.choice([0.1, 1.0, 10.0], size=3)
        point = rng.normal(size=3) * rng.choice([0.1, 1.0, 10.0], size=3)
        product, margin = products(corners[None], point[None])[0], 10.0 ** rng.uniform(-4, -0.5)
        errors = np.abs(products(*shaken(rng, corners, point, margin)) - product)
        side = side_of(corners, point, margin)
        if side == 0:
            unsure += 1
            assert abs(product) < 60.0 * errors.max()
        else:
            certain += 1
            assert side == np.sign(product)
            assert errors.max() < abs(product)
    assert certain > 50
    assert unsure > 20
