"""Triangles and lines as a picture, drawn without a graphics card: a depth for every pixel, glass translucent."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cdcore.numerics import FloatArray, IntArray
from replay.show.camera import axes_of

FOCAL: Final = 1.6
"""Focal length over the height of the picture: an opening of 35 degrees."""

NEAREST: Final = 0.01
"""Metres in front of the eye where drawing begins."""

AT_ONCE: Final = 1 << 20
"""Pixels of triangles looked at in one step: 100 MB."""

ROUNDING: Final = 1e-9
"""Pixels by which a triangle is wider: of two that share an edge through the middle of a pixel one must cover it."""

LIGHT: Final = np.array([-0.35, 0.6, 0.72])
"""Direction to the light, in the axes of the eye."""

BEFORE: Final = 0.002
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
    def of(cls, points: FloatArray, away: FloatArray, size: tuple[int, int], right: int = 0) -> "View":
        """The view from the direction ``away`` that shows points (n, 3) as large as fits; ``right``: kept free."""
        axes = axes_of(away)
        wide, height = size[0] - right, size[1]
        local = points @ axes
        middle = (local.min(axis=0) + local.max(axis=0)) / 2
        x, y, depth = np.abs(local - middle)[:, 0], np.abs(local - middle)[:, 1], (local - middle)[:, 2]
        needed = depth + 2.12 * FOCAL * height * np.maximum(x / wide, y / height)
        distance = max(0.1, float(needed.max()))
        return cls(axes @ (middle + np.array([0.0, 0.0, distance])), axes, size, (wide / 2, height / 2))

    def local(self, points: FloatArray) -> FloatArray:
        """Points (..., 3) in the axes of the eye, metres."""
        placed: FloatArray = (points - self.position) @ self.axes
        return placed

    def flat(self, local: FloatArray) -> FloatArray:
        """Column and row of a pixel, both times depth, and depth (..., 3) of points in the axes of the eye."""
        depth = -local[..., 2:]
        return np.concatenate([local[..., :2] * [1, -1] * FOCAL * self.size[1] + depth * self.centre, depth], axis=-1)

    def pixels(self, points: FloatArray) -> FloatArray:
        """Column, row and 1 / depth of points (..., 3) before the eye, which is at least ``NEAREST`` away."""
        local = self.local(points)
        local[..., 2] = np.minimum(local[..., 2], -NEAREST)
        flat = self.flat(local)
        return np.concatenate([flat[..., :2], np.ones_like(flat[..., 2:])], axis=-1) / flat[..., 2:]


def drawn(
    view: View, opaque: Sequence[Shape], glass: Sequence[Shape], lines: Sequence[Lines], behind: FloatArray
) -> tuple[FloatArray, IntArray]:
    """The picture (rows, columns, 3) from 0 to 1, and the number of the opaque shape seen at each pixel, -1: none.

    Translucent layers of a pixel are mixed by their alpha, whatever their order: nothing has to be sorted.
    Source: McGuire and Bavoil 2013. ``behind`` (rows, columns, 3) is the background.
    """
    wide, height = view.size
    count = wide * height
    colours, depth, number = behind.reshape(-1, 3).copy(), np.zeros(count), np.full(count, -1)
    for index, shape in enumerate(opaque):
        local = view.local(shape.corners)
        # Faces are lit on either side.
        colour = np.outer(0.5 + 0.5 * _facing(local, LIGHT), shape.colour)
        for face, pixel, near in covered(local, view):
            np.maximum.at(depth, pixel, near)
            first = near == depth[pixel]
            colours[pixel[first]], number[pixel[first]] = colour[face[first]], index
    layers, through = np.zeros((len(glass), count)), np.zeros(count)
    for layer, shape in zip(layers, glass, strict=True):
        local = view.local(shape.corners)
        alpha = np.minimum(0.9, shape.alpha * (1.0 + 3.0 * (1.0 - _facing(local, local.mean(axis=1))) ** 3))
        for face, pixel, near in covered(local, view):
            ahead = near > depth[pixel]
            layer += np.bincount(pixel[ahead], alpha[face[ahead]], count)
            through += np.bincount(pixel[ahead], np.log1p(-alpha)[face[ahead]], count)
    tinted = np.flatnonzero(through)
    weights = layers[:, tinted]
    mixed = weights.T @ np.array([shape.colour for shape in glass]).reshape(-1, 3) / weights.sum(axis=0)[:, None]
    colours[tinted] = mixed + (colours[tinted] - mixed) * np.exp(through[tinted])[:, None]
    for line in lines:
        on = _line_pixels(line, view, depth)
        colours[on] += line.alpha * (np.array(line.colour) - colours[on])
    return np.clip(colours, 0.0, 1.0).reshape(height, wide, 3), number.reshape(height, wide)


def _facing(local: FloatArray, direction: FloatArray) -> FloatArray:
    """Cosines between normals of triangles and a direction, or one direction each, from 0 to 1."""
    normal = np.cross(local[:, 1] - local[:, 0], local[:, 2] - local[:, 0])
    length = np.linalg.norm(normal, axis=1) * np.linalg.norm(direction, axis=-1)
    facing: FloatArray = np.abs((normal * direction).sum(axis=1)) / np.maximum(length, 1e-30)
    return facing


Covered = tuple[IntArray, IntArray, FloatArray]
"""Triangle, pixel and 1 / depth, (k,) each."""


def covered(local: FloatArray, view: View) -> Iterator[Covered]:
    """Every pixel whose middle a triangle in the eye's axes (n, 3, 3) covers, also one that reaches behind the eye.

    Barycentric coordinates over depth are linear on the screen, so they bound a stretch of each row of pixels; their
    sum is 1 / depth. Source: Olano and Greer 1997.
    """
    wide, height = view.size
    flat = view.flat(local)
    depth = flat[..., 2]
    visible = np.flatnonzero((np.abs(np.linalg.det(flat)) > 1e-12) & (depth.max(axis=1, initial=0) > NEAREST))
    # Corner by corner (3, k): sums over rows of three numbers would take most of the time.
    across, down, rest = np.linalg.inv(flat[visible]).transpose(1, 2, 0)
    pixel = flat[visible, :, 1] / np.maximum(depth[visible], NEAREST) - 0.5
    # One that reaches behind the eye may be in any row.
    ahead = depth[visible].min(axis=1, initial=1) > NEAREST
    lower = np.where(ahead, np.clip(np.ceil(pixel.min(axis=1)), 0, height), 0).astype(np.int64)
    stop = np.where(ahead, np.clip(np.floor(pixel.max(axis=1)) + 1, lower, height), height).astype(np.int64)
    triangle, row = _counted_up(lower, stop)
    slope, at_left = across[:, triangle], down[:, triangle] * (row + 0.5) + rest[:, triangle]
    with np.errstate(divide="ignore", invalid="ignore"):
        border = -at_left / slope - 0.5
    begin = np.where(slope > 0, border, np.where((slope < 0) | (at_left >= 0), -np.inf, np.inf)).max(axis=0)
    end = np.where(slope < 0, border, np.inf).min(axis=0)
    left = np.clip(np.ceil(begin - ROUNDING), 0, wide).astype(np.int64)
    right = np.clip(np.floor(end + ROUNDING) + 1, left, wide).astype(np.int64)
    near, step = at_left.sum(axis=0), slope.sum(axis=0)
    blocks = np.flatnonzero(np.diff(np.cumsum(right - left) // AT_ONCE)) + 1
    for some in np.split(np.arange(len(row)), blocks):
        interval, x = _counted_up(left[some], right[some])
        of = some[interval]
        yield visible[triangle[of]], x + wide * row[of], np.clip(near[of] + step[of] * (x + 0.5), 0.0, 1.0 / NEAREST)


def _counted_up(first: IntArray, stop: IntArray) -> tuple[IntArray, IntArray]:
    """The whole numbers from ``first`` to before ``stop`` one range after the other: which range, and the number."""
    count = stop - first
    which = np.repeat(np.arange(len(count)), count)
    return which, np.arange(len(which)) + np.repeat(first - np.cumsum(count) + count, count)


def _line_pixels(line: Lines, view: View, depth: FloatArray) -> IntArray:
    """Pixels on the segments, each once, where nothing opaque is nearer."""
    wide, height = view.size
    ends = view.pixels(line.ends)
    steps = np.ceil(np.abs(ends[:, 1, :2] - ends[:, 0, :2]).max(axis=1, initial=0)).astype(np.int64) + 1
    steps = np.minimum(steps, 4 * wide)
    segment, step = _counted_up(np.zeros_like(steps), steps)
    fraction = (step / np.maximum(steps[segment] - 1, 1))[:, None]
    x, y, near = (ends[segment, 0] * (1 - fraction) + ends[segment, 1] * fraction).T
    across, down = np.meshgrid(*[np.arange(line.width) - line.width // 2] * 2)
    column = (np.round(x)[:, None] + across.ravel()).astype(np.int64)
    row = (np.round(y)[:, None] + down.ravel()).astype(np.int64)
    inside = (column >= 0) & (column < wide) & (row >= 0) & (row < height)
    pixel = np.where(inside, column + wide * row, 0)
    return np.unique(pixel[inside & (near[:, None] * (1 + BEFORE) >= depth[pixel])])
