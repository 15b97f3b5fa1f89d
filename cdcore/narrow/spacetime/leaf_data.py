"""What a leaf of a box tree keeps of its faces, in the two frames it is asked in: its own box's and the body's.

A face's plane is kept as a unit direction with its least and largest value on the face, so that it separates by its own
numbers: for a needle the direction may be poor, the certificate never is.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cdcore.narrow.compiling import hot_kernel, kernel, stay_one_function
from cdcore.numerics import FloatArray


@hot_kernel
def write_plane(p: FloatArray, out: FloatArray, at: int) -> float:
    """Unit normal of corners ``p`` (9,), with its range on them, to ``out[at:at + 5]``; returns the longest edge."""
    ux, uy, uz = p[3] - p[0], p[4] - p[1], p[5] - p[2]
    vx, vy, vz = p[6] - p[0], p[7] - p[1], p[8] - p[2]
    wx, wy, wz = vx - ux, vy - uy, vz - uz
    size = max(abs(ux), abs(uy), abs(uz), abs(vx), abs(vy), abs(vz))
    scale = 1.0 / size if size > 1e-300 else 0.0
    ux, uy, uz, vx, vy, vz = ux * scale, uy * scale, uz * scale, vx * scale, vy * scale, vz * scale
    x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    length = np.sqrt(x * x + y * y + z * z)
    if length > 1e-150:
        x, y, z = x / length, y / length, z / length
    else:
        x, y, z = 1.0, 0.0, 0.0
    low, high = np.inf, -np.inf
    for k in range(3):
        along = x * p[3 * k] + y * p[3 * k + 1] + z * p[3 * k + 2]
        low, high = min(low, along), max(high, along)
    out[at], out[at + 1], out[at + 2], out[at + 3], out[at + 4] = x, y, z, low, high
    edge = max(ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz)
    longest: float = size * np.sqrt(edge) + np.sqrt(wx * wx + wy * wy + wz * wz)
    return longest


@hot_kernel
def pick_of(corners: FloatArray, first: int, count: int, x: float, y: float, z: float) -> int:
    """Which of the leaf's corners so far equals this one; ``count`` if none."""
    for k in range(count):
        if corners[first + k, 0] == x and corners[first + k, 1] == y and corners[first + k, 2] == z:
            return k
    return count


@kernel
def fill_leaves(
    boxes: FloatArray, leaf_nodes: NDArray[np.int64], leaves: NDArray[np.int32], placed: FloatArray,
    picks: NDArray[np.int32], corners: FloatArray, boxed: FloatArray, planes: FloatArray,
) -> int:  # fmt: skip
    """Fill the arrays of ``BoxTree`` that belong to leaves; returns the number of distinct corners."""
    stay_one_function()
    total = 0
    local = np.empty(9)
    for leaf in range(len(leaves)):
        box = boxes[leaf_nodes[leaf]]
        leaves[leaf, 2] = total
        count = 0
        for face in range(leaves[leaf, 0], leaves[leaf, 0] + leaves[leaf, 1]):
            for c in range(3):
                x = placed[face, c] - box[0]
                y = placed[face, 4 + c] - box[1]
                z = placed[face, 8 + c] - box[2]
                local[3 * c], local[3 * c + 1], local[3 * c + 2] = x, y, z
                for k in range(3):
                    boxed[face, 3 * c + k] = box[3 + 3 * k] * x + box[4 + 3 * k] * y + box[5 + 3 * k] * z
                pick = pick_of(corners, total, count, x, y, z)
                picks[face, c] = pick
                if pick == count:
                    corners[total + count, 0], corners[total + count, 1], corners[total + count, 2] = x, y, z
                    count += 1
            planes[face, 10] = write_plane(local, planes[face], 5)
            write_plane(boxed[face], planes[face], 0)
        leaves[leaf, 3] = count
        total += count
    return total
