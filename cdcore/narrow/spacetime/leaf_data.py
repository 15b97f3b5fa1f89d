"""What a leaf of a box tree keeps of its faces, in the two frames it is asked in: its own box's and the body's.

A face's plane is kept as a unit direction with its least and largest value on the face, so that it separates by its own
numbers: for a needle the direction may be poor, what it separates is apart.
"""

from __future__ import annotations

import numpy as np

from cdcore.kernels.compiling import hot_kernel, kernel, runtime_int, stay_one_function
from cdcore.kernels.memory import Memory, doubles_at, integers_at, words_at
from cdcore.numerics import IntArray


@hot_kernel
def write_plane(p: Memory, row: int, out: Memory, at: int) -> float:
    """Unit normal of ``p[row : row + 9]`` and its range there, to ``out[at : at + 5]``; returns the longest edge."""
    stay_one_function()
    ux, uy, uz = p[row + 3] - p[row], p[row + 4] - p[row + 1], p[row + 5] - p[row + 2]
    vx, vy, vz = p[row + 6] - p[row], p[row + 7] - p[row + 1], p[row + 8] - p[row + 2]
    size = max(max(max(abs(ux), abs(uy)), max(abs(uz), abs(vx))), max(abs(vy), abs(vz)))
    scale = 1.0 / size if size > 1e-300 else 0.0
    ux, uy, uz, vx, vy, vz = ux * scale, uy * scale, uz * scale, vx * scale, vy * scale, vz * scale
    x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    length = np.sqrt(x * x + y * y + z * z)
    if length > 1e-150:
        x, y, z = x / length, y / length, z / length
    else:
        x, y, z = 1.0, 0.0, 0.0
    low, high = np.inf, -np.inf
    for _ in range(3):
        along = x * p[row] + y * p[row + 1] + z * p[row + 2]
        low, high = min(low, along), max(high, along)
        row += 3
    out[at], out[at + 1], out[at + 2], out[at + 3], out[at + 4] = x, y, z, low, high
    wx, wy, wz = vx - ux, vy - uy, vz - uz
    edge = max(ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz)
    longest: float = size * (np.sqrt(edge) + np.sqrt(wx * wx + wy * wy + wz * wz))
    return longest


@hot_kernel
def pick_of(corners: Memory, first: int, count: int, x: float, y: float, z: float) -> int:
    """Which of the leaf's corners so far equals this one; ``count`` if none."""
    stay_one_function()
    for k in range(count):
        at = 3 * (first + k)
        if corners[at] == x and corners[at + 1] == y and corners[at + 2] == z:
            return k
    return count


@kernel
def fill_leaves(row: IntArray, count: int) -> int:
    """Fill the arrays of ``BoxTree`` that belong to leaves; returns the number of distinct corners.

    ``row`` holds addresses: of boxes, the leaves' nodes, leaves, placed, picks, corners, boxed, planes, and nine
    doubles of scratch.
    """
    boxes, leaf_nodes, leaves = doubles_at(row[0]), words_at(row[1]), integers_at(row[2])
    placed, picks, corners = doubles_at(row[3]), integers_at(row[4]), doubles_at(row[5])
    boxed, planes, local = doubles_at(row[6]), doubles_at(row[7]), doubles_at(row[8])
    total = runtime_int(0)
    for leaf in range(count):
        box = 16 * leaf_nodes[leaf]
        leaves[4 * leaf + 2] = total
        known = runtime_int(0)
        first = runtime_int(leaves[4 * leaf])
        for face in range(first, first + leaves[4 * leaf + 1]):
            for c in range(3):
                x = placed[12 * face + c] - boxes[box]
                y = placed[12 * face + 4 + c] - boxes[box + 1]
                z = placed[12 * face + 8 + c] - boxes[box + 2]
                local[3 * c], local[3 * c + 1], local[3 * c + 2] = x, y, z
                for k in range(3):
                    axis = box + 3 + k
                    boxed[9 * face + 3 * c + k] = boxes[axis] * x + boxes[axis + 3] * y + boxes[axis + 6] * z
                pick = pick_of(corners, total, known, x, y, z)
                picks[3 * face + c] = pick
                if pick == known:
                    at = 3 * (total + known)
                    corners[at], corners[at + 1], corners[at + 2] = x, y, z
                    known += 1
            planes[11 * face + 10] = write_plane(local, runtime_int(0), planes, 11 * face + 5)
            write_plane(boxed, 9 * face, planes, 11 * face)
        leaves[4 * leaf + 3] = known
        total += known
    return total
