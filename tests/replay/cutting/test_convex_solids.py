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


def with_faces_turned(mesh):
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
    assert volume_of(with_faces_turned(box)) == pytest.approx(-6.0, rel=1e-6)


def test_area_of_box_is_that_of_its_sides():
    """Two sides each of 1 x 2, 1 x 3 and 2 x 3 square metres, beside the origin."""
    assert area_of(shift_mesh(BOX, (5.0, 6.0, 7.0))) == pytest.approx(22.0, rel=1e-12)


def test_only_closed_inward_faces_are_turned():
    """A box with outward faces, one with inward ones, and one with inward ones that lacks two."""
    assert facing_outward(BOX) is BOX
    assert volume_of(facing_outward(with_faces_turned(BOX))) == pytest.approx(6.0)
    open_box = without_faces(with_faces_turned(BOX), 2)
    assert facing_outward(open_box) is open_box


def test_solid_within_a_mesh_needs_a_closed_surface_and_volume():
    """Boxes of 6 cubic metres, a box that lacks a side, and a triangle with a front and a back."""
    assert enclosed_solid(with_faces_turned(BOX)).volume() == pytest.approx(6.0)
    assert enclosed_solid(without_faces(BOX, 2)) is None
    assert enclosed_solid(TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 1]])) is None
    assert manifold_of(BOX).volume() == pytest.approx(6.0) and manifold_of(without_faces(BOX, 2)) is None


def test_surface_around_one_piece_is_the_piece():
    """The solids of a single box."""
    solids = solids_of([BOX])
    assert solids.parts == (BOX,) and solids.surface is BOX


@pytest.mark.parametrize("prepared", [lambda mesh: mesh, with_separate_faces])
def test_volume_of_a_union_counts_an_overlap_once(prepared):
    """Two boxes of 6 cubic metres that share half; also where the library takes their faces for no solid."""
    pieces = [prepared(BOX), prepared(shift_mesh(BOX, (0.5, 0.0, 0.0)))]
    union = union_of(pieces)
    assert union.is_closed and volume_of(union) == pytest.approx(9.0)


def test_open_pieces_are_laid_beside_each_other():
    """The faces of a box that lacks two, and of a whole one, keep their corners."""
    pieces = [without_faces(BOX, 2), shift_mesh(BOX, (0.5, 0.0, 0.0))]
    assert np.array_equal(union_of(pieces).triangles, np.concatenate([piece.triangles for piece in pieces]))


def test_many_corners_become_as_many_triangles_as_engines_take(monkeypatch):
    """A hull of V corners has 2 V - 4 triangles, an even number: 80 where an engine took 81, and not 255."""
    assert convex_solids.MOST_TRIANGLES == 255
    monkeypatch.setattr(convex_solids, "MOST_TRIANGLES", 81)
    points = np.random.default_rng(1).normal(size=(120, 3))
    ball = hull_of(points / np.linalg.norm(points, axis=1, keepdims=True))
    fewer = within_triangles(ball)
    assert len(ball.faces) == 236 and len(fewer.faces) == 80 and within_triangles(fewer) is fewer
    # A third of the corners, evenly spread, leave out less than a tenth of the volume.
    assert 0.9 * volume_of(ball) < volume_of(fewer) < volume_of(ball)


def test_corners_within_a_side_are_left_out():
    """A box cut into a grid of 768 faces is the hull of its 8 corners; a square of 512 faces spans no solid."""
    box = trimesh.creation.box((1.0, 2.0, 3.0))
    square = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    grids = [mesh.subdivide().subdivide().subdivide() for mesh in (box, square)]
    fine_box, fine_square = (TriangleMesh(mesh.vertices, mesh.faces) for mesh in (grids[0], grids[1].subdivide()))
    assert len(fine_box.faces) == 768 and len(within_triangles(fine_box).faces) == 12
    assert len(fine_square.faces) == 512 and within_triangles(fine_square) is fine_square


def test_points_lie_beyond_the_planes_of_a_box_by_their_distance():
    """Of 300 points, more than are computed together, along x: half the box is 0.5 m long."""
    points = np.zeros((300, 3))
    points[:, 0] = np.linspace(0.2, 2.0, 300)
    assert len(points) > POINTS_AT_ONCE
    assert np.abs(beyond_planes(points, BOX) - (points[:, 0] - 0.5)).max() <= 1e-12


@pytest.mark.parametrize(("reach", "outside"), [(0.5, 0.0), (0.4, 0.1)])
def test_mesh_lies_outside_pieces_by_its_farthest_corner(reach, outside):
    """A box from -0.5 to 0.5 m in x, and two pieces of it that meet at 0, of which the second ends at ``reach``."""
    halves = [box_mesh((0.5, 2.0, 3.0), (-0.25, 0.0, 0.0)), box_mesh((reach, 2.0, 3.0), (reach / 2, 0.0, 0.0))]
    assert outside_by(BOX, halves) == pytest.approx(outside, abs=1e-12)
