"""Points of one body in another body's frame, and by how much rounding may move them."""

from __future__ import annotations

from typing import Final

import numpy as np

from cdcore.kernels.compiling import become_part_of_caller, hot_kernel
from cdcore.numerics import EPS, FloatArray

PAD: Final = 1024.0 * EPS
"""How far a point seen from the other body may be from the reference vertices, as a share of both bodies' size: over
twice the sum of 192, to which a rotation's transpose is its inverse (``ORTHONORMAL_KEEP``), and 64 for placing it."""


@hot_kernel
def margin_at(places: FloatArray, frame: int, inner: int, outer: int, size: float) -> float:
    """Metres by which a point seen from the other body may be off."""
    become_part_of_caller()
    for i in range(3):
        size += abs(places[frame, inner, i]) + abs(places[frame, outer, i])
    return PAD * size


@hot_kernel
def seen_point(
    turns: FloatArray, places: FloatArray, frame: int, inner: int, outer: int, points: FloatArray, e: int
) -> tuple[float, float, float]:
    """A point of the inner body in the outer body's frame."""
    become_part_of_caller()
    x = y = z = 0.0
    for k in range(3):
        way = places[frame, inner, k] - places[frame, outer, k]
        for j in range(3):
            way += turns[frame, inner, k, j] * points[e, j]
        x += turns[frame, outer, k, 0] * way
        y += turns[frame, outer, k, 1] * way
        z += turns[frame, outer, k, 2] * way
    return x, y, z


def margin_of(places: FloatArray, inner: int, outer: int, size: float) -> float:
    """``margin_at`` for the origins (N, 3) of one frame, outside of a kernel."""
    return PAD * (size + float(np.abs(places[[inner, outer]]).sum()))
