import tomllib
from pathlib import Path

import numpy as np
import pytest
from support.shapes import beaker_mesh, random_rotations, rod_mesh

from cdcore import Motion, TriangleMesh
from cdcore.narrow.bvh.box_tree import build_box_trees
from cdcore.narrow.continuous.clearance import ClearanceSearch, ContactOffset
from cdcore.narrow.fcl_meshes import FclMeshes

CLEARANCES = tomllib.loads(Path(__file__).parents[1].joinpath("clearances.toml").read_text("utf-8"))["clearance"]
FLOOR = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]])
AT_ORIGIN = np.eye(3)[None], np.zeros((1, 3))

FRAMES = 200
"""Random poses of a beaker and a rod."""


@pytest.mark.parametrize("reach", [0.002, 0.02])
def test_near_agrees_with_fcl_distance_also_on_repeated_poses(reach):
    """Every third pose is repeated; ``reach``: metres within which bodies are near."""
    rng = np.random.default_rng(1)
    meshes = [beaker_mesh(), rod_mesh()]
    positions, rotations = rng.normal(size=(FRAMES, 2, 3)) * 0.04, random_rotations(rng, FRAMES, 2)
    positions[1::3], rotations[1::3] = positions[0::3], rotations[0::3]
    motion = Motion(np.arange(FRAMES) / 90, positions, rotations)
    things, separated = FclMeshes(meshes), np.zeros(FRAMES)
    for frame in range(FRAMES):
        for body in (0, 1):
            things.set_pose(body, rotations[frame, body], positions[frame, body])
        if not things.touch(0, 1):
            separated[frame] = things.gap(0, 1)[0]
    frames = np.flatnonzero(separated > 0)
    trees, columns = build_box_trees([mesh.triangles for mesh in meshes]), np.zeros(len(frames), dtype=np.int64)
    for pairs in ([[0, 1]], [[1, 0]]):
        near = ContactOffset(trees, np.array(pairs), reach).near(motion, frames, columns)
        assert near.tolist() == (separated[frames] <= reach).tolist()
    assert 2 < near.sum() < len(frames) > 30


def test_coplanar_faces_are_separated_within_their_plane():
    """Halves of a square 0.2 / sqrt(2) = 0.141 m apart.

    The normals of both planes lead out of the plane, and the boxes overlap: neither keeps them apart.
    """
    half = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]])
    trees = build_box_trees([half, np.array([1.1, 1.1, 0]) - half])
    motion, frame = Motion([0.0], np.zeros((1, 2, 3)), np.tile(np.eye(3), (1, 2, 1, 1))), np.zeros(1, dtype=np.int64)
    for reach, near in ((0.14, False), (0.15, True)):
        assert ContactOffset(trees, np.array([[0, 1]]), reach).near(motion, frame, frame).tolist() == [near]


def keeps(first, second, reach):
    """Whether two sets of triangles, at their own coordinates, certainly keep more than ``reach`` metres."""
    return ClearanceSearch(*build_box_trees([first, second])).separated(AT_ORIGIN, AT_ORIGIN, np.array([reach]))[0]


@pytest.mark.parametrize("scale", [1.0, 2.0**300])
def test_face_keeps_just_less_than_its_distance_from_another(scale):
    """Rows of clearances.toml: a triangle and its distance from FLOOR, by hand. At 2^300 m squares overflow."""
    for row in CLEARANCES:
        other = np.array([row["second"]], dtype=float)
        for pair in ((FLOOR, other), (other, FLOOR)):
            first, second = (triangles * scale for triangles in pair)
            assert keeps(first, second, row["distance"] * (1 - 1e-9) * scale), row["of"]
            assert not keeps(first, second, row["distance"] * (1 + 1e-9) * scale), row["of"]


def test_two_faces_keep_just_less_than_the_distance_of_fcl():
    """Two triangles at 300 random poses; those that meet are at a distance of 0."""
    rng = np.random.default_rng(3)
    meshes = [TriangleMesh(rng.normal(size=(3, 3)), [[0, 1, 2]]) for _ in range(2)]
    rotations, positions = random_rotations(rng, 300, 2), rng.normal(size=(300, 2, 3)) * 1.5
    fcl, search = FclMeshes(meshes), ClearanceSearch(*build_box_trees([mesh.triangles for mesh in meshes]))
    distances = np.zeros(300)
    for k in range(300):
        for body in (0, 1):
            fcl.set_pose(body, rotations[k, body], positions[k, body])
        if not fcl.touch(0, 1):
            distances[k] = fcl.gap(0, 1)[0]
    poses = [(rotations[:, body], positions[:, body]) for body in (0, 1)]
    assert 150 < (distances > 0.0).sum() < 300
    assert search.separated(*poses, distances * (1 - 1e-6)).tolist() == (distances > 0.0).tolist()
    assert not search.separated(*poses, distances * (1 + 1e-6)).any()
