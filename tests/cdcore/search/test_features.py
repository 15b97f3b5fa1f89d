"""Neighbours of a face are those that trimesh finds: across its edges first, then at its corners.

A feature is a face as the search stores it: with its centroid, radius and neighbours.
"""

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
    """Neighbours across edges are those of the library trimesh; with those at corners they are at most NEIGHBOURS."""
    reference = trimesh.Trimesh(mesh.vertices, mesh.faces, process=True, validate=False)
    adjacent = {face: set() for face in range(len(mesh.faces))}
    for first, second in reference.face_adjacency.tolist():
        adjacent[first].add(second)
        adjacent[second].add(first)
    by_edge, by_edge_or_corner = neighbours(mesh)
    assert by_edge == adjacent
    for face, faces in by_edge_or_corner.items():
        vertices = reference.faces[face]
        around = {other for vertex in vertices for other in reference.vertex_faces[vertex].tolist()} - {face, -1}
        assert faces <= around
        assert len(faces) == min(len(around), NEIGHBOURS)


@pytest.mark.parametrize("count", [5, 20], ids="{} faces".format)
def test_faces_at_a_crowded_edge_are_neighbours(count):
    """Faces that share the edge from (0, 0, 0) to (0, 0, 1): each has all others, but at most NEIGHBOURS, and not
    itself.
    """
    angle = 2.0 * np.pi / count * np.arange(count)
    vertices = [[0, 0, 0], [0, 0, 1], *np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)]
    by_edge, _by_edge_or_corner = neighbours(TriangleMesh(vertices, [[0, 1, 2 + k] for k in range(count)]))
    assert {len(others) for others in by_edge.values()} == {min(count - 1, NEIGHBOURS)}
    assert all(face not in others for face, others in by_edge.items())


def test_degenerate_face_shares_an_edge_only_between_different_corners():
    """Face 0 has corner 0 twice, so that it is the edge from 0 to 1, which face 2 has too; face 1 has corner 0 only."""
    corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    by_edge, _by_edge_or_corner = neighbours(TriangleMesh(corners, [[0, 0, 1], [0, 0, 2], [0, 1, 3]]))
    assert by_edge == {0: {2}, 1: set(), 2: {0}}


def test_points_along_a_diagonal_are_numbered_in_their_order():
    """1,024 points (k, k, k): a Morton code has ten bits for each coordinate."""
    codes = morton_codes(np.arange(1024.0)[:, None] * np.ones(3))
    assert (np.diff(codes) > 0).all()


def test_bits_of_three_coordinates_alternate_in_a_morton_code():
    """Ten bits of x, y and z in turn, x first, the lowest bits first; each from 0 at the smallest coordinate of all
    points to 1023 at the largest.

    Half of the way is 512, bit 9.
    """
    smallest, largest, all_of_z, half_of_x = [5.0, 7.0, 9.0], [6.0, 8.0, 10.0], [5.0, 7.0, 10.0], [5.5, 7.0, 9.0]
    ten_bits_of_z = sum(2 ** (3 * bit + 2) for bit in range(10))
    codes = morton_codes(np.array([smallest, largest, all_of_z, half_of_x]))
    assert codes.tolist() == [0, 2**30 - 1, ten_bits_of_z, 2 ** (3 * 9)]


def test_the_ball_around_a_face_holds_its_corners():
    """A row has centroid, radius and corners of a face; ``size`` is how far the farthest corner is from the origin."""
    features = features_of(ball_mesh(3.0, rings=12, sides=17))
    centroids, radii = features.rows[:, :RADIUS], features.rows[:, RADIUS]
    corners = features.rows[:, CORNERS:].reshape(-1, 3, 3)
    farthest = np.linalg.norm(corners - centroids[:, None], axis=2).max(axis=1)
    assert (farthest <= radii).all()
    assert np.linalg.norm(corners, axis=2).max() <= features.size


def test_faces_without_common_vertices_have_the_neighbours_of_joined_faces():
    """A torus of 1,600 faces, each with vertices of its own, and the torus itself."""
    torus = torus_mesh()
    count = len(torus.faces)
    unmerged = TriangleMesh(torus.triangles.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))
    assert np.array_equal(features_of(unmerged).near, features_of(torus).near)


def test_faces_of_large_fans_have_neighbours():
    """3,000 faces round one vertex; -1 would be no neighbour."""
    angle = np.linspace(0, 2 * np.pi, 3001)
    rim = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(3001)])
    fan = TriangleMesh(np.vstack([[0, 0, 0], rim]), [[0, k, k + 1] for k in range(1, 3001)])
    assert (features_of(fan).near[:, 0] >= 0).all()


def test_crowded_corner_fills_the_neighbours_of_each_face():
    """20 faces that are one point, and a triangle with a corner there: each of 21 keeps NEIGHBOURS of the 20 others."""
    crowd = [[0, 0, 0]] * 20 + [[0, 1, 2]]
    _by_edge, by_edge_or_corner = neighbours(TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], crowd))
    assert [len(by_edge_or_corner[face]) for face in range(21)] == 21 * [NEIGHBOURS]


@pytest.mark.parametrize("scale", [1e-300, 1.0, 1e300])
def test_extreme_sizes_neither_overflow_nor_vanish(scale):
    """A right triangle with legs of ``scale``: its farthest corner is root of 5 / 3 = 0.745 of that
    from the centroid.
    """
    features = features_of(TriangleMesh(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]]) * scale, [[0, 1, 2]]))
    assert np.isfinite(features.rows).all()
    assert features.mean_radius == pytest.approx(np.sqrt(5) / 3 * scale)
