from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from trimesh.creation import box, cylinder, icosphere

from cdcore.bounding.hull import hull_of
from cdcore.mesh import TriangleMesh
from replay.cutting.solid_overlap import intersection_of, solid_of
from replay.cutting.surface_distance import Surface, is_outside

SEEDS = range(6)
STILL = np.eye(3)


def mesh_of(made):
    """A mesh of trimesh as one of ours."""
    return TriangleMesh(np.asarray(made.vertices, np.float64), np.asarray(made.faces))


def bar_of_edges(*extents):
    """A box with edges of these lengths about the origin."""
    return mesh_of(box(extents=extents))


def posed_with_seed(mesh, seed):
    """A mesh with a random pose applied, and that pose: depth and volume do not depend on it."""
    rotation = Rotation.random(random_state=seed).as_matrix()
    translation = np.random.default_rng(seed).normal(size=3)
    return TriangleMesh(mesh.vertices @ rotation.T + translation, mesh.faces), rotation, translation


def overlap(first, second, at, tilt=STILL, seed=0):
    """Depth and volume of a body in the axes of another, both in one random pose."""
    moved, rotation, translation = posed_with_seed(second, seed)
    to_moved = rotation @ tilt, rotation @ np.asarray(at, np.float64) + translation
    intersection = intersection_of(solid_of(first), solid_of(moved), *to_moved)
    return (
        SimpleNamespace(depth=intersection.depth, volume=intersection.volume)
        if intersection
        else SimpleNamespace(depth=0.0, volume=0.0)
    )


@pytest.mark.parametrize("seed", SEEDS)
def test_boxes_have_their_closed_form(seed):
    """The common part of two bars has the edges ``common``; the shortest is the depth."""
    rng = np.random.default_rng(seed)
    first, second = rng.uniform(0.5, 2.0, size=(2, 3))
    common = rng.uniform(0.05, 0.2, size=3)
    result = overlap(bar_of_edges(*first), bar_of_edges(*second), (first + second) / 2 - common, seed=seed)
    assert result.depth == pytest.approx(common.min(), rel=1e-6)
    assert result.volume == pytest.approx(common.prod(), rel=1e-6)


@pytest.mark.parametrize(
    ("lift", "depth"), [(0.0, 0.75), (0.3, 0.75), (0.6, 0.65), (1.0, 0.25), (1.2499, 0.0001), (1.3, 0.0)]
)
@pytest.mark.parametrize("angle", [30.0, 90.0])
def test_crossed_bars_have_a_depth_without_a_vertex_inside(lift, depth, angle):
    """A bar 1 thick lies across one of 1.5, ``lift`` higher: 1.25 - lift deep in it, or 0.75, down to its middle.

    Both share a parallelogram of 1 * 1.5 / sin(angle) over the height in which they overlap.
    """
    tilt = Rotation.from_euler("z", angle, degrees=True).as_matrix()
    result = overlap(bar_of_edges(10, 1, 1), bar_of_edges(12, 1.5, 1.5), (0.0, 0.1, lift), tilt)
    assert result.depth == pytest.approx(depth, rel=1e-6)
    height = max(0.0, min(lift + 0.5, 0.75) - max(lift - 0.5, -0.75))
    assert result.volume == pytest.approx(1.5 / np.sin(np.radians(angle)) * height, rel=1e-6)


def test_coarse_common_part_is_deepest_amid_its_faces():
    """Two bars 1 m thick cross at right angles, 0.5 m apart: every corner of what they share lies in both surfaces."""
    cross = Rotation.from_euler("z", 90, degrees=True).as_matrix()
    bar = solid_of(bar_of_edges(4, 1, 1))
    intersection = intersection_of(bar, bar, cross, np.array([0.0, 0.0, 0.5]))
    assert 0.0 < intersection.depth_at_corners <= 0.5 == pytest.approx(intersection.depth)


