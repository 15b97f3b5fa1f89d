"""Planted overlaps and slits between convex pieces are found with their width, and nothing else is."""

import numpy as np
import pytest
from support.shapes import box_mesh, merge_meshes, revolved_mesh, shift_mesh

from cdcore import TriangleMesh
from cdcore.bounding.hull import hull_of
from replay.cutting.seams import SeamKind, seams_of, signed_gap
from replay.cutting.sectors import sector_ladder

BAR = box_mesh((0.4, 0.1, 0.1))
"""A bar of 40 cm along X, 10 cm thick, about the origin."""


CUT_X = 0.03
"""Metres on X at which the bar is cut in two."""


def bar_cut_in_two(gap):
    """The bar in two boxes with a slit of this width at CUT_X, in metres, or an overlap where it is negative."""
    left, right = CUT_X - gap / 2 + 0.2, 0.2 - CUT_X - gap / 2
    return [
        shift_mesh(box_mesh((left, 0.1, 0.1)), (-0.2 + left / 2, 0.0, 0.0)),
        shift_mesh(box_mesh((right, 0.1, 0.1)), (0.2 - right / 2, 0.0, 0.0)),
    ]


def posed_mesh(mesh, rotation, translation):
    """The mesh in another pose."""
    return TriangleMesh(mesh.vertices @ rotation.T + translation, mesh.faces)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("width", [2e-5, 1e-3, 0.02])
@pytest.mark.parametrize(("sign", "kind"), [(1, SeamKind.SLIT), (-1, SeamKind.OVERLAP)])
def test_planted_seam_has_its_kind_width_and_place(width, sign, kind, seed):
    """A bar, 10 cm thick, is cut in two at CUT_X with a slit or an overlap of so many metres, and put anywhere.

    The seam's point, back in the axes of the bar, lies in the slit or overlap, which is as thick as the bar.
    """
    rotation = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    rotation *= np.sign(np.linalg.det(rotation))
    translation = np.array([1.0, 2.0, 3.0])
    pieces = [posed_mesh(piece, rotation, translation) for piece in bar_cut_in_two(sign * width)]
    (seam,) = seams_of(posed_mesh(BAR, rotation, translation), pieces)
    assert seam.kind is kind
    assert seam.pieces == (0, 1)
    assert seam.width == pytest.approx(width, rel=1e-6)
    point_in_bar = (np.array(seam.point) - translation) @ rotation
    half_seam = np.array((width / 2, 0.05, 0.05))
    assert (np.abs(point_in_bar - (CUT_X, 0.0, 0.0)) <= half_seam + 1e-9).all()


def test_slit_lies_amid_the_walls_that_face_each_other():
    """A bar 2 cm thick stands, 1 mm away, before the upper edge of one 10 cm thick, in a body around both.

    The wall of the thick one ends 5 cm above its axis, that of the thin one goes from 4 to 6 cm: the middle is
    4.5 cm, to half a millimetre.
    """
    thick, thin = box_mesh((0.2, 0.1, 0.1)), shift_mesh(box_mesh((0.2, 0.02, 0.1)), (0.201, 0.05, 0.0))
    body = shift_mesh(box_mesh((0.6, 0.2, 0.2)), (0.1, 0.0, 0.0))
    (seam,) = seams_of(body, [thick, thin])
    assert seam.point == pytest.approx((0.1 + 0.001 / 2, 0.045, 0.0), abs=5e-4)


@pytest.mark.parametrize("gap", [0.0, 5e-7], ids=["touching", "0.5 micrometres apart"])
def test_pieces_that_meet_have_no_seam(gap):
    """A bar of 40 cm cut in two; below a micrometre apart pieces count as touching."""
    assert seams_of(BAR, bar_cut_in_two(gap)) == []


def test_gap_between_two_separate_bars_is_no_seam():
    """A seam is a slit between pieces where the mesh has material; between two bars, 2 cm apart, it has none."""
    bars = [shift_mesh(BAR, (0.0, 0.06 * side, 0.0)) for side in (-1, 1)]
    assert seams_of(merge_meshes(*bars), bars) == []


def test_slit_filled_by_a_third_piece_is_no_slit():
    """A bar is cut in two with a slit of 1 mm; a piece 2 mm thick fills it, and overlaps both sides by half a mm."""
    filling = shift_mesh(box_mesh((0.002, 0.1, 0.1)), (CUT_X, 0.0, 0.0))
    seams = seams_of(BAR, [*bar_cut_in_two(gap=0.001), filling])
    assert {seam.kind for seam in seams} == {SeamKind.OVERLAP}


@pytest.mark.slow
def test_sectors_of_a_beaker_meet_each_other():
    """A profile, (radius, height) in metres, turned to a cup, in 7 to 12 sectors: no slit is between them."""
    profile = [(0, 0), (0.035, 0), (0.035, 0.1), (0.033, 0.1), (0.033, 0.002), (0, 0.002)]
    cup = revolved_mesh(profile, 24)
    pieces = [hull_of(corners) for corners in sector_ladder(cup).pieces(12)]
    assert len(pieces) > 6
    assert [seam for seam in seams_of(cup, pieces) if seam.kind is SeamKind.SLIT] == []


@pytest.mark.parametrize(
    ("middle_of_second", "expected"),
    [
        pytest.param((1.3, 0.0, 0.0), 0.3, id="between faces"),
        pytest.param((1.3, 1.4, 0.0), np.hypot(0.3, 0.4), id="between edges"),
        pytest.param((1.3, 1.4, 1.5), np.sqrt(0.3**2 + 0.4**2 + 0.5**2), id="between corners"),
        pytest.param((0.9, 0.0, 0.0), -0.1, id="overlap by 0.1 m"),
    ],
)
def test_gap_of_two_cubes_has_its_closed_form(middle_of_second, expected):
    """Cubes of 1 m, the first about the origin; the gap is negative where they overlap."""
    cube = box_mesh((1.0, 1.0, 1.0)).vertices
    assert signed_gap(cube, cube + middle_of_second).metres == pytest.approx(expected, rel=1e-9)
