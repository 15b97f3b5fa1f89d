"""Points of one body in another body's frame, and by how much rounding may move them."""

from __future__ import annotations

from typing import Final

import numpy as np

from cdcore.kernels.compiling import always_inlined, hot_kernel
from cdcore.numerics import FloatArray
from cdcore.tolerances import EPS

PAD: Final = 1024.0 * EPS
"""How far a point seen from the other body may be from the reference vertices, as a share of both bodies' size: over
twice the sum of 192, to which a rotation's transpose is its inverse (``ORTHONORMAL_KEEP``), and 64 for placing it."""


@hot_kernel
def margin_at(translations: FloatArray, frame: int, inner: int, outer: int, size: float) -> float:
    """Metres by which a point seen from the other body may be off."""
    always_inlined()
    for i in range(3):
        size += abs(translations[frame, inner, i]) + abs(translations[frame, outer, i])
    return PAD * size


@hot_kernel
def point_in_outer(
    rotations: FloatArray, translations: FloatArray, frame: int, inner: int, outer: int, points: FloatArray, e: int
) -> tuple[float, float, float]:
    """A point of the inner body in the outer body's frame."""
    always_inlined()
    x = y = z = 0.0
    for k in range(3):
        offset = translations[frame, inner, k] - translations[frame, outer, k]
        for j in range(3):
            offset += rotations[frame, inner, k, j] * points[e, j]
        x += rotations[frame, outer, k, 0] * offset
        y += rotations[frame, outer, k, 1] * offset
        z += rotations[frame, outer, k, 2] * offset
    return x, y, z


def margin_of(translations: FloatArray, inner: int, outer: int, size: float) -> float:
    """``margin_at`` for the origins (N, 3) of one frame, outside of a kernel."""
    return PAD * (size + float(np.abs(translations[[inner, outer]]).sum()))
