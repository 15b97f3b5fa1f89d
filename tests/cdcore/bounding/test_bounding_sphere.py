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
"""All constructions of a ball about a mesh; ``sphere_best`` takes the smallest of their results."""


def holds(sphere, points):
    """Whether no point lies outside the sphere by more than rounding."""
    reach = np.linalg.norm(points - sphere.centre, axis=1)
    size = np.linalg.norm(sphere.centre) + sphere.radius
    return (reach <= sphere.radius + 4 * EPS * size).all()


def test_bounding_sphere_of_a_box_has_half_its_diagonal():
    """A box of 1 x 2 x 3 m has the diagonal root of 14; the method is approximate, here within 5 %."""
    middle = [5, -2, 1]
    sphere = sphere_by_farthest_steps(box_mesh((1, 2, 3), middle))
    assert np.allclose(sphere.centre, middle, atol=0.1)
    assert sphere.radius == pytest.approx(np.sqrt(1 + 4 + 9) / 2, rel=0.05)


meshes = st.lists(st.tuples(*[st.floats(-1e3, 1e3)] * 3), min_size=3, max_size=12).map(
    lambda points: TriangleMesh(points, np.arange(len(points) // 3 * 3).reshape(-1, 3))
)


@given(meshes)
@settings(max_examples=max(30, settings.default.max_examples))
@example(TriangleMesh(np.ones((3, 3)), [[0, 1, 2]]))
@example(shift_mesh(box_mesh(), [1e6, -1e6, 1e6]))
@example(beaker_mesh())
def test_every_ball_holds_all_used_vertices_and_best_is_smallest(mesh):
    """Meshes are random triangles, three equal points, a box 1,700 km from its origin, and a beaker.

    Each construction (BUILDERS) gives a ball that holds all vertices used; ``sphere_best`` takes the smallest of them.
    """
    balls = [build(mesh) for build in BUILDERS]
    assert all(holds(ball, mesh.referenced_vertices) for ball in balls)
    assert sphere_best(mesh).radius == min(ball.radius for ball in balls)


def test_equation_21_is_the_mean_of_all_triangle_corners():
    """Each face counts its three corners, here in a loop; the radius reaches the farthest vertex from that mean."""
    mesh = shift_mesh(beaker_mesh(), [1, 2, 3])
    total = np.zeros(3)
    for a, b, c in mesh.triangles:
        total += a + b + c
    centre = total / (3 * len(mesh.faces))
    radius = np.linalg.norm(mesh.vertices - centre, axis=1).max()
    sphere = sphere_by_triangle_mean(mesh)
    assert np.abs(sphere.centre - centre).max() < 1e-13
    assert sphere.radius == pytest.approx(radius, rel=1e-12, abs=0)


TETRAHEDRON = TriangleMesh(
    [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]
)
TRIANGLE = TriangleMesh([[np.cos(angle), np.sin(angle), 0.0] for angle in np.radians([30, 150, 270])], [[0, 1, 2]])


@pytest.mark.parametrize("build", [sphere_by_farthest_steps, sphere_best])
@pytest.mark.parametrize(
    ("regular", "minimal"),
    [pytest.param(TETRAHEDRON, np.sqrt(3), id="tetrahedron"), pytest.param(TRIANGLE, 1.0, id="triangle")],
)
@pytest.mark.parametrize("offset", [[0.0, 0.0, 0.0], [1000.0, -200.0, 30.0]], ids=["origin", "1 km away"])
def test_tight_balls_are_within_two_percent_of_minimal(regular, minimal, offset, build):
    """The smallest ball round a regular figure goes through its corners: a tetrahedron of (+-1, +-1, +-1) has the
    radius root of 3, a triangle with its corners on the unit circle 1.
    """
    rounding = 1e-12
    radius = build(shift_mesh(regular, offset)).radius
    assert minimal * (1 - rounding) <= radius <= 1.02 * minimal


def test_unused_vertices_do_not_inflate_balls():
    """A vertex 1,000 km away that no face uses: every ball about the box has the radius that it has without that
    vertex.
    """
    box = box_mesh()
    stray = TriangleMesh([*box.vertices.tolist(), [1e6, 0, 0]], box.faces)
    for build in BUILDERS:
        assert build(stray).radius == build(box).radius


def test_meshes_near_the_limits_of_float64_keep_their_balls():
    """A box of 1 x 2 x 3 m in 1e-120 and in 1e150 of its size: cubes of such lengths are no doubles.

    Still the radius is positive and finite, about half the diagonal, root of 14 / 2 = 1.87 times that scale.
    """
    box = box_mesh((1, 2, 3))
    small = sphere_best(TriangleMesh(box.vertices * 1e-120, box.faces))
    large = sphere_best(TriangleMesh(box.vertices * 1e150, box.faces))
    assert 0 < small.radius < 1e-119
    assert 1e150 < large.radius < np.inf


def unshared_box():
    """A box that no other test has asked about."""
    return TriangleMesh(box_mesh().vertices, box_mesh().faces)


def test_balls_are_cached_for_a_mesh(monkeypatch):
    """Mode "paper" has one construction, equation (21): of two queries only the first calls it."""
    built_for = []

    def build(mesh):
        built_for.append(mesh)
        return sphere_by_triangle_mean(mesh)

    monkeypatch.setitem(SPHERES, "paper", (build,))
    mesh = unshared_box()
    assert sphere_in_mode(mesh, "paper") is sphere_in_mode(mesh, "paper")
    assert len(built_for) == 1


@pytest.mark.slow
def test_cached_balls_do_not_keep_their_mesh_alive():
    """Once nobody else has the mesh, a weak reference to it is dead."""
    mesh = unshared_box()
    sphere_in_mode(mesh, "best")
    mesh_if_alive = weakref.ref(mesh)
    del mesh
    gc.collect()
    assert mesh_if_alive() is None
