import tomllib
from pathlib import Path

import numpy as np
import pytest
from support.shapes import beaker_mesh, random_rotations, rod_mesh, unrotated_motion

from cdcore import Motion, TriangleMesh
from cdcore.narrow.bvh.box_tree import build_box_trees
from cdcore.narrow.continuous.clearance import ClearanceSearch, ContactOffset
from cdcore.narrow.fcl_meshes import FclMeshes

CLEARANCES = tomllib.loads(Path(__file__).parents[1].joinpath("clearances.toml").read_text("utf-8"))["clearance"]
"""Rows of a triangle ``second`` and its ``distance`` from FLOOR, computed by hand."""
FLOOR = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]])
AT_ORIGIN = np.eye(3)[None], np.zeros((1, 3))
"""A rotation and a position, in a single frame."""


def gaps_by_fcl(meshes, rotations, positions):
    """Distances of two meshes by FCL at poses (K, 2, 3, 3), (K, 2, 3); 0 where they meet."""
    fcl, gaps = FclMeshes(meshes), np.zeros(len(positions))
    for k in range(len(positions)):
        for body in (0, 1):
            fcl.set_pose(body, rotations[k, body], positions[k, body])
        if not fcl.touch(0, 1):
            gaps[k], *_ = fcl.gap(0, 1)
    return gaps


@pytest.mark.parametrize("reach", [0.002, 0.02], ids="{} m".format)
@pytest.mark.parametrize("pair", [[0, 1], [1, 0]], ids=["beaker first", "rod first"])
def test_near_agrees_with_fcl_distance_also_on_repeated_poses(reach, pair):
    """A beaker and a rod in 200 frames of random poses, every third of which repeats that of the frame before.

    In frames in which they do not meet they are near up to a distance of ``reach``.
    """
    count, rng = 200, np.random.default_rng(1)
    meshes = [beaker_mesh(), rod_mesh()]
    positions, rotations = rng.normal(size=(count, 2, 3)) * 0.04, random_rotations(rng, count, 2)
    positions[1::3], rotations[1::3] = positions[0::3], rotations[0::3]
    motion = Motion(np.arange(count) / 90, positions, rotations)
    gaps = gaps_by_fcl(meshes, rotations, positions)
    frames = np.flatnonzero(gaps > 0)
    trees = build_box_trees([mesh.triangles for mesh in meshes])
    near = ContactOffset(trees, np.array([pair]), reach).near(motion, frames, 0 * frames)
    assert near.tolist() == (gaps[frames] <= reach).tolist()
    assert 2 < near.sum() < len(frames)
    assert len(frames) > 30


@pytest.mark.parametrize(("reach", "is_near"), [(0.14, False), (0.15, True)])
def test_coplanar_faces_are_separated_within_their_plane(reach, is_near):
    """Two halves of a square in one plane, moved apart along its diagonal: 0.2 / sqrt(2) = 0.141 m between their edges.

    The normals of both faces lead out of the plane, and the boxes overlap: neither keeps them apart.
    """
    half = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]])
    other_half = np.array([1.1, 1.1, 0]) - half
    motion, frame = unrotated_motion(np.zeros((1, 2, 3))), np.zeros(1, dtype=np.int64)
    offset = ContactOffset(build_box_trees([half, other_half]), np.array([[0, 1]]), reach)
    assert offset.near(motion, frame, frame).tolist() == [is_near]


def certainly_farther_than(first, second, distance):
    """Whether two sets of triangles, at their own coordinates, are certainly more than ``distance`` metres apart."""
    search = ClearanceSearch(*build_box_trees([first, second]))
    return bool(search.separated(AT_ORIGIN, AT_ORIGIN, np.array([distance])).item())


@pytest.mark.parametrize("scale", [1.0, 2.0**300])
@pytest.mark.parametrize("row", CLEARANCES, ids=lambda row: row["of"])
def test_distance_of_two_faces_is_that_of_their_nearest_features(row, scale):
    """FLOOR, (0, 0, 0), (1, 0, 0), (0, 1, 0), and another triangle: farther than their distance less a billionth.

    They are not farther than a billionth more. At 2^300 m squares of coordinates overflow.
    """
    floor, other = FLOOR * scale, np.array([row["second"]], dtype=float) * scale
    a_little_less, a_little_more = row["distance"] * (1 - 1e-9) * scale, row["distance"] * (1 + 1e-9) * scale
    for first, second in ((floor, other), (other, floor)):
        assert certainly_farther_than(first, second, a_little_less)
        assert not certainly_farther_than(first, second, a_little_more)


def test_distance_of_two_faces_agrees_with_fcl():
    """Two triangles at 300 random poses: where they do not meet they are farther apart than 1e-6 less than FCL's gap.

    They are nowhere farther apart than 1e-6 more.
    """
    count, rng = 300, np.random.default_rng(3)
    meshes = [TriangleMesh(rng.normal(size=(3, 3)), [[0, 1, 2]]) for _ in range(2)]
    rotations, positions = random_rotations(rng, count, 2), rng.normal(size=(count, 2, 3)) * 1.5
    gaps = gaps_by_fcl(meshes, rotations, positions)
    assert 150 < (gaps > 0.0).sum() < count
    search = ClearanceSearch(*build_box_trees([mesh.triangles for mesh in meshes]))
    poses = [(rotations[:, body], positions[:, body]) for body in (0, 1)]
    assert search.separated(*poses, gaps * (1 - 1e-6)).tolist() == (gaps > 0.0).tolist()
    assert not search.separated(*poses, gaps * (1 + 1e-6)).any()
