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
MODERATE_FAMILIES = [f for f in FAMILIES if f.name not in ("products underflow", "products overflow")]
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
    """Above the face it does not meet, below it does; the smallest heights are at the limit of rounding."""
    assert meets_and_margin(FLOOR, corner_at_height(height)) == (False, height)
    assert meets_and_margin(FLOOR, corner_at_height(-height)) == (True, height)
    assert meets_and_margin(corner_at_height(height), FLOOR) == (False, height)


def test_touching_and_coplanar_overlap_have_no_depth():
    """A corner on FLOOR, and a triangle in its plane that overlaps it: both meet, with a margin of 0 m."""
    assert meets_and_margin(FLOOR, corner_at_height(height=0.0)) == (True, 0.0)
    assert meets_and_margin(FLOOR, [[0.1, 0.1, 0], [2, 0, 0], [0, 2, 0]]) == (True, 0.0)


@pytest.mark.parametrize("row", CLEARANCES, ids=lambda row: row["of"])
def test_clearance_is_the_distance_of_the_nearest_features(row):
    """Rows of clearances.toml: a triangle and its distance from FLOOR, by hand."""
    assert meets_and_margin(FLOOR, row["second"]) == (False, pytest.approx(row["distance"], rel=1e-15))


@pytest.mark.slow
def test_moving_by_the_penetration_depth_separates():
    """Along the 11 axes of two triangles: by a thousandth more than the depth some move frees, by less none does."""
    rng = np.random.default_rng(1)
    pairs = rng.random((400, 2, 3, 3))
    meets, depth = triangle_margins(pairs)
    assert meets.sum() > 10
    for pair, deep in zip(pairs[meets], depth[meets], strict=True):
        a, b = pair
        edges = [[t[(k + 1) % 3] - t[k] for k in range(3)] for t in (a, b)]
        axes = [np.cross(e[0], e[1]) for e in edges] + [np.cross(e, f) for e in edges[0] for f in edges[1]]
        axes = [sign * axis / np.linalg.norm(axis) for axis in axes for sign in (1, -1)]
        is_separated = [not meets_and_margin(a, b + axis * deep * 1.001)[0] for axis in axes]
        kept = [meets_and_margin(a, b + axis * deep * 0.999)[0] for axis in axes]
        assert any(is_separated)
        assert all(kept)


@pytest.mark.parametrize("reach", [0.0, 0.003, 0.05, 2.0])
def test_near_face_pairs_are_complete(reach):
    """12 faces beside 15 others, all within 0.2 m; a reach of 2 m takes every pair."""
    rng = np.random.default_rng(3)
    first, second = rng.random((12, 3, 3)) * 0.1, rng.random((15, 3, 3)) * 0.1 + [0.1, 0, 0]
    every = np.array([[a, b] for a in first for b in second])
    meets, distance = triangle_margins(every)
    within = np.argwhere((meets | (distance <= reach)).reshape(12, 15))
    near = near_faces(first, second, reach)
    assert {tuple(row) for row in within} <= {tuple(row) for row in near}
    assert len(near) < 12 * 15 or reach == 2.0


@pytest.mark.sampled(3)
@pytest.mark.parametrize("family", MODERATE_FAMILIES, ids=lambda f: f.name)
def test_margin_of_triangle_pairs_lies_within_its_bounds(family):
    """The margin is how far a pair must be shifted to meet or to part."""
    pairs = family.pairs(120, seed=9)
    meets, margin = triangle_margins(pairs)
    lower, upper, separated = overlap_bounds(pairs)
    assert (lower[meets] <= margin[meets]).all()
    assert (margin[meets] <= upper[meets]).all()
    assert (separated[~meets] <= margin[~meets]).all()


def keep_separate(first, second, reach):
    """Whether two triangles that stand unmoved certainly keep each of some distances."""
    trees = build_box_trees([np.array([corners], dtype=float) for corners in (first, second)])
    pose = np.tile(np.eye(3), (len(reach), 1, 1)), np.zeros((len(reach), 3))
    return ClearanceSearch(*trees).separated(pose, pose, reach).tolist()


