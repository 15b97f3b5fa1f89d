"""The winding number is that of closed forms, of parity on sound meshes, and of the slow sum of solid angles."""

import numpy as np
import pytest
from support.shapes import ball_mesh, beaker_mesh, box_mesh, merge_meshes, shift_mesh

from cdcore import TriangleMesh
from cdcore.containment.ray_parity import UNCERTAIN, build_inside_grid, point_state
from cdcore.containment.winding_number import (
    RAY_UNCERTAIN,
    ray_crossings,
    winding_number,
    winding_number_at,
)
from cdcore.containment.winding_surface import winding_surface

MARGIN = 1e-14


def test_winding_of_a_box_and_of_its_sides():
    """1 inside a box of 2 m, 0 beside it."""
    box, points = box_mesh((2, 2, 2)), np.array([[0, 0, 0], [0.3, -0.9, 0.5], [3, 0, 0], [0, 0, -1.5]])
    assert winding_number(points, box.triangles) == pytest.approx([1, 1, 0, 0], abs=1e-12)
    # From the middle of a cube each side takes a sixth of the sphere.
    normals = np.cross(box.triangles[:, 1] - box.triangles[:, 0], box.triangles[:, 2] - box.triangles[:, 0])
    for axis in range(3):
        side = box.triangles[normals[:, axis] > 0]
        assert winding_number(np.zeros((1, 3)), side) == pytest.approx([1 / 6], abs=1e-12)


def test_disk_has_the_solid_angle_of_a_cone():
    """From this height over its middle a disk of radius 1 fills (1 - cos) / 2 of all directions.

    The number is negative before the faces, which look up, and positive behind them.
    """
    angle = np.linspace(0, 2 * np.pi, 2001)
    ring = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    disk = np.stack([np.zeros((2000, 3)), ring[:-1], ring[1:]], axis=1)
    for height in (0.1, 0.5, 1.0, 3.0):
        cone = (1 - height / np.hypot(height, 1)) / 2
        for sign in (-1, 1):
            value = winding_number(np.array([[0, 0, sign * height]]), disk)
            assert value == pytest.approx([-sign * cone], abs=1e-5)


def reversed_faces(mesh):
    """The mesh inside out."""
    return TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])


@pytest.mark.parametrize(
    "mesh",
    [
        TriangleMesh(ball_mesh(0.5).vertices, ball_mesh(0.5).faces[5:]),
        TriangleMesh(
            beaker_mesh(radius=0.5, height=1.0, wall=0.05).vertices,
            beaker_mesh(radius=0.5, height=1.0, wall=0.05).faces[::2],
        ),
        merge_meshes(box_mesh(), shift_mesh(box_mesh(), [0.5, 0.3, 0.2])),
        merge_meshes(box_mesh((2, 2, 2)), reversed_faces(ball_mesh(0.5))),
    ],
    ids=["holes", "every other face", "crossing", "hollow"],
)
def test_crossings_less_the_caps_are_the_sum_of_solid_angles(mesh):
    """Crossings of a ray count the surface and the caps that close its holes; without the caps it is the surface alone.

    Of 60 points those whose ray meets an edge, fewer than a quarter, are left out.
    """
    surface = winding_surface(mesh)
    faces = surface.grid.triangles[: len(surface.component) - len(surface.caps)]
    points = np.random.default_rng(0).uniform(*mesh.bounds, (60, 3))
    expected = winding_number(points, faces)
    crossings, compared = np.zeros(len(surface.kinds), dtype=np.int64), 0
    for point, value in zip(points, expected, strict=True):
        # Overwritten for each point: a number for each component.
        if ray_crossings(surface.grid, surface.component, point, MARGIN, crossings) == RAY_UNCERTAIN:
            continue
        caps = winding_number_at(point, surface.caps, 0, len(surface.caps))
        assert crossings.sum() - caps == pytest.approx(value, abs=1e-9)
        compared += 1
    assert compared > 45


def test_compiled_winding_number_equals_the_numpy_reference():
    """20 random points beside 50 random triangles."""
    triangles, points = np.random.default_rng(1).normal(size=(50, 3, 3)), np.random.default_rng(2).normal(size=(20, 3))
    values = [winding_number_at(point, triangles, 0, len(triangles)) for point in points]
    assert values == pytest.approx(winding_number(points, triangles), abs=1e-12)


SOUND = {
    "box": box_mesh(),
    "ball": ball_mesh(0.5, rings=12, sides=20),
    "beaker": beaker_mesh(radius=0.5, height=1.0, wall=0.05),
    "hollow": merge_meshes(ball_mesh(0.5), reversed_faces(ball_mesh(0.3))),
    "apart": merge_meshes(box_mesh(), shift_mesh(box_mesh(), [3, 0, 0])),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", SOUND)
def test_winding_number_and_parity_are_equal_in_sound_meshes(name):
    """20,000 points in the box of each mesh; where a ray meets an edge both answers are uncertain."""
    mesh, surface, count = SOUND[name], winding_surface(SOUND[name]), 20_000
    parity, crossings = build_inside_grid(mesh.triangles), np.zeros(len(surface.kinds), dtype=np.int64)
    lower, upper = mesh.bounds
    points = np.random.default_rng(5).uniform(lower, upper, (count, 3))
    numbers = np.concatenate([winding_number(some, mesh.triangles) for some in np.split(points, 40)])
    compared = 0
    for point, number in zip(points, numbers, strict=True):
        state = point_state(parity, point, MARGIN)
        uncertain = ray_crossings(surface.grid, surface.component, point, MARGIN, crossings) == RAY_UNCERTAIN
        assert uncertain == (state == UNCERTAIN)
        if not uncertain:
            assert crossings.sum() == state == round(number)
            assert number == pytest.approx(state, abs=1e-6)
            compared += 1
    assert compared > 0.99 * count
