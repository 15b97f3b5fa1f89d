"""No construction of a ball leaves out a vertex that a face uses, and scaling keeps it that way."""

import gc
import weakref

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from support.shapes import beaker_mesh, box_mesh, shift_mesh

from cdcore import TriangleMesh
from cdcore.bounding.bounding_sphere import (
    SPHERES,
    sphere_best,
    sphere_by_farthest_steps,
    sphere_by_triangle_mean,
    sphere_in_mode,
)
from cdcore.tolerances import EPS

BUILDERS = SPHERES["best"]


def holds(sphere, points):
    """Whether no point lies outside the sphere by more than rounding."""
    reach = np.linalg.norm(points - sphere.centre, axis=1)
    size = np.linalg.norm(sphere.centre) + sphere.radius
    return (reach <= sphere.radius + 4 * EPS * size).all()


def test_bounding_sphere_of_a_box_has_half_its_diagonal():
    """A box of 1 x 2 x 3 has the diagonal root of 14; the method is approximate, within 5 %."""
    ball = sphere_by_farthest_steps(shift_mesh(box_mesh((1, 2, 3)), [5, -2, 1]))
    assert np.allclose(ball.centre, [5, -2, 1], atol=0.1)
    assert ball.radius == pytest.approx(np.sqrt(14) / 2, rel=0.05)


meshes = st.lists(st.tuples(*[st.floats(-1e3, 1e3)] * 3), min_size=3, max_size=12).map(
    lambda points: TriangleMesh(points, np.arange(len(points) // 3 * 3).reshape(-1, 3))
)


@given(meshes)
@settings(max_examples=max(30, settings.default.max_examples))
@example(TriangleMesh(np.ones((3, 3)), [[0, 1, 2]]))
@example(shift_mesh(box_mesh(), [1e6, -1e6, 1e6]))
@example(beaker_mesh())
def test_every_ball_holds_all_used_vertices_and_best_is_smallest(mesh):
    """A vertex that no face uses may lie outside."""
    balls = [build(mesh) for build in BUILDERS]
    assert all(holds(ball, mesh.referenced_vertices) for ball in balls)
    assert sphere_best(mesh).radius == min(ball.radius for ball in balls)


def test_equation_21_is_the_mean_of_all_triangle_corners():
    """Each face counts its three corners; the radius reaches the farthest vertex from that mean."""
    mesh = shift_mesh(beaker_mesh(), [1, 2, 3])
    total = np.zeros(3)
    for a, b, c in mesh.triangles:
        total += a + b + c
    expected = total / (3 * len(mesh.faces))
    sphere = sphere_by_triangle_mean(mesh)
    assert np.abs(sphere.centre - expected).max() < 1e-13
    assert sphere.radius == pytest.approx(np.linalg.norm(mesh.vertices - expected, axis=1).max(), rel=1e-12)


TETRAHEDRON = TriangleMesh(
    [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]
)
TRIANGLE = TriangleMesh([[np.cos(angle), np.sin(angle), 0.0] for angle in np.radians([30, 150, 270])], [[0, 1, 2]])
"""Regular: the smallest balls have the radii of the circles through their corners, root of 3 and 1."""


@pytest.mark.parametrize("build", [sphere_by_farthest_steps, sphere_best])
@pytest.mark.parametrize(("regular", "minimal"), [(TETRAHEDRON, np.sqrt(3)), (TRIANGLE, 1.0)])
def test_tight_balls_are_within_two_percent_of_minimal(regular, minimal, build):
    """``minimal``: radius of the smallest ball round a regular figure, at the origin and 1 km away."""
    for mesh in (regular, shift_mesh(regular, [1000.0, -200.0, 30.0])):
        assert minimal <= build(mesh).radius * (1 + 1e-12) <= 1.02 * minimal


def test_unused_vertices_do_not_inflate_balls():
    """A vertex 1,000 km away that no face uses changes no radius of a box's balls."""
    box = box_mesh()
    stray = TriangleMesh([*box.vertices.tolist(), [1e6, 0, 0]], box.faces)
    for build in BUILDERS:
        assert build(stray).radius == build(box).radius


def test_meshes_near_the_limits_of_float64_keep_their_balls():
    """Edges of 1e-120 to 3e150 m, whose cubes are no doubles: the radius stays positive and finite."""
    box = box_mesh((1, 2, 3))
    small, large = (sphere_best(TriangleMesh(box.vertices * scale, box.faces)) for scale in (1e-120, 1e150))
    assert small.radius > 0
    assert np.isfinite(large.radius)


@pytest.mark.slow
def test_balls_are_cached_without_keeping_meshes_alive(monkeypatch):
    """A second query builds no ball, the best ball is at most as large as the paper's, and nothing keeps the mesh."""
    requested = []
    monkeypatch.setitem(SPHERES, "paper", (lambda mesh: requested.append(1) or sphere_by_triangle_mean(mesh),))
    mesh = box_mesh()
    assert sphere_in_mode(mesh, "paper") is sphere_in_mode(mesh, "paper") and requested == [1]
    assert sphere_in_mode(mesh, "best").radius <= sphere_in_mode(mesh, "paper").radius
    gone = weakref.ref(mesh)
    del mesh
    gc.collect()
    assert gone() is None
