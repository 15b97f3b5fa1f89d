"""Polygons cut into triangles, against the planted area and against counting crossings of a ray."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sessions.meshes.ear_clipping import FEW_CORNERS, clipped


def doubled_areas(points, triangles):
    a, b, c = (points[[triangle[k] for triangle in triangles]] for k in range(3))
    return (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]


def is_inside(outline, points):
    """By the crossings of a ray to the right, (p,)."""
    a, b = outline[:, None], np.roll(outline, -1, axis=0)[:, None]
    spans = (a[..., 1] > points[:, 1]) != (b[..., 1] > points[:, 1])
    with np.errstate(divide="ignore", invalid="ignore"):
        x = a[..., 0] + (points[:, 1] - a[..., 1]) * (b[..., 0] - a[..., 0]) / (b[..., 1] - a[..., 1])
    return (spans & (x > points[:, 0])).sum(axis=0) % 2 == 1


def star(random, count):
    """A star-shaped outline of random radii about the origin, (count, 2)."""
    angles = (np.arange(count) + random.uniform(0.1, 0.9, count)) * 2 * np.pi / count
    radii = random.uniform(0.2, 1.0, count)
    return np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=1)


def with_corners_on_edges(random, outline):
    rows = []
    for a, b in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        rows += [a, *(a + (b - a) * np.array([[0.25], [0.5]]) if random.random() < 0.5 else ())]
    return np.array(rows)


@given(st.integers(4, 40), st.booleans(), st.booleans(), st.integers(0, 2**32))
def test_triangles_cover_a_polygon_once_and_nothing_else(count, mirrored, on_edges, seed):
    random = np.random.default_rng(seed)
    outline = star(random, count)
    if on_edges:
        outline = with_corners_on_edges(random, outline)
    if mirrored:
        outline = outline[::-1]
    cut = clipped(outline)
    areas = doubled_areas(outline, cut.triangles) * (-1 if mirrored else 1)
    assert cut.covers and len(cut.triangles) == len(outline) - 2
    assert areas.min() > 0  # none is flat, although corners lie on edges
    probes = random.uniform(-1, 1, (100, 2))
    cover = sum(is_inside(outline[[*triangle]], probes).astype(int) for triangle in cut.triangles)
    assert np.array_equal(cover, is_inside(outline, probes))


@pytest.mark.parametrize("count", [FEW_CORNERS - 1, FEW_CORNERS + 1, 500])
def test_few_and_many_corners_are_cut_alike_right(count):
    random = np.random.default_rng(count)
    outline = with_corners_on_edges(random, star(random, count))
    cut = clipped(outline)
    assert cut.covers and len({*map(frozenset, cut.triangles)}) == len(outline) - 2


def test_corners_that_lie_nearly_on_an_edge_give_no_slivers():
    angle = 0.3
    square = np.array([[0, 0], [0.1, 0], [0.2, 0], [0.7, 0], [1, 0], [1, 0.3], [1, 1], [0.6, 1], [0, 1], [0, 0.7]])
    tilted = square @ np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    areas = doubled_areas(tilted, clipped(tilted).triangles)
    assert areas.min() > 1e-3 and areas.sum() == pytest.approx(2.0, rel=1e-14)


@pytest.mark.parametrize(
    "outline",
    [
        [[0, 0], [1, 1], [1, 0], [0, 1]],
        [[0, 0], [1, 0], [2, 0], [3, 0]],
        [[1, 1]] * 5,
        [[0, 0], [2, 0], [0, 0], [2, 0], [1, 1]],
    ],
    ids=["crosses itself", "on one line", "at one point", "there and back"],
)
def test_what_is_no_polygon_has_as_many_triangles_and_is_said_not_to_be_covered(outline):
    cut = clipped(np.array(outline, dtype=np.float64))
    assert not cut.covers and len(cut.triangles) == len(outline) - 2
