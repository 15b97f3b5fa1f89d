"""Boxes hold every used vertex, with orthonormal axes; collider shapes hold theirs."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from support.shapes import box_mesh, random_rotations, revolved_mesh, rod_mesh, shift_mesh

from cdcore import TriangleMesh
from cdcore.bounding.box import box_best, box_by_body_axes, box_by_principal_axes
from cdcore.bounding.collider_shapes import SHAPES, box_collider, capsule_collider, sphere_collider
from cdcore.bounding.hull import hull_collider

BUILDERS = [box_by_body_axes, box_by_principal_axes, box_best]


def slack(box, mesh):
    """How far inside the box the outermost used vertex lies, in metres; negative: outside."""
    along = np.abs((mesh.referenced_vertices - box.centre) @ box.axes)
    return (box.half - along).min()


meshes = st.lists(st.tuples(*[st.floats(-1e3, 1e3)] * 3), min_size=3, max_size=12).map(
    lambda points: TriangleMesh(points, np.arange(len(points) // 3 * 3).reshape(-1, 3))
)


@given(meshes)
@settings(max_examples=max(40, settings.default.max_examples))
@example(TriangleMesh(np.ones((3, 3)), [[0, 1, 2]]))
@example(shift_mesh(rod_mesh(), [1e3, 0, 0]))
def test_box_is_orthonormal_and_holds_all_used_vertices(mesh):
    """Slack: how far the outermost used vertex lies within the box."""
    for build in BUILDERS:
        box = build(mesh)
        assert slack(box, mesh) >= 0
        assert (box.half >= 0).all()
        assert np.abs(box.axes.T @ box.axes - np.eye(3)).max() < 1e-14


def test_the_box_of_a_box_is_that_box():
    """Edges of 1, 2 and 3 m: half of them, and 2 (1 x 2 + 2 x 3 + 3 x 1) = 22 m2 of surface."""
    box = box_by_body_axes(box_mesh((1, 2, 3), (5, 6, 7)))
    assert np.allclose(box.half, [0.5, 1, 1.5])
    assert np.allclose(box.centre, [5, 6, 7])
    assert box.surface == pytest.approx(22)


def test_box_by_principal_axes_fits_a_slanted_rod():
    """The rod is 50 times as long as thick: a box along the axes of the body has over five times the surface."""
    rod = rod_mesh(radius=0.003, length=0.3)
    slanted = TriangleMesh(rod.vertices @ random_rotations(np.random.default_rng(3)).T + [3, -2, 1], rod.faces)
    assert box_by_principal_axes(slanted).surface < 0.2 * box_by_body_axes(slanted).surface
    assert box_best(slanted).surface == box_by_principal_axes(slanted).surface


BEAKER = revolved_mesh([(0, 0), (0.035, 0), (0.035, 0.1), (0.033, 0.1), (0.033, 0.002), (0, 0.002)], 40)


def volume(mesh):
    """The volume of a closed mesh."""
    a, b, c = (mesh.triangles[:, k] for k in range(3))
    return float((np.cross(a, b) * c).sum()) / 6


@pytest.mark.parametrize("shape", SHAPES)
def test_every_collider_is_closed_and_faces_outwards(shape):
    """The signed volume of a closed mesh is positive where its faces are wound outwards."""
    made = SHAPES[shape](BEAKER)
    assert made.is_closed and volume(made) > 0


def test_the_hull_holds_every_vertex():
    """None of 60 random vertices lies before the plane of a face of the hull."""
    points = np.random.default_rng(1).normal(size=(60, 3))
    mesh = TriangleMesh(points, np.arange(60).reshape(20, 3))
    hull = hull_collider(mesh).triangles
    normal = np.cross(hull[:, 1] - hull[:, 0], hull[:, 2] - hull[:, 0])
    assert (((points[:, None] - hull[None, :, 0]) * normal).sum(axis=-1) < 1e-12).all()


def test_hull_collider_of_a_flat_mesh_is_the_mesh():
    """A single triangle has no volume to enclose."""
    flat = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    assert hull_collider(flat) is flat


def test_sphere_of_largest_half_extent_leaves_corners_outside():
    """A box of 2 x 1 x 1 m: the sphere's radius is 1 m, a corner is root of 1.5 = 1.22 m from the middle."""
    middle = np.array([5.0, 0.0, 0.0])
    box = box_mesh((2.0, 1.0, 1.0), middle)
    radii = np.linalg.norm(sphere_collider(box).referenced_vertices - middle, axis=1)
    assert np.allclose(radii, 1.0)
    assert (np.linalg.norm(box.vertices - middle, axis=1) > radii.max()).all()


def test_faces_of_a_sphere_lie_half_a_percent_within_it():
    """The sphere collider of a box of side 2 has radius 1, half the longest side; its corners lie on that radius."""
    a, b, c = np.moveaxis(sphere_collider(box_mesh((2.0, 2.0, 2.0))).triangles, 1, 0)
    normal = np.cross(b - a, c - a)
    heights = (a * normal).sum(axis=1) / np.linalg.norm(normal, axis=1)
    assert 0.995 < heights.min() < heights.max() < 1.0


def test_box_collider_grows_by_its_margin_on_every_side():
    """Edges of 1, 2 and 3 m about (5, 6, 7), and a margin of 0.25 m."""
    box = box_collider(box_mesh((1.0, 2.0, 3.0), (5.0, 6.0, 7.0)), 0.25)
    assert box.bounds.tolist() == [[4.25, 4.75, 5.25], [5.75, 7.25, 8.75]]


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_capsule_collider_lies_along_the_longest_side_of_a_box(axis):
    """A box of 4 x 1 x 1: radius 0.5 about a segment of 3, whose volume the mesh fills to more than 95 %."""
    size = np.full(3, 1.0)
    size[axis] = 4.0
    capsule = capsule_collider(box_mesh(size, (1.0, 2.0, 3.0)))
    volume = np.einsum("ij,ij->", capsule.triangles[:, 0], np.cross(*np.moveaxis(capsule.triangles[:, 1:], 1, 0))) / 6.0
    assert 0.95 < volume / (np.pi * 0.5**2 * 3.0 + np.pi / 6.0) < 1.0
    assert np.allclose(np.diff(capsule.bounds, axis=0), size)
    points = capsule.referenced_vertices - [1.0, 2.0, 3.0]
    along = np.clip(points[:, axis], -1.5, 1.5)
    points[:, axis] -= along
    assert np.allclose(np.linalg.norm(points, axis=1), 0.5)
