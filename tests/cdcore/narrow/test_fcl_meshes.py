"""FCL's answers are complete, face pairs unique and sorted, and nothing that crashes it can reach it."""

import numpy as np
import pytest
from support.shapes import ball_mesh, box_mesh, random_rotations, rod_mesh

from cdcore import TriangleMesh
from cdcore.narrow.brute_force import meeting_faces_placed
from cdcore.narrow.fcl_meshes import TREES, FclMeshes


def two_random_poses(seed, spread):
    """Two rotations, each with a translation of ``spread`` metres or so."""
    rng = np.random.default_rng(seed)
    return (random_rotations(rng), rng.normal(size=3) * spread), (random_rotations(rng), rng.normal(size=3) * spread)


@pytest.mark.parametrize("seed", range(12))
def test_fcl_face_pairs_equal_an_exhaustive_exact_test(seed):
    """A ball and a box in random poses, some 0.35 m from each other."""
    meshes = [ball_mesh(0.5, rings=6, sides=9), box_mesh((0.9, 0.7, 0.3))]
    pose_a, pose_b = two_random_poses(seed, spread=0.35)
    pairs = FclMeshes(meshes)
    pairs.set_pose(0, *pose_a)
    pairs.set_pose(1, *pose_b)
    expected = meeting_faces_placed(meshes[0].triangles, pose_a, meshes[1].triangles, pose_b).tolist()
    assert pairs.faces(0, 1).tolist() == expected
    assert pairs.touch(0, 1) == bool(expected)


def test_a_hundred_thousand_face_pairs_are_not_cut_off():
    """Every one of 400 walls through one line meets every one of 300 through another: 120,000 pairs."""

    def walls(count, axis):
        corners = np.zeros((count, 3, 3))
        corners[:, :, axis] = np.linspace(0.1, 0.9, count)[:, None]
        corners[:, 1, (axis + 1) % 3], corners[:, 2, (axis + 2) % 3] = 10, 10
        corners[:, 0, [(axis + 1) % 3, (axis + 2) % 3]] = -10
        return TriangleMesh(corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))

    pairs = FclMeshes([walls(400, 0), walls(300, 1)])
    assert len(pairs.faces(0, 1)) == 400 * 300


def test_poses_in_bulk_answer_as_single_poses():
    """Forty random poses of a rod and a ball, in some of which they touch."""
    rng = np.random.default_rng(0)
    rotations, positions = random_rotations(rng, 40, 2), rng.normal(size=(40, 2, 3)) * 0.2
    meshes = FclMeshes([rod_mesh(radius=0.02, length=0.5), ball_mesh(0.2, rings=6, sides=10)])
    sequence = [(rotations[:, k], positions[:, k]) for k in range(2)]
    hits, answer = (meshes.at_poses(ask, 0, 1, *sequence) for ask in (meshes.touch, meshes.faces))
    for k in range(40):
        meshes.set_pose(0, rotations[k, 0], positions[k, 0])
        meshes.set_pose(1, rotations[k, 1], positions[k, 1])
        assert meshes.touch(0, 1) == hits[k]
        assert meshes.faces(0, 1).tolist() == answer[k].tolist()
    assert 3 < sum(hits) < 37


def test_ball_wholly_inside_a_box_has_no_meeting_faces():
    """A ball of 0.1 m in a box of 1 m."""
    pairs = FclMeshes([ball_mesh(0.1), box_mesh()])
    assert not pairs.touch(0, 1)
    assert pairs.faces(0, 1).shape == (0, 2)


def test_spike_through_a_tripled_face_meets_all_three():
    """The face is drawn twice, and once more with the other winding."""
    wall = TriangleMesh([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2], [0, 1, 2], [2, 1, 0]])
    spike = TriangleMesh([[0, 0, -1], [0, 0, 1], [0.1, 0, 1]], [[0, 1, 2]])
    assert FclMeshes([wall, spike]).faces(0, 1).tolist() == [[0, 0], [1, 0], [2, 0]]


def test_equal_meshes_use_a_common_tree_and_can_be_separate():
    """Four boxes of two sizes have two trees; a pose of one box does not move the other that has its tree."""
    before = len(TREES)
    pairs = FclMeshes([box_mesh((3, 1, 1)), box_mesh((3, 1, 1)), box_mesh((2, 3, 2))])
    other = FclMeshes([box_mesh((3, 1, 1))])
    assert len(TREES) == before + 2 and other.touch(0, 0)
    assert pairs.touch(0, 1)
    pairs.set_pose(1, np.eye(3), np.array([4.0, 0, 0]))
    assert not pairs.touch(0, 1)


def test_a_tree_outlives_its_detector_and_ends_with_its_mesh():
    """Detectors of a run are made one after the other of the same meshes."""
    mesh, before = box_mesh((5, 1, 7)), len(TREES)
    FclMeshes([mesh])
    assert len(TREES) == before + 1
    tree = TREES[mesh.content_hash]
    FclMeshes([mesh])
    assert TREES[mesh.content_hash] is tree
    del mesh, tree
    assert len(TREES) == before
