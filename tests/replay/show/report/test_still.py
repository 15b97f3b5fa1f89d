"""Pictures of faults: what covers what, and that the arrow is as long as the gap."""

import base64
import io
import re

import numpy as np
import pytest
from PIL import Image
from support.report_states import run_with_steady_times

from replay.show.report import still
from replay.show.report.page import report_html
from replay.show.report.rasteriser import FOCAL_RATIO, Lines, Shape, View, covered_pixels, draw_picture
from replay.show.report.still import FIRST_SIZE, fault_still

pytestmark = pytest.mark.usefixtures("usual_pixels")

SIZE = (180, 120)
BLACK = np.zeros((SIZE[1], SIZE[0], 3))


@pytest.fixture
def usual_pixels(coarse_stills, monkeypatch):
    """Pictures of faults have as many pixels as in a report of a user."""
    monkeypatch.setattr(still, "PIXELS_PER_UNIT", coarse_stills)


def view_along_minus_z():
    """A camera at the origin that looks along -Z, with a picture of SIZE pixels."""
    return View(np.zeros(3), np.eye(3), SIZE, (SIZE[0] / 2, SIZE[1] / 2))


def wall_at(z, edge=4.0):
    """Two triangles across the picture at this depth."""
    a, b, c, d = ([x, y, z] for x, y in ((-edge, -edge), (edge, -edge), (edge, edge), (-edge, edge)))
    return np.array([[a, b, c], [a, c, d]], dtype=np.float64)


def test_triangle_covers_exactly_pixels_whose_rays_meet_the_triangle():
    """12 random triangles before a camera at the origin that looks along -Z, four of them partly behind it.

    A pixel is covered exactly if the ray through its middle meets the triangle, at the same depth; within 1e-9 of an
    edge both answers will do.
    """
    rng = np.random.default_rng(3)  # any seed
    corners = rng.uniform([-1, -0.6, -3], [1, 0.6, -0.5], (12, 3, 3))
    behind_the_camera = 0.4
    corners[8:, 0, 2] = behind_the_camera
    blocks = zip(*covered_pixels(corners, view_along_minus_z()), strict=True)
    triangles, pixels, inverse_depths = (np.concatenate(column) for column in blocks)
    width, height = SIZE
    y, x = np.divmod(np.arange(width * height), width)
    focus = FOCAL_RATIO * height
    across, up = (x + 0.5 - width / 2) / focus, -(y + 0.5 - height / 2) / focus
    rays = np.stack([across, up, -np.ones(len(x))], axis=1)
    for number, (a, b, c) in enumerate(corners):
        # A point s a + t b + u c on a ray, by Cramer's rule: s, t and u are scaled volumes, of one sign inside.
        fractions = np.stack([rays @ np.cross(b, c), rays @ np.cross(c, a), rays @ np.cross(a, b)], axis=1)
        fractions *= np.sign(np.linalg.det([a, b, c]))
        is_clear = np.abs(fractions).min(axis=1) > 1e-9
        inside = set(np.flatnonzero((fractions > 0).all(axis=1) & is_clear))
        on_edge = set(np.flatnonzero(~is_clear))
        of_triangle = triangles == number
        assert inside <= set(pixels[of_triangle]) <= inside | on_edge
        depth = abs(np.linalg.det([a, b, c])) / fractions[pixels[of_triangle]].sum(axis=1)
        assert np.allclose(1 / inverse_depths[of_triangle], depth, rtol=1e-9)


