"""An oriented box around faces, along their principal axes or the body's: whichever has the smaller surface."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cdcore.kernels.compiling import hot_kernel, stay_one_function
from cdcore.kernels.memory import Memory
from cdcore.narrow.bvh.tree_memory import Doubles, Integers, Words, reader

SWEEPS = 8
"""Jacobi rotations converge quadratically: 3 x 3 matrices are diagonal to rounding after five sweeps."""


class BuildMemory(NamedTuple):
    """What fitting and splitting read and write; rows one after another.

    ``corners`` (f, 9) of the faces, body axes; ``order`` (f,) faces, those of a node next to each other; ``spans``
    (f, 9) by face: least and largest coordinate and centroid along each axis of the node at hand, whose ``axes`` (9,)
    stand by rows and whose ``extent`` (6,) is the least and largest coordinate along each; ``matrix`` (9,) scratch.
    Of a split: ``bounds`` (BINS, 6) least and largest coordinates of the faces of a bin; ``counts`` (BINS,) its faces;
    ``left`` (BINS,) cost of the bins up to this one; ``right`` (6,) the box of several bins. ``boxes``, ``links``,
    ``leaves`` are those of the ``BoxTree``; ``stack`` (3 f + 6,) is scratch.
    """

    corners: Doubles
    spans: Doubles
    axes: Doubles
    extent: Doubles
    matrix: Doubles
    bounds: Doubles
    left: Doubles
    right: Doubles
    boxes: Doubles
    order: Integers
    links: Integers
    leaves: Integers
    counts: Words
    stack: Words


build_at = reader(BuildMemory)
"""In a kernel: the memory whose row starts at a place."""


@hot_kernel
def diagonalise(m: Memory, v: Memory) -> None:
    """Rotate the symmetric ``m`` (9,) to diagonal in place; the rows of ``v`` (9,) become its eigenvectors."""
    stay_one_function()
    set_identity(v)
    for turn in range(3 * SWEEPS):
        p = (turn % 3) // 2
        q = 1 + (turn % 3 + 1) // 2
        off = m[3 * p + q]
        if off == 0.0:
            continue
        theta = (m[4 * q] - m[4 * p]) / (2.0 * off)
        t = 1.0 / (abs(theta) + np.sqrt(theta * theta + 1.0))
        if theta < 0.0:
            t = -t
        c = 1.0 / np.sqrt(t * t + 1.0)
        turn_entries(m, p, q, 3, c, t * c)
        turn_entries(m, 3 * p, 3 * q, 1, c, t * c)
        turn_entries(v, 3 * p, 3 * q, 1, c, t * c)


@hot_kernel
def turn_entries(m: Memory, p: int, q: int, step: int, c: float, s: float) -> None:
    """Turn two rows (step 1) or columns (step 3) of a matrix by an angle."""
    stay_one_function()
    for _ in range(3):
        a, b = m[p], m[q]
        m[p], m[q] = c * a - s * b, s * a + c * b
        p, q = p + step, q + step


@hot_kernel
def set_identity(v: Memory) -> None:
    """The body's axes as rows of ``v`` (9,)."""
    stay_one_function()
    for k in range(9):
        v[k] = 1.0 if k % 4 == 0 else 0.0


@hot_kernel
def orthonormal_rows(v: Memory) -> None:
    """Make the nearly orthonormal rows of ``v`` (9,) orthonormal to a few roundings and right-handed."""
    stay_one_function()
    x, y, z = v[0], v[1], v[2]
    n = np.sqrt(x * x + y * y + z * z)
    x, y, z = x / n, y / n, z / n
    d = x * v[3] + y * v[4] + z * v[5]
    a, b, c = v[3] - d * x, v[4] - d * y, v[5] - d * z
    n = np.sqrt(a * a + b * b + c * c)
    a, b, c = a / n, b / n, c / n
    v[0], v[1], v[2], v[3], v[4], v[5] = x, y, z, a, b, c
    v[6], v[7], v[8] = y * c - z * b, z * a - x * c, x * b - y * a


@hot_kernel
def place_faces(fit: BuildMemory, start: int, stop: int) -> float:
    """Fill ``spans`` and ``extent`` of faces ``order[start:stop]`` along ``axes``; returns half the box's surface."""
    stay_one_function()
    corners, spans, extent = fit.corners, fit.spans, fit.extent
    for k in range(3):
        x, y, z = fit.axes[3 * k], fit.axes[3 * k + 1], fit.axes[3 * k + 2]
        low, high = np.inf, -np.inf
        for row in range(start, stop):
            at = 9 * fit.order[row]
            a = x * corners[at] + y * corners[at + 1] + z * corners[at + 2]
            b = x * corners[at + 3] + y * corners[at + 4] + z * corners[at + 5]
            c = x * corners[at + 6] + y * corners[at + 7] + z * corners[at + 8]
            least, most = min(min(a, b), c), max(max(a, b), c)
            spans[at + k], spans[at + 3 + k], spans[at + 6 + k] = least, most, a / 3.0 + b / 3.0 + c / 3.0
            low, high = min(low, least), max(high, most)
        extent[2 * k], extent[2 * k + 1] = low, high
    x, y, z = extent[1] - extent[0], extent[3] - extent[2], extent[5] - extent[4]
    surface: float = x * y + y * z + z * x
    return surface


@hot_kernel
def fill_covariance(fit: BuildMemory, start: int, stop: int, scale: float) -> None:
    """The covariance of the corners, times their number, in ``matrix``; ``scale`` keeps its entries finite."""
    stay_one_function()
    corners, m, count = fit.corners, fit.matrix, 3.0 * (stop - start)
    cx, cy, cz = 0.0, 0.0, 0.0
    for row in range(start, stop):
        at = 9 * fit.order[row]
        for _ in range(3):
            cx, cy, cz = cx + corners[at] / count, cy + corners[at + 1] / count, cz + corners[at + 2] / count
            at += 3
    xx, xy, xz, yy, yz, zz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for row in range(start, stop):
        at = 9 * fit.order[row]
        for _ in range(3):
            x, y, z = (corners[at] - cx) * scale, (corners[at + 1] - cy) * scale, (corners[at + 2] - cz) * scale
            xx, xy, xz = xx + x * x, xy + x * y, xz + x * z
            yy, yz, zz = yy + y * y, yz + y * z, zz + z * z
            at += 3
    m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8] = xx, xy, xz, xy, yy, yz, xz, yz, zz


@hot_kernel
def fit_box(fit: BuildMemory, start: int, stop: int, scale: float) -> None:
    """Write axes, extent and spans of the better of two boxes around faces ``order[start:stop]``."""
    stay_one_function()
    set_identity(fit.axes)
    along_body = place_faces(fit, start, stop)
    fill_covariance(fit, start, stop, scale)
    diagonalise(fit.matrix, fit.axes)
    orthonormal_rows(fit.axes)
    if along_body <= place_faces(fit, start, stop):
        set_identity(fit.axes)
        place_faces(fit, start, stop)
