"""Overlap of two closed solids from layered depth images along three axes, as sampled rays see it.

Source: B. Heidelberger, M. Teschner, M. Gross, Real-time volumetric intersections of deforming objects (VMV 2003);
Detection of collisions and self-collisions using image-space techniques (WSCG 2004).
Differs: pixels tile the window exactly, so that a window thinner than a pixel is still looked through; three axes.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cdcore.image_space.layers import Window, overlap_along
from cdcore.numerics import FloatArray
from cdcore.tolerances import EPS, UNDERFLOW_PAD

SHIFT: Final = np.array([1e-4, 2e-4, 3e-4])
"""Of a pixel: rays are moved off its centre, so that none runs along an edge of a mesh drawn on a grid."""

DEPTH_ULPS: Final = 4096.0
"""Stretches shorter than this many eps of both bodies' coordinates do not count: a depth is rounded by some 20 eps, a
point by 10, and bodies that only touch must not seem to overlap."""

MOST_PIXELS: Final = 4096
"""Of the longest side: 16 million rays an axis."""


@dataclass(frozen=True, eq=False)
class Overlap:
    """Overlap along the rays of three axes: ``volume`` in cubic metres is the mean of those along x, y and z.

    ``inside``: 0 where A, 1 where B lies wholly inside the other as far as the rays tell; else -1.
    """

    volume: float
    rays: int
    layers: int
    inside: int


NOTHING: Final = Overlap(0.0, 0, 0, -1)
"""Boxes that have no volume in common."""


def overlap_of_placed(world_a: FloatArray, world_b: FloatArray, resolution: int) -> Overlap:
    """The overlap of placed closed faces (f, 3, 3) and (g, 3, 3).

    It misses overlaps thinner than a pixel that no ray of three axes runs through.
    """
    lower_a, upper_a, lower_b, upper_b = (
        pick(world, axis=(0, 1)) for world in (world_a, world_b) for pick in (np.min, np.max)
    )
    lower, upper = np.maximum(lower_a, lower_b), np.minimum(upper_a, upper_b)
    if not (lower < upper).all():
        return NOTHING
    pixel = float((upper - lower).max()) / resolution
    # A side of whole pixels that rounding makes a hair longer gets no pixel more.
    count = np.maximum(1, np.ceil((upper - lower) / pixel - 1e-9)).astype(np.int64)
    size = (upper - lower) / count
    least = DEPTH_ULPS * EPS * float(max(np.abs(world_a).max(), np.abs(world_b).max())) + UNDERFLOW_PAD
    first_ray = (0.5 + SHIFT) * size
    window, lengths = Window(lower + first_ray, size, count), np.zeros((3, 3))
    layers = sum(overlap_along(world_a, world_b, axis, window, least, lengths[axis]) for axis in range(3))
    areas = np.array([size[1] * size[2], size[2] * size[0], size[0] * size[1]])
    volume = float((lengths[:, 2] * areas).mean())
    inside = _inside(lengths, (lower_a, upper_a, lower_b, upper_b)) if volume > 0.0 else -1
    rays = count[0] * count[1] + count[1] * count[2] + count[2] * count[0]
    return Overlap(volume, int(rays), layers, inside)


def _inside(lengths: FloatArray, boxes: tuple[FloatArray, ...]) -> int:
    """Number of the body all of whose ray intervals lie in the other, its box inside the other's; -1 for neither."""
    lower_a, upper_a, lower_b, upper_b = boxes
    within = ((lower_a > lower_b) & (upper_a < upper_b)).all(), ((lower_b > lower_a) & (upper_b < upper_a)).all()
    for body in range(2):
        # All of it up to rounding: both lengths are sums over the same rays.
        if within[body] and (lengths[:, 2] >= lengths[:, body] * (1.0 - 1e-9)).all():
            return body
    return -1
