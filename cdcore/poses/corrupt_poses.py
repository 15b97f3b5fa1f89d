"""Refuses corrupt poses: not finite, or no rotation; repairs what is nearly a rotation, and blanks what is not valid.

Compiled passes go over many poses once, in place. Poses are read and written by address (``cdcore.kernels.memory``),
which is twice as fast as by three indices. Samples of a recording are refused before, in the pass over a session that
precedes a run.
"""

from collections.abc import Callable
from typing import Final

import numpy as np

from cdcore.errors import InvalidPoseError
from cdcore.kernels.compiling import always_inlined, hot_kernel, kernel, never_inlined
from cdcore.kernels.memory import Memory, doubles_of
from cdcore.numerics import BoolArray, FloatArray, IntArray, readonly
from cdcore.poses.kernels import same_pose
from cdcore.tolerances import ORTHONORMAL_KEEP, ORTHONORMAL_REJECT

GOOD = -1
"""No pose is bad."""

POLAR_STEPS = 5
"""Newton-Schulz squares the error: 1e-3, 1e-6, 1e-12, then rounding."""

LAST_ROW: Final = [0.0, 0.0, 0.0, 1.0]
"""The last row of a matrix of a pose, column convention."""


def refuse_corrupt_poses(
    matrices: FloatArray, position: FloatArray, rotation: FloatArray, valid: BoolArray, label: Callable[[int], str]
) -> tuple[BoolArray, int, float]:
    """Returns where poses changed (T, N), how many rotations were repaired, and the largest error of a valid one.

    The arrays are those of `check_poses`. ``label`` says frame and body of a pose by its number.

    Raises InvalidPoseError: a valid pose is not finite, is no rotation, or its matrix ends in another row than 0 0 0 1.
    """
    changed = np.empty(valid.shape, dtype=np.bool_)
    scratch, last = np.empty(18), np.full(valid.shape[1], GOOD)
    # A read-only view whatever was given: else the kernel would be compiled for both kinds.
    entries = readonly(matrices[:])
    corrupt, repaired, worst = check_poses(entries, position, rotation, valid, scratch, last, changed)
    if corrupt == GOOD:
        return changed, repaired, worst
    frame, body = divmod(corrupt, valid.shape[1])
    if matrices.size and matrices[frame, body, 3].tolist() != LAST_ROW:
        fault = f"last row is {matrices[frame, body, 3].tolist()}, not 0 0 0 1; pass column-convention matrices"
    else:
        fault = _fault_of_pose(position[frame, body], rotation[frame, body])
    raise InvalidPoseError(label(corrupt) + fault)


def _fault_of_pose(position: FloatArray, rotation: FloatArray) -> str:
    """Says why a pose is refused, and what to do."""
    with np.errstate(invalid="ignore", over="ignore"):
        error, determinant = float(np.abs(rotation.T @ rotation - np.eye(3)).max()), float(np.linalg.det(rotation))
    if not np.isfinite(position).all():
        what = f"translation {position.tolist()} is not finite"
    elif not np.isfinite(rotation).all():
        what = "rotation is not finite"
    elif determinant < 0:
        what = "matrix is a reflection, not a rotation (determinant below 0)"
    else:
        what = f"matrix is not a rotation (|R^T R - I| reaches {error:.3g}, at most 1e-3 is repaired)"
    return what + "; flag the pose as not valid or repair it"


