"""Compiled loops of sweep and prune: endpoints kept sorted from frame to frame, pairs told by the swaps."""

from __future__ import annotations

import numpy as np

from cdcore.kernels.compiling import hot_kernel, kernel
from cdcore.numerics import BoolArray, ByteArray, FloatArray, IntArray

CLEAR = np.uint8(0)
CANDIDATE = np.uint8(3)
NO_POSE = np.uint8(7)


@hot_kernel
def comes_after(ends: FloatArray, axis: int, first: int, second: int) -> bool:
    """Whether endpoint ``first`` belongs behind ``second``; of equal values low ends go first: touching counts."""
    x, y = ends[axis, first], ends[axis, second]
    return bool(x > y or (x == y and first % 2 > second % 2))


@hot_kernel
def sort_ends(ends: FloatArray, order: IntArray, shared: IntArray, axis: int) -> tuple[int, int]:
    """Insertion sort of one axis; ``shared`` (N, N) is kept equal to the axes on which two bodies overlap.

    Returns swaps done and how often a pair began or ceased to overlap on all axes.
    """
    swaps, events = 0, 0
    row = order[axis]
    for place in range(1, len(row)):
        at = place
        while at > 0 and comes_after(ends, axis, row[at - 1], row[at]):
            before, moved = row[at - 1], row[at]
            row[at - 1], row[at] = moved, before
            a, b = moved // 2, before // 2
            swaps += 1
            at -= 1
            if moved % 2 != before % 2:
                events += 1 if shared[a, b] == 3 else 0
                change = 1 if moved % 2 == 0 else -1
                shared[a, b] += change
                shared[b, a] = shared[a, b]
                events += 1 if shared[a, b] == 3 else 0
    return swaps, events


@kernel
def place_ends(
    rotation: FloatArray, translation: FloatArray, centre: FloatArray, half: FloatArray, size: float, pad_ulps: float,
    body: int, ends: FloatArray,
) -> None:  # fmt: skip
    """World box of a body from its own box, padded, as its six endpoints: low at 2 body, high at 2 body + 1."""
    largest = max(abs(translation[0]), abs(translation[1]), abs(translation[2]))
    pad = pad_ulps * (size + largest)
    for i in range(3):
        middle = (rotation[i, 0] * centre[0] + rotation[i, 1] * centre[1] + rotation[i, 2] * centre[2]) + translation[i]
        reach = abs(rotation[i, 0]) * half[0] + abs(rotation[i, 1]) * half[1] + abs(rotation[i, 2]) * half[2] + pad
        ends[i, 2 * body] = middle - reach
        ends[i, 2 * body + 1] = middle + reach


@kernel
def sweep(
    rotation: FloatArray, translation: FloatArray, valid: BoolArray, centres: FloatArray, halves: FloatArray,
    sizes: FloatArray, pad_ulps: float, first: IntArray, second: IntArray, ends: FloatArray, order: IntArray,
    shared: IntArray, verdict: ByteArray,
) -> tuple[int, int]:  # fmt: skip
    """Fill ``verdict`` (T, P); ``ends`` (3, 2N), ``order`` (3, 2N) and ``shared`` (N, N) come from the frame before.

    A body without a pose stays where it was. Returns swaps and pair events.
    """
    swaps, events = 0, 0
    for frame in range(valid.shape[0]):
        for body in range(valid.shape[1]):
            if valid[frame, body]:
                place_ends(
                    rotation[frame, body], translation[frame, body], centres[body], halves[body], sizes[body],
                    pad_ulps, body, ends,
                )  # fmt: skip
        for axis in range(3):
            done, told = sort_ends(ends, order, shared, axis)
            swaps += done
            events += told
        for pair in range(len(first)):
            a, b = first[pair], second[pair]
            if not (valid[frame, a] and valid[frame, b]):
                verdict[frame, pair] = NO_POSE
            else:
                verdict[frame, pair] = CANDIDATE if shared[a, b] == 3 else CLEAR
    return swaps, events
