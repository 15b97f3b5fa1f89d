"""Surfaces come apart by a step that is as long as they are deep, and by none that is shorter."""

import numpy as np
import pytest
from support.shapes import ball_mesh, box_mesh, merged, random_rotations

from cdcore.narrow.brute_force import meeting_faces_exhaustive
from cdcore.narrow.margins.separating_moves import come_apart, shell_vectors, unit


def freed(first, second, step, turn=None, shift=(0, 0, 0)):
    """Whether two meshes, the first shifted, both in a turned world, come apart."""
    turn = np.eye(3) if turn is None else turn
    a, b = (mesh.triangles @ turn.T for mesh in (first, second))
    a = a + turn @ np.array(shift)
    meeting = meeting_faces_exhaustive(a, b)
    assert len(meeting), "they meet"
    shells = [shell_vectors(mesh.triangles, mesh.faces) @ turn.T for mesh in (first, second)]
    return come_apart(a, b, *shells, meeting, step)


@pytest.mark.parametrize("share", [0.5, 0.9, 0.999, 1.0, 1.001, 1.1, 2.0])
@pytest.mark.parametrize("seed", range(3))
def test_flush_cubes_come_apart_by_a_step_of_their_depth_and_no_shorter_one(seed, share):
    turn = random_rotations(np.random.default_rng(seed), 1)[0] if seed else None
    shift = np.roll([1 - 2.0**-10, 0, 0], seed)
    if share != 1.0 or turn is None:  # turned places round by more than nothing
        assert freed(box_mesh(), box_mesh(), share * 2.0**-10, turn, shift) == (share >= 1.0)


@pytest.mark.parametrize(("step", "free"), [(0.99e-3, False), (1.01e-3, True)])
def test_a_plug_too_large_for_its_hole_on_all_sides_needs_the_step_it_is_too_large_by(step, free):
    hole = merged(*(box_mesh((1, 1, 1), [x, y, 0]) for x in (-1, 0, 1) for y in (-1, 0, 1) if x or y))
    assert freed(box_mesh((1.002, 1.002, 3)), hole, step) == free


def test_a_ball_leaves_a_wall_by_the_depth_of_its_corner():
    assert freed(ball_mesh(0.5), box_mesh(), 1.01e-3, shift=(1 - 1e-3, 0.2, 0.1))
    assert not freed(ball_mesh(0.5), box_mesh(), 0.9e-3, shift=(1 - 1e-3, 0.0, 0.0))


def test_the_corners_of_a_cube_move_every_face_by_one():
    mesh = box_mesh()
    shell = shell_vectors(mesh.triangles, mesh.faces)
    normal = unit(np.cross(mesh.triangles[:, 1] - mesh.triangles[:, 0], mesh.triangles[:, 2] - mesh.triangles[:, 0]))
    assert np.allclose(np.einsum("fck,fk->fc", shell, normal), 1.0)
    assert np.allclose(np.linalg.norm(shell, axis=2), np.sqrt(3))


def test_corners_of_faces_without_area_stay():
    triangles = np.array([[[0, 0, 0], [1, 0, 0], [2, 0, 0]]], dtype=float)
    assert not shell_vectors(triangles, np.array([[0, 1, 2]])).any()


def test_a_spike_moves_by_a_bounded_length():
    triangles = np.array([[[0, 0, 0], [1, 0, 1e-3], [1, 1, 0]], [[0, 0, 0], [1, 1, 0], [1, 0, -1e-3]]])
    assert np.linalg.norm(shell_vectors(triangles, np.array([[0, 1, 2], [0, 2, 3]])), axis=2).max() <= 3.0 + 1e-9
