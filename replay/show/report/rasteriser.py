"""Triangles and lines as a picture, drawn without a graphics card: a depth for every pixel, glass translucent."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from cdcore.numerics import FloatArray, IntArray
from replay.show.camera import axes_of

FOCAL_RATIO: Final = 1.6
"""Focal length over the height of the picture: an opening of 35 degrees."""

NEAR_PLANE_M: Final = 0.01
"""Metres in front of the eye where drawing begins."""

PIXELS_AT_ONCE: Final = 1 << 20
"""Pixels of triangles looked at in one step: 100 MB."""

LIGHT_DIRECTION: Final = np.array([-0.35, 0.6, 0.72])
"""Direction to the light, in the axes of the eye."""

LINE_LEAD_FRACTION: Final = 0.002
"""Share of the distance by which a line is drawn before the surface that it lies on."""

Colour = tuple[float, float, float]


@dataclass(frozen=True)
class Shape:
    """Triangles (n, 3, 3) in world metres; an alpha, or one each (n,), below 1 is glass, denser seen from aside."""

    corners: FloatArray
    colour: Colour
    alpha: FloatArray | float = 1.0


@dataclass(frozen=True)
class Lines:
    """Segments (k, 2, 3) in world metres, so many pixels wide; hidden where something opaque is nearer."""

    ends: FloatArray
    colour: Colour
    alpha: float
    width: int = 1


@dataclass(frozen=True)
class View:
    """An eye, its axes right, up and back as columns (3, 3), and the pixel that it looks at."""

    position: FloatArray
    axes: FloatArray
    size: tuple[int, int]
    centre: tuple[float, float]

    @classmethod
    def of(cls, points: FloatArray, view_direction: FloatArray, size: tuple[int, int], right: int = 0) -> "View":
        """The view from a direction that shows points (n, 3) as large as fits; ``right``: kept free."""
        axes = axes_of(view_direction)
        wide, height = size[0] - right, size[1]
        local = points @ axes
        middle = (local.min(axis=0) + local.max(axis=0)) / 2
        x, y, depth = np.abs(local - middle)[:, 0], np.abs(local - middle)[:, 1], (local - middle)[:, 2]
        needed_distances = depth + 2.12 * FOCAL_RATIO * height * np.maximum(x / wide, y / height)
        distance = max(0.1, float(needed_distances.max()))
        return cls(axes @ (middle + np.array([0.0, 0.0, distance])), axes, size, (wide / 2, height / 2))

    def local(self, points: FloatArray) -> FloatArray:
        """Points (..., 3) in the axes of the eye, metres."""
        placed: FloatArray = (points - self.position) @ self.axes
        return placed

    def flat(self, local: FloatArray) -> FloatArray:
        """Column and row of a pixel, both times depth, and depth (..., 3) of points in the axes of the eye."""
        depth = -local[..., 2:]
        return np.concatenate(
            [local[..., :2] * [1, -1] * FOCAL_RATIO * self.size[1] + depth * self.centre, depth], axis=-1
        )

    def pixels(self, points: FloatArray) -> FloatArray:
        """Column, row and 1 / depth of points (..., 3) before the eye, which is at least ``NEAR_PLANE_M`` away."""
        local = self.local(points)
        local[..., 2] = np.minimum(local[..., 2], -NEAR_PLANE_M)
        flat = self.flat(local)
        return np.concatenate([flat[..., :2], np.ones_like(flat[..., 2:])], axis=-1) / flat[..., 2:]


def draw_picture(
    view: View, opaque: Sequence[Shape], glass: Sequence[Shape], lines: Sequence[Lines], background: FloatArray
) -> tuple[FloatArray, IntArray]:
    """The picture (rows, columns, 3) from 0 to 1, and the number of the opaque shape seen at each pixel, -1: none.

    Translucent layers of a pixel are mixed by their alpha, whatever their order: nothing has to be sorted.
    Source: McGuire and Bavoil 2013. ``background``: (rows, columns, 3).
    """
    wide, height = view.size
    count = wide * height
    colours, depth, number = background.reshape(-1, 3).copy(), np.zeros(count), np.full(count, -1)
    for index, shape in enumerate(opaque):
        local = view.local(shape.corners)
        # Faces are lit on either side.
        colour = np.outer(0.5 + 0.5 * _facing_cosines(local, LIGHT_DIRECTION), shape.colour)
        for face, pixel, inverse_depth in covered_pixels(local, view):
            np.maximum.at(depth, pixel, inverse_depth)
            first = inverse_depth == depth[pixel]
            colours[pixel[first]], number[pixel[first]] = colour[face[first]], index
    layers, log_transmission = np.zeros((len(glass), count)), np.zeros(count)
    for layer, shape in zip(layers, glass, strict=True):
        local = view.local(shape.corners)
        alpha = np.minimum(0.9, shape.alpha * (1.0 + 3.0 * (1.0 - _facing_cosines(local, local.mean(axis=1))) ** 3))
        for face, pixel, inverse_depth in covered_pixels(local, view):
            is_ahead = inverse_depth > depth[pixel]
            layer += np.bincount(pixel[is_ahead], alpha[face[is_ahead]], count)
            log_transmission += np.bincount(pixel[is_ahead], np.log1p(-alpha)[face[is_ahead]], count)
    glass_pixels = np.flatnonzero(log_transmission)
    weights = layers[:, glass_pixels]
    glass_colours = (
        weights.T @ np.array([shape.colour for shape in glass]).reshape(-1, 3) / weights.sum(axis=0)[:, None]
    )
    colours[glass_pixels] = (
        glass_colours + (colours[glass_pixels] - glass_colours) * np.exp(log_transmission[glass_pixels])[:, None]
    )
    for line in lines:
        line_pixels = _line_pixels(line, view, depth)
        colours[line_pixels] += line.alpha * (np.array(line.colour) - colours[line_pixels])
    return np.clip(colours, 0.0, 1.0).reshape(height, wide, 3), number.reshape(height, wide)


def _facing_cosines(local: FloatArray, direction: FloatArray) -> FloatArray:
    """Cosines between normals of triangles and a direction, or one direction each, from 0 to 1."""
    normal = np.cross(local[:, 1] - local[:, 0], local[:, 2] - local[:, 0])
    length = np.linalg.norm(normal, axis=1) * np.linalg.norm(direction, axis=-1)
    facing: FloatArray = np.abs((normal * direction).sum(axis=1)) / np.maximum(length, 1e-30)
    return facing


CoveredPixels = tuple[IntArray, IntArray, FloatArray]
"""Triangle, pixel and 1 / depth, (k,) each."""


def covered_pixels(local: FloatArray, view: View) -> Iterator[CoveredPixels]:
    """Every pixel whose middle a triangle in the eye's axes (n, 3, 3) covers, also one that reaches behind the eye."""
    # A kernel; a report without a fault draws nothing and loads no compiler.
    from cdcore.image_space.pixel_spans import pixels_of_spans, row_spans

    wide, height = view.size
    flat = view.flat(local)
    depth = flat[..., 2]
    visible = np.flatnonzero((np.abs(np.linalg.det(flat)) > 1e-12) & (depth.max(axis=1, initial=0) > NEAR_PLANE_M))
    pixel_rows = flat[visible, :, 1] / np.maximum(depth[visible], NEAR_PLANE_M) - 0.5
    # One that reaches behind the eye may be in any row.
    is_ahead = depth[visible].min(axis=1, initial=1) > NEAR_PLANE_M
    lower = np.where(is_ahead, np.clip(np.ceil(pixel_rows.min(axis=1)), 0, height), 0).astype(np.int64)
    stop = np.where(is_ahead, np.clip(np.floor(pixel_rows.max(axis=1)) + 1, lower, height), height).astype(np.int64)
    spans = row_spans(np.asarray(np.linalg.inv(flat[visible]), dtype=np.float64), lower, stop, wide)
    blocks = np.flatnonzero(np.diff(np.cumsum(spans.right - spans.left) // PIXELS_AT_ONCE)) + 1
    for first, last in pairwise([0, *blocks.tolist(), len(spans.row)]):
        triangle, pixel, inverse_depth = pixels_of_spans(spans.part(slice(first, last)), wide, 1.0 / NEAR_PLANE_M)
        yield visible[triangle], pixel, inverse_depth


def _line_pixels(line: Lines, view: View, depth: FloatArray) -> IntArray:
    """Pixels on the segments, each once and in order, where nothing opaque is nearer."""
    from cdcore.image_space.pixel_spans import concatenated_ranges

    wide, height = view.size
    ends = view.pixels(line.ends)
    steps = np.ceil(np.abs(ends[:, 1, :2] - ends[:, 0, :2]).max(axis=1, initial=0)).astype(np.int64) + 1
    steps = np.minimum(steps, 4 * wide)
    segment, step = concatenated_ranges(np.zeros_like(steps), steps)
    fraction = (step / np.maximum(steps[segment] - 1, 1))[:, None]
    x, y, inverse_depth = (ends[segment, 0] * (1 - fraction) + ends[segment, 1] * fraction).T
    column_offsets, row_offsets = np.meshgrid(*[np.arange(line.width) - line.width // 2] * 2)
    column = (np.round(x)[:, None] + column_offsets.ravel()).astype(np.int64)
    row = (np.round(y)[:, None] + row_offsets.ravel()).astype(np.int64)
    is_in_picture = (column >= 0) & (column < wide) & (row >= 0) & (row < height)
    pixel = np.where(is_in_picture, column + wide * row, 0)
    # Marked in the picture, not sorted: sorting took half the time of a picture with a grid.
    is_on_line = np.zeros(wide * height, dtype=np.bool_)
    is_on_line[pixel[is_in_picture & (inverse_depth[:, None] * (1 + LINE_LEAD_FRACTION) >= depth[pixel])]] = True
    return np.flatnonzero(is_on_line)
