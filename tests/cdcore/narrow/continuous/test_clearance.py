import numpy as np
import pytest
from support.shapes import beaker_mesh, random_rotations, rod_mesh

from cdcore import Motion
from cdcore.narrow.bvh.box_tree import build_box_trees
from cdcore.narrow.continuous.clearance import ContactOffset
from cdcore.narrow.fcl_meshes import FclMeshes

FRAMES = 200
"""Of the second of two unit cubes on the X axis: the gap is 1 less."""


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
    """Halves of a square a little apart: the normals of both planes lead out of it, and the boxes overlap."""
    half = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]])
    trees = build_box_trees([half, np.array([1.1, 1.1, 0]) - half])
    motion, frame = Motion([0.0], np.zeros((1, 2, 3)), np.tile(np.eye(3), (1, 2, 1, 1))), np.zeros(1, dtype=np.int64)
    for reach, near in ((0.14, False), (0.15, True)):
        assert ContactOffset(trees, np.array([[0, 1]]), reach).near(motion, frame, frame).tolist() == [near]
