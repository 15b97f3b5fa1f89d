"""Sweep and prune: world boxes whose ends overlap on all three axes, found by sorting what is nearly sorted.

Source: D. Baraff, Dynamic simulation of non-penetrating rigid bodies (1992); J. D. Cohen, M. C. Lin, D. Manocha,
M. K. Ponamgi, I-COLLIDE (1995).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cdcore.bounding.box import Box
from cdcore.broad.box_stage import BOX_PAD_ULPS, BoxStage
from cdcore.broad.sphere_stage import CANDIDATE, CLEAR, NO_POSE, VolumeAnswer
from cdcore.kernels.compiling import hot_kernel, kernel
from cdcore.numerics import EPS, BoolArray, ByteArray, FloatArray, IntArray
from cdcore.protocol import Motion


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
            swapped, changed = sort_ends(ends, order, shared, axis)
            swaps += swapped
            events += changed
        for pair in range(len(first)):
            a, b = first[pair], second[pair]
            if not (valid[frame, a] and valid[frame, b]):
                verdict[frame, pair] = NO_POSE
            else:
                verdict[frame, pair] = CANDIDATE if shared[a, b] == 3 else CLEAR
    return swaps, events


@dataclass(frozen=True, eq=False)
class SweepMemory:
    """Endpoints (3, 2N), their order, and the axes each two bodies share, as the last frame left them."""

    ends: FloatArray
    order: IntArray
    shared: IntArray


class SweepStage:
    """Finds the pair-frames whose world boxes overlap: of one box a body, along its own axes; ``pairs`` (P, 2) numbers.

    Choose it for many bodies that move little from frame to frame; ``SphereStage`` knows the paths and is cheaper over
    a recording.
    """

    def __init__(self, boxes: Sequence[Box], pairs: IntArray) -> None:
        self._boxes = BoxStage(boxes, pairs)

    def fresh_memory(self) -> SweepMemory:
        """All bodies at one point, where they overlap, low ends before high ends."""
        count = len(self._boxes.centres)
        order = np.concatenate([np.arange(0, 2 * count, 2), np.arange(1, 2 * count, 2)])
        return SweepMemory(np.zeros((3, 2 * count)), np.tile(order, (3, 1)), np.full((count, count), 3, dtype=np.int64))

    def candidates(self, motion: Motion, memory: SweepMemory) -> VolumeAnswer:
        """Answer for every frame and pair of the motion; ``memory`` is left as its last frame was.

        Counts neighbours exchanged, and overlaps begun or ended.
        """
        boxes = self._boxes
        verdict = np.zeros((len(motion), len(boxes.first)), dtype=np.uint8)
        swaps, events = sweep(
            motion.rotations, motion.translations, motion.valid, boxes.centres, boxes.halves, boxes.sizes,
            BOX_PAD_ULPS * EPS, boxes.first, boxes.second, memory.ends, memory.order, memory.shared, verdict,
        )  # fmt: skip
        return VolumeAnswer(verdict, {"swaps": int(swaps), "pair_events": int(events)})
