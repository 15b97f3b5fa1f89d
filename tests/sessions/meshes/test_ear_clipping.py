"""Polygons cut into triangles, against the planted area and against counting crossings of a ray."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.spatial import Delaunay

from sessions.meshes import ear_clipping
from sessions.meshes.ear_clipping import FEW_CORNERS, clip_ears
from sessions.meshes.least_area import MOST_CORNERS


def doubled_areas(points, triangles):
    """Twice the signed areas of triangles, above 0 where they run anticlockwise."""
    a, b, c = (points[[triangle[k] for triangle in triangles]] for k in range(3))
    return (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]


def is_inside(outline, points):
    """Whether points (p, 2) lie in a polygon, by the crossings of a ray to the right, (p,)."""
    a, b = outline[:, None], np.roll(outline, -1, axis=0)[:, None]
    spans = (a[..., 1] > points[:, 1]) != (b[..., 1] > points[:, 1])
    with np.errstate(divide="ignore", invalid="ignore"):
        x = a[..., 0] + (points[:, 1] - a[..., 1]) * (b[..., 0] - a[..., 0]) / (b[..., 1] - a[..., 1])
    return (spans & (x > points[:, 0])).sum(axis=0) % 2 == 1


def random_star(random, count):
    """A star-shaped outline of random radii about the origin, (count, 2)."""
    angles = (np.arange(count) + random.uniform(0.1, 0.9, count)) * 2 * np.pi / count
    radii = random.uniform(0.2, 1.0, count)
    return np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=1)


def with_corners_on_edges(random, outline):
    """The outline with two more corners on every second edge, at random."""
    rows = []
    for a, b in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        rows += [a, *(a + (b - a) * np.array([[0.25], [0.5]]) if random.random() < 0.5 else ())]
    return np.array(rows)


@given(st.integers(4, 40), st.booleans(), st.booleans(), st.integers(0, 2**32))
def test_clipped_ears_cover_exactly_the_polygon_without_overlap(count, mirrored, on_edges, seed):
    """A random star of 4 to 40 corners, some with corners on their edges, is cut into triangles, either way round.

    Each of 100 random points lies in one triangle if it lies in the polygon, else in none; no triangle is flat.
    """
    random = np.random.default_rng(seed)
    outline = random_star(random, count)
    if on_edges:
        outline = with_corners_on_edges(random, outline)
    if mirrored:
        outline = outline[::-1]
    cut = clip_ears(outline)
    areas = doubled_areas(outline, cut.triangles) * (-1 if mirrored else 1)
    assert cut.covers
    assert len(cut.triangles) == len(outline) - 2
    assert areas.min() > 0
    points = random.uniform(-1, 1, (100, 2))
    triangles_of_points = sum(is_inside(outline[[*triangle]], points).astype(int) for triangle in cut.triangles)
    assert np.array_equal(triangles_of_points, is_inside(outline, points))


def outline_of_glued_triangles(random, points, fraction):
    """Corners of an outline of triangles that are glued along a random tree; edges that are not glued stay slits."""
    triangles = Delaunay(points)
    corners, neighbours = triangles.simplices, triangles.neighbors
    start = int(random.integers(len(corners)))
    members = {start}
    outline = [(corners[start, k], corners[start, (k + 1) % 3], start) for k in range(3)]
    while len(members) < fraction * len(corners):
        free = []
        for index, (a, b, owner) in enumerate(outline):
            across = int(neighbours[owner, np.flatnonzero(~np.isin(corners[owner], (a, b)))[0]])
            if across >= 0 and across not in members:
                free.append((index, across))
        if not free:
            break
        index, across = free[random.integers(len(free))]
        a, b, _ = outline[index]
        tip = next(corner for corner in corners[across] if corner not in (a, b))
        outline[index : index + 1] = [(a, tip, across), (tip, b, across)]
        members.add(across)
    return [a for a, _, _ in outline], corners[sorted(members)]


@given(st.integers(4, 24), st.integers(4, 40), st.floats(0.2, 1.0), st.integers(0, 2**32))
def test_self_touching_outlines_are_cut_as_planted(count, grid, fraction, seed):
    """Triangles of random points on a grid are glued along a tree; where they are not glued their outline is a slit.

    It is cut into as many triangles again, of the same area in all, none of them flat.
    """
    random = np.random.default_rng(seed)
    points = np.unique(random.integers(0, grid, (count, 2)), axis=0) / 3.0 + [1000.0, -70.0]
    assume(len(points) > 3 and np.linalg.matrix_rank(points - points[0], tol=1e-9) == 2)
    corners, planted = outline_of_glued_triangles(random, points, fraction)
    areas = doubled_areas(points, [tuple(triangle) for triangle in planted])
    assume(areas.min() > 1e-6)
    outline = points[corners]
    cut = clip_ears(outline)
    result = doubled_areas(outline, cut.triangles)
    assert cut.covers
    assert len(cut.triangles) == len(planted)
    assert result.min() > 0
    assert result.sum() == pytest.approx(areas.sum(), rel=1e-12, abs=0)


TOUCHING = {
    "notch to an edge": ([(0, 0), (4, 0), (4, 4), (0, 4), (0, 3), (4, 2), (0, 1)], 12.0),
    "notch to a corner on an edge": ([(0, 0), (2, 0), (4, 0), (4, 4), (3, 4), (2, 0), (1, 4), (0, 4)], 12.0),
    "notch to the first corner": ([(0, 0), (4, 0), (4, 4), (3, 4), (0, 0), (1, 4), (0, 4)], 12.0),
    "slit from a notch": ([(0, 0), (4, 0), (4, 4), (3, 4), (2, 0), (2, 1), (2, 0), (1, 4), (0, 4)], 12.0),
    "edge there and back": ([(0, 0), (2, 0), (0, 0), (2, 0), (1, 1)], 1.0),
}
"""Outlines that touch themselves in a point or along an edge, and their areas; a notch is 2 wide and 4 deep."""


@pytest.mark.parametrize(("corners", "area"), TOUCHING.values(), ids=TOUCHING)
def test_outline_that_touches_itself_is_covered_once(corners, area):
    """Triangles cover an outline of TOUCHING without overlap, wherever it begins and whichever way it winds.

    Their areas are not negative and sum to that of the outline.
    """
    for first_corner in range(len(corners)):
        outline = np.roll(np.array(corners, dtype=np.float64), first_corner, axis=0)
        for direction in (1, -1):
            cut = clip_ears(outline[::direction])
            areas = direction * doubled_areas(outline[::direction], cut.triangles) / 2
            assert cut.covers, (first_corner, direction)
            assert areas.min() >= 0, (first_corner, direction)
            assert areas.sum() == pytest.approx(area), (first_corner, direction)


def test_disc_of_repeated_corners_is_covered_once():
    """Every corner of a disc of radius 1, whose area is pi, stands twice, so that no corner is an ear with an area."""
    angles = np.linspace(0, 2 * np.pi, MOST_CORNERS, endpoint=False).repeat(2)
    outline = np.column_stack([np.cos(angles), np.sin(angles)])
    cut = clip_ears(outline)
    assert cut.covers
    assert len(cut.triangles) == len(outline) - 2
    assert np.abs(doubled_areas(outline, cut.triangles)).sum() / 2 == pytest.approx(np.pi, rel=1e-3)


def saw(teeth, rounding=0.0):
    """A triangle with its base up, and on it teeth of base 1 and height 1; they meet ``rounding`` above that base."""
    between = [(x, y) for number in range(teeth - 1, 0, -1) for x, y in ((number, rounding), (number - 0.5, 1.0))]
    return np.array([(0.0, 0.0), (teeth / 2, -teeth / 2), (teeth, 0.0), (teeth - 0.5, 1.0), *between])


MANY_TEETH = FEW_CORNERS + 6
"""So many that not all corners are searched for a diagonal."""
SLIT = [(30, 26), (34, 30), (23, 26), (29, 24), (23, 26), (18, 22), (18, 15), (23, 23), (22, 8), (27, 4), (36, 13)]


@pytest.mark.parametrize(
    ("corners", "area"),
    [
        pytest.param(SLIT, 247.0, id="a slit"),  # by the shoelace formula
        # A saw of n teeth is a triangle of n * n / 4 and n teeth of 1/2.
        pytest.param(saw(6), 6 * 6 / 4 + 6 / 2, id="few corners, all searched"),
        pytest.param(saw(MANY_TEETH), MANY_TEETH**2 / 4 + MANY_TEETH / 2, id="many corners"),
        pytest.param(
            saw(MANY_TEETH, rounding=1e-15), MANY_TEETH**2 / 4 + MANY_TEETH / 2, id="corners nearly on a line"
        ),
        pytest.param(-saw(MANY_TEETH, rounding=1e-15), MANY_TEETH**2 / 4 + MANY_TEETH / 2, id="upside down"),
    ],
)
def test_corners_on_a_diagonal_are_not_cut_off(corners, area):
    """A diagonal that runs through other corners, or along a slit, is no side of a triangle.

    So there is no sliver: each triangle has an area over 0.1, and all of them have that of the outline.
    """
    outline = np.array(corners, dtype=np.float64)
    cut = clip_ears(outline)
    areas = doubled_areas(outline, cut.triangles) / 2
    assert cut.covers
    assert areas.min() > 0.1
    assert areas.sum() == pytest.approx(area)


@pytest.mark.parametrize("count", [FEW_CORNERS - 1, FEW_CORNERS + 1, 500])
def test_star_of_n_corners_has_n_minus_2_triangles(count):
    """A star of ``count`` corners gets more on its edges, n in all, and so n - 2 triangles.

    Whether a corner can be cut off is tested against all others up to FEW_CORNERS (64), beyond against near ones.
    """
    random = np.random.default_rng(count)
    outline = with_corners_on_edges(random, random_star(random, count))
    cut = clip_ears(outline)
    different_triangles = {*map(frozenset, cut.triangles)}
    assert cut.covers
    assert len(different_triangles) == len(outline) - 2


def test_corners_that_lie_nearly_on_an_edge_give_no_slivers():
    """A unit square, tilted by 0.3 rad, has six more corners on its edges, where rounding puts them beside these.

    Twice the areas of its triangles are 2 in all, and 0.001 at least; of corners on one edge it would be some 1e-17.
    """
    angle = 0.3
    square = np.array([[0, 0], [0.1, 0], [0.2, 0], [0.7, 0], [1, 0], [1, 0.3], [1, 1], [0.6, 1], [0, 1], [0, 0.7]])
    tilted = square @ np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    areas = doubled_areas(tilted, clip_ears(tilted).triangles)
    assert areas.min() > 0.001
    assert areas.sum() == pytest.approx(2.0, rel=1e-14, abs=0)


@pytest.mark.parametrize(
    "outline",
    [
        [[0, 0], [1, 1], [1, 0], [0, 1]],
        [[0, 0], [1, 0], [2, 0], [3, 0]],
        [[1, 1]] * 5,
    ],
    ids=["crosses itself", "on one line", "at one point"],
)
def test_invalid_polygon_keeps_triangle_count_and_is_reported_uncovered(outline):
    """An outline of n corners that no triangles can cover still gets n - 2, and the result says so."""
    cut = clip_ears(np.array(outline, dtype=np.float64))
    assert not cut.covers
    assert len(cut.triangles) == len(outline) - 2


def test_large_crossing_polygon_keeps_triangle_count(monkeypatch):
    """The outline of 40 random corners crosses itself; beyond 8 corners (MOST_CORNERS, here) a quicker way is taken.

    It gives 40 - 2 different triangles too.
    """
    monkeypatch.setattr(ear_clipping, "MOST_CORNERS", 8)
    cut = clip_ears(np.random.default_rng(0).random((40, 2)))
    assert not cut.covers
    assert len({*map(frozenset, cut.triangles)}) == 38
