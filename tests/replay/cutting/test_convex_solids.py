"""Convex solids: their volume and area, within the limits of engines, as one surface, and how far a mesh lies outside.

Expected values are those of boxes, worked out by hand.
"""

import numpy as np
import pytest
import trimesh
from support.shapes import box_mesh, shift_mesh, without_faces

from cdcore import TriangleMesh
from cdcore.bounding.hull import hull_of
from replay.cutting import convex_solids
from replay.cutting.convex_solids import (
    POINTS_AT_ONCE,
    area_of,
    beyond_planes,
    enclosed_solid,
    facing_outward,
    manifold_of,
    outside_by,
    solids_of,
    union_of,
    volume_of,
    within_triangles,
)

BOX = box_mesh((1.0, 2.0, 3.0))
"""A box of 1 x 2 x 3 m about the origin: 6 cubic metres, 12 faces."""


def with_inward_faces(mesh):
    """The mesh with its faces the other way round."""
    return TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])


def with_separate_faces(mesh):
    """The mesh, closed as before, but each face has corners of its own."""
    corners = mesh.triangles.reshape(-1, 3)
    return TriangleMesh(corners, np.arange(len(corners)).reshape(-1, 3))


@pytest.mark.parametrize("metres_away", [0.0, 1e7 / 3])
def test_volume_of_box_is_that_of_its_edges(metres_away):
    """1 x 2 x 3 m, also far from the origin, where doubles are half a nanometre apart; negative with inward faces."""
    box = shift_mesh(BOX, (metres_away, metres_away, -metres_away))
    assert volume_of(box) == pytest.approx(6.0, rel=1e-6)
    assert volume_of(with_inward_faces(box)) == pytest.approx(-6.0, rel=1e-6)


def test_area_of_box_is_that_of_its_sides():
    """Two sides each of 1 x 2, 1 x 3 and 2 x 3 square metres, beside the origin."""
    assert area_of(shift_mesh(BOX, (5.0, 6.0, 7.0))) == pytest.approx(2 * (2.0 + 3.0 + 6.0), rel=1e-12)


def test_inward_faces_of_a_closed_mesh_are_turned_outward():
    """The box of 6 cubic metres has a negative volume with inward faces."""
    assert volume_of(facing_outward(with_inward_faces(BOX))) == pytest.approx(6.0)


@pytest.mark.parametrize(
    "mesh", [BOX, without_faces(with_inward_faces(BOX), count=2)], ids=["outward faces", "inward faces, two missing"]
)
def test_outward_or_open_mesh_keeps_its_faces(mesh):
    """A box; or a box that lacks two faces, of which nobody knows the inside."""
    assert facing_outward(mesh) is mesh


@pytest.mark.parametrize("mesh", [BOX, with_inward_faces(BOX)], ids=["outward faces", "inward faces"])
def test_solid_within_a_closed_mesh_has_its_volume(mesh):
    """The box of 6 cubic metres, whichever way its faces are turned."""
    assert enclosed_solid(mesh).volume() == pytest.approx(6.0)


@pytest.mark.parametrize(
    "mesh",
    [
        pytest.param(without_faces(BOX, count=2), id="box without a side"),
        pytest.param(TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 1]]), id="triangle, two sides"),
    ],
)
def test_mesh_without_a_volume_holds_no_solid(mesh):
    """A box without a side is open; a triangle with a front and a back is closed and flat."""
    assert enclosed_solid(mesh) is None


def test_manifold_is_made_of_closed_meshes_only():
    """The library manifold3d takes the box, and not the box without a side."""
    assert manifold_of(BOX).volume() == pytest.approx(6.0)
    assert manifold_of(without_faces(BOX, count=2)) is None


def test_surface_around_one_piece_is_the_piece():
    """The surface around several pieces is their union; of a single box it is the box itself."""
    solids = solids_of([BOX])
    assert solids.parts == (BOX,)
    assert solids.surface is BOX


