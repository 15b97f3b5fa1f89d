"""FCL's answers are complete, face pairs unique and sorted, and nothing that crashes it can reach it."""

import numpy as np
import pytest
from support.shapes import ball_mesh, random_rotations, rod_mesh

from cdcore import TriangleMesh
from cdcore.narrow.brute_force import meeting_faces_placed
from cdcore.narrow.fcl_meshes import TREES, FclMeshes
from replay.studies.stress.solids import box_mesh  # equal meshes, not one that tests share


def two_random_poses(seed, spread):
    """Two rotations, each with a translation of ``spread`` metres or so."""
    rng = np.random.default_rng(seed)
    return (random_rotations(rng), rng.normal(size=3) * spread), (random_rotations(rng), rng.normal(size=3) * spread)


@pytest.mark.parametrize("seed", range(12))
def test_fcl_face_pairs_equal_an_exhaustive_exact_test(seed):
    """A ball and a box in random poses, some 0.35 m from each other; ``set_pose`` places a mesh by its number."""
    ball, box = ball_mesh(0.5, rings=6, sides=9), box_mesh((0.9, 0.7, 0.3))
    ball_pose, box_pose = two_random_poses(seed, spread=0.35)
    meshes = FclMeshes([ball, box])
    meshes.set_pose(0, *ball_pose)
    meshes.set_pose(1, *box_pose)
    expected = meeting_faces_placed(ball.triangles, ball_pose, box.triangles, box_pose).tolist()
    assert meshes.faces(0, 1).tolist() == expected
    assert meshes.touch(0, 1) == bool(expected)


def test_a_hundred_thousand_face_pairs_are_not_cut_off():
    """400 walls across x and 300 across y, all from 0.1 to 0.9: each of the ones crosses each of the others."""

    def walls(count, axis):
        corners = np.zeros((count, 3, 3))
        corners[:, :, axis] = np.linspace(0.1, 0.9, count)[:, None]
        corners[:, 1, (axis + 1) % 3], corners[:, 2, (axis + 2) % 3] = 10, 10
        corners[:, 0, [(axis + 1) % 3, (axis + 2) % 3]] = -10
        return TriangleMesh(corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))

    across_x, across_y = walls(400, axis=0), walls(300, axis=1)
    assert len(FclMeshes([across_x, across_y]).faces(0, 1)) == 400 * 300


def test_poses_in_bulk_answer_as_single_poses():
    """Forty random poses of a rod and a ball, in some of which they touch."""
    rng, count = np.random.default_rng(0), 40
    rotations, positions = random_rotations(rng, count, 2), rng.normal(size=(count, 2, 3)) * 0.2
    rod, ball = 0, 1
    meshes = FclMeshes([rod_mesh(radius=0.02, length=0.5), ball_mesh(0.2, rings=6, sides=10)])
    poses = [(rotations[:, body], positions[:, body]) for body in (rod, ball)]
    touches, faces = (meshes.at_poses(query, rod, ball, *poses) for query in (meshes.touch, meshes.faces))
    assert 3 < sum(touches) < count - 3
    for k in range(count):
        for body in (rod, ball):
            meshes.set_pose(body, rotations[k, body], positions[k, body])
        assert meshes.touch(rod, ball) == touches[k], k
        assert meshes.faces(rod, ball).tolist() == faces[k].tolist(), k


def test_ball_wholly_inside_a_box_has_no_meeting_faces():
    """A ball of radius 0.1 m in the middle of a box of 1 m."""
    meshes = FclMeshes([ball_mesh(0.1), box_mesh()])
    assert not meshes.touch(0, 1)
    assert meshes.faces(0, 1).shape == (0, 2)


def test_spike_through_a_tripled_face_meets_all_three():
    """The face is drawn twice, and once more with the other winding."""
    wall = TriangleMesh([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2], [0, 1, 2], [2, 1, 0]])
    spike = TriangleMesh([[0, 0, -1], [0, 0, 1], [0.1, 0, 1]], [[0, 1, 2]])
    assert FclMeshes([wall, spike]).faces(0, 1).tolist() == [[0, 0], [1, 0], [2, 0]]


def test_equal_meshes_use_a_common_tree():
    """Three of four boxes are equal, one of them in other ``FclMeshes``: two trees."""
    before = len(TREES)
    meshes = FclMeshes([box_mesh((3, 1, 1)), box_mesh((3, 1, 1)), box_mesh((2, 3, 2))])
    others = FclMeshes([box_mesh((3, 1, 1))])
    assert len(TREES) == before + 2
    del meshes, others


def test_equal_meshes_have_poses_of_their_own():
    """Two boxes 3 m long with a common tree: the second is moved by 4 m, away from the first."""
    meshes = FclMeshes([box_mesh((3, 1, 1)), box_mesh((3, 1, 1))])
    assert meshes.touch(0, 1)
    meshes.set_pose(1, np.eye(3), np.array([4.0, 0, 0]))
    assert not meshes.touch(0, 1)


def test_a_tree_outlives_its_detector_and_ends_with_its_mesh():
    """``FclMeshes`` stands for a detector; a run makes one after the other of the same meshes."""
    mesh, before = box_mesh((5, 1, 7)), len(TREES)
    FclMeshes([mesh])
    assert len(TREES) == before + 1
    tree = TREES[mesh.content_hash]
    FclMeshes([mesh])
    assert TREES[mesh.content_hash] is tree
    del mesh, tree
    assert len(TREES) == before
