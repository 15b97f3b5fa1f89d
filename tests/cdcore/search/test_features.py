"""Neighbours of a face are those that trimesh finds: across its edges first, then at its corners."""

import numpy as np
import pytest
import trimesh
from support.search_scenes import ball_of, torus_mesh
from support.shapes import ball_mesh, box_mesh

from cdcore import TriangleMesh
from cdcore.search.features import CORNERS, NEIGHBOURS, RADIUS, features_of, morton_codes


def neighbours(mesh):
    """Face -> its neighbours across edges, and all its neighbours, by the numbers of the mesh."""
    features = features_of(mesh)
    by_edge, every = {}, {}
    for position, row in enumerate(features.near.tolist()):
        known = [int(features.face[other]) for other in row[:NEIGHBOURS] if other >= 0]
        face = int(features.face[position])
        by_edge[face], every[face] = set(known[: row[NEIGHBOURS]]), set(known)
        assert len(every[face]) == len(known)
    return by_edge, every


@pytest.mark.parametrize(
    "mesh",
    [ball_of(faces=320), torus_mesh(major=1.0, minor=0.3, around=20, across=12), box_mesh()],
    ids=["ball", "torus", "box"],
)
def test_neighbours_have_a_common_edge_or_corner(mesh):
    """Neighbours by an edge are those of trimesh; by a corner at most NEIGHBOURS of them."""
    plain = trimesh.Trimesh(mesh.vertices, mesh.faces, process=True, validate=False)
    adjacent = {face: set() for face in range(len(mesh.faces))}
    for first, second in plain.face_adjacency.tolist():
        adjacent[first].add(second)
        adjacent[second].add(first)
    by_edge, every = neighbours(mesh)
    assert by_edge == adjacent
    for face, answer in every.items():
        around = {other for vertex in plain.faces[face] for other in plain.vertex_faces[vertex].tolist()} - {face, -1}
        assert answer <= around
        assert len(answer) == min(len(around), NEIGHBOURS)


@pytest.mark.parametrize("count", [5, 20])
def test_faces_at_a_crowded_edge_are_neighbours(count):
    """``count`` faces share the edge from (0, 0, 0) to (0, 0, 1); at most NEIGHBOURS of the others are kept."""
    angle = 2.0 * np.pi / count * np.arange(count)
    vertices = [[0, 0, 0], [0, 0, 1], *np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)]
    by_edge, _ = neighbours(TriangleMesh(vertices, [[0, 1, 2 + k] for k in range(count)]))
    assert {len(others) for others in by_edge.values()} == {min(count - 1, NEIGHBOURS)}
    assert all(face not in others for face, others in by_edge.items())


def test_degenerate_face_shares_an_edge_only_between_different_corners():
    """Face 0 is the edge from corner 0 to 1, which face 2 has too; face 1 has corner 0 only."""
    corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    by_edge, _ = neighbours(TriangleMesh(corners, [[0, 0, 1], [0, 0, 2], [0, 1, 3]]))
    assert by_edge == {0: {2}, 1: set(), 2: {0}}


def test_points_along_a_diagonal_are_numbered_in_their_order():
    """1,024 points (k, k, k): a Morton code has ten bits for each coordinate."""
    assert (np.diff(morton_codes(np.arange(1024.0)[:, None] * np.ones(3))) > 0).all()


def test_bits_of_three_coordinates_alternate_in_a_morton_code():
    """Ten bits of x, y and z in turn, lowest first; 0 is the lower corner of the box of all points, 1023 the upper."""
    points = np.array([[5.0, 7.0, 9.0], [6.0, 8.0, 10.0], [5.0, 7.0, 10.0], [5.5, 7.0, 9.0]])
    every_third_bit = sum(8**bit for bit in range(10))
    assert morton_codes(points).tolist() == [0, 2**30 - 1, 4 * every_third_bit, 8**9]


def test_the_ball_around_a_face_holds_its_corners():
    """A row has centroid, radius and corners of a face; ``size``: no corner is farther from the origin."""
    features = features_of(ball_mesh(3.0, rings=12, sides=17))
    corners = features.rows[:, CORNERS:].reshape(-1, 3, 3)
    far = np.linalg.norm(corners - features.rows[:, None, :RADIUS], axis=2).max(axis=1)
    assert (far <= features.rows[:, RADIUS]).all()
    assert np.linalg.norm(corners, axis=2).max() <= features.size


def test_duplicate_vertices_merge_and_faces_of_large_fans_have_neighbours():
    """A torus whose faces share no vertex, and a fan of 3,000 faces round one vertex."""
    free = TriangleMesh(torus_mesh().triangles.reshape(-1, 3), np.arange(4800).reshape(-1, 3))
    assert np.array_equal(features_of(free).near, features_of(torus_mesh()).near)
    angle = np.linspace(0, 2 * np.pi, 3001)
    rim = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(3001)])
    fan = TriangleMesh(np.vstack([[0, 0, 0], rim]), [[0, k, k + 1] for k in range(1, 3001)])
    assert (features_of(fan).near[:, 0] >= 0).all()


def test_crowded_corner_fills_the_neighbours_of_each_face():
    """20 faces in one point and a triangle at it: each of 21 keeps NEIGHBOURS of the 20 others."""
    crowd = [[0, 0, 0]] * 20 + [[0, 1, 2]]
    _, every = neighbours(TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], crowd))
    assert [len(every[face]) for face in range(len(crowd))] == [NEIGHBOURS] * len(crowd)


@pytest.mark.parametrize("scale", [1e-300, 1.0, 1e300])
def test_extreme_sizes_neither_overflow_nor_vanish(scale):
    """A right triangle with legs of 1: its farthest corner is root of 5 / 3 = 0.745 from the centroid."""
    features = features_of(TriangleMesh(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]]) * scale, [[0, 1, 2]]))
    assert np.isfinite(features.rows).all()
    assert 0.5 * scale < features.mean_radius < scale
