"""Linear programmes of at most four variables: where the smallest of several linear functions is greatest."""

from __future__ import annotations

from functools import cache
from itertools import combinations
from typing import Final

import numpy as np

from cdcore.kernels.compiling import INTERPRETED, hot_kernel, kernel
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
    tight = count + np.argsort(values, kind="stable")[:dimensions]
    if INTERPRETED:
        return greatest_minimum_slowly(rows, bounds, count, tight, scale)
    corner, working = np.empty((2, dimensions)), np.empty(count + dimensions + EXCHANGES, dtype=np.int64)
    working[:count], working[count : count + len(tight)] = np.arange(count), tight
    equations = np.empty((dimensions, dimensions + 1))
    done = fill_highest_corner(rows, bounds, working, np.array([count, count + len(tight)]), scale, equations, corner)
    return corner[0, :-1] if done else None


@hot_kernel
def solve(equations: FloatArray, corner: FloatArray) -> float:
    """Solve equations (m, m + 1) in their place, with the right side as last column; return the determinant."""
    size, determinant = len(corner), 1.0
    for k in range(size):
        pivot = k
        for i in range(k + 1, size):
            if abs(equations[i, k]) > abs(equations[pivot, k]):
                pivot = i
        if pivot != k:
            for j in range(k, size + 1):
                equations[k, j], equations[pivot, j] = equations[pivot, j], equations[k, j]
            determinant = -determinant
        determinant *= equations[k, k]
        if determinant == 0.0:
            return 0.0
        for i in range(k + 1, size):
            factor = equations[i, k] / equations[k, k]
            for j in range(k + 1, size + 1):
                equations[i, j] -= factor * equations[k, j]
    for k in range(size - 1, -1, -1):
        total = equations[k, size]
        for j in range(k + 1, size):
            total -= equations[k, j] * corner[j]
        corner[k] = total / equations[k, k]
    return determinant


@hot_kernel
def excess(row: FloatArray, bound: float, corner: FloatArray) -> float:
    """Metres by which a corner breaks a row."""
    total = 0.0
    for j in range(len(corner)):
        total += row[j] * corner[j]
    return total - bound


@hot_kernel
def next_combination(chosen: IntArray, size: int, count: int) -> bool:
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


@hot_kernel
def highest_corner(
    rows: FloatArray,
    bounds: FloatArray,
    working: IntArray,
    count: int,
    slack: float,
    equations: FloatArray,
    corners: FloatArray,
    chosen: IntArray,
) -> bool:
    """Fill ``corners[0]`` with the corner of the working rows whose last number is greatest; whether there is one."""
    size, present = len(equations), False
    for k in range(size):
        chosen[k] = k
    more = count >= size
    while more:
        for k in range(size):
            n = working[chosen[k]]
            for j in range(size):
                equations[k, j] = rows[n, j]
            equations[k, size] = bounds[n]
        if abs(solve(equations, corners[1])) > SINGULAR and (not present or corners[1, -1] > corners[0, -1]):
            feasible = True
            for k in range(count):
                if excess(rows[working[k]], bounds[working[k]], corners[1]) > slack:
                    feasible = False
                    break
            if feasible:
                present = True
                for j in range(size):
                    corners[0, j] = corners[1, j]
        more = next_combination(chosen, size, count)
    return present


@kernel
def fill_highest_corner(
    rows: FloatArray,
    bounds: FloatArray,
    working: IntArray,
    counts: IntArray,
    scale: float,
    equations: FloatArray,
    corners: FloatArray,
) -> bool:
    """Fill ``corners[0]`` with the highest corner of all rows (n, m); whether one was found.

    ``counts``: rows that stay at the front of ``working``, and rows in it; ``equations`` and ``corners[1]`` are
    scratch.
    """
    fixed, count = counts[0], counts[1]
    size, lowest, present = len(equations), np.inf, False
    chosen = np.empty(size, dtype=np.int64)
    best = np.empty(size)
    for _ in range(EXCHANGES):
        if not highest_corner(rows, bounds, working, count, FEASIBLE * scale, equations, corners, chosen):
            break
        present = True
        for j in range(size):
            best[j] = corners[0, j]
        worst, most = 0, -np.inf
        for n in range(len(rows)):
            broken = excess(rows[n], bounds[n], best)
            if broken > most:
                worst, most = n, broken
        known = most <= BROKEN * scale
        for k in range(count):
            known |= working[k] == worst
        if known:
            break
        # Where the best corner is no lower than before, leaving out a row would bring back an earlier corner.
        if best[size - 1] < lowest - FEASIBLE * scale:
            lowest, kept = best[size - 1], fixed
            for k in range(fixed, count):
                if excess(rows[working[k]], bounds[working[k]], best) >= -NOT_TIGHT * scale:
                    working[kept] = working[k]
                    kept += 1
            count = kept
        working[count] = worst
        count += 1
    for j in range(size):
        corners[0, j] = best[j]
    return present


def greatest_minimum_slowly(
    rows: FloatArray, bounds: FloatArray, count: int, tight: IntArray, scale: float
) -> FloatArray | None:
    """``greatest_minimum`` of rows (n, k + 1) of length 1, of which the first ``count`` stay, without a kernel."""
    fixed = np.arange(count)
    best, lowest = None, np.inf
    for _ in range(EXCHANGES):
        working = np.concatenate([fixed, tight])
        corner = _highest_corner_slowly(rows[working], bounds[working], FEASIBLE * scale)
        if corner is None:
            return best
        best = corner[:-1]
        broken = rows @ corner - bounds
        worst = int(broken.argmax())
        if broken[worst] <= BROKEN * scale or worst in working:
            return best
        if corner[-1] < lowest - FEASIBLE * scale:
            tight, lowest = tight[broken[tight] >= -NOT_TIGHT * scale], float(corner[-1])
        tight = np.append(tight, worst)
    return best


def _highest_corner_slowly(rows: FloatArray, bounds: FloatArray, slack: float) -> FloatArray | None:
    """The corner (k,) of the space ``rows @ x <= bounds`` whose last number is greatest; ``None``: there is none."""
    sets = _combinations(len(rows), rows.shape[1])
    matrices = rows[sets]
    regular = np.abs(np.linalg.det(matrices)) > SINGULAR
    corners = np.linalg.solve(matrices[regular], bounds[sets[regular]][..., None])[..., 0]
    feasible = corners[(corners @ rows.T <= bounds + slack).all(axis=1)]
    return None if not len(feasible) else np.asarray(feasible[feasible[:, -1].argmax()])


@cache
def _combinations(count: int, size: int) -> IntArray:
    return np.array([*combinations(range(count), size)], dtype=np.int64)
