"""Compiled passes over many poses: read once, checked, repaired and blanked in place; they know arrays only."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numba import njit

from cdcore.numerics import BoolArray, FloatArray

GOOD = -1
"""No pose is bad."""

OPTIONS: Final[dict[str, Any]] = {"cache": True, "no_cfunc_wrapper": True, "no_rewrites": True, "error_model": "numpy"}
"""Nobody calls these from C, they have no array expressions to rewrite, and they divide by nothing that may be zero:
a third of the time to compile."""

POLAR_STEPS = 5
"""Newton-Schulz squares the error: 1e-3, 1e-6, 1e-12, then rounding."""


@njit(**OPTIONS)
def matrix_error(r: FloatArray) -> float:
    """Largest entry of ``|R^T R - I|`` of one matrix (3, 3); infinity for a reflection, NaN where not finite."""
    error = 0.0
    for i in range(3):
        for j in range(i, 3):
            dot = r[0, i] * r[0, j] + r[1, i] * r[1, j] + r[2, i] * r[2, j]
            off = abs(dot - 1.0) if i == j else abs(dot)
            if np.isnan(off):
                return np.nan
            error = max(error, off)
    determinant = (
        r[0, 0] * (r[1, 1] * r[2, 2] - r[2, 1] * r[1, 2])
        + r[1, 0] * (r[2, 1] * r[0, 2] - r[0, 1] * r[2, 2])
        + r[2, 0] * (r[0, 1] * r[1, 2] - r[1, 1] * r[0, 2])
    )
    if determinant < 0.0:
        return np.inf
    return error


@njit(**OPTIONS)
def repair_rotation(r: FloatArray, gram: FloatArray, step: FloatArray) -> None:
    """Replace a matrix near a rotation by the nearest one, by the polar iteration ``R <- R (3 I - R^T R) / 2``.

    Source: Bjoerck and Bowie, An iterative algorithm for computing the best estimate of an orthogonal matrix (1971).
    """
    for _ in range(POLAR_STEPS):
        for i in range(3):
            for j in range(3):
                dot = r[0, i] * r[0, j] + r[1, i] * r[1, j] + r[2, i] * r[2, j]
                gram[i, j] = (1.0 if i == j else 0.0) - dot
        for i in range(3):
            for j in range(3):
                step[i, j] = 0.5 * (r[i, 0] * gram[0, j] + r[i, 1] * gram[1, j] + r[i, 2] * gram[2, j])
        for i in range(3):
            for j in range(3):
                r[i, j] += step[i, j]


@njit(**OPTIONS)
def place_is_finite(place: FloatArray) -> bool:
    """Whether a translation (3,) is finite."""
    return bool(np.isfinite(place[0]) and np.isfinite(place[1]) and np.isfinite(place[2]))


@njit(**OPTIONS)
def check_poses(
    place: FloatArray, turn: FloatArray, valid: BoolArray, keep: float, reject: float
) -> tuple[int, int, float]:
    """Check N poses, repair what is within ``reject``, put identity where nothing is valid.

    Parameters
    ----------
    place, turn : (N, 3) and (N, 3, 3), changed in place.
    valid : (N,).

    Returns
    -------
    number of the first bad pose or GOOD, how many were repaired, the worst error among the valid.
    """
    gram, step = np.empty((3, 3)), np.empty((3, 3))
    repaired = 0
    worst = 0.0
    for k in range(len(valid)):
        if not valid[k]:
            place[k] = 0.0
            turn[k] = 0.0
            turn[k, 0, 0] = turn[k, 1, 1] = turn[k, 2, 2] = 1.0
            continue
        error = matrix_error(turn[k])
        if not (error <= reject and place_is_finite(place[k])):
            return k, repaired, worst
        worst = max(worst, error)
        if error > keep:
            repair_rotation(turn[k], gram, step)
            repaired += 1
    return GOOD, repaired, worst


@njit(**OPTIONS)
def split_poses(poses: FloatArray, valid: BoolArray, place: FloatArray, turn: FloatArray) -> int:
    """Cut N matrices (N, 4, 4) into ``place`` and ``turn``; number of the first valid whose last row is not 0 0 0 1."""
    for k in range(len(valid)):
        for i in range(3):
            place[k, i] = poses[k, i, 3]
            for j in range(3):
                turn[k, i, j] = poses[k, i, j]
        last = poses[k, 3]
        if valid[k] and not (last[0] == 0.0 and last[1] == 0.0 and last[2] == 0.0 and last[3] == 1.0):
            return k
    return GOOD


@njit(**OPTIONS)
def turns_of_quaternions(q: FloatArray, valid: BoolArray, reject: float, turn: FloatArray) -> int:
    """Rotations of N quaternions (N, 4), xyzw; number of the first valid one whose norm is off by ``reject``."""
    for k in range(len(valid)):
        if not valid[k]:
            continue
        x, y, z, w = q[k, 0], q[k, 1], q[k, 2], q[k, 3]
        norm = np.sqrt(((x * x + y * y) + z * z) + w * w)
        if not abs(norm - 1.0) <= reject:
            return k
        x, y, z, w = x / norm, y / norm, z / norm, w / norm
        turn[k, 0, 0] = 1 - 2 * (y * y + z * z)
        turn[k, 0, 1] = 2 * (x * y - z * w)
        turn[k, 0, 2] = 2 * (x * z + y * w)
        turn[k, 1, 0] = 2 * (x * y + z * w)
        turn[k, 1, 1] = 1 - 2 * (x * x + z * z)
        turn[k, 1, 2] = 2 * (y * z - x * w)
        turn[k, 2, 0] = 2 * (x * z - y * w)
        turn[k, 2, 1] = 2 * (y * z + x * w)
        turn[k, 2, 2] = 1 - 2 * (x * x + y * y)
    return GOOD
