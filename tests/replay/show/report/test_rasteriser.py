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
    """The eye, 2 m above the origin, looks down onto the middle of 40 x 30 pixels, 24 pixels a metre there.

    0.1 m to the right is 2.4 columns, 0.2 m upwards 4.8 rows; the third number is one over the depth.
    """
    assert VIEW.pixels(np.array([[0.1, 0.2, 0.0]])) == pytest.approx(np.array([[20 + 2.4, 15 - 4.8, 1 / 2.0]]))


def test_point_behind_the_eye_is_projected_at_the_near_plane():
    """The eye is at a height of 2 m and looks down.

    A point at 3 m counts as if it were on the near plane before the eye.
    """
    ((_column, _row, inverse_depth),) = VIEW.pixels(np.array([[0.0, 0.0, 3.0]]))
    assert inverse_depth == pytest.approx(1.0 / NEAR_PLANE_M)


@pytest.mark.parametrize("right", [pytest.param(0, id="whole picture"), pytest.param(12, id="12 columns left free")])
@pytest.mark.parametrize("direction", [(0.0, 0.0, -1.0), (1.0, -0.5, 0.3)])
def test_view_shows_all_points_as_large_as_fits(direction, right):
    """50 points in a cube of 0.8 m, from a direction, in a picture of 40 x 30 pixels with ``right`` columns left free.

    The outermost is 1 / 2.12 of the width or the height away from the middle, so that a margin is left.
    """
    points = np.random.default_rng(1).uniform([4.7, 0.7, -2.3], [5.5, 1.5, -1.5], (50, 3))  # any seed
    view = View.of(points, np.array(direction), SIZE, right)
    used_size = np.array([WIDE - right, HEIGHT])
    fractions_from_middle = np.abs(view.pixels(points)[:, :2] - used_size / 2) / used_size
    assert fractions_from_middle.max() == pytest.approx(1 / 2.12, rel=1e-9)


SQUARE_2_M_AWAY = Shape(square(0.25), RED)
"""0.5 m wide: 12 x 12 pixels about the middle, rows 9 to 20 and columns 14 to 25."""

SQUARE_1_5_M_AWAY = Shape(square(0.1, height=0.5), BLUE)
"""0.2 m wide, at 32 pixels a metre: covers the middles of 6 x 6 pixels, rows 12 to 17 and columns 17 to 22."""


@pytest.mark.parametrize(
    ("shapes", "nearer"),
    [
        pytest.param([SQUARE_2_M_AWAY, SQUARE_1_5_M_AWAY], 1, id="nearer drawn last"),
        pytest.param([SQUARE_1_5_M_AWAY, SQUARE_2_M_AWAY], 0, id="nearer drawn first"),
    ],
)
def test_nearer_shape_is_visible_at_each_pixel(shapes, nearer):
    """A square of 0.5 m 2 m from the eye covers 12 x 12 pixels of 40 x 30, one of 0.2 m at 1.5 m covers 6 x 6 of these.

    ``draw_picture`` returns the number of the shape that is seen at each pixel; -1: none.
    """
    _picture, number = draw_picture(VIEW, shapes, [], [], WHITE)
    expected = np.full((HEIGHT, WIDE), -1)
    expected[9:21, 14:26] = 1 - nearer
    expected[12:18, 17:23] = nearer
    assert np.array_equal(number, expected)


def test_surface_reaching_behind_the_eye_is_drawn_before_it():
    """A floor 0.5 m below the eye, from 3 m before it to 5 m behind it, and wide: it fills the lower rows of 30.

    A metre is 48 pixels at 1 m: the far edge, at 48 / 3 pixels a metre, is 0.5 * 16 = 8 rows below the middle, row 15.
    """
    floor = np.array([[[-9.0, -0.5, -1.0], [9.0, -0.5, -1.0], [0.0, -0.5, 7.0]]])
    _picture, number = draw_picture(VIEW, [Shape(floor, RED)], [], [], WHITE)
    assert (number[: 15 + 8] == -1).all()
    assert (number[15 + 8 :] == 0).all()


def test_light_falls_on_faces_by_their_angle_to_it():
    """A red square in the middle faces the eye: half of its colour, and half times the cosine to the light.

    The light comes from (-0.35, 0.6, 0.72), of which 0.72 is towards the eye. The background is white.
    """
    picture, _number = draw_picture(VIEW, [SQUARE_2_M_AWAY], [], [], WHITE)
    brightness = 0.5 + 0.5 * 0.72 / np.linalg.norm([-0.35, 0.6, 0.72])
    assert picture[15, 20] == pytest.approx([brightness, 0.0, 0.0])
    assert picture[0, 0].tolist() == [1.0, 1.0, 1.0]


RED_GLASS, BLUE_GLASS = Shape(square(0.05), RED, 0.3), Shape(square(0.05, height=-0.1), BLUE, 0.3)
"""Small squares of alpha 0.3 about the middle of the picture, 2 and 2.1 m from the eye, so seen straight."""