@hot_kernel
def matrix_error(r: Memory, o: int) -> float:
    """Largest entry of ``|R^T R - I|`` of the matrix at ``r[o:o + 9]``; infinity for a reflection, NaN where not
    finite.
    """
    always_inlined()
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
    never_inlined()
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
def settle_pose(position: Memory, rotation: Memory, k: int, valid: bool, scratch: Memory) -> float:
    """Repair pose ``k``, or put identity where it is not valid; returns its error, NaN for one to refuse."""
    always_inlined()
    if not valid:
        for i in range(3):
            position[3 * k + i] = 0.0
        for i in range(9):
            rotation[9 * k + i] = 1.0 if i % 4 == 0 else 0.0
        return 0.0
    error: float = matrix_error(rotation, 9 * k)
    for i in range(3):
        # a number that is not finite makes its product with 0 NaN; their sum could overflow
        error += 0.0 * position[3 * k + i]
    if not error <= ORTHONORMAL_KEEP:
        if not error <= ORTHONORMAL_REJECT:
            return np.nan
        repair_rotation(rotation, 9 * k, scratch)
    return error


@hot_kernel
def split(matrix: Memory, position: Memory, rotation: Memory, k: int) -> bool:
    """Copy translation and rotation of pose ``k`` from its 4x4 matrix; returns whether its last row is 0 0 0 1."""
    always_inlined()
    o = 16 * k
    for i in range(3):
        position[3 * k + i] = matrix[o + 4 * i + 3]
        for j in range(3):
            rotation[9 * k + 3 * i + j] = matrix[o + 4 * i + j]
    still = (matrix[o + 12] == 0.0) & (matrix[o + 13] == 0.0) & (matrix[o + 14] == 0.0)
    return still & (matrix[o + 15] == 1.0)


@kernel
def check_poses(
    matrices: FloatArray,
    position: FloatArray,
    rotation: FloatArray,
    valid: BoolArray,
    scratch: FloatArray,
    last: IntArray,
    changed: BoolArray,
) -> tuple[int, int, float]:
    """Check poses of N bodies at T times, repair what is within ORTHONORMAL_REJECT of a rotation, put identity where
    nothing is ``valid``.

    ``position`` (T, N, 3) and ``rotation`` (T, N, 3, 3), contiguous, are changed in place; ``matrices`` (T, N, 4, 4):
    where they come from, or nothing; ``valid`` (T, N); ``scratch`` (18,); ``last`` (N,): filled with GOOD. Fills
    ``changed`` (T, N) as of ``Motion``; a pose that repeats the last one was checked there. In numpy the same took six
    times as long. Returns the number of the first bad pose or GOOD, how many were repaired, and the worst error of a
    valid one.
    """
    entries, positions, rotations = doubles_of(matrices), doubles_of(position), doubles_of(rotation)
    room = doubles_of(scratch)
    given, repaired, worst = matrices.size > 0, 0, 0.0
    frames, bodies = valid.shape
    for t in range(frames):
        for body in range(bodies):
            k, before, present = t * bodies + body, last[body], valid[t, body]
            changed[t, body] = t == 0
            if given and not split(entries, positions, rotations, k) and present:
                return k, repaired, worst
            if present:
                last[body] = k
                if before >= 0 and same_pose(positions, rotations, k, positions, rotations, before):
                    continue
            error = settle_pose(positions, rotations, k, present, room)
            if not error <= ORTHONORMAL_REJECT:
                return k, repaired, worst
            worst = max(worst, error)
            repaired += error > ORTHONORMAL_KEEP
            if present and before >= 0:
                changed[t, body] = not same_pose(positions, rotations, k, positions, rotations, before)
    return GOOD, repaired, worst


@kernel
def note_changes(
    position: FloatArray, rotation: FloatArray, valid: BoolArray, last: IntArray, changed: BoolArray
) -> None:
    """Fill ``changed`` (T, N) as of ``Motion``, of poses ``position`` (T, N, 3) and ``rotation`` (T, N, 3, 3),
    contiguous; ``last`` (N,): filled with GOOD.
    """
    positions, rotations = doubles_of(position), doubles_of(rotation)
    frames, bodies = valid.shape
    for t in range(frames):
        for body in range(bodies):
            k, before = t * bodies + body, last[body]
            changed[t, body] = t == 0
            if valid[t, body]:
                last[body] = k
                changed[t, body] |= before >= 0 and not same_pose(positions, rotations, k, positions, rotations, before)
