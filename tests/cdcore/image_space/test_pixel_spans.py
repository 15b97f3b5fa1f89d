"""Rows of pixels under triangles: the kernels give the bits of their slow references."""

import numpy as np

from cdcore.image_space.pixel_spans import pixels_of_spans, pixels_of_spans_slowly, row_spans, row_spans_slowly

WIDTH, HEIGHT = 60, 40


def random_triangles_in_rows(count=400):
    """Inverse corner matrices of triangles in an image, and the first row of each and the row after its last.

    Some have whole numbers for x, some an upright edge; a corner is (x, y, 1) times its depth.
    """
    rng = np.random.default_rng(0)
    corners = np.concatenate([rng.uniform(-20, 80, (count, 3, 2)), rng.uniform(0.5, 3.0, (count, 3, 1))], axis=2)
    corners[:, :, :2] *= corners[:, :, 2:]
    corners[::7, :, 0] = np.round(corners[::7, :, 0])
    corners[::5, 1, :2] = corners[::5, 0, :2] * corners[::5, 1, 2:] / corners[::5, 0, 2:] + [0.0, 9.0]  # upright edges
    first = rng.integers(0, HEIGHT, count)
    stop = first + rng.integers(0, HEIGHT - first + 1)
    return np.linalg.inv(corners), first, stop


def test_row_spans_agree_with_slow_reference_bit_by_bit():
    """400 random triangles over rows of pixels: the pixels that each of them covers in a row, by kernels and by plain
    Python.
    """
    triangles = random_triangles_in_rows()
    for values, expected in zip(row_spans(*triangles, WIDTH), row_spans_slowly(*triangles, WIDTH), strict=True):
        assert np.array_equal(values, expected)


def test_pixels_of_spans_agree_with_slow_reference_bit_by_bit():
    """Any 897 of the rows under 400 triangles: their pixels, and 1 / depth there, by kernels and by plain Python.

    A value above ``most`` is cut to it; corners have up to 2, as depths are from 0.5 to 3.
    """
    rows = row_spans(*random_triangles_in_rows(), WIDTH).part(slice(3, 900))
    pixels, slow_pixels = (function(rows, WIDTH, most=1.5) for function in (pixels_of_spans, pixels_of_spans_slowly))
    pixel_numbers, *_ = pixels
    assert len(pixel_numbers) > 1000
    for values, expected in zip(pixels, slow_pixels, strict=True):
        assert np.array_equal(values, expected)


def test_horizontal_edge_covers_only_rows_beyond_it():
    """A triangle covers pixels where x / 10, 1 - x / 10 and y - 2.5 are at least 0: x from 0 to 10, y from 2.5 on.

    The middles of rows 0 to 4 are at y = 0.5, 1.5, 2.5, ...: the first two rows have none.
    """
    columns, rows, constants = [0.1, -0.1, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, -2.5]
    spans = row_spans(np.array([[columns, rows, constants]]), np.array([0]), np.array([5]), WIDTH)
    assert (spans.right - spans.left).tolist() == [0, 0, 10, 10, 10]
