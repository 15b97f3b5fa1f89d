"""Compiled passes over many poses: read once, checked, repaired and blanked in place; they know arrays only.

Poses are read and written by address (``cdcore.kernels.memory``), which is twice as fast as by three indices.
"""

import numpy as np

from cdcore.kernels.compiling import become_part_of_caller, hot_kernel, kernel, stay_one_function
from cdcore.kernels.memory import Memory, doubles_of
from cdcore.numerics import BoolArray, FloatArray

GOOD = -1
"""No pose is bad."""

POLAR_STEPS = 5
"""Newton-Schulz squares the error: 1e-3, 1e-6, 1e-12, then rounding."""


@hot_kernel
def matrix_error(r: Memory, o: int) -> float:
    """Largest entry of ``|R^T R - I|`` of the matrix at ``r[o:o + 9]``; infinity for a reflection, NaN where not
    finite.
    """
    become_part_of_caller()
    error = total = determinant = 0.0
    for i in range(3):
        u, v = (i + 1) % 3, (i + 2) % 3
        determinant += r[o + i] * (r[o + 3 + u] * r[o + 6 + v] - r[o + 3 + v] * r[o + 6 + u])
        for j in range(i, 3):
            dot = r[o + i] * r[o + j] + r[o + 3 + i] * r[o + 3 + j] + r[o + 6 + i] * r[o + 6 + j]
            entry = abs(dot - 1.0) if i == j else abs(dot)
            error = max(error, entry)
            total += entry
    if determinant < 0.0:
        error = np.inf
    # NaN and infinity among the entries make their sum times 0 a NaN, which no comparison above would have kept
    return error + 0.0 * total


@hot_kernel
def repair_rotation(r: Memory, o: int, scratch: Memory) -> None:
    """Replace a matrix near a rotation by the nearest one, by the polar iteration ``R <- R (3 I - R^T R) / 2``.

    ``scratch`` (18,). Source: Bjoerck and Bowie, An iterative algorithm for computing the best estimate of an
    orthogonal matrix (1971).
    """
    stay_one_function()
    for _ in range(POLAR_STEPS):
        for i in range(3):
            for j in range(3):
                dot = r[o + i] * r[o + j] + r[o + 3 + i] * r[o + 3 + j] + r[o + 6 + i] * r[o + 6 + j]
                scratch[3 * i + j] = (1.0 if i == j else 0.0) - dot
        for i in range(3):
            for j in range(3):
                a, b, c = r[o + 3 * i], r[o + 3 * i + 1], r[o + 3 * i + 2]
                scratch[9 + 3 * i + j] = 0.5 * (a * scratch[j] + b * scratch[3 + j] + c * scratch[6 + j])
        for k in range(9):
            r[o + k] += scratch[9 + k]


@hot_kernel
def settled(place: Memory, turn: Memory, k: int, valid: bool, keep: float, reject: float, scratch: Memory) -> float:
    """Repair pose ``k``, or put identity where it is not valid; returns its error, NaN for one to refuse."""
    become_part_of_caller()
    if not valid:
        for i in range(3):
            place[3 * k + i] = 0.0
        for i in range(9):
            turn[9 * k + i] = 1.0 if i % 4 == 0 else 0.0
        return 0.0
    # a number that is not finite makes its product with 0 NaN; their sum could overflow
    wrong = 0.0 * place[3 * k] + 0.0 * place[3 * k + 1] + 0.0 * place[3 * k + 2]
    error: float = matrix_error(turn, 9 * k) + wrong
    if not error <= keep:
        if not error <= reject:
            return np.nan
        repair_rotation(turn, 9 * k, scratch)
    return error


@hot_kernel
def same_pose(place: Memory, turn: Memory, k: int, other: int) -> bool:
    """Whether two poses agree in every number; what is not finite agrees with nothing."""
    become_part_of_caller()
    same = True
    for i in range(3):
        same &= place[3 * k + i] == place[3 * other + i]
    for i in range(9):
        same &= turn[9 * k + i] == turn[9 * other + i]
    return same


@hot_kernel
def split(matrix: Memory, place: Memory, turn: Memory, k: int) -> bool:
    """Copy translation and rotation of pose ``k`` from its 4x4 matrix; returns whether its last row is 0 0 0 1."""
    become_part_of_caller()
    o = 16 * k
    for i in range(3):
        place[3 * k + i] = matrix[o + 4 * i + 3]
        for j in range(3):
            turn[9 * k + 3 * i + j] = matrix[o + 4 * i + j]
    still = (matrix[o + 12] == 0.0) & (matrix[o + 13] == 0.0) & (matrix[o + 14] == 0.0)
    return still & (matrix[o + 15] == 1.0)


@kernel
def check_poses(
    matrices: FloatArray, place: FloatArray, turn: FloatArray, valid: BoolArray, keep: float, reject: float,
    scratch: FloatArray, changed: BoolArray,
) -> tuple[int, int, float]:  # fmt: skip
    """Check poses of N bodies at T times, repair what is within ``reject``, put identity where nothing is ``valid``.

    ``place`` (T, N, 3) and ``turn`` (T, N, 3, 3), contiguous, are changed in place; ``matrices`` (T, N, 4, 4): where
    they come from, or nothing; ``valid`` (T, N); ``scratch`` (18,). Fills ``changed`` (T, N) as of ``Motion``; a pose
    that repeats the last one was checked there. In numpy the same took six times as long.
    Returns the number of the first bad pose or GOOD, how many were repaired, and the worst error of a valid one.
    """
    entries, places, turns, room = doubles_of(matrices), doubles_of(place), doubles_of(turn), doubles_of(scratch)
    given, repaired, worst = matrices.size > 0, 0, 0.0
    frames, bodies = valid.shape
    last = np.full(bodies, GOOD)
    for t in range(frames):
        for body in range(bodies):
            k, before, there = t * bodies + body, last[body], valid[t, body]
            changed[t, body] = t == 0
            if given and not split(entries, places, turns, k) and there:
                return k, repaired, worst
            if there:
                last[body] = k
                if before >= 0 and same_pose(places, turns, k, before):
                    continue
            error = settled(places, turns, k, there, keep, reject, room)
            if not error <= reject:
                return k, repaired, worst
            worst = max(worst, error)
            repaired += error > keep
            if there and before >= 0:
                changed[t, body] = not same_pose(places, turns, k, before)
    return GOOD, repaired, worst


@kernel
def note_changes(place: FloatArray, turn: FloatArray, valid: BoolArray, changed: BoolArray) -> None:
    """Fill ``changed`` (T, N) as of ``Motion``, of poses ``place`` (T, N, 3) and ``turn`` (T, N, 3, 3), contiguous."""
    places, turns = doubles_of(place), doubles_of(turn)
    frames, bodies = valid.shape
    last = np.full(bodies, GOOD)
    for t in range(frames):
        for body in range(bodies):
            k, before = t * bodies + body, last[body]
            changed[t, body] = t == 0
            if valid[t, body]:
                last[body] = k
                changed[t, body] |= before >= 0 and not same_pose(places, turns, k, before)
