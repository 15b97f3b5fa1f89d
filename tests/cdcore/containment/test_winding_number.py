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
"""Metres by which coordinates may be off."""


def test_winding_number_is_1_inside_and_0_outside_a_box():
    """A box of side 2 m about the origin: its sides are 1 m from the middle."""
    inside, outside = [[0, 0, 0], [0.3, -0.9, 0.5]], [[3, 0, 0], [0, 0, -1.5]]
    numbers = winding_number(np.array(inside + outside), box_mesh((2, 2, 2)).triangles)
    assert numbers == pytest.approx([1, 1, 0, 0], abs=1e-12)


def test_side_of_a_cube_winds_by_a_sixth():
    """From the middle each of the six sides takes a sixth of all directions."""
    cube, middle = box_mesh((2, 2, 2)), np.zeros((1, 3))
    for axis in range(3):
        side = cube.triangles[(cube.triangles[:, :, axis] == 1).all(axis=1)]
        assert winding_number(middle, side) == pytest.approx([1 / 6], abs=1e-12), axis


@pytest.mark.parametrize("height", [0.1, 0.5, 1.0, 3.0])
def test_disk_has_the_solid_angle_of_a_cone(height):
    """A disk of radius 1 m, of 2,000 triangles that look up, fills a cone of (1 - cos) / 2 of all directions.

    Before it, above, the winding number is negative, and behind it, below, positive.
    """
    angle = np.linspace(0, 2 * np.pi, 2001)
    ring = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    disk = np.stack([np.zeros((2000, 3)), ring[:-1], ring[1:]], axis=1)
    cone = (1 - height / np.hypot(height, 1)) / 2
    above, below = winding_number(np.array([[0, 0, height], [0, 0, -height]]), disk)
    assert above == pytest.approx(-cone, abs=1e-5)
    assert below == pytest.approx(cone, abs=1e-5)


def reversed_faces(mesh):
    """The mesh inside out."""
    return TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])


@pytest.mark.parametrize(
    "mesh",
    [
        pytest.param(TriangleMesh(ball_mesh(0.5).vertices, ball_mesh(0.5).faces[5:]), id="ball that lacks five faces"),
        pytest.param(
            TriangleMesh(
                beaker_mesh(radius=0.5, height=1.0, wall=0.05).vertices,
                beaker_mesh(radius=0.5, height=1.0, wall=0.05).faces[::2],
            ),
            id="beaker that lacks every other face",
        ),
        pytest.param(merge_meshes(box_mesh(), shift_mesh(box_mesh(), [0.5, 0.3, 0.2])), id="boxes that cross"),
        pytest.param(merge_meshes(box_mesh((2, 2, 2)), reversed_faces(ball_mesh(0.5))), id="hollow box"),
    ],
)
def test_crossings_less_the_caps_are_the_sum_of_solid_angles(mesh):
    """A ray counts the faces it crosses, of the mesh and of the caps that close its holes, by their winding.

    Less the winding number of the caps that is the sum of the solid angles of the mesh's faces. Rays that meet an edge
    are left out, at most a quarter of 60.
    """
    surface = winding_surface(mesh)
    faces_without_caps = surface.grid.triangles[: len(surface.component) - len(surface.caps)]
    points = np.random.default_rng(0).uniform(*mesh.bounds, (60, 3))
    expected = winding_number(points, faces_without_caps)
    compared = 0
    for point, value in zip(points, expected, strict=True):
        crossings = np.zeros(len(surface.kinds), dtype=np.int64)  # filled in below, a number for each component
        if ray_crossings(surface.grid, surface.component, point, MARGIN, crossings) == RAY_UNCERTAIN:
            continue
        of_caps = winding_number_at(point, surface.caps, 0, len(surface.caps))
        assert crossings.sum() - of_caps == pytest.approx(value, abs=1e-9)
        compared += 1
    assert compared >= 45


def test_compiled_winding_number_equals_the_numpy_reference():
    """At 20 random points beside 50 random triangles ``winding_number_at``, compiled, equals ``winding_number``."""
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
    """At 20,000 points in the bounds of a mesh: crossings of a ray by winding, their parity, and sums of solid angles.

    A ray that meets an edge is uncertain for both of the first two, and is left out: less than 1 %.
    """
    mesh, surface, count = SOUND[name], winding_surface(SOUND[name]), 20_000
    parity, crossings = build_inside_grid(mesh.triangles), np.zeros(len(surface.kinds), dtype=np.int64)
    points = np.random.default_rng(5).uniform(*mesh.bounds, (count, 3))
    in_blocks = np.split(points, 40)  # for memory
    numbers = np.concatenate([winding_number(block, mesh.triangles) for block in in_blocks])
    compared = 0
    for point, number in zip(points, numbers, strict=True):
        state = point_state(parity, point, MARGIN)  # 1 inside, 0 outside
        uncertain = ray_crossings(surface.grid, surface.component, point, MARGIN, crossings) == RAY_UNCERTAIN
        assert uncertain == (state == UNCERTAIN)
        if not uncertain:
            assert crossings.sum() == state
            assert number == pytest.approx(state, abs=1e-6)
            compared += 1
    assert compared > 0.99 * count
