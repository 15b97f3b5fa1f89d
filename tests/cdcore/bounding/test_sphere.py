"""No construction of a ball leaves out a vertex that a face uses, and scaling keeps it that way."""

import gc
import weakref

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.shapes import ball_mesh, beaker_mesh, box_mesh, moved, revolved_mesh, rod_mesh

from cdcore import TriangleMesh
from cdcore.bounding.sphere import (
    SPHERES,
    sphere_about,
    sphere_best,
    sphere_by_box_centre,
    sphere_by_farthest_steps,
    sphere_by_ritter,
    sphere_by_triangle_mean,
    sphere_in_mode,
)  # fmt: skip
from cdcore.numerics import EPS

BUILDERS = SPHERES["best"]
SHAPES = {
    "box": box_mesh((1, 2, 3)), "ball": ball_mesh(), "beaker": beaker_mesh(), "rod": rod_mesh(),
    "cone": revolved_mesh([(0, 0), (1, 0), (0, 2)]), "point": TriangleMesh(np.ones((3, 3)), [[0, 1, 2]]),
    "far": moved(box_mesh(), [1e6, -1e6, 1e6]),
}  # fmt: skip


def holds(sphere, points):
    reach = np.linalg.norm(points - sphere.centre, axis=1)
    size = np.linalg.norm(sphere.centre) + sphere.radius
    return (reach <= sphere.radius + 4 * EPS * size).all()


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("build", BUILDERS)
def test_every_used_vertex_lies_in_the_ball(build, shape):
    assert holds(build(SHAPES[shape]), SHAPES[shape].referenced_vertices)


meshes = st.lists(st.tuples(*[st.floats(-1e3, 1e3)] * 3), min_size=3, max_size=12).map(
    lambda points: TriangleMesh(points, np.arange(len(points) // 3 * 3).reshape(-1, 3))
)


@given(meshes)
@settings(max_examples=100)
def test_every_used_vertex_of_any_mesh_lies_in_every_ball_and_best_is_the_smallest(mesh):
    balls = [build(mesh) for build in BUILDERS]
    assert all(holds(ball, mesh.referenced_vertices) for ball in balls)
    assert sphere_best(mesh).radius == min(ball.radius for ball in balls)


def test_equation_21_is_the_mean_of_all_triangle_corners():
    mesh = beaker_mesh()
    total = np.zeros(3)
    for a, b, c in mesh.triangles:
        total += a + b + c
    expected = total / (3 * len(mesh.faces))
    sphere = sphere_by_triangle_mean(mesh)
    assert np.abs(sphere.centre - expected).max() < 1e-15
    assert sphere.radius == pytest.approx(np.linalg.norm(mesh.vertices - expected, axis=1).max(), rel=1e-12)


def test_equation_21_depends_on_the_tessellation_and_the_box_centre_does_not():
    box = box_mesh()
    split = [[0, 1, 8], [1, 3, 8], [3, 2, 8], [2, 0, 8]]
    fine = TriangleMesh([*box.vertices.tolist(), [-0.5, 0, 0]], [*box.faces[2:].tolist(), *split])
    assert np.linalg.norm(sphere_by_triangle_mean(fine).centre - sphere_by_triangle_mean(box).centre) > 0.01
    assert np.array_equal(sphere_by_box_centre(fine).centre, sphere_by_box_centre(box).centre)


@pytest.mark.parametrize("shape", ["box", "ball", "beaker", "rod", "cone"])
def test_equation_21_is_at_most_twice_the_smallest_ball(shape):
    assert sphere_by_triangle_mean(SHAPES[shape]).radius <= 2 * sphere_best(SHAPES[shape]).radius * (1 + 1e-12)


def test_a_fine_bulb_with_a_long_neck_is_where_the_best_ball_pays():
    bulb = [(np.sin(a), -np.cos(a)) for a in np.linspace(0, 2.8, 40)]
    flask = revolved_mesh([(0.0, -1.0), *bulb[1:], (0.3, 8.0), (0.0, 8.0)], 40)
    assert sphere_by_triangle_mean(flask).radius > 1.5 * sphere_best(flask).radius


@pytest.mark.parametrize("build", [sphere_by_farthest_steps, sphere_best])
def test_the_tight_balls_come_within_two_per_cent_of_the_smallest_of_a_tetrahedron(build):
    corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], dtype=float)
    mesh = TriangleMesh(corners, [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]])
    assert np.sqrt(3) <= build(mesh).radius * (1 + 1e-12) <= 1.02 * np.sqrt(3)


def test_ritter_is_within_a_fifth_of_the_smallest_on_a_cone():
    cone = SHAPES["cone"]
    assert 1.25 * (1 - 1e-12) <= sphere_by_ritter(cone).radius <= 1.2 * 1.25


def test_a_far_vertex_that_no_face_uses_does_not_inflate_any_ball():
    box = box_mesh()
    stray = TriangleMesh([*box.vertices.tolist(), [1e6, 0, 0]], box.faces)
    for build in BUILDERS:
        assert build(stray).radius == build(box).radius


def test_a_mesh_near_the_limits_of_float64_neither_overflows_nor_vanishes():
    small, large = TriangleMesh(SHAPES["box"].vertices * 1e-120, box_mesh().faces), 1e150 * SHAPES["box"].vertices
    assert sphere_best(small).radius > 0
    assert np.isfinite(sphere_best(TriangleMesh(large, box_mesh().faces)).radius)


def test_modes_are_those_of_the_table():
    assert sphere_in_mode(SHAPES["cone"], "paper").radius == sphere_by_triangle_mean(SHAPES["cone"]).radius
    assert sphere_in_mode(SHAPES["cone"], "best").radius == sphere_best(SHAPES["cone"]).radius


def test_a_ball_cannot_be_changed():
    with pytest.raises(ValueError, match="read-only"):
        sphere_about(box_mesh(), [0, 0, 0]).centre[0] = 1


def test_a_ball_is_found_once_and_keeps_no_mesh_that_nobody_uses(monkeypatch):
    asked = []
    monkeypatch.setitem(SPHERES, "paper", (lambda mesh: asked.append(1) or sphere_by_triangle_mean(mesh),))
    mesh = box_mesh()
    assert sphere_in_mode(mesh, "paper") is sphere_in_mode(mesh, "paper") and asked == [1]
    assert sphere_in_mode(mesh, "best").radius <= sphere_in_mode(mesh, "paper").radius
    gone = weakref.ref(mesh)
    del mesh
    gc.collect()
    assert gone() is None
