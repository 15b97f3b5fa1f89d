"""An oriented box around points: along their principal axes or along the body's axes, whichever has the smaller
surface.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cdcore.narrow.compiling import hot_kernel, kernel, stay_one_function
from cdcore.numerics import FloatArray

SWEEPS = 8
"""Jacobi rotations converge quadratically: 3 x 3 matrices are diagonal to rounding after five sweeps."""


@hot_kernel
def diagonalise(m: FloatArray, v: FloatArray) -> None:  # noqa: C901 - loops over rows and columns
    """Rotate the symmetric ``m`` (3, 3) to diagonal in place; the rows of ``v`` become its eigenvectors."""
    stay_one_function()
    for i in range(3):
        for j in range(3):
            v[i, j] = 1.0 if i == j else 0.0
    for _ in range(SWEEPS):
        for p in range(2):
            for q in range(p + 1, 3):
                if m[p, q] == 0.0:
                    continue
                theta = (m[q, q] - m[p, p]) / (2.0 * m[p, q])
                t = 1.0 / (abs(theta) + np.sqrt(theta * theta + 1.0))
                if theta < 0.0:
                    t = -t
                c = 1.0 / np.sqrt(t * t + 1.0)
                s = t * c
                for k in range(3):
                    a, b = m[k, p], m[k, q]
                    m[k, p], m[k, q] = c * a - s * b, s * a + c * b
                for k in range(3):
                    a, b = m[p, k], m[q, k]
                    m[p, k], m[q, k] = c * a - s * b, s * a + c * b
                    a, b = v[p, k], v[q, k]
                    v[p, k], v[q, k] = c * a - s * b, s * a + c * b


@hot_kernel
def orthonormal_rows(v: FloatArray) -> None:
    """Make the nearly orthonormal rows of ``v`` (3, 3) orthonormal to a few roundings and right-handed."""
    x, y, z = v[0, 0], v[0, 1], v[0, 2]
    n = np.sqrt(x * x + y * y + z * z)
    x, y, z = x / n, y / n, z / n
    d = x * v[1, 0] + y * v[1, 1] + z * v[1, 2]
    a, b, c = v[1, 0] - d * x, v[1, 1] - d * y, v[1, 2] - d * z
    n = np.sqrt(a * a + b * b + c * c)
    a, b, c = a / n, b / n, c / n
    v[0, 0], v[0, 1], v[0, 2] = x, y, z
    v[1, 0], v[1, 1], v[1, 2] = a, b, c
    v[2, 0], v[2, 1], v[2, 2] = y * c - z * b, z * a - x * c, x * b - y * a


@hot_kernel
def extents_along(
    corners: FloatArray, order: NDArray[np.int32], start: int, stop: int, v: FloatArray, out: FloatArray
) -> None:
    """Least and largest coordinate of triangles ``order[start:stop]`` along the rows of ``v``, into ``out`` (3, 2)."""
    for k in range(3):
        out[k, 0], out[k, 1] = np.inf, -np.inf
    for row in range(start, stop):
        face = order[row]
        for c in range(3):
            x, y, z = corners[face, c, 0], corners[face, c, 1], corners[face, c, 2]
            for k in range(3):
                along = v[k, 0] * x + v[k, 1] * y + v[k, 2] * z
                out[k, 0] = min(out[k, 0], along)
                out[k, 1] = max(out[k, 1], along)


@hot_kernel
def half_surface(extent: FloatArray) -> float:
    """Half the surface of a box with these extents (3, 2)."""
    x, y, z = extent[0, 1] - extent[0, 0], extent[1, 1] - extent[1, 0], extent[2, 1] - extent[2, 0]
    area: float = x * y + y * z + z * x
    return area


@kernel
def principal_axes(  # noqa: C901 - loops over faces, corners, rows and columns
    corners: FloatArray, order: NDArray[np.int32], start: int, stop: int, v: FloatArray
) -> None:
    """Eigenvectors of the corners' covariance, as rows of ``v``, orthonormal to a few roundings."""
    count = 3.0 * (stop - start)
    mean, m = np.zeros(3), np.zeros((3, 3))
    largest = 0.0
    for row in range(start, stop):
        for c in range(3):
            for k in range(3):
                mean[k] += corners[order[row], c, k] / count
    for row in range(start, stop):
        for c in range(3):
            for k in range(3):
                largest = max(largest, abs(corners[order[row], c, k] - mean[k]))
    if largest == 0.0:
        largest = 1.0
    for row in range(start, stop):
        for c in range(3):
            for i in range(3):
                for j in range(3):
                    a = (corners[order[row], c, i] - mean[i]) / largest
                    b = (corners[order[row], c, j] - mean[j]) / largest
                    m[i, j] += a * b
    diagonalise(m, v)
    orthonormal_rows(v)


@kernel
def fit_box(
    corners: FloatArray, order: NDArray[np.int32], start: int, stop: int, axes: FloatArray, extent: FloatArray
) -> None:
    """Write axes (rows) and extents along them of the better of two boxes around triangles ``order[start:stop]``."""
    stay_one_function()
    other_axes, other = np.empty((3, 3)), np.empty((3, 2))
    principal_axes(corners, order, start, stop, axes)
    extents_along(corners, order, start, stop, axes, extent)
    for i in range(3):
        for j in range(3):
            other_axes[i, j] = 1.0 if i == j else 0.0
    extents_along(corners, order, start, stop, other_axes, other)
    if half_surface(other) <= half_surface(extent):
        for i in range(3):
            for j in range(3):
                axes[i, j] = other_axes[i, j]
            extent[i, 0], extent[i, 1] = other[i, 0], other[i, 1]
