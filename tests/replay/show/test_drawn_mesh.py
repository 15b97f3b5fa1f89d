"""Edges and shading of meshes as pictures draw them."""

import numpy as np
import pytest
from support.shapes import box_mesh

from cdcore import TriangleMesh
from replay.show.drawn_mesh import bend_cosines, edges_of, face_normals, shaded_mesh, spans_hollow

BOX = box_mesh((1.0, 2.0, 3.0))


def test_both_faces_of_an_edge_hold_its_two_ends():
    """``BOX`` is a closed mesh of 12 triangles; each edge belongs to two of them, so there are 12 * 3 / 2 = 18."""
    edges, faces = edges_of(BOX)
    assert len(edges) == 18
    assert (faces[:, 0] != faces[:, 1]).all()
    for ends, pair in zip(edges.tolist(), faces.tolist(), strict=True):
        for face in pair:
            assert all(end in BOX.triangles[face].tolist() for end in ends)


def test_edges_without_two_faces_are_left_out():
    """Four triangles: edge 0-1 has three of them, edges 0-2 and 0-4 have two each, all others a single one."""
    point_2, point_4 = (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
    points = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), point_2, (0.0, -1.0, 0.0), point_4]
    mesh = TriangleMesh(points, [[0, 1, 2], [1, 0, 3], [0, 1, 4], [2, 0, 4]])
    edges, faces = edges_of(mesh)
    triangles_of_edge = {
        max(map(tuple, ends)): sorted(pair) for ends, pair in zip(edges.tolist(), faces.tolist(), strict=True)
    }  # the first end, point 0, is the origin, so the greater end is the other one
    assert triangles_of_edge == {point_2: [0, 3], point_4: [2, 3]}


def test_faces_of_a_box_meet_flat_or_at_right_angles():
    """A box's mesh has 18 edges: 12 of the box (cosine 0) and 6 diagonals of its sides (cosine 1)."""
    _, unit_normals = face_normals(BOX.triangles)
    _, faces_of_edge = edges_of(BOX)
    assert np.sort(bend_cosines(unit_normals, faces_of_edge)) == pytest.approx([0.0] * 12 + [1.0] * 6)


def test_shading_of_a_box_is_flat_on_every_side():
    """Each of six sides has four vertices of its own, with the normal of the side; triangles stay where they are."""
    vertices, normals, faces = shaded_mesh(BOX)
    assert len(vertices) == 6 * 4
    assert vertices[faces].tolist() == BOX.triangles.tolist()
    for triangle, corner_normals in zip(vertices[faces], normals[faces], strict=True):
        side_normal = np.cross(triangle[1] - triangle[0], triangle[2] - triangle[0])
        assert corner_normals == pytest.approx(np.tile(side_normal / np.linalg.norm(side_normal), (3, 1)))


def test_shading_of_a_gentle_edge_has_the_mean_normal():
    """Two equal triangles, left and right of the edge x = 0, rise by 0.1 over a length of 1 away from it.

    Both corners of the edge are shared, and the mean of the two normals there points straight up (+Z).
    """
    points = [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.5, 0.1], [1.0, 0.5, 0.1]]
    vertices, normals, _ = shaded_mesh(TriangleMesh(points, [[0, 1, 2], [1, 0, 3]]))
    assert len(vertices) == len(points)
    on_edge = vertices[:, 0] == 0.0
    assert normals[on_edge] == pytest.approx(np.tile([0.0, 0.0, 1.0], (2, 1)))
    assert np.linalg.norm(normals, axis=1) == pytest.approx([1.0] * len(points))


def test_only_the_lid_of_a_hull_spans_the_hollow():
    """The mesh is ``BOX`` without its upper side, with a vertex amid each edge; the whole ``BOX`` is its hull.

    A face of the hull spans the hollow if the middle of an edge is far from every vertex of the mesh: the diagonal of
    the upper side, which the mesh lacks.
    """
    is_lid = (BOX.triangles[:, :, 2] == BOX.bounds[1, 2]).all(axis=1)
    open_triangles = BOX.triangles[~is_lid]
    middles = (open_triangles + open_triangles[:, [1, 2, 0]]) / 2
    mesh = TriangleMesh(np.concatenate([BOX.vertices, middles.reshape(-1, 3)]), BOX.faces[~is_lid])
    assert is_lid.sum() == 2
    assert spans_hollow(BOX, mesh).tolist() == is_lid.tolist()
