"""Linear programmes of at most four variables: where the smallest of several linear functions is greatest."""

from __future__ import annotations

from functools import cache
from itertools import combinations
from typing import Final

import numpy as np

from cdcore.kernels.compiling import INTERPRETED, hot_kernel, kernel
from cdcore.kernels.memory import Memory, doubles_of, integers_of
from cdcore.numerics import FloatArray, IntArray

EXCHANGES: Final = 60
"""Rows that a linear programme takes in at most."""

SINGULAR: Final = 1e-12
"""Determinant of rows of length 1 below which they have no corner."""

FEASIBLE: Final = 1e-12
BROKEN: Final = 1e-11
NOT_TIGHT: Final = 1e-9
"""Fractions of the largest value: by which a corner of a working set may break its rows, by which a row is broken that
is taken in, and by which a row is loose that is left out."""


def greatest_minimum(
    slopes: FloatArray, values: FloatArray, limits: FloatArray, right: FloatArray
) -> FloatArray | None:
    """The x (k,) with the greatest smallest ``values + slopes @ x`` where ``limits @ x <= right``; ``None``: not found.

    All corners of a working set of rows are computed, the row that the best corner breaks most is taken in, and rows
    that are not tight there are left out.
    """
    count, dimensions = len(limits), slopes.shape[1] + 1
    rows = np.empty((count + len(slopes), dimensions))
    rows[:count, :-1], rows[:count, -1] = limits, 0.0
    rows[count:, :-1], rows[count:, -1] = -slopes, 1.0
    bounds = np.concatenate([right, values])
    # Rows of length 1: then what breaks a row is a distance.
    lengths = np.maximum(np.sqrt((rows * rows).sum(axis=1)), 1e-300)
    rows, bounds = rows / lengths[:, None], bounds / lengths
    scale = float(np.abs(values).max()) or 1.0
    fixed, tight = np.arange(count), count + np.argsort(values, kind="stable")[:dimensions]
    best, lowest = None, np.inf
    for _ in range(EXCHANGES):
        working = np.concatenate([fixed, tight])
        corner = highest_corner(rows[working], bounds[working], FEASIBLE * scale)
        if corner is None:
            break
        best = corner[:-1]
        broken = (rows * corner).sum(axis=1) - bounds
        worst = int(broken.argmax())
        if broken[worst] <= BROKEN * scale or worst in working:
            break
        # Where the best corner is no lower than before, leaving out a row would bring back an earlier corner.
        if corner[-1] < lowest - FEASIBLE * scale:
            tight, lowest = tight[broken[tight] >= -NOT_TIGHT * scale], float(corner[-1])
        tight = np.append(tight, worst)
    return best


def highest_corner(rows: FloatArray, bounds: FloatArray, slack: float) -> FloatArray | None:
    """The corner (m,) of the space ``rows @ x <= bounds`` whose last number is greatest; ``None``: there is none."""
    if INTERPRETED:
        return _highest_corner_slowly(rows, bounds, slack)
    size = rows.shape[1]
    corners, equations = np.empty((2, size)), np.empty((size, size + 1))
    present = fill_highest_corner(rows, bounds, slack, equations, corners, np.arange(size))
    return corners[0] if present else None


@hot_kernel
def solve(equations: Memory, size: int, corner: Memory) -> float:
    """Solve equations (size, size + 1) in their place, the right side last; return the determinant."""
    determinant, width = 1.0, size + 1
    for k in range(size):
        pivot = k
        for i in range(k + 1, size):
            if abs(equations[width * i + k]) > abs(equations[width * pivot + k]):
                pivot = i
        if pivot != k:
            for j in range(k, width):
                equation = equations[width * k + j]
                equations[width * k + j] = equations[width * pivot + j]
                equations[width * pivot + j] = equation
            determinant = -determinant
        determinant *= equations[width * k + k]
        if determinant == 0.0:
            return 0.0
        for i in range(k + 1, size):
            factor = equations[width * i + k] / equations[width * k + k]
            for j in range(k + 1, width):
                equations[width * i + j] -= factor * equations[width * k + j]
    for k in range(size - 1, -1, -1):
        total = equations[width * k + size]
        for j in range(k + 1, size):
            total -= equations[width * k + j] * corner[j]
        corner[k] = total / equations[width * k + k]
    return determinant


@hot_kernel
def next_combination(chosen: Memory, size: int, count: int) -> bool:
    """Go on to the next of the ascending choices of ``size`` numbers below a count; whether there is one."""
    k = size - 1
    while k >= 0 and chosen[k] == count - size + k:
        k -= 1
    if k < 0:
        return False
    chosen[k] += 1
    for j in range(k + 1, size):
        chosen[j] = chosen[j - 1] + 1
    return True


@kernel
def fill_highest_corner(
    rows: FloatArray,
    bounds: FloatArray,
    slack: float,
    equations: FloatArray,
    corners: FloatArray,
    choice: IntArray,
) -> bool:
    """Fill ``corners[0]`` (m,) with the corner of all rows (n, m) whose last number is greatest; whether there is one.

    ``choice``: the numbers 0 to m - 1; ``equations`` (m, m + 1), ``corners[1]`` and ``choice`` are scratch.
    """
    count, size, present = len(bounds), len(equations), False
    numbers, written, corner, chosen = (
        doubles_of(rows),
        doubles_of(equations),
        doubles_of(corners[1]),
        integers_of(choice),
    )
    more = count >= size
    while more:
        for k in range(size):
            for j in range(size):
                written[(size + 1) * k + j] = numbers[size * chosen[k] + j]
            written[(size + 1) * k + size] = bounds[chosen[k]]
        if abs(solve(written, size, corner)) > SINGULAR and (not present or corner[size - 1] > corners[0, size - 1]):
            feasible = True
            for k in range(count):
                total = 0.0
                for j in range(size):
                    total += numbers[size * k + j] * corner[j]
                if total - bounds[k] > slack:
                    feasible = False
                    break
            if feasible:
                present = True
                for j in range(size):
                    corners[0, j] = corner[j]
        more = next_combination(chosen, size, count)
    return present


def _highest_corner_slowly(rows: FloatArray, bounds: FloatArray, slack: float) -> FloatArray | None:
    """``highest_corner`` without a kernel: all corners at once."""
    sets = _combinations(len(rows), rows.shape[1])
    matrices = rows[sets]
    regular = np.abs(np.linalg.det(matrices)) > SINGULAR
    corners = np.linalg.solve(matrices[regular], bounds[sets[regular]][..., None])[..., 0]
    feasible = corners[(corners @ rows.T <= bounds + slack).all(axis=1)]
    return None if not len(feasible) else np.asarray(feasible[feasible[:, -1].argmax()])


@cache
def _combinations(count: int, size: int) -> IntArray:
    return np.array([*combinations(range(count), size)], dtype=np.int64)
