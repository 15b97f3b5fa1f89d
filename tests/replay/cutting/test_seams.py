"""Planted overlaps and slits between convex pieces are found with their width, and nothing else is."""

import numpy as np
import pytest
from support.shapes import box_mesh, revolved_mesh, shift_mesh

from cdcore import TriangleMesh
from cdcore.bounding.hull import hull_of
from replay.cutting.seams import SeamKind, seams_of, signed_gap
from replay.cutting.sectors import sector_ladder

BAR = box_mesh((0.4, 0.1, 0.1))


CUT_X = 0.03


def bar_cut_at_x(gap, at=CUT_X, aside=(0.0, 0.0, 0.0)):
    """A bar in two boxes with a slit of this width at x, or an overlap where it is negative."""
    left, right = at - gap / 2 + 0.2, 0.2 - at - gap / 2
    return [
        shift_mesh(box_mesh((left, 0.1, 0.1)), (-0.2 + left / 2, 0.0, 0.0)),
        shift_mesh(box_mesh((right, 0.1, 0.1)), (0.2 - right / 2 + aside[0], aside[1], aside[2])),
    ]


def posed_mesh(mesh, rotation, translation):
    """The mesh in another pose."""
    return TriangleMesh(mesh.vertices @ rotation.T + translation, mesh.faces)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("width", [2e-5, 1e-3, 0.02])
@pytest.mark.parametrize("sign", [1, -1])
def test_planted_seam_has_its_kind_width_and_place(width, sign, seed):
    """A bar along X, 10 cm thick, is cut in two with a slit or an overlap, and put anywhere."""
    rotation = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    rotation *= np.sign(np.linalg.det(rotation))
    translation = np.array([1.0, 2.0, 3.0])
    pieces = [posed_mesh(piece, rotation, translation) for piece in bar_cut_at_x(sign * width)]
    (seam,) = seams_of(posed_mesh(BAR, rotation, translation), pieces)
    assert seam.kind is (SeamKind.SLIT if sign > 0 else SeamKind.OVERLAP)
    assert seam.width == pytest.approx(width, rel=1e-6) and seam.pieces == (0, 1)
    point_in_bar = (np.array(seam.point) - translation) @ rotation
    half_seam = np.array((width / 2, 0.05, 0.05))
    assert (np.abs(point_in_bar - (CUT_X, 0.0, 0.0)) <= half_seam + 1e-9).all()


def test_slit_lies_amid_the_walls_that_face_each_other():
    """A bar of 2 cm stands before the upper edge of one of 10 cm: they face each other 4 to 5 cm above its axis."""
    wide, thin = box_mesh((0.2, 0.1, 0.1)), shift_mesh(box_mesh((0.2, 0.02, 0.1)), (0.201, 0.05, 0.0))
    (seam,) = seams_of(shift_mesh(box_mesh((0.6, 0.2, 0.2)), (0.1, 0.0, 0.0)), [wide, thin])
    assert seam.point == pytest.approx((0.1005, 0.045, 0.0), abs=5e-4)


def test_pieces_that_meet_have_no_seam():
    """A bar cut in two that touch, and that are 0.5 micrometres apart."""
    assert seams_of(BAR, bar_cut_at_x(gap=0.0)) == []
    assert seams_of(BAR, bar_cut_at_x(gap=5e-7)) == []


def test_gap_between_two_separate_bars_is_no_seam():
    """A seam is a slit between pieces where the mesh has material; between two bars it has none."""
    fingers = [shift_mesh(BAR, (0.0, 0.06 * side, 0.0)) for side in (-1, 1)]
    whole = TriangleMesh(
        np.concatenate([finger.vertices for finger in fingers]),
        np.concatenate([fingers[0].faces, fingers[1].faces + len(fingers[0].vertices)]),
    )
    assert seams_of(whole, fingers) == []


def test_slit_filled_by_a_third_piece_is_no_slit():
    """A slit of 1 mm and a piece 2 mm thick in it, which overlaps both sides."""
    filled = shift_mesh(box_mesh((0.002, 0.1, 0.1)), (0.03, 0.0, 0.0))
    assert seams_of(BAR, [*bar_cut_at_x(gap=0.001), filled]) != []
    kinds = {seam.kind for seam in seams_of(BAR, [*bar_cut_at_x(gap=0.001), filled])}
    assert kinds == {SeamKind.OVERLAP}


@pytest.mark.slow
def test_sectors_of_a_beaker_meet_each_other():
    """A profile, (radius, height) in metres, turned to a cup and cut into 12 sectors: no slit is between them."""
    wall = [(0, 0), (0.035, 0), (0.035, 0.1), (0.033, 0.1), (0.033, 0.002), (0, 0.002)]
    cup = revolved_mesh(wall, 24)
    pieces = [hull_of(corners) for corners in sector_ladder(cup).pieces(12)]
    assert len(pieces) > 6 and all(seam.kind is SeamKind.OVERLAP for seam in seams_of(cup, pieces))


@pytest.mark.parametrize("shift", [(0.3, 0.0, 0.0), (0.3, 0.4, 0.0), (0.3, 0.4, 0.5), (-0.1, 0.0, 0.0)])
def test_gap_of_two_cubes_has_its_closed_form(shift):
    """Unit cubes apart by ``shift``: the gap is its length, between faces, edges or corners.

    The last overlap by 0.1 m.
    """
    cube = box_mesh((1.0, 1.0, 1.0)).vertices
    other = cube + np.sign(shift) + np.array(shift) if shift[0] > 0 else cube + np.array((0.9, 0.0, 0.0))
    expected = np.linalg.norm(shift) if shift[0] > 0 else -0.1
    assert signed_gap(cube, other).metres == pytest.approx(expected, rel=1e-9)
