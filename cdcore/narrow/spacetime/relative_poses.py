"""Eight poses of one body as seen from another, and how far their rotations stray from the middle one."""

from __future__ import annotations

import numpy as np

from cdcore.kernels.compiling import hot_kernel, stay_one_function
from cdcore.kernels.memory import Memory
from cdcore.narrow.spacetime.bounds import CHORD_SLACK
from cdcore.narrow.spacetime.lanes import dot, fused, load8, minus, splat8, store
from cdcore.narrow.spacetime.memory import PoseMemory


@hot_kernel
def fill_relative(pose_a: PoseMemory, pose_b: PoseMemory, frame: int, relative: Memory) -> None:
    """Poses of A in B's frame for eight frames, (96,): rotation by rows, then translation."""
    stay_one_function()
    a, n, f_a = pose_a.entries, pose_a.stride, frame * pose_a.step
    b, m, f_b = pose_b.entries, pose_b.stride, frame * pose_b.step
    x = minus(load8(a, 9 * n + f_a), load8(b, 9 * m + f_b))
    y = minus(load8(a, 10 * n + f_a), load8(b, 10 * m + f_b))
    z = minus(load8(a, 11 * n + f_a), load8(b, 11 * m + f_b))
    for i in range(3):
        p, q, r = load8(b, i * m + f_b), load8(b, (3 + i) * m + f_b), load8(b, (6 + i) * m + f_b)
        for j in range(3):
            u, v, w = load8(a, j * n + f_a), load8(a, (3 + j) * n + f_a), load8(a, (6 + j) * n + f_a)
            store(relative, 24 * i + 8 * j, dot(p, q, r, u, v, w))
        store(relative, 72 + 8 * i, dot(p, q, r, x, y, z))


@hot_kernel
def largest_chord(relative: Memory, lane: int, lanes: int, middle: Memory, squares: Memory) -> float:
    """Write the rotation of one lane to ``middle`` (9,); returns how far any lane's lies from it, spectral norm.

    ``squares`` (8,) is scratch.
    """
    stay_one_function()
    total = splat8(0.0)
    for k in range(9):
        middle[k] = relative[8 * k + lane]
        change = minus(load8(relative, 8 * k), middle[k])
        total = fused(change, change, total)
    store(squares, 0, total)
    largest = 0.0
    for k in range(lanes):
        largest = max(largest, squares[k])
    chord: float = np.sqrt(0.5 * largest) * CHORD_SLACK
    return chord