def test_glass_is_mixed_by_its_alpha():
    """A small square of red glass, alpha 0.3, in the middle of a white picture: its green and blue are 0.7 of white.

    The middle is the pixel in row 15 and column 20.
    """
    picture, _number = draw_picture(VIEW, [], [RED_GLASS], [], WHITE)
    assert picture[15, 20] == pytest.approx([1.0, 0.7, 0.7], abs=1e-3)


def test_two_glasses_are_mixed_equally():
    """Red and blue glass of alpha 0.3 each before white: 0.7 * 0.7 of white is left, the rest half red, half blue."""
    picture, _number = draw_picture(VIEW, [], [RED_GLASS, BLUE_GLASS], [], WHITE)
    half_of_rest = (1 - 0.49) / 2
    assert picture[15, 20] == pytest.approx([0.49 + half_of_rest, 0.49, 0.49 + half_of_rest], abs=1e-3)


def test_glass_behind_an_opaque_shape_is_hidden():
    """A blue square of 0.5 m, 1.5 m from the eye, stands before two small squares of glass 2 and 2.1 m away."""
    opaque = Shape(square(0.25, height=0.5), BLUE)
    without_glass, _number = draw_picture(VIEW, [opaque], [], [], WHITE)
    with_glass, _number = draw_picture(VIEW, [opaque], [RED_GLASS, BLUE_GLASS], [], WHITE)
    assert np.array_equal(with_glass, without_glass)


def test_glass_viewed_from_aside_is_denser():
    """A pane of red glass, alpha 0.2, that rises by 60 degrees, so that the cosine to the eye is 0.5.

    Its alpha is multiplied by 1 + 3 * (1 - 0.5) ** 3 = 1.375; the background is white. The pixel is that in the middle.
    """
    flat = square(0.05)
    pane = np.stack([flat[..., 0], 0.5 * flat[..., 1], np.sqrt(0.75) * flat[..., 1]], axis=-1)
    picture, _number = draw_picture(VIEW, [], [Shape(pane, RED, 0.2)], [], WHITE)
    alpha = 1.375 * 0.2
    assert picture[15, 20] == pytest.approx([1.0, 1.0 - alpha, 1.0 - alpha], abs=0.01)


@pytest.mark.parametrize(
    ("width", "rows", "columns"),
    [pytest.param(1, (15, 15), (15, 25), id="a pixel"), pytest.param(3, (14, 16), (14, 26), id="three pixels")],
)
def test_lines_cover_the_pixels_between_their_ends(width, rows, columns):
    """A blue line of alpha 0.5 through the middle (column 20, row 15), 0.2 m to the left and the right: 4.8 columns.

    Ends are rounded, to 15 and 25; a wide line is wider on all sides. ``rows``, ``columns``: the first and the last.
    """
    line = Lines(np.array([[[-0.2, 0.0, 0.0], [0.2, 0.0, 0.0]]]), BLUE, alpha=0.5, width=width)
    picture, _number = draw_picture(VIEW, [], [], [line], WHITE)
    (first_row, last_row), (first_column, last_column) = rows, columns
    expected = np.zeros((HEIGHT, WIDE), dtype=bool)
    expected[first_row : last_row + 1, first_column : last_column + 1] = True
    is_drawn = picture[..., 0] < 1.0
    assert np.array_equal(is_drawn, expected)
    assert picture[15, 20] == pytest.approx([0.5, 0.5, 1.0])


def test_line_is_hidden_by_what_is_nearer():
    """A blue line across the picture at height 0, 2 m from the eye, and a red square about the middle of it.

    The line is seen beside the square in any case.
    """
    rows = {
        "square nearer to the eye": (0.1, False),
        "line lies in the square": (0.0, True),
        "square farther away": (-0.1, True),
    }
    for row, (height, is_visible) in rows.items():
        line = Lines(np.array([[[-0.9, 0.0, 0.0], [0.9, 0.0, 0.0]]]), BLUE, alpha=1.0)
        picture, _number = draw_picture(VIEW, [Shape(square(0.25, height=height), RED)], [], [line], WHITE)
        blue_in_the_middle = picture[15, 20, 2]  # row 15 of 30, column 20 of 40; white and blue have 1, red has 0
        assert (blue_in_the_middle == 1.0) == is_visible, row
        assert picture[15, 0].tolist() == picture[15, 39].tolist() == [0.0, 0.0, 1.0], row


def test_focal_length_is_an_opening_of_35_degrees():
    """From the upper to the lower edge of a picture of height 1, whose eye is ``FOCAL_RATIO``, 1.6, away from it.

    1.6 is rounded: it gives 34.7 degrees.
    """
    opening_deg = np.degrees(2 * np.arctan(0.5 / FOCAL_RATIO))
    assert opening_deg == pytest.approx(35.0, abs=0.5)
