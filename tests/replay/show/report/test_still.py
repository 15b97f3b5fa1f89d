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
    """12 random triangles, four of them partly behind the camera, against rays through the middles of pixels."""
    rng = np.random.default_rng(3)
    local = rng.uniform([-1, -0.6, -3], [1, 0.6, -0.5], (12, 3, 3))
    local[8:, 0, 2] = 0.4  # these reach behind the eye
    blocks = zip(*covered_pixels(local, view_along_minus_z()), strict=True)
    triangles, pixels, inverse_depths = (np.concatenate(column) for column in blocks)
    y, x = np.divmod(np.arange(SIZE[0] * SIZE[1]), SIZE[0])
    focus = FOCAL_RATIO * SIZE[1]
    across, up = (x + 0.5 - SIZE[0] / 2) / focus, -(y + 0.5 - SIZE[1] / 2) / focus
    rays = np.stack([across, up, -np.ones(len(x))], axis=1)
    for number, (a, b, c) in enumerate(local):
        # a point s a + t b + u c on a ray, by Cramer's rule: the shares are scaled volumes, of one sign inside
        fractions = np.stack([rays @ np.cross(b, c), rays @ np.cross(c, a), rays @ np.cross(a, b)], axis=1)
        fractions *= np.sign(np.linalg.det([a, b, c]))
        clear = np.abs(fractions).min(axis=1) > 1e-9
        inside = np.flatnonzero((fractions > 0).all(axis=1) & clear)
        mine = triangles == number
        assert set(inside) <= set(pixels[mine]) <= set(inside) | set(np.flatnonzero(~clear))
        depth = abs(np.linalg.det([a, b, c])) / fractions[pixels[mine]].sum(axis=1)
        assert np.allclose(1 / inverse_depths[mine], depth, rtol=1e-9)


@pytest.mark.parametrize("alpha", [1.0, 0.2], ids=["opaque", "glass"])
def test_opaque_wall_hides_and_glass_does_not(alpha):
    """A blue wall 1 m ahead fills the picture; behind it are a yellow line at 1.5 m and a red wall at 2 m."""
    red, blue, yellow = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (1.0, 1.0, 0.0)
    blue_wall, red_wall = Shape(wall_at(-1.0), blue, alpha), Shape(wall_at(-2.0), red)
    opaque, glass = ([blue_wall, red_wall], []) if alpha == 1 else ([red_wall], [blue_wall])
    line = Lines(np.array([[[-0.5, 0.0, -1.5], [0.5, 0.0, -1.5]]]), yellow, 1.0)
    picture, shape = draw_picture(view_along_minus_z(), opaque, glass, [line], BLACK)
    reds, greens = picture[..., 0], picture[..., 1]
    # But for pixels of the diagonal, where two triangles share an edge, each shows the first opaque shape.
    assert (shape == 0).mean() > 0.98
    assert (reds.max() > 0.3) == (alpha < 1), "red behind the wall, darkened by its shade"
    assert (greens.max() > 0.9) == (alpha < 1), "the yellow line between them"


@pytest.mark.slow
def test_picture_holds_the_whole_cage_and_the_gap_arrow():
    """The cage is yellow; none of its pixels lies on the border of the picture."""
    result = run_with_steady_times("only false")
    (fault,) = result.false["c"]
    text = fault_still(result, "c", fault, FIRST_SIZE)[0]
    assert f"{1e3 * fault.metres:.2g} mm" in text and "from " in text
    recorded = Image.open(io.BytesIO(base64.b64decode(re.search('image/webp;base64,([^"]+)"', text)[1])))
    r, g, b = np.moveaxis(np.asarray(recorded.convert("RGB")).astype(int), -1, 0)
    rows, columns = np.nonzero((r > 190) & (g > 140) & (b < 90))
    assert len(rows) > 200
    assert (
        rows.min() > 0 and columns.min() > 0 and rows.max() < recorded.height - 1 and columns.max() < recorded.width - 1
    )


@pytest.mark.slow
def test_arrow_of_a_gap_has_two_symmetric_heads():
    """Each head is two strokes from its tip, 6 pixels back along the shaft and 4 aside."""
    result = run_with_steady_times("in a hollow")
    (fault,) = result.false["hull"]
    path, *_ = re.findall(r'd="((?:M[-\d. ]+(?:L[-\d. ]+)+){3})"', fault_still(result, "hull", fault, FIRST_SIZE)[0])
    shaft, *heads = (np.array(re.findall(r"([-\d.]+) ([-\d.]+)", stroke), float) for stroke in path.split("M")[1:])
    direction = (shaft[1] - shaft[0]) / np.linalg.norm(shaft[1] - shaft[0])
    for (left, tip, right), end, inward in zip(heads, shaft, (direction, -direction), strict=True):
        np.testing.assert_allclose(tip, end)
        np.testing.assert_allclose((left + right) / 2.0 - tip, 6.0 * inward, atol=0.15)
        assert np.linalg.norm(left - right) == pytest.approx(8.0, abs=0.2)


@pytest.mark.parametrize("state", ["several", "only false", "between frames", "no reference", "a tradeoff"])
def test_drawings_of_a_page_are_unchanged(state, monkeypatch, snapshot):
    """Lanes, plots and words as they are written; of each raster picture the mean of its tiles."""
    pictures, made = [], Image.fromarray

    def noted(pixels):
        tiles = [tile for band in np.array_split(pixels, 6) for tile in np.array_split(band, 8, axis=1)]
        pictures.append(" ".join(f"{tile.mean():.0f}" for tile in tiles))
        return made(pixels)

    monkeypatch.setattr(Image, "fromarray", noted)
    page = report_html(run_with_steady_times(state))
    drawings = re.findall(r"<svg\b.*?</svg>|<div class=.ticks.*?</div>", page, re.DOTALL)
    assert [*pictures, *(re.sub('base64,[^"]+', "", drawing) for drawing in drawings)] == snapshot
