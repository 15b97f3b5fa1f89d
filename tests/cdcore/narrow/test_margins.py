"""Clearance and penetration of triangles and of placed surfaces agree with closed forms down to the last bits."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from support.random_worlds import bodies_of, grid_plate
from support.shapes import box_mesh, merge_meshes, random_rotations

from cdcore.narrow.brute_force import meeting_faces_exhaustive, near_faces
from cdcore.narrow.bvh.box_tree import build_box_trees
from cdcore.narrow.continuous.clearance import ClearanceSearch
from cdcore.narrow.margins import can_be_separated, overlap_bounds, shell_vectors, triangle_margins, unit
from replay.studies.stress.families import FAMILIES

FLOOR = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
"""A right triangle in z = 0, metres."""
MODERATE_FAMILIES = [f for f in FAMILIES if f.name not in ("products underflow", "products overflow")]
"""Of random triangle pairs that are hard to decide, those with coordinates of moderate size."""
CLEARANCES = tomllib.loads(Path(__file__).with_name("clearances.toml").read_text("utf-8"))["clearance"]


def meets_and_margin(first, second):
    """Whether two triangles meet, and how far one may move before that changes."""
    meets, distance = triangle_margins(np.array([[first, second]], dtype=float))
    return bool(meets[0]), float(distance[0])


def corner_at_height(height):
    """A triangle whose lowest corner is at this height over FLOOR."""
    return [[0.2, 0.2, height], [0.3, 0.2, 1], [0.2, 0.3, 1]]


@pytest.mark.parametrize("height", [1e-15, 2.0**-53, 1e-9, 2e-6, 0.125])
def test_margin_of_a_corner_is_its_height_over_the_face(height):
    """A corner above or below a triangle in z = 0: above it they do not meet, below it they do (the rest is above).

    The margin, how far a triangle must move to change that, is the height; the smallest are at the limit of rounding.
    """
    assert meets_and_margin(FLOOR, corner_at_height(height)) == (False, height)
    assert meets_and_margin(FLOOR, corner_at_height(-height)) == (True, height)
    assert meets_and_margin(corner_at_height(height), FLOOR) == (False, height)


def test_touching_and_coplanar_overlap_have_no_depth():
    """A corner on a triangle in z = 0, and a triangle in that plane that overlaps it: both meet, with a
    margin of 0 m.
    """
    assert meets_and_margin(FLOOR, corner_at_height(height=0.0)) == (True, 0.0)
    assert meets_and_margin(FLOOR, [[0.1, 0.1, 0], [2, 0, 0], [0, 2, 0]]) == (True, 0.0)


@pytest.mark.parametrize("row", CLEARANCES, ids=lambda row: row["of"])
def test_clearance_is_the_distance_of_the_nearest_features(row):
    """Rows of clearances.toml: a triangle and its distance from (0, 0, 0), (1, 0, 0), (0, 1, 0), computed by hand."""
    assert meets_and_margin(FLOOR, row["second"]) == (False, pytest.approx(row["distance"], rel=1e-15, abs=0))


@pytest.mark.slow
def test_moving_by_the_penetration_depth_separates():
    """In those of 400 random pairs that meet one triangle is moved along each of the 11 axes that may separate them.

    By a thousandth more than the depth some move frees it, by a thousandth less none does.
    """
    pairs = np.random.default_rng(1).random((400, 2, 3, 3))
    meets, depths = triangle_margins(pairs)
    assert meets.sum() > 10
    for (a, b), depth in zip(pairs[meets], depths[meets], strict=True):
        edges_a, edges_b = ([triangle[(k + 1) % 3] - triangle[k] for k in range(3)] for triangle in (a, b))
        normals = [np.cross(edges[0], edges[1]) for edges in (edges_a, edges_b)]
        axes = normals + [np.cross(e, f) for e in edges_a for f in edges_b]
        directions = [sign * axis / np.linalg.norm(axis) for axis in axes for sign in (1, -1)]
        meets_further, meets_less_far = (
            [meets_and_margin(a, b + direction * depth * factor)[0] for direction in directions]
            for factor in (1.001, 0.999)
        )
        assert not all(meets_further)
        assert all(meets_less_far)


@pytest.mark.parametrize("reach", [0.0, 0.003, 0.05, 2.0], ids="{} m".format)
def test_near_face_pairs_are_complete(reach):
    """12 faces beside 15 others, all within 0.2 m: no pair that meets or is at most ``reach`` apart is left out.

    Pairs are left out at all where the reach is less than 2 m.
    """
    rng = np.random.default_rng(3)
    first, second = rng.random((12, 3, 3)) * 0.1, rng.random((15, 3, 3)) * 0.1 + [0.1, 0, 0]
    meets, gap = triangle_margins(np.array([[a, b] for a in first for b in second]))
    within_reach = np.argwhere((meets | (gap <= reach)).reshape(12, 15)).tolist()
    near = near_faces(first, second, reach).tolist()
    assert within_reach or reach < 0.05
    assert all(pair in near for pair in within_reach)
    assert (len(near) < 12 * 15) == (reach < 2.0)


@pytest.mark.sampled(3)
@pytest.mark.parametrize("family", MODERATE_FAMILIES, ids=lambda family: family.name)
def test_margin_of_triangle_pairs_lies_within_its_bounds(family):
    """The margin is how far a triangle must be moved to meet the other, or to part from it.

    ``overlap_bounds`` bounds the depth of pairs that meet from both sides, and the gap of others from below.
    """
    pairs = family.pairs(120, seed=9)
    meets, margin = triangle_margins(pairs)
    least_depth, most_depth, least_gap = overlap_bounds(pairs)
    assert (least_depth[meets] <= margin[meets]).all()
    assert (margin[meets] <= most_depth[meets]).all()
    assert (least_gap[~meets] <= margin[~meets]).all()


def certainly_farther_than(first, second, distances):
    """Whether two triangles that stand unmoved are certainly farther from each other than each of some distances."""
    trees = build_box_trees([np.array([corners], dtype=float) for corners in (first, second)])
    pose = np.tile(np.eye(3), (len(distances), 1, 1)), np.zeros((len(distances), 3))
    return ClearanceSearch(*trees).separated(pose, pose, distances).tolist()


def test_gap_is_exact_for_every_kind_of_nearest_feature():
    """Pairs of triangles that do not meet: random, nearly parallel 1 m apart, with a point and with a line as triangle.

    They are farther apart than their gap less a billionth, and not farther than their gap and a billionth.
    """
    rng = np.random.default_rng(5)
    random, flat = rng.normal(size=(20, 2, 3, 3)), rng.normal(size=(20, 2, 3, 3)) * [1, 1, 0.01]
    nearly_parallel = flat + np.array([[[0, 0, 0]], [[0, 0, 1]]])
    point, line = rng.normal(size=3), [[-1, 0.5, 1], [2, 0.5, 1], [-1, 0.5, 1]]
    pairs = np.concatenate([random, nearly_parallel, [[FLOOR, [point, point, point]], [FLOOR, line]]])
    meets, gaps = triangle_margins(pairs)
    assert (~meets).sum() > 30
    for (first, second), gap in zip(pairs[~meets], gaps[~meets], strict=True):
        assert certainly_farther_than(first, second, gap * np.array([1 - 1e-9, 1 + 1e-9])) == [True, False]


def can_be_parted(first, second, step, rotation=None, shift=(0, 0, 0)):
    """Whether moves of their surfaces by ``step`` part two meshes that meet, the first shifted, in a rotated world."""
    rotation = np.eye(3) if rotation is None else rotation
    a, b = (mesh.triangles @ rotation.T for mesh in (first, second))
    a = a + rotation @ np.array(shift)
    meeting = meeting_faces_exhaustive(a, b)
    assert len(meeting), "they meet"
    shells = [shell_vectors(mesh.triangles, mesh.faces) @ rotation.T for mesh in (first, second)]
    return can_be_separated(a, b, *shells, meeting, step)


@pytest.mark.parametrize("fraction", [0.5, 0.9, 0.999, 1.001, 1.1, 2.0])
@pytest.mark.parametrize("axis", [0, 1, 2], ids=["x", "y, rotated", "z, rotated"])
def test_flush_cubes_separate_by_their_depth(axis, fraction):
    """Two cubes of 1 m, 1/1024 m deep in each other along an axis: a step of at least that depth parts them."""
    depth = 2.0**-10
    rotation = random_rotations(np.random.default_rng(axis)) if axis else None
    shift = np.roll([1 - depth, 0, 0], axis)
    assert can_be_parted(box_mesh(), box_mesh(), fraction * depth, rotation, shift) == (fraction >= 1.0)


def test_flush_cubes_separate_by_exactly_their_depth():
    """Two cubes of 1 m, 1/1024 m deep in each other along x, unrotated, where no coordinate is rounded."""
    depth = 2.0**-10
    assert can_be_parted(box_mesh(), box_mesh(), depth, shift=(1 - depth, 0, 0))


@pytest.mark.parametrize(("step", "free"), [(0.99e-3, False), (1.01e-3, True)])
def test_oversized_plug_needs_a_step_of_its_oversize(step, free):
    """A plug of 1.002 m in a hole of 1 m, between eight cubes, overlaps by 1 mm at every side."""
    hole = merge_meshes(*(box_mesh((1, 1, 1), [x, y, 0]) for x in (-1, 0, 1) for y in (-1, 0, 1) if x or y))
    assert can_be_parted(box_mesh((1.002, 1.002, 3)), hole, step) == free


@pytest.mark.parametrize(("depth", "free"), [(0.99e-3, True), (1.01e-3, False)])
def test_tool_leaves_an_inconsistently_wound_sheet_along_the_normal(depth, free):
    """A cube of 1 m stands ``depth`` metres deep in a sheet at a height of 1 m; every other face is wound the other
    way.

    A step of 1 mm moves faces wound both ways both ways at once: only a shift of the whole tool frees it.
    """
    faces = [box_mesh().triangles.copy(), grid_plate() + np.array([0, 0, 1])]
    for triangles in faces:
        triangles[::2] = triangles[::2, ::-1]
    tool, sheet = (body.mesh for body in bodies_of(faces))
    rotation, half_of_the_tool = random_rotations(np.random.default_rng(2)), 0.5
    shift = (2.6, 2.7, 1 + half_of_the_tool - depth)
    assert can_be_parted(tool, sheet, step=1e-3, rotation=rotation, shift=shift) == free


def test_cube_corners_move_every_face_by_1():
    """The shell vector of a cube's corner leads 1 along the normal of each of its three faces: it is root of 3 long."""
    mesh = box_mesh()
    shell = shell_vectors(mesh.triangles, mesh.faces)
    a, b, c = np.moveaxis(mesh.triangles, 1, 0)
    normals = unit(np.cross(b - a, c - a))
    assert np.allclose(np.einsum("fck,fk->fc", shell, normals), 1.0)
    assert np.allclose(np.linalg.norm(shell, axis=2), np.sqrt(3))
