"""Report cards of made solids are those of closed form."""

import numpy as np
import pytest
from support.shapes import box_mesh, revolved_mesh, shift_mesh
from trimesh.creation import icosphere

from cdcore import TriangleMesh
from cdcore.bounding.hull import hull_collider
from replay.advice.report_card import reach, shape_figures
from replay.cutting.surface_distance import Surface, is_outside


def test_larger_box_has_its_closed_form_errors():
    """A box of twice the volume stands out by half a metre at two ends."""
    small, large = box_mesh((1.0, 1.0, 1.0)), box_mesh((2.0, 1.0, 1.0))
    card = shape_figures(small, [large])
    assert (card["pieces"], card["triangles"], card["most_triangles"]) == (1, 12, 12)
    assert card["beyond"] == pytest.approx(1.0, rel=1e-6) and card["missing"] == pytest.approx(0.0, abs=1e-6)
    assert card["reach_mm"] == pytest.approx(500.0, rel=1e-6) and card["outside_mm"] == 0.0


@pytest.mark.parametrize("shift", [0.0, 1.0])
def test_float32_rounding_of_written_colliders_is_not_reported(shift):
    """A hull shifted by 2 um is reported; its corners rounded to float32 are not."""
    wall = [(0, 0), (0.035, 0), (0.035, 0.1), (0.033, 0.1), (0.033, 0.002), (0, 0.002)]
    cup = shift_mesh(revolved_mesh(wall, 12), (shift, 0.0, 0.0))
    hull = hull_collider(cup)
    written = TriangleMesh(hull.vertices.astype(np.float32).astype(np.float64), hull.faces)
    card = shape_figures(cup, [written])
    assert (card["missing"], card["outside_mm"]) == (0.0, 0.0) and card["beyond"] > 1.0
    aside = shape_figures(cup, [shift_mesh(hull, (2e-6, 0.0, 0.0))])
    assert aside["missing"] > 0.0 and aside["outside_mm"] > 0.0


def test_half_a_box_misses_half_of_a_box():
    """Half the volume is missing, up to half a metre from the piece."""
    whole, half = box_mesh((1.0, 1.0, 1.0)), shift_mesh(box_mesh((0.5, 1.0, 1.0)), (-0.25, 0.0, 0.0))
    card = shape_figures(whole, [half])
    assert card["missing"] == pytest.approx(0.5, rel=1e-6) and card["beyond"] == pytest.approx(0.0, abs=1e-6)
    assert card["outside_mm"] == pytest.approx(500.0, rel=1e-6) and card["reach_mm"] == 0.0


def test_crossed_bars_count_their_common_volume_once():
    """Bars of a tenth of a plate of 1 m x 1 m share a hundredth of it."""
    bars = [box_mesh((1.0, 0.1, 0.1)), box_mesh((0.1, 1.0, 0.1))]
    hull = box_mesh((1.0, 1.0, 0.1))
    card = shape_figures(hull, bars)
    covered = 0.1 + 0.1 - 0.01
    assert card["missing"] == pytest.approx(1.0 - covered, rel=1e-6) and card["beyond"] == pytest.approx(0, abs=1e-6)


@pytest.mark.slow
def test_reach_of_a_plug_in_a_cup_is_its_radius():
    """The plug fills the cup: its axis is farthest from the inner wall, a 48-gon about a radius of 33 mm."""
    wall = [(0, 0), (0.035, 0), (0.035, 0.1), (0.033, 0.1), (0.033, 0.002), (0, 0.002)]
    cup, plug = revolved_mesh(wall, 48), revolved_mesh([(0, 0), (0.035, 0), (0.035, 0.1), (0, 0.1)], 48)
    assert reach(cup, [plug]) == pytest.approx(0.033 * np.cos(np.pi / 48), rel=1e-6)


