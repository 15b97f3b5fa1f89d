"""Edges and shading of meshes as pictures draw them."""

import numpy as np
import pytest
from support.shapes import box_mesh

from cdcore import TriangleMesh
from replay.show.drawn_mesh import bend_cosines, edges_of, face_normals, shaded_mesh, spans_hollow

BOX = box_mesh((1.0, 2.0, 3.0))


def test_both_faces_of_an_edge_hold_its_two_ends():
    """A closed mesh of 12 triangles has 12 * 3 / 2 edges."""
    edges, faces = edges_of(BOX)
    assert len(edges) == 18 and (faces[:, 0] != faces[:, 1]).all()
    for ends, pair in zip(edges.tolist(), faces.tolist(), strict=True):
        for face in pair:
            assert all(end in BOX.triangles[face].tolist() for end in ends)


def test_edges_without_two_faces_are_left_out():
    """Three triangles share the edge from 0 to 1, two of them the edge from 0 to 2."""
    points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]]
    mesh = TriangleMesh(points, [[0, 1, 2], [1, 0, 3], [0, 1, 4], [2, 0, 4]])
    edges, faces = edges_of(mesh)
    assert sorted(map(sorted, faces.tolist())) == [[0, 3], [2, 3]]
    assert {max(map(tuple, edge)) for edge in edges.tolist()} == {(0.0, 1.0, 0.0), (0.0, 0.0, 1.0)}


def test_faces_of_a_box_meet_flat_or_at_right_angles():
    """Six edges are diagonals of flat sides, twelve are those of the box."""
    cosines = bend_cosines(face_normals(BOX.triangles)[1], edges_of(BOX)[1])
    assert np.sort(cosines) == pytest.approx([0.0] * 12 + [1.0] * 6)


def test_shading_of_a_box_is_flat_on_every_side():
    """Each of six sides has four corners of its own, with the normal of the side."""
    vertices, normals, faces = shaded_mesh(BOX)
    assert len(vertices) == 6 * 4 and vertices[faces].tolist() == BOX.triangles.tolist()
    for triangle, corner_normals in zip(vertices[faces], normals[faces], strict=True):
        side_normal = np.cross(triangle[1] - triangle[0], triangle[2] - triangle[0])
        assert corner_normals == pytest.approx(np.tile(side_normal / np.linalg.norm(side_normal), (3, 1)))


def test_shading_of_a_gentle_edge_has_the_mean_normal():
    """Two equal triangles that rise 0.1 from their common edge: in the mean they face straight up."""
    mesh = TriangleMesh([[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.5, 0.1], [1.0, 0.5, 0.1]], [[0, 1, 2], [1, 0, 3]])
    vertices, normals, _ = shaded_mesh(mesh)
    assert len(vertices) == 4
    shared = vertices[:, 0] == 0.0
    assert normals[shared] == pytest.approx(np.tile([0.0, 0.0, 1.0], (2, 1)))
    assert np.linalg.norm(normals, axis=1) == pytest.approx([1.0] * 4)


def test_only_the_lid_of_a_hull_spans_the_hollow():
    """The mesh lacks the upper side of the hull and has a vertex amid every other edge."""
    is_lid = (BOX.triangles[:, :, 2] == BOX.bounds[1, 2]).all(axis=1)
    open_triangles = BOX.triangles[~is_lid]
    middles = (open_triangles + open_triangles[:, [1, 2, 0]]) / 2
    mesh = TriangleMesh(np.concatenate([BOX.vertices, middles.reshape(-1, 3)]), BOX.faces[~is_lid])
    assert spans_hollow(BOX, mesh).tolist() == is_lid.tolist() and is_lid.sum() == 2