def test_gap_is_exact_for_every_kind_of_nearest_feature():
    """Random, nearly parallel, a point and a line as triangles: kept apart to 1e-9 below their distance, not above."""
    rng = np.random.default_rng(5)
    pairs = [
        *rng.normal(size=(60, 2, 3, 3)),
        *(rng.normal(size=(60, 2, 3, 3)) * [1, 1, 0.01] + [[[0] * 3], [[0, 0, 1]]]),
    ]
    point = rng.normal(size=3)
    pairs += [np.array([FLOOR, [point, point, point]]), np.array([FLOOR, [[-1, 0.5, 1], [2, 0.5, 1], [-1, 0.5, 1]]])]
    meets, distance = triangle_margins(np.array(pairs))
    assert (~meets).sum() > 80
    for (first, second), far in zip(np.array(pairs)[~meets], distance[~meets], strict=True):
        assert keep_separate(first, second, far * np.array([1 - 1e-9, 1 + 1e-9])) == [True, False]


def separates_within(first, second, step, rotation=None, shift=(0, 0, 0)):
    """Whether two meshes, the first shifted, both in a turned world, come apart."""
    rotation = np.eye(3) if rotation is None else rotation
    a, b = (mesh.triangles @ rotation.T for mesh in (first, second))
    a = a + rotation @ np.array(shift)
    meeting = meeting_faces_exhaustive(a, b)
    assert len(meeting), "they meet"
    shells = [shell_vectors(mesh.triangles, mesh.faces) @ rotation.T for mesh in (first, second)]
    return can_be_separated(a, b, *shells, meeting, step)


@pytest.mark.parametrize("fraction", [0.5, 0.9, 0.999, 1.0, 1.001, 1.1, 2.0])
@pytest.mark.parametrize("seed", range(3))
def test_flush_cubes_separate_by_exactly_their_depth(seed, fraction):
    """Unit cubes 2**-10 m deep in each other along x, y or z, by ``seed``; the step is ``fraction`` of the depth."""
    rotation = random_rotations(np.random.default_rng(seed), 1)[0] if seed else None
    shift = np.roll([1 - 2.0**-10, 0, 0], seed)
    if fraction != 1.0 or rotation is None:  # turned places round by more than nothing
        assert separates_within(box_mesh(), box_mesh(), fraction * 2.0**-10, rotation, shift) == (fraction >= 1.0)


@pytest.mark.parametrize(("step", "free"), [(0.99e-3, False), (1.01e-3, True)])
def test_oversized_plug_needs_a_step_of_its_oversize(step, free):
    """A plug of 1.002 m in a hole of 1 m overlaps by 1 mm at every side."""
    hole = merge_meshes(*(box_mesh((1, 1, 1), [x, y, 0]) for x in (-1, 0, 1) for y in (-1, 0, 1) if x or y))
    assert separates_within(box_mesh((1.002, 1.002, 3)), hole, step) == free


@pytest.mark.parametrize(("depth", "free"), [(0.99e-3, True), (1.01e-3, False)])
def test_tool_leaves_an_inconsistently_wound_sheet_along_the_normal(depth, free):
    """The tool is ``depth`` metres deep in the sheet, and moves by 1 mm.

    Shells of faces wound both ways go both ways at once: only a shift frees them.
    """
    faces = [box_mesh().triangles.copy(), grid_plate() + np.array([0, 0, 1])]
    for triangles in faces:
        triangles[::2] = triangles[::2, ::-1]
    tool, sheet = (body.mesh for body in bodies_of(faces))
    rotation = random_rotations(np.random.default_rng(2), 1)[0]
    assert separates_within(tool, sheet, step=1e-3, rotation=rotation, shift=(2.6, 2.7, 1.5 - depth)) == free


def test_cube_corners_move_every_face_by_1():
    """The shell vector of a corner, root of 3 long, leads 1 along the normal of each of its faces."""
    mesh = box_mesh()
    shell = shell_vectors(mesh.triangles, mesh.faces)
    normal = unit(np.cross(mesh.triangles[:, 1] - mesh.triangles[:, 0], mesh.triangles[:, 2] - mesh.triangles[:, 0]))
    assert np.allclose(np.einsum("fck,fk->fc", shell, normal), 1.0)
    assert np.allclose(np.linalg.norm(shell, axis=2), np.sqrt(3))
