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
"""Of random poses, which neither depth nor volume depend on."""
UNROTATED = np.eye(3)


def mesh_of(made):
    """A mesh of trimesh as one of ours."""
    return TriangleMesh(np.asarray(made.vertices, np.float64), np.asarray(made.faces))


def bar_of_edges(*extents):
    """A box with edges of these lengths about the origin."""
    return mesh_of(box(extents=extents))


def posed_with_seed(mesh, seed):
    """A mesh with a random pose applied, and that pose as rotation matrix and translation."""
    rotation = Rotation.random(random_state=seed).as_matrix()
    translation = np.random.default_rng(seed).normal(size=3)
    return TriangleMesh(mesh.vertices @ rotation.T + translation, mesh.faces), rotation, translation


def overlap(first, second, at, tilt=UNROTATED, seed=0):
    """Depth and volume of what two bodies share: the first, rotated by ``tilt`` and put ``at`` a place, in the second.

    Both stand in one random pose; metres and cubic metres, 0 where nothing is shared.
    """
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
    """Two boxes of 0.5 to 2 m share a corner: a box with edges of 0.05 to 0.2 m, of which the shortest is the depth."""
    rng = np.random.default_rng(seed)
    first, second = rng.uniform(0.5, 2.0, size=(2, 3))
    shared = rng.uniform(0.05, 0.2, size=3)
    result = overlap(bar_of_edges(*first), bar_of_edges(*second), at=(first + second) / 2 - shared, seed=seed)
    assert result.depth == pytest.approx(shared.min(), rel=1e-6)
    assert result.volume == pytest.approx(shared.prod(), rel=1e-6)


@pytest.mark.parametrize(
    ("lift", "depth"), [(0.0, 0.75), (0.3, 0.75), (0.6, 0.65), (1.0, 0.25), (1.2499, 0.0001), (1.3, 0.0)]
)
@pytest.mark.parametrize("angle", [30.0, 90.0])
def test_crossed_bars_have_a_depth_without_a_vertex_inside(lift, depth, angle):
    """A bar 1 m thick lies across one of 1.5 m, its axis ``lift`` metres higher, at an angle in degrees.

    It is 1.25 - lift deep in the other, or 0.75, down to its middle. They share a parallelogram of
    1 * 1.5 / sin(angle) over the height in which they overlap.
    """
    tilt = Rotation.from_euler("z", angle, degrees=True).as_matrix()
    thin, thick = bar_of_edges(10, 1, 1), bar_of_edges(12, 1.5, 1.5)
    result = overlap(thin, thick, at=(0.0, 0.1, lift), tilt=tilt)
    assert result.depth == pytest.approx(depth, rel=1e-6)
    shared_height = max(0.0, min(lift + 0.5, 0.75) - max(lift - 0.5, -0.75))
    assert result.volume == pytest.approx(1 * 1.5 / np.sin(np.radians(angle)) * shared_height, rel=1e-6)


def test_coarse_common_part_is_deepest_amid_its_faces():
    """Two bars 1 m thick cross at right angles, 0.5 m above each other: they share 1 x 1 x 0.5 m, 0.5 m deep.

    Every corner of what they share lies in both surfaces, so that corners alone say no more than the depth.
    """
    cross = Rotation.from_euler("z", 90, degrees=True).as_matrix()
    bar = solid_of(bar_of_edges(4, 1, 1))
    intersection = intersection_of(bar, bar, cross, np.array([0.0, 0.0, 0.5]))
    assert intersection.depth == pytest.approx(0.5)
    assert 0.0 < intersection.depth_at_corners <= 0.5


@pytest.mark.parametrize("sides", [3, 5, 8])
@pytest.mark.parametrize("depth", [0.03, 0.2])
def test_prism_in_a_slab_is_as_deep_as_its_face(sides, depth):
    """A prism 1 m high, within a circle of 0.4 m radius, stands ``depth`` metres deep in a slab 2 m thick.

    Its base is ``sides`` triangles with two edges of 0.4 m.
    """
    prism, slab = mesh_of(cylinder(0.4, 1.0, sections=sides)), bar_of_edges(3, 3, 2)
    result = overlap(prism, slab, at=(0.1, 0.2, 0.5 + 1.0 - depth), seed=sides)
    base_area = sides * 0.4**2 * np.sin(2 * np.pi / sides) / 2
    assert result.depth == pytest.approx(depth, rel=1e-6)
    assert result.volume == pytest.approx(base_area * depth, rel=1e-6)


