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
"""Its sides are 1 m from the origin."""
quarter_metres = st.integers(-6, 6).map(lambda k: k / 4)


@given(st.tuples(quarter_metres, quarter_metres, quarter_metres))
def test_parity_holds_on_rays_through_corners_and_edges(point):
    """Points of a grid of 0.25 m in and around a box whose sides are 1 m from its middle; points on a side are left
    out.
    """
    distance = max(abs(value) for value in point)
    if distance == 1:
        return
    assert point_inside(np.array(point), BOX.triangles) == (distance < 1)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=50)
def test_inside_a_convex_mesh_means_behind_all_its_faces(seed):
    """A ball of 48 faces at a random pose: a point is inside where it is on the centre's side of each face's plane.

    Points within 1e-9 of a plane are left out.
    """
    rng = np.random.default_rng(seed)
    ball = ball_mesh(1.0, rings=4, sides=6)
    vertices = place_points(ball.vertices, random_rotations(rng), rng.normal(size=3))
    triangles, centre = vertices[ball.faces], vertices.mean(axis=0)
    point = centre + rng.normal(size=3) * 0.5
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    side_of_point = np.einsum("fk,fk->f", normals, point - triangles[:, 0])
    side_of_centre = np.einsum("fk,fk->f", normals, centre - triangles[:, 0])
    if np.abs(side_of_point).min() > 1e-9:
        assert point_inside(point, triangles) == bool((side_of_point * side_of_centre > 0).all())


ROUNDING_MARGIN = 1e-14
"""Metres by which coordinates may be off."""
MESHES = {
    "box": box_mesh(),
    "ball": ball_mesh(0.5, rings=12, sides=20),
    "beaker": beaker_mesh(radius=0.5, height=1.0, wall=0.05),
    "shells": merge_meshes(ball_mesh(0.5), ball_mesh(0.3), ball_mesh(0.1)),
}


@pytest.mark.sampled(3)
@pytest.mark.parametrize("shape", MESHES)
def test_certain_inside_answers_agree_with_exact_ray_parity(shape):
    """A grid of cells casts rays in floats, with a margin; where it is certain its answer is that of exact rays.

    Points are 300 in the bounds of a mesh, of which at most 2 stay uncertain, some near its vertices, and its middle.
    """
    mesh = MESHES[shape]
    anywhere = np.random.default_rng(0).uniform(*mesh.bounds, (300, 3))
    points = np.concatenate([anywhere, mesh.vertices[:20] * 0.999, np.zeros((1, 3))])
    answers = states_of_points(build_inside_grid(mesh.triangles), points, ROUNDING_MARGIN)
    for point, answer in zip(points, answers.tolist(), strict=True):
        if answer != UNCERTAIN:
            assert (answer == INSIDE) == point_inside(point, mesh.triangles)
    assert (answers[: len(anywhere)] == UNCERTAIN).sum() <= 2


@pytest.mark.parametrize("shape", MESHES)
def test_every_answer_is_uncertain_beyond_the_overlap_of_cells(shape):
    """A grid of cells casts a ray through the faces of one cell alone; cells overlap, by less than 1 m.

    With errors of coordinates of up to 1 m (``margin``) faces of other cells may matter.
    """
    mesh, margin = MESHES[shape], 1.0
    points = np.random.default_rng(0).uniform(*mesh.bounds, (30, 3))
    assert (states_of_points(build_inside_grid(mesh.triangles), points, margin) == UNCERTAIN).all()


def test_a_ray_through_an_edge_is_uncertain():
    """From the middle of a box the ray along +x meets the diagonal that two triangles of its face share."""
    middle = np.zeros((1, 3))
    assert states_of_points(build_inside_grid(box_mesh().triangles), middle, ROUNDING_MARGIN) == [UNCERTAIN]


@pytest.mark.slow
@pytest.mark.parametrize("margin", [1e-12, 1e-6, 1e-2])
def test_points_moved_by_the_margin_never_contradict_a_certain_crossing(margin):
    """Whether the rays of 2,000 random points cross a triangle each: certain answers hold although coordinates are off.

    20 times all coordinates are moved by up to the margin; without a margin the answer is then the same, or uncertain.
    """
    rng = np.random.default_rng(4)
    triangles, points = rng.uniform(-1, 1, (2000, 3, 3)), rng.uniform(-1, 1, (2000, 3))

    def crossed(corners, origins, margin):
        return np.array([triangle_crossed(*pair, margin) for pair in zip(corners, origins, strict=True)])

    answers = crossed(triangles, points, margin)
    certain = answers != UNCERTAIN
    assert certain.sum() > 1000
    assert set(answers.tolist()) >= {OUTSIDE, INSIDE}, "not crossed, and crossed"
    for _ in range(20):
        moved_triangles = triangles + rng.uniform(-margin, margin, triangles.shape)
        moved_points = points + rng.uniform(-margin, margin, points.shape)
        after = crossed(moved_triangles, moved_points, 0.0)
        assert ((after == answers) | (after == UNCERTAIN))[certain].all()


def copies_off_by(rng, corners, point, margin):
    """300 copies of a triangle (n, 3, 3) and a point (n, 3), each coordinate off by the margin, up or down."""
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
        pytest.param(
            lambda corners, point, margin: edge_side(corners, 0, 1, point, margin), edge_products, id="side of an edge"
        ),
        pytest.param(plane_side, volumes, id="side of a plane"),
    ],
)
def test_certain_side_survives_every_error_within_the_margin(side_of, products):
    """The side of a random point is the sign of a product of its coordinates, which are off by up to the margin.

    1 and -1 are certain: the product keeps its sign in 300 copies with errors. 0 is not, and only where errors matter:
    where the largest of those 300 changes the product by more than a 60th of itself.
    """
    rng, certain, uncertain = np.random.default_rng(6), 0, 0
    for _ in range(300):
        corners = rng.normal(size=(3, 3)) * rng.choice([0.1, 1.0, 10.0], size=3)
        point = rng.normal(size=3) * rng.choice([0.1, 1.0, 10.0], size=3)
        (product,) = products(corners[None], point[None])
        margin = 10.0 ** rng.uniform(-4, -0.5)
        largest_error = np.abs(products(*copies_off_by(rng, corners, point, margin)) - product).max()
        side = side_of(corners, point, margin)
        if side == 0:
            uncertain += 1
            assert abs(product) < 60.0 * largest_error
        else:
            certain += 1
            assert side == np.sign(product)
            assert largest_error < abs(product)
    assert certain > 50
    assert uncertain > 20
