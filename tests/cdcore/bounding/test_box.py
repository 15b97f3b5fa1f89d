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
    """How far inside the box the outermost vertex that a face uses lies, in metres; negative: outside."""
    along_axes = np.abs((mesh.referenced_vertices - box.centre) @ box.axes)
    return (box.half - along_axes).min()


meshes = st.lists(st.tuples(*[st.floats(-1e3, 1e3)] * 3), min_size=3, max_size=12).map(
    lambda points: TriangleMesh(points, np.arange(len(points) // 3 * 3).reshape(-1, 3))
)


@given(meshes)
@settings(max_examples=max(40, settings.default.max_examples))
@example(TriangleMesh(np.ones((3, 3)), [[0, 1, 2]]))
@example(shift_mesh(rod_mesh(), [1e3, 0, 0]))
def test_box_is_orthonormal_and_holds_all_used_vertices(mesh):
    """Meshes are random triangles, three equal points, and a rod 1 km from its origin; a box is made in three ways.

    Slack: how far inside the box its outermost vertex lies; half extents are not negative, and R^T R is the identity.
    """
    for build in BUILDERS:
        box = build(mesh)
        assert slack(box, mesh) >= 0
        assert (box.half >= 0).all()
        assert np.abs(box.axes.T @ box.axes - np.eye(3)).max() < 1e-14


def test_the_box_of_a_box_is_that_box():
    """Edges of 1, 2 and 3 m about (5, 6, 7): half extents 0.5, 1 and 1.5 m, and a surface of 22 m2."""
    box = box_by_body_axes(box_mesh((1, 2, 3), centre=(5, 6, 7)))
    assert np.allclose(box.half, [0.5, 1, 1.5])
    assert np.allclose(box.centre, [5, 6, 7])
    assert box.surface == pytest.approx(2 * (1 * 2 + 2 * 3 + 3 * 1))


def test_box_by_principal_axes_fits_a_slanted_rod():
    """A rod of 6 mm x 300 mm at a random angle: a box along the body's axes has over five times the surface of one
    along the rod, which is the best.
    """
    rod = rod_mesh(radius=0.003, length=0.3)
    slanted = TriangleMesh(rod.vertices @ random_rotations(np.random.default_rng(3)).T + [3, -2, 1], rod.faces)
    assert box_by_principal_axes(slanted).surface < 0.2 * box_by_body_axes(slanted).surface
    assert box_best(slanted).surface == box_by_principal_axes(slanted).surface


BEAKER = revolved_mesh([(0, 0), (0.035, 0), (0.035, 0.1), (0.033, 0.1), (0.033, 0.002), (0, 0.002)], 40)


def signed_volume(mesh):
    """The volume of a closed mesh, positive where its faces are wound outwards."""
    a, b, c = (mesh.triangles[:, k] for k in range(3))
    return float((np.cross(a, b) * c).sum()) / 6


@pytest.mark.parametrize("shape", SHAPES)
def test_every_collider_is_closed_and_faces_outwards(shape):
    """Colliders (box, sphere, capsule, hull, ...) of a beaker; wound outwards a closed mesh has a positive volume."""
    collider = SHAPES[shape](BEAKER)
    assert collider.is_closed
    assert signed_volume(collider) > 0


def test_the_hull_holds_every_vertex():
    """None of 60 random vertices lies in front of the plane of a face of the hull."""
    points = np.random.default_rng(1).normal(size=(60, 3))
    a, b, c = np.moveaxis(hull_collider(TriangleMesh(points, np.arange(60).reshape(20, 3))).triangles, 1, 0)
    normals = np.cross(b - a, c - a)
    heights = ((points[:, None] - a) * normals).sum(axis=-1)  # of each point above each face, times the normal's length
    assert heights.shape == (60, len(a))
    assert heights.max() < 1e-12


def test_hull_collider_of_a_flat_mesh_is_the_mesh():
    """A triangle has no hull with a volume: the mesh itself stands for it."""
    flat = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    assert hull_collider(flat) is flat


def test_sphere_of_largest_half_extent_leaves_corners_outside():
    """A box of 2 x 1 x 1 m: the sphere's radius is 1 m, a corner is root(1 + 1/4 + 1/4) = 1.22 m from the middle."""
    middle = np.array([5.0, 0.0, 0.0])
    box = box_mesh((2.0, 1.0, 1.0), middle)
    sphere_radii = np.linalg.norm(sphere_collider(box).referenced_vertices - middle, axis=1)
    box_radii = np.linalg.norm(box.vertices - middle, axis=1)
    assert np.allclose(sphere_radii, 1.0)
    assert (box_radii > sphere_radii.max()).all()


def test_faces_of_a_sphere_lie_half_a_percent_within_it():
    """The sphere collider of a box of side 2 has radius 1, half the longest side.

    Its corners lie on that radius, 48 around, so that its faces lie within it: from the middle of a cell of 7.5 x 7.5
    degrees a corner is 5.3 degrees away, and cos(5.3 degrees) = 0.9957.
    """
    a, b, c = np.moveaxis(sphere_collider(box_mesh((2.0, 2.0, 2.0))).triangles, 1, 0)
    normals = np.cross(b - a, c - a)
    distances_of_planes = (a * normals).sum(axis=1) / np.linalg.norm(normals, axis=1)
    assert distances_of_planes.min() > 0.995
    assert distances_of_planes.max() < 1.0


def test_box_collider_grows_by_its_margin_on_every_side():
    """Edges of 1, 2 and 3 m about (5, 6, 7) are bounds of (4.5, 5, 5.5) to (5.5, 7, 8.5); the margin is 0.25 m."""
    box = box_collider(box_mesh((1.0, 2.0, 3.0), centre=(5.0, 6.0, 7.0)), grown=0.25)
    assert box.bounds.tolist() == [[4.25, 4.75, 5.25], [5.75, 7.25, 8.75]]


@pytest.mark.parametrize("axis", [0, 1, 2], ids="xyz".__getitem__)
def test_capsule_collider_lies_along_the_longest_side_of_a_box(axis):
    """A box of 4 x 1 x 1 m has a capsule of radius 0.5 m about a segment of 3 m; its corners are 0.5 m from that.

    A mesh with its corners on the capsule fills a little less than its volume, a cylinder and a ball.
    """
    size, middle = np.full(3, 1.0), np.array([1.0, 2.0, 3.0])
    size[axis] = 4.0
    capsule = capsule_collider(box_mesh(size, middle))
    cylinder, ball = np.pi * 0.5**2 * 3.0, 4 / 3 * np.pi * 0.5**3
    assert 0.95 < signed_volume(capsule) / (cylinder + ball) < 1.0
    lower, upper = capsule.bounds
    assert np.allclose(upper - lower, size)
    offsets = capsule.referenced_vertices - middle
    offsets[:, axis] -= np.clip(offsets[:, axis], -1.5, 1.5)  # from the nearest point of the segment
    assert np.allclose(np.linalg.norm(offsets, axis=1), 0.5)
