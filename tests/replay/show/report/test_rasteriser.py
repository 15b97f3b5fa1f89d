"""Triangles and lines land on the pixels that the projection gives, and hide each other by their distance.

The eye of most tests is at (0, 0, 2) m and looks along -Z onto the middle of a picture of 40 x 30 pixels: at 2 m a
metre is 1.6 x 30 / 2 = 24 pixels.
"""

import numpy as np
import pytest

from replay.show.report.rasteriser import FOCAL_RATIO, NEAR_PLANE_M, Lines, Shape, View, draw_picture

SIZE = WIDE, HEIGHT = 40, 30
VIEW = View(np.array([0.0, 0.0, 2.0]), np.eye(3), SIZE, (20.0, 15.0))
WHITE = np.ones((HEIGHT, WIDE, 3))
RED, BLUE = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)


def square(half, height=0.0):
    """Two triangles (2, 3, 3) of a square about the Z axis at a height."""
    corners = np.array([[-half, -half], [half, -half], [half, half], [-half, half]])
    points = np.column_stack([corners, np.full(4, height)])
    return points[[[0, 1, 2], [0, 2, 3]]]


def pixels_where(mask):
    """First and last row and column of what is marked, as (rows, columns)."""
    rows, columns = np.nonzero(mask)
    return (rows.min(), rows.max()), (columns.min(), columns.max())


def test_points_are_projected_to_columns_and_rows():
    """0.1 m to the right is 2.4 columns and 0.2 m upwards 4.8 rows; a point behind the eye is at the near plane."""
    assert VIEW.pixels(np.array([[0.1, 0.2, 0.0]])) == pytest.approx(np.array([[22.4, 10.2, 0.5]]))
    assert VIEW.pixels(np.array([[0.0, 0.0, 3.0]]))[0, 2] == pytest.approx(1.0 / NEAR_PLANE_M)


@pytest.mark.parametrize("right", [0, 12])
@pytest.mark.parametrize("direction", [(0.0, 0.0, -1.0), (1.0, -0.5, 0.3)])
def test_view_shows_all_points_as_large_as_fits(direction, right):
    """The farthest from the middle of the free part is 1 / 2.12 of its width or height away."""
    points = np.random.default_rng(1).uniform([4.7, 0.7, -2.3], [5.5, 1.5, -1.5], (50, 3))
    view = View.of(points, np.array(direction), SIZE, right)
    free = np.array([WIDE - right, HEIGHT])
    away = np.abs(view.pixels(points)[:, :2] - free / 2) / free
    assert away.max() == pytest.approx(1 / 2.12, rel=1e-9)


def test_nearer_shape_is_seen_at_each_pixel():
    """A square of 0.5 m at 2 m covers 12 pixels, one of 0.2 m at 1.5 m 6.4; each pixel whose middle is covered."""
    _, number = draw_picture(VIEW, [Shape(square(0.25), RED), Shape(square(0.1, height=0.5), BLUE)], [], [], WHITE)
    # From 15 - 6 to 15 + 6 and from 20 - 6 to 20 + 6; the middles of pixels are halves.
    assert pixels_where(number >= 0) == ((9, 20), (14, 25))
    assert pixels_where(number == 1) == ((12, 17), (17, 22))
    assert (number[9:21, 14:26] >= 0).all() and (number[12:18, 17:23] == 1).all()


def test_farther_shape_does_not_hide_a_nearer_drawn_before():
    """The small square, which is nearer, is drawn first."""
    _, number = draw_picture(VIEW, [Shape(square(0.1, height=0.5), BLUE), Shape(square(0.25), RED)], [], [], WHITE)
    assert (number[12:18, 17:23] == 0).all() and number[9, 14] == 1 and number[0, 0] == -1


def test_surface_reaching_behind_the_eye_is_drawn_before_it():
    """A floor 0.5 m below the eye, from 3 m before to 5 m behind it, fills the lower rows over the whole width."""
    floor = np.array([[[-9.0, -0.5, -1.0], [9.0, -0.5, -1.0], [0.0, -0.5, 7.0]]])
    _, number = draw_picture(VIEW, [Shape(floor, RED)], [], [], WHITE)
    # Its far edge, 3 m away, is 0.5 x 48 / 3 = 8 rows below the middle.
    assert (number[:23] == -1).all() and (number[23:] == 0).all()


