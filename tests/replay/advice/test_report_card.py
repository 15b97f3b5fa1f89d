"""Report cards of made solids are those of closed form."""

import numpy as np
import pytest
from support.shapes import box_mesh, revolved_mesh, shift_mesh
from support.small_worlds import unit_cubes_on_x
from trimesh.creation import icosphere

from cdcore import TriangleMesh
from cdcore.bounding.hull import hull_collider
from replay.advice.report_card import contact_figures, reach, shape_figures
from replay.auditing.tolerance import Reference, Tolerance
from replay.cutting import surface_distance
from replay.cutting.surface_distance import Surface, is_outside
from replay.detection.detector_spec import DetectorSpec
from replay.detection.run_detector import make_detector
from replay.engine import prepare


def test_larger_box_has_its_closed_form_errors():
    """A cube of side 1 m, and in its place a box of twice the volume, which stands out by half a metre at two ends.

    ``beyond``: volume of the pieces outside the mesh, of its own; ``missing``: of the mesh outside them. ``reach_mm``:
    how far pieces stand out; ``outside_mm``: how far the mesh does.
    """
    cube, larger = box_mesh((1.0, 1.0, 1.0)), box_mesh((2.0, 1.0, 1.0))
    card = shape_figures(cube, [larger])
    assert (card["pieces"], card["triangles"], card["most_triangles"]) == (1, 12, 12)
    assert card["beyond"] == pytest.approx(1.0, rel=1e-6)
    assert card["missing"] == pytest.approx(0.0, abs=1e-6)
    assert card["reach_mm"] == pytest.approx(500.0, rel=1e-6)
    assert card["outside_mm"] == 0.0


@pytest.fixture(params=[pytest.param(0.0, id="cup at the origin"), pytest.param(1.0, id="cup at 1 m")])
def cup(request):
    """A cup of 35 mm radius, 0.1 m high, with a hollow; its middle is at x = 0 or 1 m, where float32 is coarser."""
    wall = [(0, 0), (0.035, 0), (0.035, 0.1), (0.033, 0.1), (0.033, 0.002), (0, 0.002)]
    return shift_mesh(revolved_mesh(wall, 12), (request.param, 0.0, 0.0))


@pytest.fixture
def coarse_reach(monkeypatch):
    """How far pieces reach beyond a mesh, at which a test does not look, is sampled coarsely, which takes less time."""
    monkeypatch.setattr(surface_distance, "SAMPLES_PER_SIZE", 4)


@pytest.mark.usefixtures("coarse_reach")
def test_float32_rounding_of_written_colliders_is_not_reported(cup):
    """The hull of a cup, its corners rounded to float32 as in a file: no part of the cup is called missing.

    The hull fills the hollow of a cup whose walls are 2 mm thick: ``beyond``, in volumes of the cup, is above 1.
    """
    hull = hull_collider(cup)
    rounded = TriangleMesh(hull.vertices.astype(np.float32).astype(np.float64), hull.faces)
    card = shape_figures(cup, [rounded])
    assert (card["missing"], card["outside_mm"]) == (0.0, 0.0)
    assert card["beyond"] > 1.0


@pytest.mark.usefixtures("coarse_reach")
def test_hull_two_micrometres_aside_is_reported(cup):
    """A hull moved by 2 um, more than float32 rounds at 1 m (0.06 um), leaves a part of the cup outside."""
    card = shape_figures(cup, [shift_mesh(hull_collider(cup), (2e-6, 0.0, 0.0))])
    assert card["missing"] > 0.0
    assert card["outside_mm"] > 0.0


def test_half_a_box_misses_half_of_a_box():
    """A cube of side 1 m, and its left half in its place: half of the volume is missing, up to half a metre away."""
    whole, left_half = box_mesh((1.0, 1.0, 1.0)), shift_mesh(box_mesh((0.5, 1.0, 1.0)), (-0.25, 0.0, 0.0))
    card = shape_figures(whole, [left_half])
    assert card["missing"] == pytest.approx(0.5, rel=1e-6)
    assert card["outside_mm"] == pytest.approx(500.0, rel=1e-6)
    assert card["beyond"] == pytest.approx(0.0, abs=1e-6)
    assert card["reach_mm"] == 0.0


