"""Pictures of a scene: which moments, and the grid below the bodies."""

from types import SimpleNamespace

import numpy as np
import pytest
from PIL import ImageDraw
from support.shapes import box_mesh

from cdcore import Motion
from replay.show import scene_look
from replay.show.scene_look import GRID_M, MOST_LINES, Moment, guides_of, moments_to_show, scene_picture
from sessions import Scene


def assembly_of(posed, pairs=()):
    """An assembly of two bodies, of which the first has a pose in these frames alone."""
    valid = np.zeros((6, 2), dtype=bool)
    valid[posed, 0] = True
    return SimpleNamespace(motion=SimpleNamespace(valid=valid), pairs=np.array(pairs, dtype=int).reshape(-1, 2))


@pytest.mark.parametrize(("posed", "frames"), [([1, 3, 4], [1, 3]), ([1, 2, 4, 5], [1, 4]), ([], [0, 0])])
def test_first_and_middle_picture_have_poses(posed, frames):
    """``posed``: frames with poses; ``frames``: the first and the middle one of them."""
    moments = moments_to_show(assembly_of(posed), closest_frame=2, closest_pair=0)
    assert [moment.frame for moment in moments] == [*frames, 2] and moments[2].bodies == ()


def test_closest_picture_names_its_two_bodies():
    """The first and the middle picture are of no pair; the third is of bodies 0 and 1 of the only pair."""
    moments = moments_to_show(assembly_of([1], pairs=[(0, 1)]), closest_frame=2, closest_pair=0)
    assert [moment.bodies for moment in moments] == [(), (), (0, 1)]


@pytest.mark.parametrize(
    ("direction", "corner"),
    [((1.0, 0.0, 1.0), (0.4, 0.3)), ((-1.0, 0.0, 1.0), (-0.1, 0.3)), ((1.0, 0.0, -1.0), (0.4, -0.2))],
)
def test_axes_stand_at_the_grid_corner_in_that_direction(direction, corner):
    """Points from -0.05 to 0.31 m on X and -0.15 to 0.25 m on Z: the grid of 0.1 m reaches out to the next line."""
    points = np.array([[-0.05, 0.7, -0.15], [0.31, 2.0, 0.25]])
    guides = guides_of(points, np.array(direction))
    assert guides.spacing == GRID_M == 0.1
    assert guides.axes[:, 0] == pytest.approx(np.tile([corner[0], 0.7, corner[1]], (3, 1)))
    assert guides.axes[:, 1] - guides.axes[:, 0] == pytest.approx(0.1 * np.eye(3))
    ends = guides.grid.reshape(-1, 3)
    assert len(guides.grid) == 6 + 6 and ends.min(axis=0) == pytest.approx([-0.1, 0.7, -0.2])
    assert ends.max(axis=0) == pytest.approx([0.4, 0.7, 0.3])


@pytest.mark.parametrize(("lengths", "spacing"), [(MOST_LINES - 2, GRID_M), (MOST_LINES - 1, 10 * GRID_M)])
def test_grid_of_too_many_lines_is_coarser(lengths, spacing):
    """``lengths``: of the grid along Z, in steps of 0.1 m; the points have no width on X."""
    points = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 1.0 + 0.999 * lengths * GRID_M]])
    assert guides_of(points, np.ones(3)).spacing == pytest.approx(spacing)


def drawn_and_written(monkeypatch, moment, posed=(True, True, True)):
    """Grid, bodies and texts with their pixels of a picture of three cubes of 10 cm, at x = 0, 0.3 and 5 m."""
    drawn, texts = {}, {}

    def draw(view, shapes, _edges, lines, background):
        drawn.update(view=view, bodies=len(shapes), grid=lines[0].ends, axes=lines[1:])
        return background, None

    monkeypatch.setattr(scene_look, "draw_picture", draw)
    monkeypatch.setattr(ImageDraw.ImageDraw, "text", lambda _, at, text, **style: texts.update({text: at}))
    names, mesh = ("cup", "rod", "far"), box_mesh((0.1, 0.1, 0.1))
    translations = np.zeros((1, 3, 3))
    translations[0, :, 0] = (0.0, 0.3, 5.0)
    motion = Motion([0.0], translations, np.tile(np.eye(3), (1, 3, 1, 1)), [posed])
    bodies = [SimpleNamespace(name=name, mesh=mesh) for name in names]
    scene_picture(SimpleNamespace(bodies=bodies, motion=motion), Scene(), moment)
    return drawn, texts


@pytest.mark.parametrize(
    ("pair", "posed", "bodies", "right_end", "spacing"),
    [
        ((0, 1), (True, True, True), 3, 0.4, "10 cm"),
        ((), (True, True, True), 3, 6.0, "1 m"),
        ((), (True, True, False), 2, 0.4, "10 cm"),
        ((0, 1), (False, False, True), 1, 5.1, "10 cm"),
    ],
    ids=["pair", "all", "all with a pose", "pair without a pose"],
)
def test_grid_lies_below_the_bodies_that_the_picture_is_about(pair, posed, bodies, right_end, spacing, monkeypatch):
    """Cubes reach 5 cm beyond their middles; the grid ends at the next line."""
    drawn, texts = drawn_and_written(monkeypatch, Moment("closest", 0, pair), posed)
    assert drawn["bodies"] == bodies and drawn["grid"][..., 0].max() == pytest.approx(right_end)
    assert f"closest moment, 0.000 s; grid {spacing}" in texts


def test_axes_are_named_right_of_and_above_their_ends(monkeypatch):
    """By less than 10 pixels, of which those downwards count positive."""
    drawn, texts = drawn_and_written(monkeypatch, Moment("first", 0))
    for name, axis in zip(scene_look.AXIS_NAMES, drawn["axes"], strict=True):
        x, y, _ = drawn["view"].pixels(axis.ends[0, 1:])[0]
        text_x, text_y = texts[name]
        assert 0 < text_x - x < 10 and 0 < y - text_y < 10
