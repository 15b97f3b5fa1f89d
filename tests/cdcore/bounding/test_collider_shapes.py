import numpy as np
import pytest
from support.shapes import box_mesh, revolved_mesh

from cdcore import TriangleMesh
from cdcore.bounding.collider_shapes import SHAPES, capsule_collider, hull_collider, sphere_collider

BEAKER = revolved_mesh([(0, 0), (0.035, 0), (0.035, 0.1), (0.033, 0.1), (0.033, 0.002), (0, 0.002)], 40)


def volume(mesh):
    a, b, c = (mesh.triangles[:, k] for k in range(3))
    return float((np.cross(a, b) * c).sum()) / 6


@pytest.mark.parametrize("shape", SHAPES)
def test_every_collider_is_closed_and_faces_outwards(shape):
    made = SHAPES[shape](BEAKER)
    assert made.is_closed and volume(made) > 0


def test_the_hull_of_a_beaker_is_the_full_cylinder():
    area = 40 / 2 * np.sin(2 * np.pi / 40) * 0.035**2
    assert volume(hull_collider(BEAKER)) == pytest.approx(area * 0.1, rel=1e-12)


def test_the_hull_holds_every_vertex():
    points = np.random.default_rng(1).normal(size=(60, 3))
    mesh = TriangleMesh(points, np.arange(60).reshape(20, 3))
    hull = hull_collider(mesh).triangles
    normal = np.cross(hull[:, 1] - hull[:, 0], hull[:, 2] - hull[:, 0])
    assert (((points[:, None] - hull[None, :, 0]) * normal).sum(axis=-1) < 1e-12).all()


def test_a_flat_mesh_is_its_own_hull():
    flat = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    assert hull_collider(flat) is flat


def test_a_sphere_has_the_largest_half_extent_and_lets_corners_stick_out():
    points = sphere_collider(box_mesh((2.0, 1.0, 1.0), (5.0, 0.0, 0.0))).referenced_vertices
    away = np.linalg.norm(points - [5.0, 0.0, 0.0], axis=1)
    assert np.allclose(away, 1.0) and np.linalg.norm([1.0, 0.5, 0.5]) > 1.0


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_capsule_lies_along_the_longest_side(axis):
    size = np.full(3, 1.0)
    size[axis] = 4.0
    points = capsule_collider(box_mesh(size, (1.0, 2.0, 3.0))).referenced_vertices - [1.0, 2.0, 3.0]
    along = np.clip(points[:, axis], -1.5, 1.5)
    points[:, axis] -= along
    assert np.allclose(np.linalg.norm(points, axis=1), 0.5)


def test_the_meshed_sphere_has_nearly_the_volume_of_the_true_one():
    assert volume(sphere_collider(box_mesh((2.0, 2.0, 2.0)))) == pytest.approx(4 / 3 * np.pi, rel=0.0075)
