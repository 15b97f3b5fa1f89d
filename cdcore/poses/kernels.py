"""The answers of ``cdcore.poses`` inside kernels: place, relative pose, same pose, length moved.

A pose in one row (12,) is the rotation row by row, then the translation.
"""

import numpy as np

from cdcore.kernels.compiling import always_inlined, hot_kernel, kernel, never_inlined
from cdcore.kernels.memory import Memory
from cdcore.kernels.simd import Lanes, plus, times
from cdcore.kernels.vectors import Vector, vector_at
from cdcore.numerics import FloatArray


@hot_kernel
def place_coordinate(row: tuple[Lanes, Lanes, Lanes], translation: Lanes, point: tuple[Lanes, Lanes, Lanes]) -> Lanes:
    """One world coordinate of a body point: every step rounds, as in ``place_points``; doubles or lanes of them."""
    always_inlined()
    row_x, row_y, row_z = row
    x, y, z = point
    placed = plus(times(row_x, x), times(row_y, y))
    return plus(plus(placed, times(row_z, z)), translation)


@hot_kernel
def placed_by_row(pose: FloatArray, point: Vector) -> Vector:
    """World coordinates of a body point at a pose in one row (12,)."""
    always_inlined()
    return (
        place_coordinate(vector_at(pose, 0), pose[9], point),
        place_coordinate(vector_at(pose, 3), pose[10], point),
        place_coordinate(vector_at(pose, 6), pose[11], point),
    )


@kernel
def place_face(
    corners: FloatArray, face: int, rotation: FloatArray, move: FloatArray, pair: FloatArray, first: int
) -> None:
    """Write world corners of a face of ``corners`` (f, 3, 3) to ``pair[first:first + 9]``."""
    never_inlined()
    for c in range(3):
        point = corners[face, c, 0], corners[face, c, 1], corners[face, c, 2]
        for k in range(3):
            row = rotation[k, 0], rotation[k, 1], rotation[k, 2]
            pair[first + 3 * c + k] = place_coordinate(row, move[k], point)


@hot_kernel
def copy_pose(rotation: FloatArray, move: FloatArray, to_rotation: FloatArray, to_move: FloatArray) -> None:
    """Write a pose (3, 3), (3,) over another one; entry by entry, since ``[:] =`` takes seconds to compile."""
    never_inlined()
    for i in range(3):
        to_move[i] = move[i]
        for j in range(3):
            to_rotation[i, j] = rotation[i, j]


@hot_kernel
def relative_pose(
    rotation_a: FloatArray,
    move_a: FloatArray,
    rotation_b: FloatArray,
    move_b: FloatArray,
    rotation: FloatArray,
    move: FloatArray,
) -> None:
    """The pose of B in A's frame, to ``rotation`` (3, 3) and ``move`` (3,)."""
    never_inlined()
    for i in range(3):
        move[i] = 0.0
        for k in range(3):
            move[i] += rotation_a[k, i] * (move_b[k] - move_a[k])
        for j in range(3):
            rotation[i, j] = (
                rotation_a[0, i] * rotation_b[0, j]
                + rotation_a[1, i] * rotation_b[1, j]
                + rotation_a[2, i] * rotation_b[2, j]
            )


@hot_kernel
def relative_row(pose_a: FloatArray, pose_b: FloatArray, relative: FloatArray) -> None:
    """The pose of B in A's frame, all three in one row (12,)."""
    never_inlined()
    for i in range(3):
        total = 0.0
        for k in range(3):
            total += pose_a[3 * k + i] * (pose_b[9 + k] - pose_a[9 + k])
        relative[9 + i] = total
        for j in range(3):
            relative[3 * i + j] = pose_a[i] * pose_b[j] + pose_a[3 + i] * pose_b[3 + j] + pose_a[6 + i] * pose_b[6 + j]


@hot_kernel
def same_pose(
    position: Memory, rotation: Memory, k: int, other_position: Memory, other_rotation: Memory, other: int
) -> bool:
    """Whether pose ``k`` and the other one agree in every number; NaN agrees with nothing."""
    always_inlined()
    same = True
    for i in range(3):
        same &= position[3 * k + i] == other_position[3 * other + i]
    for i in range(9):
        same &= rotation[9 * k + i] == other_rotation[9 * other + i]
    return same


@hot_kernel
def length_moved(
    rotation: FloatArray,
    move: FloatArray,
    from_rotation: FloatArray,
    from_move: FloatArray,
    centre: FloatArray,
    radius: float,
) -> float:
    """Metres that no point of a ball moves more between two poses; rounding is not covered."""
    always_inlined()
    rotation_change, moved = 0.0, 0.0
    for i in range(3):
        offset = move[i] - from_move[i]
        for j in range(3):
            change = rotation[i, j] - from_rotation[i, j]
            rotation_change += change * change
            offset += change * centre[j]
        moved += offset * offset
    return np.sqrt(rotation_change) * radius + np.sqrt(moved)
