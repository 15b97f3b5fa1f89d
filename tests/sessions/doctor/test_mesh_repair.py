"""A broken ball becomes the ball again, and every step is named."""

import numpy as np
import pytest
import trimesh

from sessions.doctor.meshes import mesh_findings, repaired_mesh
from sessions.mesh_data import MeshData, has_consistent_winding

BALL = trimesh.creation.icosphere(subdivisions=2, radius=0.1)
"""A ball of 10 cm with 320 faces and 162 vertices."""
FACES = np.array(BALL.faces)


def test_repair_leaves_a_closed_mesh_unchanged():
    """The ball as trimesh makes it has no fault, and no step of repair is named."""
    mesh = MeshData(BALL.vertices, FACES)
    mended, steps = repaired_mesh(mesh)
    assert steps == []
    assert np.array_equal(mended.triangles, mesh.triangles)


@pytest.mark.parametrize(
    ("faces", "step"),
    [
        (FACES[:, ::-1], "320 faces turned to wind outwards"),
        (np.concatenate([FACES, FACES[3:7]]), "4 repeated faces removed"),
        (np.concatenate([FACES, [[0, 1, 1]]]), "1 face without area removed"),
        (np.where(np.arange(320)[:, None] < 60, FACES[:, ::-1], FACES), "60 faces turned to wind outwards"),
        (FACES[1:], "1 hole closed"),
        (np.delete(FACES, [0, 200], axis=0), "2 holes closed"),
    ],
)
def test_each_fault_is_mended_and_named(faces, step):
    """Faces of the ball are reversed, repeated, added without area, or lost, and one step of repair is named.

    Then no fault is left, and the volume is the ball's within 2 %: a hole of one of 320 faces is closed flat.
    """
    mended, steps = repaired_mesh(MeshData(BALL.vertices, faces))
    assert steps == [step]
    assert has_consistent_winding(mended)
    assert [*mesh_findings("ball", mended)] == []
    assert mended.volume == pytest.approx(BALL.volume, rel=0.02)


def test_split_vertices_are_joined():
    """All 320 faces of the ball have corners of their own, 960 at 162 places: 960 - 162 = 798 are joined to another."""
    split = MeshData(BALL.triangles.reshape(-1, 3), np.arange(960).reshape(-1, 3))
    mended, steps = repaired_mesh(split)
    assert steps == ["798 vertices at the place of another joined"]
    assert has_consistent_winding(mended)


def test_closed_solids_that_touch_are_not_joined():
    """A cube of 1 m and one 1 m further along X and Y have an edge in common, with vertices of their own: no repair."""
    cube = trimesh.creation.box((1, 1, 1))
    vertices = np.concatenate([cube.vertices, np.add(cube.vertices, [1, 1, 0])])
    two_cubes = MeshData(vertices, np.concatenate([cube.faces, cube.faces + len(cube.vertices)]))
    _mended, steps = repaired_mesh(two_cubes)
    assert steps == []


def test_a_face_by_itself_stays():
    """A triangle with an area is open, and has no hole that could be closed."""
    single = MeshData([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    mended, steps = repaired_mesh(single)
    assert np.array_equal(mended.triangles, single.triangles)
    assert steps == []


def test_mesh_of_flat_faces_alone_stays():
    """The corners of the only triangle are on a line: without it nothing would be left."""
    flat = MeshData([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]])
    mended, steps = repaired_mesh(flat)
    assert mended is flat
    assert steps == ["nothing is left of it without its flat faces; it stays as it was"]


def test_a_rim_that_touches_itself_is_two_holes():
    """A flat grid of 3 by 3 squares lacks a corner and the middle, which share a point.

    The middle and the outer rim, which touch in that point, are the two holes.
    """
    vertices = np.array([[x, y, 0.0] for y in range(4) for x in range(4)])
    squares = [(x, y) for y in range(3) for x in range(3) if (x, y) not in ((0, 0), (1, 1))]
    faces = []
    for x, y in squares:
        first = 4 * y + x  # its corners are this, the next, and those four further, in the next line
        faces += [(first, first + 1, first + 5), (first, first + 5, first + 4)]
    mended, steps = repaired_mesh(MeshData(vertices, faces))
    first_step, *_others = steps
    assert first_step == "2 holes closed"
    assert has_consistent_winding(mended)