@pytest.mark.parametrize("depth", [0.02, 0.04, 0.06, 0.08, 0.1, 0.12])
def test_tetrahedron_corner_in_a_slab_has_closed_form(depth):
    """Below the slab's top, at 1 m, is the tip of a tetrahedron of height 1: its volume grows by the cube of the depth.

    |det(a, b, c)| / 6 is the volume of a tetrahedron with the corners 0, a, b and c.
    """
    corners = np.array([[0, 0, 0], [1, 0, 1], [-1, 0.5, 1], [-0.2, -1, 1]], dtype=np.float64)
    slab = bar_of_edges(3, 3, 2)
    result = overlap(hull_of(corners), slab, at=(0.0, 0.0, 1.0 - depth), seed=round(100 * depth))
    whole_volume = abs(np.linalg.det(corners[1:])) / 6
    assert result.depth == pytest.approx(depth, rel=1e-6)
    assert result.volume == pytest.approx(whole_volume * depth**3, rel=1e-6)


def test_tetrahedron_within_another_is_as_deep_as_the_inscribed_sphere():
    """The corners are four of a cube of edge 2: a volume of 8/3, faces 1 / root of 3 from the middle.

    The smaller one, of 0.9 of the size, is wholly inside, and holds that middle.
    """
    corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], dtype=np.float64)
    result = overlap(hull_of(0.9 * corners), hull_of(corners), at=(0.0, 0.0, 0.0), seed=3)
    assert result.depth == pytest.approx(1 / np.sqrt(3), rel=1e-6)
    assert result.volume == pytest.approx(0.9**3 * 8 / 3, rel=1e-6)


def test_meshed_spheres_converge_at_second_order():
    """Spheres of radius r = 1 m, d = 1.6 m apart: 2 r - d = 0.4 m deep, a lens of pi (4 r + d) (2 r - d)^2 / 12.

    The second mesh has edges half as long as the first, and so about a quarter of its error: a ratio of 3.3 to 4.8.
    """
    errors = []
    for level in (2, 3):
        sphere = mesh_of(icosphere(level))
        result = overlap(sphere, sphere, at=(0.0, 0.0, 1.6))
        lens = np.pi * (4 + 1.6) * (2 - 1.6) ** 2 / 12
        errors.append((abs(result.depth - 0.4), abs(result.volume - lens)))
    ratios = np.array(errors[0]) / np.array(errors[1])
    assert (ratios > 3.3).all() and (ratios < 4.8).all(), ratios


@pytest.mark.sampled(4)
@pytest.mark.parametrize("seed", SEEDS[:4])
def test_depth_in_a_trough_agrees_with_dense_samples(seed):
    """A rod of 0.7 x 0.5 x 3 m, anyhow rotated, in a trough: a box of 4 x 4 x 2 m with a hollow from above.

    The depth is that of the deepest of samples of the rod that are in the trough's walls. They are at most 0.05 m
    apart, so the deepest point is within 0.04 m of a sample.
    """
    from manifold3d import Manifold

    trough = Manifold.cube([4, 4, 2], True) - Manifold.cube([3.2, 3.2, 2], True).translate([0, 0, 0.5])
    trough_mesh = trough.to_mesh64()
    hollow = TriangleMesh(trough_mesh.vert_properties[:, :3], np.asarray(trough_mesh.tri_verts).astype(np.int64))
    tilt = Rotation.random(random_state=seed).as_matrix()
    edges = np.array([0.7, 0.5, 3.0])
    rod, at = bar_of_edges(*edges), np.random.default_rng(seed).uniform([-2, -2, -1], [2, 2, 0])
    result = overlap(rod, hollow, at, tilt, seed)

    samples = (np.indices((21, 16, 61)).reshape(3, -1).T / [20, 15, 60] - 0.5) * edges
    placed_samples = samples @ tilt.T + at
    in_walls = placed_samples[~is_outside(placed_samples, hollow.triangles)]
    placed_rod = TriangleMesh(rod.vertices @ tilt.T + at, rod.faces)
    deepest_sample = max(
        (float(Surface(mesh.triangles).distances(in_walls)[0].max()) for mesh in (hollow, placed_rod)), default=0.0
    )
    assert deepest_sample - 1e-9 <= result.depth <= deepest_sample + 0.04


def test_open_mesh_has_no_solid_for_the_depth():
    """A cube, and the cube without its first face."""
    whole = bar_of_edges(1, 1, 1)
    assert solid_of(whole).reason == ""
    assert solid_of(TriangleMesh(whole.vertices, whole.faces[1:])).reason == "is open"