def test_signed_distances_of_a_ball_match_its_radius():
    """A ball of 5,120 faces lies up to 2 mm within its sphere of 1 m; points at 0.2 to 2 m from its middle."""
    ball = icosphere(subdivisions=4)
    mesh = TriangleMesh(ball.vertices, ball.faces)
    points = np.random.default_rng(0).normal(size=(50, 3))
    points = points / np.linalg.norm(points, axis=1, keepdims=True) * np.linspace(0.2, 2.0, 50)[:, None]
    radius = np.linalg.norm(points, axis=1)
    assert np.allclose(Surface(mesh.triangles).distances(points)[0], np.abs(radius - 1.0), atol=2e-3)
    clear = np.abs(radius - 1.0) > 5e-3
    assert (is_outside(points, mesh.triangles) == (radius > 1.0))[clear].all()


def test_volumes_of_open_meshes_are_not_known():
    """A box lacks a face, as the mesh and as its piece."""
    box = box_mesh((1.0, 1.0, 1.0))
    open_box = TriangleMesh(box.vertices, box.faces[1:])
    for mesh, piece in ((open_box, box), (box, open_box)):
        card = shape_figures(mesh, [piece])
        assert card["beyond"] is None and card["missing"] is None


def test_reach_of_crossed_bars_has_closed_form():
    """Pieces stand beyond the mesh by half of 1.0 less half of 0.2, and by half of 0.7 less half of 0.2."""
    bar, crossing = box_mesh((2.0, 0.2, 0.2)), box_mesh((0.2, 1.0, 0.2))
    assert reach(bar, [bar, crossing]) == pytest.approx(0.4, rel=1e-6)
    higher = box_mesh((0.3, 0.2, 0.7))
    assert reach(bar, [bar, higher]) == pytest.approx(0.25, rel=1e-6)
    assert reach(bar, [bar]) == 0.0


@pytest.mark.sampled(3)
@pytest.mark.parametrize("sides", [5, 12, 40])
def test_reach_of_a_plugged_tube_is_the_inscribed_radius(sides):
    """A tube without floor, filled: the middle of an end is farthest from the wall, at the middle of a side."""
    wall = [(0.03, 0), (0.035, 0), (0.035, 0.4), (0.03, 0.4), (0.03, 0)]
    tube, plug = revolved_mesh(wall, sides), revolved_mesh([(0, 0), (0.035, 0), (0.035, 0.4), (0, 0.4)], sides)
    assert reach(tube, [plug]) == pytest.approx(0.03 * np.cos(np.pi / sides), rel=1e-6)


@pytest.mark.slow
def test_reach_into_a_fine_narrow_neck_is_found():
    """Thousands of long triangles along the wall hid the small lid of the neck: 11.1 mm in place of 16.3 mm."""
    outer = [(0, 0), (0.042, 0), *((0.042 - 0.0009 * k, 0.003 * k) for k in range(1, 29)), (0.0168, 0.14)]
    inner = [(0.0158, 0.14), *((0.041 - 0.0009 * k, 0.003 * k) for k in range(28, 0, -1)), (0.041, 0.001), (0, 0.001)]
    flask = revolved_mesh([*outer, *inner], 40)
    assert len(flask.faces) > 3000
    assert reach(flask, [hull_collider(flask)]) == pytest.approx(0.0158 * np.cos(np.pi / 40), rel=1e-6)


def test_report_card_measures_planted_overlap_and_slit():
    """Three boxes along x: the second begins 1 mm within the first and ends 4 mm before the third."""
    bar = box_mesh((0.4, 0.1, 0.1))
    pieces = [
        shift_mesh(box_mesh((width, 0.1, 0.1)), (x, 0.0, 0.0))
        for width, x in ((0.1, -0.15), (0.1, -0.051), (0.197, 0.1015))
    ]
    card = shape_figures(bar, pieces)
    assert card["overlap_mm"] == pytest.approx(1.0, rel=1e-6) and card["slit_mm"] == pytest.approx(4.0, rel=1e-6)
    assert [(seam["kind"], seam["pieces"]) for seam in card["seams"]] == [("slit", [1, 2]), ("overlap", [0, 1])]
    alone = shape_figures(bar, [bar])
    assert (alone["overlap_mm"], alone["slit_mm"], alone["seams"]) == (0.0, 0.0, [])
