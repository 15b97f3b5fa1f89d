"""A broken ball becomes the ball again, and every step is named."""

import numpy as np
import pytest
import trimesh

from sessions.doctor.meshes import mesh_findings, repaired_mesh
from sessions.mesh_data import MeshData, has_consistent_winding

BALL = trimesh.creation.icosphere(subdivisions=2, radius=0.1)
FACES = np.array(BALL.faces)


def test_repair_leaves_a_closed_mesh_unchanged():
    """The ball as trimesh makes it."""
    mesh = MeshData(BALL.vertices, FACES)
    mended, done = repaired_mesh(mesh)
    assert done == [] and np.array_equal(mended.triangles, mesh.triangles)


@pytest.mark.parametrize(
    ("faces", "done"),
    [
        (FACES[:, ::-1], ["320 faces turned to wind outwards"]),
        (np.concatenate([FACES, FACES[3:7]]), ["4 repeated faces removed"]),
        (np.concatenate([FACES, [[0, 1, 1]]]), ["1 face without area removed"]),
        (np.where(np.arange(320)[:, None] < 60, FACES[:, ::-1], FACES), ["60 faces turned to wind outwards"]),
        (FACES[1:], ["1 hole closed"]),
        (np.delete(FACES, [0, 200], axis=0), ["2 holes closed"]),
    ],
)
def test_each_fault_is_mended_and_named(faces, done):
    """A ball of 320 faces: reversed, repeated, degenerate and lost ones."""
    mended, note = repaired_mesh(MeshData(BALL.vertices, faces))
    assert note == done and has_consistent_winding(mended)
    assert mended.volume == pytest.approx(BALL.volume, rel=0.02) and not [*mesh_findings("x", mended)]


def test_split_vertices_are_joined_and_touching_components_are_not():
    """The ball's 320 faces have 960 corners at 162 places; the two boxes have an edge in common."""
    soup = MeshData(BALL.triangles.reshape(-1, 3), np.arange(960).reshape(-1, 3))
    mended, note = repaired_mesh(soup)
    assert note == ["798 vertices at the place of another joined"] and has_consistent_winding(mended)
    box = trimesh.creation.box((1, 1, 1))
    two = MeshData(
        np.concatenate([box.vertices, np.add(box.vertices, [1, 1, 0])]), np.concatenate([box.faces, box.faces + 8])
    )
    assert repaired_mesh(two)[1] == []


def test_a_face_by_itself_and_nothing_but_flat_faces_stay():
    """One triangle with an area, and one whose corners are on a line."""
    alone = MeshData([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    assert np.array_equal(repaired_mesh(alone)[0].triangles, alone.triangles) and repaired_mesh(alone)[1] == []
    flat = MeshData([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]])
    assert repaired_mesh(flat) == (flat, ["nothing is left of it without its flat faces; it stays as it was"])


def test_a_rim_that_touches_itself_is_two_holes():
    """Squares on a grid of three by three, but for a corner and the middle, which share a point.

    The middle and the outer rim, which touch in that point, are the two holes.
    """
    grid = np.array([[x, y, 0.0] for y in range(4) for x in range(4)])
    cells = [(x, y) for y in range(3) for x in range(3) if (x, y) not in ((0, 0), (1, 1))]
    faces = [(k, k + a, k + b) for x, y in cells for k in [4 * y + x] for a, b in ((1, 5), (5, 4))]
    mended, note = repaired_mesh(MeshData(grid, faces))
    assert note[0] == "2 holes closed" and has_consistent_winding(mended)