@pytest.mark.parametrize(
    "prepared", [lambda mesh: mesh, with_separate_faces], ids=["shared corners", "corners of each face"]
)
def test_volume_of_a_union_counts_an_overlap_once(prepared):
    """Two boxes of 6 cubic metres that share half of it.

    A box whose faces have corners of their own is no solid for the library that unites them.
    """
    pieces = [prepared(BOX), prepared(shift_mesh(BOX, (0.5, 0.0, 0.0)))]
    union = union_of(pieces)
    assert union.is_closed
    assert volume_of(union) == pytest.approx(6.0 + 6.0 - 3.0)


def test_open_pieces_are_laid_beside_each_other():
    """The faces of a box that lacks two, and of a whole one, keep their corners."""
    pieces = [without_faces(BOX, count=2), shift_mesh(BOX, (0.5, 0.0, 0.0))]
    assert np.array_equal(union_of(pieces).triangles, np.concatenate([piece.triangles for piece in pieces]))


def test_engines_take_255_triangles():
    """The limit of PhysX for a convex mesh."""
    assert convex_solids.MOST_TRIANGLES == 255


def test_many_corners_become_as_many_triangles_as_engines_take(monkeypatch):
    """A hull of V corners has 2 V - 4 triangles, an even number: 236 of 120 corners, and 80 where 81 are allowed.

    A third of the corners, evenly spread, leave out less than a tenth of the volume.
    """
    monkeypatch.setattr(convex_solids, "MOST_TRIANGLES", 81)
    points = np.random.default_rng(1).normal(size=(120, 3))
    ball = hull_of(points / np.linalg.norm(points, axis=1, keepdims=True))
    assert len(ball.faces) == 2 * 120 - 4
    fewer = within_triangles(ball)
    assert len(fewer.faces) == 80
    assert 0.9 * volume_of(ball) < volume_of(fewer) < volume_of(ball)
    assert within_triangles(fewer) is fewer, "few enough as it is"


def subdivided(mesh, times):
    """The mesh of trimesh with each face cut into four, so many times."""
    for _ in range(times):
        mesh = mesh.subdivide()
    return TriangleMesh(mesh.vertices, mesh.faces)


def test_corners_within_a_side_are_left_out():
    """A box of 12 faces, each cut into 64, is the hull of its 8 corners, of 12 faces and 6 cubic metres."""
    fine_box = subdivided(trimesh.creation.box((1.0, 2.0, 3.0)), times=3)
    assert len(fine_box.faces) == 12 * 4**3
    plain_box = within_triangles(fine_box)
    assert len(plain_box.faces) == 12
    assert volume_of(plain_box) == pytest.approx(6.0, rel=1e-9)


def test_flat_mesh_of_many_faces_stays_as_it_is():
    """A square of 2 faces, each cut into 256: more than the 255 that engines take of a convex solid.

    Else ``within_triangles`` returns the hull of some corners, with at most 255 faces; those of a square span no solid.
    """
    square = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    fine_square = subdivided(square, times=4)
    assert len(fine_square.faces) == 2 * 4**4
    assert within_triangles(fine_square) is fine_square


def test_points_lie_beyond_planes_of_a_box_by_their_distance():
    """300 points along x, more than are computed together; half the box is 0.5 m long, and inside is negative."""
    points = np.zeros((300, 3))
    points[:, 0] = np.linspace(0.2, 2.0, 300)
    assert len(points) > POINTS_AT_ONCE
    assert beyond_planes(points, BOX) == pytest.approx(points[:, 0] - 0.5, abs=1e-12)


@pytest.mark.parametrize(("end_of_second", "outside"), [(0.5, 0.0), (0.4, 0.1)])
def test_mesh_lies_outside_pieces_by_its_farthest_corner(end_of_second, outside):
    """A box from -0.5 to 0.5 m in x, and two pieces of it that meet at 0: the second ends there, or 0.1 m before."""
    first = box_mesh((0.5, 2.0, 3.0), (-0.25, 0.0, 0.0))
    second = box_mesh((end_of_second, 2.0, 3.0), (end_of_second / 2, 0.0, 0.0))
    assert outside_by(BOX, [first, second]) == pytest.approx(outside, abs=1e-12)
