"""Pixels whose middles triangles cover: a stretch of each row of a picture, and its pixels one after the other.

Barycentric coordinates over depth are linear on the screen, so they bound a stretch of each row of pixels; their sum is
1 / depth. Source: Olano and Greer 1997. Each kernel has a slow reference beside it, which gives the same bits.
"""

from __future__ import annotations

from math import inf
from typing import NamedTuple

import numpy as np

from cdcore.kernels.compiling import INTERPRETED, kernel
from cdcore.numerics import FloatArray, IntArray

ROUNDING = 1e-9
"""Pixels by which a triangle is wider: of two that share an edge through the middle of a pixel one must cover it."""


class Spans(NamedTuple):
    """Stretches of rows of pixels, (r,) each, from ``left`` to before ``right`` in a row that a triangle covers.

    ``inverse_depth``: 1 / depth at the left edge of the picture; ``step``: what it gains a pixel.
    """

    triangle: IntArray
    row: IntArray
    left: IntArray
    right: IntArray
    inverse_depth: FloatArray
    step: FloatArray

    def part(self, rows: slice) -> Spans:
        """Some of the stretches."""
        return Spans(
            triangle=self.triangle[rows],
            row=self.row[rows],
            left=self.left[rows],
            right=self.right[rows],
            inverse_depth=self.inverse_depth[rows],
            step=self.step[rows],
        )


def row_spans(coordinates: FloatArray, first: IntArray, stop: IntArray, width: int) -> Spans:
    """Stretches of the rows from ``first`` to before ``stop`` (n,) in a picture so many pixels wide.

    ``coordinates`` (n, 3, 3): for each corner, in its column, the barycentric coordinate over depth: what it gains a
    column of pixels and a row, and its value in the upper left corner.
    """
    if INTERPRETED:
        return row_spans_slowly(coordinates, first, stop, width)
    count = int((stop - first).sum())
    triangle, row, left, right = np.empty((4, count), dtype=np.int64)
    inverse_depth, step = np.empty((2, count))
    spans = Spans(triangle, row, left, right, inverse_depth, step)
    fill_spans(np.ascontiguousarray(coordinates), first, stop, width, spans)
    return spans


def pixels_of_spans(spans: Spans, width: int, most: float) -> tuple[IntArray, IntArray, FloatArray]:
    """Triangle, number of the pixel and 1 / depth, from 0 to ``most``, of every pixel of stretches, (k,) each."""
    if INTERPRETED:
        return pixels_of_spans_slowly(spans, width, most)
    count = int((spans.right - spans.left).sum())
    triangle, pixel = np.empty((2, count), dtype=np.int64)
    inverse_depth = np.empty(count)
    fill_pixels(spans, width, most, triangle, pixel, inverse_depth)
    return triangle, pixel, inverse_depth


@kernel
def fill_spans(coordinates: FloatArray, first: IntArray, stop: IntArray, width: int, spans: Spans) -> None:
    """Fill in the stretches of ``row_spans``."""
    number = 0
    for n in range(len(first)):
        for row in range(first[n], stop[n]):
            begin, end, inverse_depth, step = -inf, inf, 0.0, 0.0
            for corner in range(3):
                slope = coordinates[n, 0, corner]
                at_left = coordinates[n, 1, corner] * (row + 0.5) + coordinates[n, 2, corner]
                inverse_depth += at_left
                step += slope
                if slope > 0.0:
                    begin = max(begin, -at_left / slope - 0.5)
                elif slope < 0.0:
                    end = min(end, -at_left / slope - 0.5)
                elif at_left < 0.0:
                    begin = inf
            left = int(min(max(np.ceil(begin - ROUNDING), 0.0), width))
            spans.triangle[number], spans.row[number] = n, row
            spans.left[number] = left
            spans.right[number] = int(min(max(np.floor(end + ROUNDING) + 1.0, left), width))
            spans.inverse_depth[number], spans.step[number] = inverse_depth, step
            number += 1


@kernel
def fill_pixels(
    spans: Spans, width: int, most: float, triangle: IntArray, pixel: IntArray, inverse_depth: FloatArray
) -> None:
    """Fill in the pixels of ``pixels_of_spans``."""
    number = 0
    for span in range(len(spans.row)):
        for column in range(spans.left[span], spans.right[span]):
            triangle[number] = spans.triangle[span]
            pixel[number] = column + width * spans.row[span]
            inverse_depth[number] = min(max(spans.inverse_depth[span] + spans.step[span] * (column + 0.5), 0.0), most)
            number += 1


def row_spans_slowly(coordinates: FloatArray, first: IntArray, stop: IntArray, width: int) -> Spans:
    """``row_spans`` without a kernel."""
    triangle, row = concatenated_ranges(first, stop)
    by_column, by_row, constant = coordinates.transpose(1, 2, 0)
    slope, at_left = by_column[:, triangle], by_row[:, triangle] * (row + 0.5) + constant[:, triangle]
    with np.errstate(divide="ignore", invalid="ignore"):
        border = -at_left / slope - 0.5
    begin = np.where(slope > 0, border, np.where((slope < 0) | (at_left >= 0), -np.inf, np.inf)).max(axis=0)
    end = np.where(slope < 0, border, np.inf).min(axis=0)
    left = np.clip(np.ceil(begin - ROUNDING), 0, width).astype(np.int64)
    right = np.clip(np.floor(end + ROUNDING) + 1, left, width).astype(np.int64)
    return Spans(triangle, row, left, right, at_left.sum(axis=0), slope.sum(axis=0))


def pixels_of_spans_slowly(spans: Spans, width: int, most: float) -> tuple[IntArray, IntArray, FloatArray]:
    """``pixels_of_spans`` without a kernel."""
    span, column = concatenated_ranges(spans.left, spans.right)
    inverse_depth = spans.inverse_depth[span] + spans.step[span] * (column + 0.5)
    return spans.triangle[span], column + width * spans.row[span], np.clip(inverse_depth, 0.0, most)


def concatenated_ranges(first: IntArray, stop: IntArray) -> tuple[IntArray, IntArray]:
    """The whole numbers from ``first`` to before ``stop`` one range after the other: which range, and the number."""
    count = stop - first
    range_numbers = np.repeat(np.arange(len(count)), count)
    return range_numbers, np.arange(len(range_numbers)) + np.repeat(first - np.cumsum(count) + count, count)