@pytest.mark.parametrize("sides", [3, 5, 8])
@pytest.mark.parametrize("depth", [0.03, 0.2])
def test_prism_in_a_slab_is_as_deep_as_its_face(sides, depth):
    """A prism, 1 m high, within a circle of 0.4 m stands ``depth`` metres deep in a slab."""
    result = overlap(
        mesh_of(cylinder(0.4, 1.0, sections=sides)), bar_of_edges(3, 3, 2), (0.1, 0.2, 1.5 - depth), seed=sides
    )
    assert result.depth == pytest.approx(depth, rel=1e-6)
    assert result.volume == pytest.approx(depth * sides / 2 * 0.4**2 * np.sin(2 * np.pi / sides), rel=1e-6)


@pytest.mark.parametrize("seed", SEEDS)
def test_tetrahedron_corner_in_a_slab_has_closed_form(seed):
    """Below the slab's top is a tip of a tetrahedron of height 1: its volume grows by the cube of the depth."""
    depth = 0.02 * (seed + 1)
    corner = np.array([[0, 0, 0], [1, 0, 1], [-1, 0.5, 1], [-0.2, -1, 1]], dtype=np.float64)
    result = overlap(hull_of(corner), bar_of_edges(3, 3, 2), (0.0, 0.0, 1.0 - depth), seed=seed)
    base = abs(np.linalg.det(corner[1:])) / 6
    assert result.depth == pytest.approx(depth, rel=1e-6)
    assert result.volume == pytest.approx(base * depth**3, rel=1e-6)


def test_tetrahedron_within_another_is_as_deep_as_the_inscribed_sphere():
    """The corners are those of a cube of edge 2: a volume of 8/3, faces 1 / root of 3 from the middle."""
    corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], dtype=np.float64)
    result = overlap(hull_of(0.9 * corners), hull_of(corners), (0.0, 0.0, 0.0), seed=3)
    assert result.depth == pytest.approx(1 / np.sqrt(3), rel=1e-6)
    assert result.volume == pytest.approx(0.9**3 * 8 / 3, rel=1e-6)


def test_meshed_spheres_converge_at_second_order():
    """Unit spheres 1.6 m apart: 0.4 m deep, and a lens of closed form. Each finer mesh has a quarter of the error."""
    errors = []
    for level in (1, 2, 3, 4):
        sphere = mesh_of(icosphere(level))
        result = overlap(sphere, sphere, (0.0, 0.0, 1.6))
        lens = np.pi * (4 + 1.6) * (2 - 1.6) ** 2 / 12
        errors.append((abs(result.depth - 0.4), abs(result.volume - lens)))
    ratios = np.array(errors[:-1]) / np.array(errors[1:])
    assert (ratios[1:] > 3.3).all() and (ratios[1:] < 4.8).all(), ratios


@pytest.mark.sampled(4)
@pytest.mark.parametrize("seed", SEEDS[:4])
def test_depth_in_a_trough_agrees_with_dense_samples(seed):
    """The rod has samples at most 0.05 apart, so the deepest point is within 0.04 of a sample."""
    from manifold3d import Manifold

    trough = Manifold.cube([4, 4, 2], True) - Manifold.cube([3.2, 3.2, 2], True).translate([0, 0, 0.5])
    made = trough.to_mesh64()
    hollow = TriangleMesh(made.vert_properties[:, :3], np.asarray(made.tri_verts).astype(np.int64))
    tilt = Rotation.random(random_state=seed).as_matrix()
    rod, at = bar_of_edges(0.7, 0.5, 3.0), np.random.default_rng(seed).uniform([-2, -2, -1], [2, 2, 0])
    result = overlap(rod, hollow, at, tilt, seed)
    steps = (np.indices((21, 16, 61)).reshape(3, -1).T / [20, 15, 60] - 0.5) * [0.7, 0.5, 3.0]
    points = steps @ tilt.T + at
    in_hollow = points[~is_outside(points, hollow.triangles)]
    moved = TriangleMesh(rod.vertices @ tilt.T + at, rod.faces)
    sampled = max(
        (float(Surface(mesh.triangles).distances(in_hollow)[0].max()) for mesh in (hollow, moved)), default=0.0
    )
    assert sampled - 1e-9 <= result.depth <= sampled + 0.04


def test_open_mesh_has_no_solid_for_the_depth():
    """A cube, and the cube without its first face."""
    whole = bar_of_edges(1, 1, 1)
    assert solid_of(whole).reason == ""
    assert solid_of(TriangleMesh(whole.vertices, whole.faces[1:])).reason == "is open"
