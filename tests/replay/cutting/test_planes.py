"""A body of any form in convex pieces by planes: they cover it, and their hulls add next to nothing."""

from functools import cache

import numpy as np
import pytest
from manifold3d import CrossSection, Manifold
from support.shapes import box_mesh, revolved_mesh, shift_mesh, without_faces
from trimesh import Trimesh

from cdcore import TriangleMesh
from cdcore.bounding.hull import hull_of
from replay.cutting import planes
from replay.cutting.convex_solids import manifold_of, outside_by, volume_of
from replay.cutting.planes import MOST_REGIONS, best_cut, cut_in_two, plane_ladder


def united(*meshes):
    """One solid of boxes that overlap."""
    whole = sum((manifold_of(mesh) for mesh in meshes[1:]), manifold_of(meshes[0])).to_mesh64()
    return TriangleMesh(whole.vert_properties[:, :3], np.asarray(whole.tri_verts).astype(np.int64))


U_SHAPE = united(
    box_mesh((0.2, 0.02, 0.1)),
    shift_mesh(box_mesh((0.02, 0.1, 0.1)), (0.09, 0.045, 0.0)),
    shift_mesh(box_mesh((0.02, 0.1, 0.1)), (-0.09, 0.045, 0.0)),
)
CUP = revolved_mesh([(0, 0), (0.035, 0), (0.035, 0.1), (0.033, 0.1), (0.033, 0.002), (0, 0.002)], 8)
"""A body of revolution with a floor and a wall of 2 mm, of (radius, height) in metres, with 8 sides."""


@cache
def ladders_by_body():
    """Hash of a mesh -> its pieces for each number of them that is allowed, cut once."""
    return {mesh.content_hash: plane_ladder(mesh) for mesh in (U_SHAPE, CUP)}


def hulls_of_pieces(mesh, most):
    """Hulls of at most so many pieces of a mesh that is cut by planes."""
    return [hull_of(corners) for corners in ladders_by_body()[mesh.content_hash].pieces(most)]


@pytest.mark.parametrize("most", [3, MOST_REGIONS])
def test_body_of_boxes_is_cut_into_its_boxes(most):
    """A U of three boxes: three pieces, however many are allowed, whose volumes add up to its own."""
    pieces = hulls_of_pieces(U_SHAPE, most)
    assert len(pieces) == 3
    assert sum(map(volume_of, pieces)) == pytest.approx(volume_of(U_SHAPE), rel=1e-9)


@pytest.mark.sampled(10)
@pytest.mark.parametrize("most", [1, 2, 8, 24, MOST_REGIONS])
@pytest.mark.parametrize("mesh", [U_SHAPE, CUP], ids=["u", "cup"])
def test_pieces_are_convex_and_cover_the_body(mesh, most):
    """A U of three boxes, or a hollow cup, is cut by planes into at most ``most`` pieces; trimesh calls them convex."""
    pieces = hulls_of_pieces(mesh, most)
    assert 1 <= len(pieces) <= most
    assert outside_by(mesh, pieces) < 1e-9
    assert all(Trimesh(piece.vertices, piece.faces, process=False).is_convex for piece in pieces)


def test_hulls_of_the_finest_pieces_add_little_to_a_cup():
    """Hulls of all pieces have less than 1.1 of the volume of a hollow cup, its one hull more than 2.2 of it."""
    finest = sum(map(volume_of, hulls_of_pieces(CUP, MOST_REGIONS)))
    (hull,) = hulls_of_pieces(CUP, most=1)
    assert volume_of(CUP) * (1.0 - 1e-9) <= finest < 1.1 * volume_of(CUP)
    assert volume_of(hull) > 2.2 * volume_of(CUP)


def test_cutting_stops_at_the_most_regions(monkeypatch):
    """Planes would cut a hollow cup into more than eight pieces (``ends``: one a piece); three are the limit here."""
    assert len(ladders_by_body()[CUP.content_hash].ends) > 8
    monkeypatch.setattr(planes, "MOST_REGIONS", 3)
    assert len(plane_ladder(CUP).ends) == 3


def test_cutting_a_mesh_again_gives_identical_pieces():
    """A U of three boxes is cut twice: corners of the pieces, and the joins that make fewer of them, bit for bit."""
    first, second = ladders_by_body()[U_SHAPE.content_hash], plane_ladder(U_SHAPE)
    assert np.array_equal(first.corners, second.corners)
    assert np.array_equal(first.joins, second.joins)


def test_open_surface_is_not_cut():
    """A U of three boxes that lacks a face."""
    assert plane_ladder(without_faces(U_SHAPE, count=1)) is None


def test_convex_piece_within_a_solid_is_cut_into_covering_halves():
    """The hull of the cup is cut in two convex halves: they cover the cup, and together are no larger than the hull."""
    solid, hull = manifold_of(CUP), hull_of(CUP.vertices)
    first, second = cut_in_two(hull, solid)
    assert outside_by(CUP, [first, second]) < 1e-9
    assert volume_of(first) + volume_of(second) <= volume_of(hull) * (1.0 + 1e-9)


@pytest.mark.parametrize("shift_m", [-3.0, 3.0])
def test_half_ring_is_cut_near_its_middle(shift_m):
    """Half a ring of five straight segments: a cut of the middle one leaves least to add, and no corner lies there.

    Each half has more than 0.4 of the volume, that is two of the five segments and a part of the middle one.
    """
    angles = np.pi * np.arange(6) / 5
    outer = np.column_stack([np.cos(angles), np.sin(angles)])
    half_ring = Manifold.extrude(CrossSection([np.concatenate([outer, 0.8 * outer[::-1]])]), 0.3)
    volumes = [half.volume() for _excess, half in best_cut(half_ring.translate([shift_m] * 3))]
    assert len(volumes) == 2
    assert min(volumes) > 0.4 * half_ring.volume()