@pytest.mark.parametrize(("alpha", "is_glass"), [(1.0, False), (0.2, True)], ids=["opaque", "glass"])
def test_opaque_wall_hides_and_glass_does_not(alpha, is_glass):
    """A blue wall 1 m ahead fills the picture; behind it are a yellow line at 1.5 m and a red wall at 2 m.

    Through glass red (darkened by shade, so over 0.3 of 1) and yellow (over 0.9 of green) are seen. The first opaque
    shape is the blue wall, or behind glass the red one; 2 % of pixels lie on the diagonal between its two triangles.
    """
    red, blue, yellow = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (1.0, 1.0, 0.0)
    blue_wall, red_wall = Shape(wall_at(-1.0), blue, alpha), Shape(wall_at(-2.0), red)
    opaque, glass = ([red_wall], [blue_wall]) if is_glass else ([blue_wall, red_wall], [])
    line = Lines(np.array([[[-0.5, 0.0, -1.5], [0.5, 0.0, -1.5]]]), yellow, 1.0)
    picture, shape_of_pixel = draw_picture(view_along_minus_z(), opaque, glass, [line], BLACK)
    reds, greens, _blues = np.moveaxis(picture, -1, 0)
    assert (shape_of_pixel == 0).mean() > 0.98
    assert (reds.max() > 0.3) == is_glass
    assert (greens.max() > 0.9) == is_glass


@pytest.mark.slow
def test_picture_of_a_false_contact_holds_the_whole_collider():
    """The collider box that is reported is drawn as a yellow cage, in over 200 pixels, none on the picture's border.

    The gap to the other body is written into the picture, in millimetres.
    """
    result = run_with_steady_times("only false")
    (fault,) = result.false["c"]
    html, *_ = fault_still(result, "c", fault, FIRST_SIZE)
    assert f"{1e3 * fault.metres:.2g} mm" in html
    assert "from " in html
    encoded = re.search('image/webp;base64,([^"]+)"', html)[1]
    picture = Image.open(io.BytesIO(base64.b64decode(encoded)))
    red, green, blue = np.moveaxis(np.asarray(picture.convert("RGB")).astype(int), -1, 0)
    is_yellow = (red > 190) & (green > 140) & (blue < 90)
    assert is_yellow.sum() > 200
    assert not is_yellow[[0, -1], :].any()
    assert not is_yellow[:, [0, -1]].any()


@pytest.mark.slow
def test_arrow_of_a_gap_has_two_symmetric_heads():
    """The gap of a false contact is drawn as an SVG path of three strokes: a shaft, and a head at each of its ends.

    A head is two lines from its tip, 6 units back along the shaft and 4 aside; coordinates have a digit.
    """
    result = run_with_steady_times("in a hollow")
    (fault,) = result.false["hull"]
    html, *_ = fault_still(result, "hull", fault, FIRST_SIZE)
    path, *_ = re.findall(r'd="((?:M[-\d. ]+(?:L[-\d. ]+)+){3})"', html)
    shaft, *heads = (np.array(re.findall(r"([-\d.]+) ([-\d.]+)", stroke), float) for stroke in path.split("M")[1:])
    begin, end = shaft
    direction = (end - begin) / np.linalg.norm(end - begin)
    for (left, tip, right), shaft_end, inward in zip(heads, (begin, end), (direction, -direction), strict=True):
        np.testing.assert_allclose(tip, shaft_end)
        np.testing.assert_allclose((left + right) / 2.0 - tip, 6.0 * inward, atol=0.15)
        assert np.linalg.norm(left - right) == pytest.approx(2 * 4.0, abs=0.2)


@pytest.mark.parametrize("state", ["several", "only false", "between frames", "no reference", "a tradeoff"])
def test_drawings_of_a_page_are_unchanged(state, monkeypatch, snapshot):
    """All drawings of the report of a run in this state equal stored ones, which people reviewed.

    Lanes, rulers and plots are compared as they are written (SVG, HTML); of each picture in pixels, the mean of each of
    6 by 8 tiles.
    """
    pictures, image_of_pixels = [], Image.fromarray

    def with_tiles_noted(pixels):
        tiles = [tile for band in np.array_split(pixels, 6) for tile in np.array_split(band, 8, axis=1)]
        pictures.append(" ".join(f"{tile.mean():.0f}" for tile in tiles))
        return image_of_pixels(pixels)

    monkeypatch.setattr(Image, "fromarray", with_tiles_noted)
    page = report_html(run_with_steady_times(state))
    drawings = re.findall(r"<svg\b.*?</svg>|<div class=.ticks.*?</div>", page, re.DOTALL)
    assert [*pictures, *(re.sub('base64,[^"]+', "", drawing) for drawing in drawings)] == snapshot
