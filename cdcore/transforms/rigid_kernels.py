"""Compiled passes over many poses: read once, checked, repaired and blanked in place; they know arrays only.

Poses are read and written by address (``cdcore.kernels.memory``) and checked as they are cut: 38,000 matrices took
0.93 ms in two passes over arrays of three dimensions, 0.65 in one, and 0.40 by address (2026-11).
"""

import numpy as np

from cdcore.kernels.compiling import become_part_of_caller, hot_kernel, kernel, runtime_int, stay_one_function
from cdcore.kernels.memory import Memory, doubles_of, fetch_early, words_of
from cdcore.numerics import ONE_POSE, BoolArray, FloatArray, IntArray

GOOD = -1
"""No pose is bad."""

AHEAD = 16
"""Matrices by which memory is asked early, which takes a fifth off the pass over 38,000 (2026-11)."""

POLAR_STEPS = 5
"""Newton-Schulz squares the error: 1e-3, 1e-6, 1e-12, then rounding."""


@hot_kernel
def matrix_error(r: Memory, o: int) -> float:
    """Largest entry of ``|R^T R - I|`` of the matrix at ``r[o:o + 9]``; infinity for a reflection, NaN where not
    finite.
    """
    become_part_of_caller()
    a, b, c, d, e, f, g, h, i = r[o], r[o + 1], r[o + 2], r[o + 3], r[o + 4], r[o + 5], r[o + 6], r[o + 7], r[o + 8]
    aa, ab, ac = abs(a * a + d * d + g * g - 1.0), abs(a * b + d * e + g * h), abs(a * c + d * f + g * i)
    bb, bc, cc = abs(b * b + e * e + h * h - 1.0), abs(b * c + e * f + h * i), abs(c * c + f * f + i * i - 1.0)
    error = max(max(max(aa, ab), max(ac, bb)), max(bc, cc))
    if a * (e * i - h * f) + d * (h * c - b * i) + g * (b * f - e * c) < 0.0:
        error = np.inf
    # NaN and infinity among the six make their sum times 0 a NaN, which no comparison above would have kept
    return error + 0.0 * (aa + ab + ac + bb + bc + cc)


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


@kernel
def check_poses(
    place: FloatArray, turn: FloatArray, valid: BoolArray, keep: float, reject: float, scratch: FloatArray,
    still: BoolArray,
) -> tuple[int, int, float]:  # fmt: skip
    """Check N poses, repair what is within ``reject``, put identity where nothing is ``valid`` (N,).

    ``place`` (N, 3) and ``turn`` (N, 3, 3), contiguous, are changed in place; ``scratch`` (18,). ``still`` (M,): of M
    bodies, frame after frame, set to False where one moves; a pose that repeats that of the first frame was checked
    there. Returns the number of the first bad pose or GOOD, how many were repaired, and the worst error of a valid one.
    """
    places, turns, room, repaired, worst = doubles_of(place), doubles_of(turn), doubles_of(scratch), 0, 0.0
    bodies, body = len(still), -1
    for k in range(len(valid)):
        body = body + 1 if body + 1 < bodies else 0
        if k >= bodies and valid[k] and same_pose(places, turns, k, body):
            continue
        error = settled(places, turns, k, valid[k], keep, reject, room)
        if not error <= reject:
            return k, repaired, worst
        if error > worst:
            worst = error
        if error > keep:
            repaired += 1
        still[body] = still[body] and (k < bodies or same_pose(places, turns, k, body))
    return GOOD, repaired, worst


@hot_kernel
def laid_error(given: Memory, p: int, pose: Memory) -> float:
    """Cut the matrix at ``given[p:p + 16]`` into ``pose`` (12,); returns its error, NaN for a number or row amiss."""
    become_part_of_caller()
    for i in range(3):
        pose[9 + i] = given[p + 4 * i + 3]
        for j in range(3):
            pose[3 * i + j] = given[p + 4 * i + j]
    error: float = matrix_error(pose, runtime_int(0)) + 0.0 * pose[9] + 0.0 * pose[10] + 0.0 * pose[11]
    affine = given[p + 12] == 0.0 and given[p + 13] == 0.0 and given[p + 14] == 0.0 and given[p + 15] == 1.0
    return error if affine else np.nan


@hot_kernel
def same_words(words: Memory, a: int, b: int) -> bool:
    """Whether sixteen words at two places are equal."""
    become_part_of_caller()
    same = True
    for i in range(16):
        same &= words[a + i] == words[b + i]
    return same


@kernel
def lay_poses(
    given: FloatArray, bits: IntArray, lanes: FloatArray, keep: float, still: BoolArray, scratch: FloatArray
) -> tuple[bool, float]:  # fmt: skip
    """Lay out matrices (T, N, 4, 4), ``bits`` the same as integers: equal entries of consecutive frames side by side.

    ``lanes`` (N, 12, S): rotation row by row, then translation, in rows as of ``row_length``, the last frame repeated;
    of a body that keeps one pose, and True in ``still`` (N,), that pose. ``scratch`` (12,). Returns the worst error,
    and whether all matrices are good to the last bit: else nothing else is said.
    """
    matrices, words, rows, pose = doubles_of(given), words_of(bits), doubles_of(lanes), doubles_of(scratch)
    frames, bodies, stride, worst = given.shape[0], given.shape[1], lanes.shape[2], 0.0
    p = -16
    for f in range(frames):
        for body in range(bodies):
            p += 16
            fetch_early(matrices, p + 16 * AHEAD)
            fetch_early(matrices, p + 16 * AHEAD + 8)
            row = 12 * stride * body
            if f > 0 and still[body]:
                if same_words(words, p, 16 * body):
                    continue
                still[body] = False
                repeat_pose(rows, row, stride, runtime_int(1), f)
            error = laid_error(matrices, p, pose)
            if not error <= keep:
                return False, worst
            worst = max(worst, error)
            for i in range(12):
                rows[row + i * stride + f] = pose[i]
    for body in range(bodies):
        first, stop = (1, ONE_POSE) if still[body] else (frames, stride)
        repeat_pose(rows, 12 * stride * body, stride, first, stop)
    return True, worst


@hot_kernel
def repeat_pose(rows: Memory, row: int, stride: int, first: int, stop: int) -> None:
    """Fill places from ``first`` on of twelve rows with what lies before them."""
    stay_one_function()
    for i in range(12):
        for place in range(row + i * stride + first, row + i * stride + stop):
            rows[place] = rows[place - 1]


@kernel
def take_poses(
    lanes: FloatArray, still: BoolArray, frames: IntArray, bodies: IntArray, place: FloatArray, turn: FloatArray
) -> None:
    """Fill ``place`` (K, n, 3) and ``turn`` (K, n, 3, 3) with the poses of bodies (n,) at frames (K,)."""
    rows, places, turns, stride = doubles_of(lanes), doubles_of(place), doubles_of(turn), lanes.shape[2]
    for k in range(len(frames)):
        for j in range(len(bodies)):
            at, pose = 12 * stride * bodies[j], k * len(bodies) + j
            if not still[bodies[j]]:
                at += frames[k]
            for i in range(9):
                turns[9 * pose + i] = rows[at + i * stride]
            for i in range(3):
                places[3 * pose + i] = rows[at + (9 + i) * stride]
