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


def assembly_of(posed_frames, pairs=()):
    """Six frames of two bodies, of which the first has a pose in these frames alone, the second in none."""
    valid = np.zeros((6, 2), dtype=bool)
    valid[posed_frames, 0] = True
    return SimpleNamespace(motion=SimpleNamespace(valid=valid), pairs=np.array(pairs, dtype=int).reshape(-1, 2))


def test_first_and_middle_picture_have_poses():
    """Three moments of a recording of six frames are drawn: the first and the middle frame with a pose, the closest.

    The closest one, frame 2, is passed in; no pair of bodies is.
    """
    rows = {
        "three frames with poses": ([1, 3, 4], 1, 3),
        "four frames: the upper of both in the middle": ([1, 2, 4, 5], 1, 4),
        "no pose: the first frame": ([], 0, 0),
    }
    for row, (posed_frames, first, middle) in rows.items():
        moments = moments_to_show(assembly_of(posed_frames), closest_frame=2, closest_pair=0)
        assert [(moment.name, moment.frame) for moment in moments] == [
            ("first", first),
            ("middle", middle),
            ("closest", 2),
        ], row


def test_closest_picture_names_its_two_bodies():
    """The first and the middle picture are about all bodies, (); the third about bodies 0 and 1 of the only pair."""
    assembly = assembly_of([1], pairs=[(0, 1)])
    moments = moments_to_show(assembly, closest_frame=2, closest_pair=0)
    assert [moment.bodies for moment in moments] == [(), (), (0, 1)]


def test_closest_picture_without_pairs_is_about_all_bodies():
    """The third picture of a recording is of the closest moment; without pairs it is about all bodies, ()."""
    *_, closest = moments_to_show(assembly_of([1], pairs=[]), closest_frame=2, closest_pair=0)
    assert closest.bodies == ()


POINTS = np.array([[-0.05, 0.7, -0.15], [0.31, 2.0, 0.25]])
"""From -0.05 to 0.31 m on X and -0.15 to 0.25 m on Z, the lowest at a height of 0.7 m."""


def test_grid_reaches_to_the_next_line_below_the_points():
    """Points from -0.05 to 0.31 m on X and -0.15 to 0.25 m on Z, the lowest at a height of 0.7 m.

    The grid lies at 0.7 m, from -0.1 to 0.4 m on X and -0.2 to 0.3 m on Z: six lines each way.
    """
    guides = guides_of(POINTS, corner_direction=np.array([1.0, 0.0, 1.0]))
    ends = guides.grid.reshape(-1, 3)
    assert guides.spacing == GRID_M == 0.1
    assert len(guides.grid) == 6 + 6
    assert ends.min(axis=0) == pytest.approx([-0.1, 0.7, -0.2])
    assert ends.max(axis=0) == pytest.approx([0.4, 0.7, 0.3])


def test_axes_stand_at_the_grid_corner_in_that_direction():
    """The grid is from -0.1 to 0.4 m on X and -0.2 to 0.3 m on Z, 0.7 m high; ``direction``: towards the user.

    Three axes begin at one corner and are 0.1 m long, along X, Y and Z.
    """
    rows = {
        "+x +z": ((1.0, 0.0, 1.0), 0.4, 0.3),
        "-x +z": ((-1.0, 0.0, 1.0), -0.1, 0.3),
        "+x -z": ((1.0, 0.0, -1.0), 0.4, -0.2),
    }
    for row, (direction, x, z) in rows.items():
        guides = guides_of(POINTS, np.array(direction))
        begins, ends = guides.axes[:, 0], guides.axes[:, 1]
        assert begins == pytest.approx(np.tile([x, 0.7, z], (3, 1))), row
        assert ends - begins == pytest.approx(0.1 * np.eye(3)), row


@pytest.mark.parametrize(
    ("steps", "spacing"),
    [
        pytest.param(MOST_LINES - 2, 0.1, id="the most lines"),
        pytest.param(MOST_LINES - 1, 1.0, id="a step longer"),
    ],
)
def test_grid_of_too_many_lines_is_coarser(steps, spacing):
    """Two points along Z, a little less than so many steps of 0.1 m apart; there are at most 41 lines each way.

    Two lines may lie beyond the points, so that 39 steps have room.
    """
    points = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 1.0 + 0.999 * steps * 0.1]])
    guides = guides_of(points, corner_direction=np.ones(3))  # any direction
    assert guides.spacing == pytest.approx(spacing)


def drawn_and_written(monkeypatch, moment, posed=(True, True, True)):
    """Grid, bodies and texts with their pixels of a picture of three cubes of 10 cm, at x = 0, 0.3 and 5 m."""
    drawn, texts = {}, {}

    def draw(view, shapes, _edges, lines, background):
        grid, *axes = lines
        drawn.update(view=view, bodies=len(shapes), grid=grid.ends, axes=axes)
        return background, None

    monkeypatch.setattr(scene_look, "draw_picture", draw)
    monkeypatch.setattr(ImageDraw.ImageDraw, "text", lambda _, at, text, **style: texts.update({text: at}))
    names, mesh = ("cup", "rod", "far"), box_mesh((0.1, 0.1, 0.1))
    translations = np.zeros((1, 3, 3))
    translations[0, :, 0] = (0.0, 0.3, 5.0)
    motion = Motion([0.0], translations, np.tile(np.eye(3), (1, 3, 1, 1)), [posed])
    bodies = [SimpleNamespace(name=name, mesh=mesh) for name in names]
    scene_picture(SimpleNamespace(bodies=bodies, motion=motion), Scene(), moment)
    return SimpleNamespace(**drawn, texts=texts)


CUP, ROD = 0, 1


def test_grid_lies_below_the_bodies_that_the_picture_is_about(monkeypatch):
    """Cubes of 10 cm, cup, rod and a third, at x = 0, 0.3 and 5 m; all with a pose (``posed``) are drawn.

    The picture is about those of the pair, else about all. The grid ends at the next line to the right of them, beyond
    the x of the row. Its lines are 10 cm apart, or 1 m for bodies over 3.9 m wide together. The frame is at 0 s.
    """
    rows = {
        "pair: 0.35 m": ((CUP, ROD), (True, True, True), 3, 0.4, "10 cm"),
        "all: 5.05 m": ((), (True, True, True), 3, 6.0, "1 m"),
        "all with a pose: 0.35 m": ((), (True, True, False), 2, 0.4, "10 cm"),
        "pair without a pose: the third, 5.05 m": ((CUP, ROD), (False, False, True), 1, 5.1, "10 cm"),
    }
    for row, (pair, posed, bodies, right_end, spacing) in rows.items():
        drawn = drawn_and_written(monkeypatch, Moment("closest", frame=0, bodies=pair), posed)
        assert drawn.bodies == bodies, row
        assert drawn.grid[..., 0].max() == pytest.approx(right_end), row
        assert f"closest moment, 0.000 s; grid {spacing}" in drawn.texts, row


def test_axes_are_named_right_of_and_above_their_ends(monkeypatch):
    """Each of the three axes has its name less than 10 pixels right of and above its end; pixels count downwards."""
    drawn = drawn_and_written(monkeypatch, Moment("first", frame=0))
    for name, axis in zip(scene_look.AXIS_NAMES, drawn.axes, strict=True):
        ((_begin, end),) = axis.ends
        ((end_x, end_y, _depth),) = drawn.view.pixels(end[None])
        text_x, text_y = drawn.texts[name]
        assert 0 < text_x - end_x < 10
        assert 0 < end_y - text_y < 10
