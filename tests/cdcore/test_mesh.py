"""A mesh is valid or does not exist; what it says follows from its faces; reference vertices have one order."""

import gc
import math
from fractions import Fraction
from weakref import ref

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.shapes import (
    ball_mesh,
    beaker_mesh,
    box_mesh,
    merge_meshes,
    random_rotations,
    shift_mesh,
    unrotated_motion,
    without_faces,
)

from cdcore import Body, TriangleMesh, create_detector
from cdcore.mesh import distinct_rows, winding
from cdcore.poses import place_points
from cdcore.tolerances import EPS, PAD_ULPS, UNDERFLOW_PAD

CORNERS = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
"""Of a right triangle in z = 0."""


def test_meshes_are_immutable_and_independent_of_their_source():
    """Later changes of the source do not reach the mesh, and its own arrays cannot be changed."""
    vertices, faces = np.array(CORNERS), np.array([[0, 1, 2]], dtype=np.int32)
    mesh = TriangleMesh(vertices, faces)
    vertices[0], faces[0] = 7.0, 0
    assert mesh.vertices.tolist() == CORNERS
    assert mesh.faces.tolist() == [[0, 1, 2]]
    for array in (mesh.vertices, mesh.faces, mesh.triangles, mesh.referenced_vertices):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    with pytest.raises(AttributeError):
        mesh.vertices = vertices


def test_faces_keep_their_order_and_duplicates_stay():
    """The same triangle three times, twice with the other winding."""
    faces = [[2, 1, 0], [0, 1, 2], [2, 1, 0]]
    mesh = TriangleMesh(CORNERS, faces)
    assert mesh.faces.tolist() == faces
    assert mesh.triangles.tolist() == [CORNERS[::-1], CORNERS, CORNERS[::-1]]


def test_a_vertex_no_face_uses_is_not_referenced():
    """A fourth vertex, 1,000 km away, that no face uses."""
    mesh = TriangleMesh([*CORNERS, [1e6, 0, 0]], [[0, 1, 2]])
    assert mesh.referenced_vertices.tolist() == CORNERS


@pytest.mark.parametrize(
    ("mesh", "closed"),
    [
        (box_mesh(), True),
        (ball_mesh(), True),
        (beaker_mesh(), True),
        (without_faces(box_mesh(), count=1), False),
        (TriangleMesh(CORNERS, [[0, 1, 2]]), False),
        (TriangleMesh(CORNERS, [[0, 1, 2], [0, 2, 1]]), True),
        (TriangleMesh(CORNERS, [[0, 0, 1]]), False),
    ],
    ids=["box", "ball", "beaker", "open box", "triangle", "triangle on both sides", "segment only"],
)
def test_closed_means_every_edge_has_an_even_number_of_faces(mesh, closed):
    """An open box lacks a triangle; a triangle drawn from both sides has two faces at each edge; of a face with two
    equal corners only a segment is left.
    """
    assert mesh.is_closed is closed


def test_a_box_of_unmerged_corners_is_closed_all_the_same():
    """12 faces with 36 vertices of their own are closed, and one component."""
    box = box_mesh()
    unmerged = TriangleMesh(box.triangles.reshape(-1, 3), np.arange(36).reshape(-1, 3))
    assert unmerged.is_closed
    assert len(np.unique(unmerged.components)) == 1


def test_minus_zero_and_zero_are_the_same_coordinate():
    """A triangle from both sides, whose corner at the origin is written once with 0.0 and once with -0.0.

    Where the two are the same point the faces share all edges: the mesh is closed, and is a single component.
    """
    mesh = TriangleMesh([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [-0.0, -0.0, 0]], [[0, 1, 2], [3, 2, 1]])
    assert mesh.is_closed
    assert mesh.components.tolist() == [0, 0]


def test_equal_rows_share_a_number():
    """Distinct rows are in ascending order, and each row has the number of its equal there; 0.0 equals -0.0."""
    distinct, numbers = distinct_rows(np.array([[0.0, 2.0], [-1.0, 5.0], [-0.0, 2.0], [0.0, 1.0]]))
    assert distinct.tolist() == [[-1, 5], [0, 1], [0, 2]]
    assert numbers.tolist() == [2, 0, 2, 1]


def test_degenerate_faces_do_not_open_a_closed_mesh():
    """A box with two more faces, of two and of three equal corners."""
    box, segment, point = box_mesh(), [3, 3, 5], [4, 4, 4]
    assert TriangleMesh(box.vertices, [*box.faces.tolist(), segment, point]).is_closed


