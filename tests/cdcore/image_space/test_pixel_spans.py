"""Stretches of pixels under triangles: the kernels give the bits of their slow references."""

import numpy as np

from cdcore.image_space.pixel_spans import pixels_of_spans, pixels_of_spans_slowly, row_spans, row_spans_slowly

WIDTH, HEIGHT = 60, 40


def test_kernels_agree_with_slow_references_bit_by_bit():
    """400 triangles of random pixels and depths, some with whole numbers and upright edges; 1 / depth ends at 1.5."""
    rng = np.random.default_rng(0)
    corners = np.concatenate([rng.uniform(-20, 80, (400, 3, 2)), rng.uniform(0.5, 3.0, (400, 3, 1))], axis=2)
    corners[:, :, :2] *= corners[:, :, 2:]
    corners[::7, :, 0] = np.round(corners[::7, :, 0])
    corners[::5, 1, :2] = corners[::5, 0, :2] * corners[::5, 1, 2:] / corners[::5, 0, 2:] + [0.0, 9.0]  # upright edges
    first = rng.integers(0, HEIGHT, 400)
    stop = first + rng.integers(0, HEIGHT - first + 1)
    coordinates = np.linalg.inv(corners)
    spans, slow = (function(coordinates, first, stop, WIDTH) for function in (row_spans, row_spans_slowly))
    for values, expected in zip(spans, slow, strict=True):
        assert (values == expected).all()
    part = spans.part(slice(3, 900))
    pixels, slow_pixels = (function(part, WIDTH, 1.5) for function in (pixels_of_spans, pixels_of_spans_slowly))
    assert len(pixels[0]) > 1000
    for values, expected in zip(pixels, slow_pixels, strict=True):
        assert (values == expected).all()


def test_horizontal_edge_covers_only_rows_beyond_it():
    """Coordinates x / 10, 1 - x / 10 and y - 2.5 are all positive for x from 0 to 10 and rows from middle 2.5 on."""
    columns, rows, at_corner = [0.1, -0.1, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, -2.5]
    spans = row_spans(np.array([[columns, rows, at_corner]]), np.array([0]), np.array([5]), WIDTH)
    assert (spans.right - spans.left).tolist() == [0, 0, 10, 10, 10]
