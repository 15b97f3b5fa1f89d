"""Triangles and lines as a picture, drawn without a graphics card: a depth for every pixel, glass translucent."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cdcore.numerics import FloatArray, IntArray
from replay.outputs.camera import axes_of

FOCAL: Final = 1.6
"""Focal length over the height of the picture: an opening of 35 degrees."""

NEAREST: Final = 0.01
"""Metres in front of the eye where drawing begins; a triangle that reaches behind it is left out."""

LARGE: Final = 0.12
"""Metres: longer triangles are cut into four until they are not, so that little of a bench top is left out."""

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
    """Triangles (n, 3, 3) in world metres; an alpha (n,) below 1 is glass, which is denser seen from aside."""

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
        wide, high = size[0] - right, size[1]
        local = points @ axes
        middle = (local.min(axis=0) + local.max(axis=0)) / 2
        x, y, depth = np.abs(local - middle)[:, 0], np.abs(local - middle)[:, 1], (local - middle)[:, 2]
        needed = depth + 2.12 * FOCAL * high * np.maximum(x / wide, y / high)
        distance = max(0.1, float(needed.max()))
        return cls(axes @ (middle + np.array([0.0, 0.0, distance])), axes, size, (wide / 2, high / 2))

    def local(self, points: FloatArray) -> FloatArray:
        """Points (..., 3) in the axes of the eye, metres."""
        placed: FloatArray = (points - self.position) @ self.axes
        return placed

    def pixels(self, points: FloatArray) -> FloatArray:
        """Column, row and 1 / depth of points (..., 3) before the eye."""
        local = self.local(points)
        depth = np.maximum(-local[..., 2], NEAREST)
        scale = FOCAL * self.size[1] / depth
        x, y = self.centre[0] + local[..., 0] * scale, self.centre[1] - local[..., 1] * scale
        return np.stack([x, y, 1.0 / depth], axis=-1)


def drawn(
    view: View, shapes: Sequence[Shape], lines: Sequence[Lines], behind: FloatArray
) -> tuple[FloatArray, IntArray]:
    """The picture (rows, columns, 3) from 0 to 1, and the number of the opaque shape seen at each pixel, -1: none.

    Translucent layers of a pixel are mixed by their alpha, whatever their order: nothing has to be sorted.
    Source: McGuire and Bavoil 2013. ``behind`` (rows, columns, 3) is the background.
    """
    wide, high = view.size
    count = wide * high
    corners, colour, alpha, number = _gathered(shapes)
    local = view.local(corners)
    colour, alpha = _shaded(local, colour, alpha)
    nothing = np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64), np.zeros(0)
    found = zip(nothing, *covered(local, view), strict=True)
    face, pixel, near = (np.concatenate(part) for part in found)
    seen, depth = behind.reshape(-1, 3).copy(), np.zeros(count)
    opaque = np.flatnonzero(alpha[face] >= 1.0)
    np.maximum.at(depth, pixel[opaque], near[opaque])
    first = opaque[near[opaque] == depth[pixel[opaque]]]
    seen[pixel[first]] = colour[face[first]]
    shape = np.full(count, -1, dtype=np.int64)
    shape[pixel[first]] = number[face[first]]
    clear = np.flatnonzero((alpha[face] < 1.0) & (near > depth[pixel]))
    share, at = alpha[face[clear]], pixel[clear]
    weight = np.maximum(np.bincount(at, share, count), 1e-12)
    through = np.exp(np.bincount(at, np.log1p(-share), count))
    tint = [np.bincount(at, share * colour[face[clear], k], count) / weight for k in range(3)]
    seen = seen * through[:, None] + np.stack(tint, axis=1) * (1.0 - through)[:, None]
    for line in lines:
        on = _line_pixels(line, view, depth)
        seen[on] += line.alpha * (np.array(line.colour) - seen[on])
    return np.clip(seen, 0.0, 1.0).reshape(high, wide, 3), shape.reshape(high, wide)


def _gathered(shapes: Sequence[Shape]) -> tuple[FloatArray, FloatArray, FloatArray, IntArray]:
    """Small triangles, their colour and alpha, and the number of their shape."""
    corners, colours, alphas, numbers = [], [], [], []
    for number, shape in enumerate(shapes):
        small, alpha = _small(shape.corners, np.broadcast_to(shape.alpha, len(shape.corners)).astype(np.float64))
        corners.append(small)
        alphas.append(alpha)
        colours.append(np.tile(shape.colour, (len(small), 1)))
        numbers.append(np.full(len(small), number))
    if not corners:
        return np.zeros((0, 3, 3)), np.zeros((0, 3)), np.zeros(0), np.zeros(0, dtype=np.int64)
    return np.concatenate(corners), np.concatenate(colours), np.concatenate(alphas), np.concatenate(numbers)


def _small(corners: FloatArray, alpha: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Triangles none of which is large, and their alpha."""
    while (large := np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1, initial=0) > LARGE).any():
        old = corners[large]
        middle = (old + np.roll(old, -1, axis=1)) / 2
        ends = [np.stack([old[:, k], middle[:, k], middle[:, k - 1]], axis=1) for k in range(3)]
        corners = np.concatenate([corners[~large], middle, *ends])
        alpha = np.concatenate([alpha[~large], *[alpha[large]] * 4])
    return corners, alpha