def test_doubled_faces_have_the_same_corners_in_any_order():
    """A face of a box once more, with two corners exchanged, is doubled; two equal segments are not."""
    box = box_mesh()
    segments = [[3, 3, 5], [5, 3, 3]]
    a, b, c = box.faces[4].tolist()  # any face of the box
    assert not box.has_doubled_faces
    assert not TriangleMesh(box.vertices, [*box.faces.tolist(), *segments]).has_doubled_faces
    assert TriangleMesh(box.vertices, [*box.faces.tolist(), [b, a, c]]).has_doubled_faces


@pytest.mark.parametrize("scale", [1.0, 1e-4, 1e103, 1e-110])
@pytest.mark.parametrize("middle", [[0.0, 0.0, 0.0], [1e7 / 3, -2e6 / 3, 5e6 / 3]], ids=["origin", "3,000 km away"])
def test_winding_tells_where_the_normals_point(middle, scale):
    """1 where the faces of a box of 1 m have their normals outside, -1 inside.

    Scaled by 1e-4 the distant box still has digits enough; by 1e103 its volume overflows float64, by 1e-110 it
    vanishes.
    """
    outwards = scale * shift_mesh(box_mesh(), middle).triangles
    inwards = outwards[:, ::-1]
    assert (winding(outwards), winding(inwards)) == (1, -1)


def test_winding_of_a_closed_surface_without_volume_is_0():
    """A triangle drawn from both sides."""
    assert winding(TriangleMesh(CORNERS, [[0, 1, 2], [0, 2, 1]]).triangles) == 0


def test_components_are_named_by_their_lowest_face():
    """Three separate boxes of 12 faces each: every face has the number of the first face of its box."""
    three = merge_meshes(box_mesh(), shift_mesh(box_mesh(), [3, 0, 0]), shift_mesh(box_mesh(), [6, 0, 0]))
    assert three.components.tolist() == 12 * [0] + 12 * [12] + 12 * [24]


def test_content_hash_depends_on_coordinates_and_faces_alone():
    """Equal boxes have the same hash; a shift by 1e-16 m, about a rounding of their coordinates of 0.5 m, changes it.

    So does another order of faces.
    """
    box = box_mesh()
    assert TriangleMesh(box.vertices, box.faces).content_hash == box.content_hash
    assert shift_mesh(box, [1e-16, 0, 1e-16]).content_hash != box.content_hash
    assert TriangleMesh(box.vertices, box.faces[::-1]).content_hash != box.content_hash


def test_mesh_prints_as_its_size():
    """A box has 8 corners, and two triangles on each of 6 sides."""
    assert repr(box_mesh()) == "TriangleMesh(8 vertices, 12 faces)"


def test_placed_points_round_in_the_declared_order():
    """Bit for bit ((r0 x + r1 y) + r2 z) + t for each row r of the rotation, in doubles of Python."""
    rng = np.random.default_rng(0)
    rotation, translation, points = random_rotations(rng), rng.normal(size=3), rng.normal(size=(50, 3))
    expected = [
        [
            ((r0 * x + r1 * y) + r2 * z) + t
            for (r0, r1, r2), t in zip(rotation.tolist(), translation.tolist(), strict=True)
        ]
        for x, y, z in points.tolist()
    ]
    assert place_points(points, rotation, translation).tolist() == expected


coordinates = st.floats(-1e6, 1e6, allow_nan=False)


@given(st.lists(coordinates, min_size=3, max_size=3), st.lists(coordinates, min_size=3, max_size=3), st.integers(0, 99))
def test_placing_errs_by_less_than_the_sphere_pad(point, translation, seed):
    """Python's fractions give the exact place.

    The broad phase pads spheres by PAD_ULPS eps of the sizes and distances of two bodies; placing one point may use up
    a quarter of that.
    """
    rotation = random_rotations(np.random.default_rng(seed))
    placed = place_points(np.array([point]), rotation, np.array(translation))[0]
    size = math.hypot(*point) + np.abs(translation).max() + UNDERFLOW_PAD
    for i in range(3):
        exact = sum(Fraction(float(rotation[i, k])) * Fraction(point[k]) for k in range(3)) + Fraction(translation[i])
        assert abs(float(Fraction(float(placed[i])) - exact)) <= PAD_ULPS / 4 * EPS * size, i


@pytest.mark.slow
def test_detectors_keep_no_reference_to_a_mesh():
    """A detector ``exact`` of two boxes answers a frame and is gone: a weak reference to a mesh of it is dead."""
    mesh = TriangleMesh(box_mesh().vertices, box_mesh().faces)  # not the box that all tests share
    bodies = [Body("large", mesh), Body("small", box_mesh((0.1, 0.1, 0.1)))]
    create_detector("exact", bodies).detect(unrotated_motion(np.zeros((1, 2, 3))))
    mesh_if_alive = ref(mesh)
    del mesh, bodies
    gc.collect()
    assert mesh_if_alive() is None