def test_crossed_bars_count_their_common_volume_once():
    """A plate of 1 x 1 x 0.1 m, and in its place two crossed bars of a tenth of it each, which share a hundredth."""
    plate = box_mesh((1.0, 1.0, 0.1))
    bars = [box_mesh((1.0, 0.1, 0.1)), box_mesh((0.1, 1.0, 0.1))]
    card = shape_figures(plate, bars)
    covered = 0.1 + 0.1 - 0.01
    assert card["missing"] == pytest.approx(1.0 - covered, rel=1e-6)
    assert card["beyond"] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.slow
def test_reach_of_a_plug_in_a_cup_is_its_radius():
    """A cup, inner radius 33 mm, of 48 sides, and a plug that fills it: its axis is farthest from the inner wall.

    Sides of a regular polygon are nearer than its corners, by the cosine of half the angle of a side.
    """
    wall = [(0, 0), (0.035, 0), (0.035, 0.1), (0.033, 0.1), (0.033, 0.002), (0, 0.002)]
    cup, plug = revolved_mesh(wall, 48), revolved_mesh([(0, 0), (0.035, 0), (0.035, 0.1), (0, 0.1)], 48)
    assert reach(cup, [plug]) == pytest.approx(0.033 * np.cos(np.pi / 48), rel=1e-6)


def test_distances_to_a_ball_match_its_radius():
    """50 points at 0.2 to 2 m from the middle of a ball of radius 1 m; its 5,120 faces lie up to 2 mm within it."""
    ball = icosphere(subdivisions=4)
    directions = np.random.default_rng(0).normal(size=(50, 3))  # any seed
    radius = np.linspace(0.2, 2.0, 50)
    points = radius[:, None] * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    distances, *_ = Surface(TriangleMesh(ball.vertices, ball.faces).triangles).distances(points)
    assert np.allclose(distances, np.abs(radius - 1.0), atol=2e-3)


def test_points_beyond_the_radius_of_a_ball_are_outside():
    """50 points at 0.2 to 2 m from the middle of a ball of 1 m; those within 5 mm of its surface are left out.

    The faces of the ball lie up to 2 mm within its sphere.
    """
    ball = icosphere(subdivisions=4)
    directions = np.random.default_rng(0).normal(size=(50, 3))  # any seed
    radius = np.linspace(0.2, 2.0, 50)
    points = radius[:, None] * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    is_clear = np.abs(radius - 1.0) > 5e-3
    outside = is_outside(points, TriangleMesh(ball.vertices, ball.faces).triangles)
    assert (outside == (radius > 1.0))[is_clear].all()


@pytest.mark.usefixtures("coarse_reach")
@pytest.mark.parametrize("open_body", ["mesh", "piece"])
def test_volumes_of_open_meshes_are_not_known(open_body):
    """A cube is its own collider; a face is missing, of the mesh or of the piece: that has no inside, so no volume.

    The volumes beyond the mesh and missing from it are then None.
    """
    cube = box_mesh((1.0, 1.0, 1.0))
    open_cube = TriangleMesh(cube.vertices, cube.faces[1:])
    mesh, piece = (open_cube, cube) if open_body == "mesh" else (cube, open_cube)
    card = shape_figures(mesh, [piece])
    assert (card["beyond"], card["missing"]) == (None, None)


@pytest.mark.parametrize(
    ("size", "metres"),
    [
        pytest.param((0.2, 1.0, 0.2), (1.0 - 0.2) / 2, id="longer across"),
        pytest.param((0.3, 0.2, 0.7), (0.7 - 0.2) / 2, id="higher"),
    ],
)
def test_reach_of_crossed_bars_has_closed_form(size, metres):
    """The reach is how far pieces stand out of a mesh at most, in metres.

    The mesh is a bar of 2 x 0.2 x 0.2 m; its pieces are the bar itself and a box about the same middle, which stands
    out on two opposite sides.
    """
    bar = box_mesh((2.0, 0.2, 0.2))
    assert reach(bar, [bar, box_mesh(size)]) == pytest.approx(metres, rel=1e-6)


def test_piece_equal_to_its_mesh_reaches_nowhere():
    """The reach is how far pieces stand out of a mesh; here a bar of 2 x 0.2 x 0.2 m stands in place of itself."""
    bar = box_mesh((2.0, 0.2, 0.2))
    assert reach(bar, [bar]) == 0.0