def test_light_falls_on_faces_by_their_angle_to_it():
    """A face that looks at the eye: half its colour, and half by the cosine to the light (-0.35, 0.6, 0.72)."""
    picture, _ = draw_picture(VIEW, [Shape(square(0.25), RED)], [], [], WHITE)
    brightness = 0.5 + 0.5 * 0.72 / np.linalg.norm([-0.35, 0.6, 0.72])
    assert picture[15, 20] == pytest.approx([brightness, 0.0, 0.0]) and picture[0, 0].tolist() == [1.0, 1.0, 1.0]


def test_glass_is_mixed_by_its_alpha_unless_it_is_hidden():
    """Red glass of alpha 0.3 before white; with as much blue glass 0.49 of the white is left, and equal parts of both.

    Small squares far away look straight at the eye.
    """
    glass = [Shape(square(0.05), RED, 0.3), Shape(square(0.05, height=-0.1), BLUE, 0.3)]
    picture, _ = draw_picture(VIEW, [], glass[:1], [], WHITE)
    assert picture[15, 20] == pytest.approx([1.0, 0.7, 0.7], abs=1e-3)
    picture, _ = draw_picture(VIEW, [], glass, [], WHITE)
    assert picture[15, 20] == pytest.approx([0.745, 0.49, 0.745], abs=1e-3)
    before, _ = draw_picture(VIEW, [Shape(square(0.25, height=0.5), BLUE)], [], [], WHITE)
    hidden, _ = draw_picture(VIEW, [Shape(square(0.25, height=0.5), BLUE)], glass, [], WHITE)
    assert np.array_equal(before, hidden)


def test_glass_seen_from_aside_is_denser():
    """A pane that rises by 60 degrees shows half its area: alpha times 1 + 3 x (1 - 0.5) ** 3, that is 1.375."""
    flat = square(0.05)
    pane = np.stack([flat[..., 0], 0.5 * flat[..., 1], np.sqrt(0.75) * flat[..., 1]], axis=-1)
    picture, _ = draw_picture(VIEW, [], [Shape(pane, RED, 0.2)], [], WHITE)
    assert picture[15, 20] == pytest.approx([1.0, 1.0 - 1.375 * 0.2, 1.0 - 1.375 * 0.2], abs=0.01)


@pytest.mark.parametrize(("width", "rows"), [(1, (15, 15)), (3, (14, 16))])
def test_lines_cover_the_pixels_between_their_ends(width, rows):
    """From 0.2 m left of the middle to 0.2 m right: 20 - 4.8 to 20 + 4.8 columns, rounded."""
    line = Lines(np.array([[[-0.2, 0.0, 0.0], [0.2, 0.0, 0.0]]]), BLUE, alpha=0.5, width=width)
    picture, _ = draw_picture(VIEW, [], [], [line], WHITE)
    drawn = picture[..., 0] < 1.0
    margin = width // 2
    assert pixels_where(drawn) == (rows, (15 - margin, 25 + margin))
    assert drawn[rows[0] : rows[1] + 1, 15 - margin : 26 + margin].all()
    assert picture[15, 20] == pytest.approx([0.5, 0.5, 1.0])


@pytest.mark.parametrize(("height", "is_seen"), [(0.1, False), (0.0, True), (-0.1, True)])
def test_line_is_hidden_by_what_is_nearer(height, is_seen):
    """A square above, in or below the line; the line is drawn on a surface that it lies in."""
    line = Lines(np.array([[[-0.9, 0.0, 0.0], [0.9, 0.0, 0.0]]]), BLUE, alpha=1.0)
    picture, _ = draw_picture(VIEW, [Shape(square(0.25, height=height), RED)], [], [line], WHITE)
    assert (picture[15, 20, 2] == 1.0) == is_seen
    assert picture[15, 0].tolist() == picture[15, 39].tolist() == [0.0, 0.0, 1.0]


def test_focal_length_is_an_opening_of_35_degrees():
    """From the upper to the lower edge of the picture."""
    assert np.degrees(2 * np.arctan(0.5 / FOCAL_RATIO)) == pytest.approx(35.0, abs=0.5)