def _shaded(local: FloatArray, colour: FloatArray, alpha: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Opaque faces are lit, on either side; glass is denser where it is seen from aside, so that its walls show."""
    normal = np.cross(local[:, 1] - local[:, 0], local[:, 2] - local[:, 0])
    length = np.maximum(np.linalg.norm(normal, axis=1), 1e-30)
    lit = np.abs(normal @ LIGHT) / (length * np.linalg.norm(LIGHT))
    middle = local.mean(axis=1)
    aside = 1.0 - np.abs((normal * middle).sum(axis=1)) / (length * np.maximum(np.linalg.norm(middle, axis=1), 1e-30))
    dense = np.where(alpha < 1.0, np.minimum(0.9, alpha * (1.0 + 3.0 * aside**3)), 1.0)
    shade = np.where(alpha < 1.0, 1.0, 0.5 + 0.5 * lit)
    return colour * shade[:, None], dense


Covered = tuple[IntArray, IntArray, FloatArray]
"""Triangle, pixel and 1 / depth, (k,) each."""


def covered(local: FloatArray, view: View) -> Iterator[Covered]:
    """Every pixel whose middle a triangle in the eye's axes (n, 3, 3) covers.

    Barycentric coordinates over depth are linear on the screen, so they bound a stretch of each row of pixels.
    Source: Olano and Greer 1997.
    """
    wide, high = view.size
    depth = -local[..., 2:]
    # x and y in pixels times depth, y downwards
    flat = local[..., :2] * [1, -1] * FOCAL * high + depth * view.centre
    screen = np.concatenate([flat, depth], axis=2)
    there = np.flatnonzero((np.abs(np.linalg.det(screen)) > 1e-12) & (depth.min(axis=(1, 2), initial=1) > NEAREST))
    inverse, place = np.linalg.inv(screen[there]), flat[there, :, 1] / depth[there, :, 0] - 0.5
    low = np.clip(np.ceil(place.min(axis=1)), 0, high).astype(np.int64)
    last = np.clip(np.floor(place.max(axis=1)) + 1, 0, high).astype(np.int64)
    one, row = _counted_up(low, np.maximum(last, low))
    slope, at_left = inverse[one, 0], inverse[one, 1] * (row + 0.5)[:, None] + inverse[one, 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        border = -at_left / slope - 0.5
    begin = np.where(slope > 0, border, np.where((slope < 0) | (at_left >= 0), -np.inf, np.inf)).max(axis=1)
    end = np.where(slope < 0, border, np.inf).min(axis=1)
    left = np.clip(np.ceil(begin - ROUNDING), 0, wide).astype(np.int64)
    right = np.clip(np.floor(end + ROUNDING) + 1, left, wide).astype(np.int64)
    near, step = at_left.sum(axis=1), slope.sum(axis=1)
    blocks = np.flatnonzero(np.diff(np.cumsum(right - left) // AT_ONCE)) + 1
    for some in np.split(np.arange(len(row)), blocks):
        stretch, x = _counted_up(left[some], right[some])
        of = some[stretch]
        yield there[one[of]], x + wide * row[of], near[of] + step[of] * (x + 0.5)


def _counted_up(first: IntArray, last: IntArray) -> tuple[IntArray, IntArray]:
    """The whole numbers from ``first`` to before ``last`` one range after the other: which range, and the number."""
    count = last - first
    one = np.repeat(np.arange(len(count)), count)
    return one, np.arange(len(one)) + np.repeat(first - np.cumsum(count) + count, count)


def _line_pixels(line: Lines, view: View, depth: FloatArray) -> IntArray:
    """Pixels on the segments, each once, where nothing opaque is nearer."""
    wide, high = view.size
    ends = view.pixels(line.ends)
    steps = np.ceil(np.abs(ends[:, 1, :2] - ends[:, 0, :2]).max(axis=1, initial=0)).astype(np.int64) + 1
    steps = np.minimum(steps, 4 * wide)
    one, step = _counted_up(np.zeros_like(steps), steps)
    share = (step / np.maximum(steps[one] - 1, 1))[:, None]
    x, y, near = (ends[one, 0] * (1 - share) + ends[one, 1] * share).T
    x, y = np.round(x).astype(np.int64), np.round(y).astype(np.int64)
    found = []
    for right in range(line.width):
        for down in range(line.width):
            column, row = x + right - line.width // 2, y + down - line.width // 2
            inside = (column >= 0) & (column < wide) & (row >= 0) & (row < high)
            pixel = column[inside] + wide * row[inside]
            found.append(pixel[near[inside] * (1 + BEFORE) >= depth[pixel]])
    return np.unique(np.concatenate(found))