@pytest.mark.sampled(3)
@pytest.mark.parametrize("sides", [5, 12, 40])
def test_reach_of_a_plugged_tube_is_the_inscribed_radius(sides):
    """The mesh is a tube without floor, inner radius 30 mm; its only piece is a plug, as wide as the tube outside.

    The reach is how far the plug stands beyond the wall at most. The middle of an end of the plug is farthest from the
    wall, which is nearest in the middle of a side.
    """
    wall = [(0.03, 0), (0.035, 0), (0.035, 0.4), (0.03, 0.4), (0.03, 0)]
    tube, plug = revolved_mesh(wall, sides), revolved_mesh([(0, 0), (0.035, 0), (0.035, 0.4), (0, 0.4)], sides)
    assert reach(tube, [plug]) == pytest.approx(0.03 * np.cos(np.pi / sides), rel=1e-6)


@pytest.mark.slow
def test_reach_into_a_fine_narrow_neck_is_measured():
    """A flask of 40 sides whose neck has an inner radius of 15.8 mm; its hull closes the neck by a small lid.

    The middle of the lid is farthest from the wall. Thousands of long triangles along the wall once hid it.
    """
    outer = [(0, 0), (0.042, 0), *((0.042 - 0.0009 * k, 0.003 * k) for k in range(1, 29)), (0.0168, 0.14)]
    inner = [(0.0158, 0.14), *((0.041 - 0.0009 * k, 0.003 * k) for k in range(28, 0, -1)), (0.041, 0.001), (0, 0.001)]
    flask = revolved_mesh([*outer, *inner], 40)
    assert len(flask.faces) > 3000
    assert reach(flask, [hull_collider(flask)]) == pytest.approx(0.0158 * np.cos(np.pi / 40), rel=1e-6)


def test_report_card_measures_planted_overlap_and_slit():
    """Three boxes along x in place of a bar of 0.4 m: from -200 to -100 mm, -101 to -1 mm, and 3 to 200 mm.

    The first two overlap by 1 mm; between the last two is a slit of 4 mm. Seams are listed by pieces, the widest first.
    """
    bar = box_mesh((0.4, 0.1, 0.1))
    pieces = [
        shift_mesh(box_mesh((end - begin, 0.1, 0.1)), ((begin + end) / 2, 0.0, 0.0))
        for begin, end in ((-0.2, -0.1), (-0.101, -0.001), (0.003, 0.2))
    ]
    card = shape_figures(bar, pieces)
    assert card["overlap_mm"] == pytest.approx(1.0, rel=1e-6)
    assert card["slit_mm"] == pytest.approx(4.0, rel=1e-6)
    assert [(seam["kind"], seam["pieces"]) for seam in card["seams"]] == [("slit", [1, 2]), ("overlap", [0, 1])]


def test_single_piece_has_no_seams():
    """A bar in place of itself: there is no second piece to overlap, or to leave a slit."""
    bar = box_mesh((0.4, 0.1, 0.1))
    card = shape_figures(bar, [bar])
    assert (card["overlap_mm"], card["slit_mm"], card["seams"]) == (0.0, 0.0, [])


@pytest.mark.parametrize(("edge", "false", "missed"), [(1.0, 0.0, 0.0), (1.5, 0.5, 0.0), (0.7, None, 1.0)])
def test_figures_of_contact_are_those_of_a_single_body(edge, false, missed):
    """Unit cubes a and b are 0.9 m apart in a frame, which is contact, and 1.2 m in the next, which is none.

    A piece of so many metres stands for a: it touches b from (1 + edge) / 2 on. Cube c, always on b, does not count.
    ``false``: of the contact that is reported, None where none is; ``missed``: of the true contact.
    """
    assembly = prepare(unit_cubes_on_x({"a": [0] * 4, "b": [3, 0.9, 1.2, 3], "c": [3.5, 1.4, 1.7, 3.5]})).assembly
    exact = make_detector(DetectorSpec("exact", "exact", {}), assembly, 0)
    tolerance = Tolerance(assembly, lambda motion: exact.detect(motion, faces=True), tau=0.0)  # none
    reference = Reference.of(exact.detect(assembly.motion), assembly, None, tolerance)
    figures = contact_figures(assembly, reference, "a", [box_mesh((edge, edge, edge))])
    assert (figures["false"], figures["missed"]) == (false, missed)
