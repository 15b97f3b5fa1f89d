"""Spans of frames, coarse above fine: the box in which a body's root centre stays for 64 frames, for 512, up to all.

Bodies whose boxes are further apart than their radii are apart in every frame of the span: distant bodies are dismissed
for a whole recording in as many tests as there are levels. A path length, which skips shorter stretches, only grows; a
body that moves to and fro keeps its box.

The ends of a box are centres as they were placed; the distance of two boxes and the sum of two radii err by less than
20 u S, which the pad of ``cdcore.narrow.spacetime.bounds`` covers: an origin is no further out than a centre in the
box and the reach of its body.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from cdcore.kernels.compiling import become_part_of_caller, hot_kernel, stay_one_function
from cdcore.kernels.memory import Memory
from cdcore.narrow.spacetime.memory import PoseMemory
from cdcore.narrow.spacetime.simd import LANES, least, load8, most, splat8, store

SPAN_BITS: Final = 6
"""The finest spans have 64 frames: with 16 the tests of near bodies cost what they save, with 256 less is saved."""
FAN_BITS: Final = 3
"""A span holds eight of the level below."""
SPAN: Final = 1 << SPAN_BITS
FAN: Final = 1 << FAN_BITS
SPAN_TESTS: Final = 8
"""Place of their counter among those of ``cdcore.narrow.spacetime.block``."""


def span_count(frames: int) -> int:
    """Number of spans on all levels over so many frames, one at least on top."""
    level = -(-frames // SPAN)
    total = level
    while level > 1:
        level = -(-level // FAN)
        total += level
    return total


@hot_kernel
def least_and_most(entries: Memory, first: int, stop: int, lanes: Memory) -> tuple[float, float]:
    """Ends of ``entries[first:stop]``, whole vectors of it; ``lanes`` (2 LANES,) is scratch."""
    become_part_of_caller()
    low, high = splat8(np.inf), splat8(-np.inf)
    for at in range(first, stop, LANES):
        place = load8(entries, at)
        low, high = least(place, low), most(place, high)
    store(lanes, 0, low)
    store(lanes, LANES, high)
    lowest, highest = np.inf, -np.inf
    for k in range(LANES):
        lowest, highest = min(lowest, lanes[k]), max(highest, lanes[LANES + k])
    return lowest, highest


@hot_kernel
def fill_ranges(centres: Memory, stride: int, count: int, ranges: Memory, lanes: Memory) -> None:
    """Fill ``ranges`` (6 n,), finest level first: least x, y, z of the root centre in a span, then the largest.

    ``lanes`` (2 LANES,) is scratch.
    """
    stay_one_function()
    for first in range(0, count, SPAN):
        for axis in range(3):
            at, row = 6 * (first >> SPAN_BITS) + axis, axis * stride
            # what follows the last frame repeats it
            ends = least_and_most(centres, row + first, row + min(first + SPAN, count), lanes)
            ranges[at], ranges[at + 3] = ends
    below, level = 0, (count + SPAN - 1) >> SPAN_BITS
    while level > 1:
        above = (level + FAN - 1) >> FAN_BITS
        for span in range(above):
            first, stop = below + FAN * span, below + min(FAN * span + FAN, level)
            for k in range(6):
                end = ranges[6 * first + k]
                for child in range(first + 1, stop):
                    other = ranges[6 * child + k]
                    end = min(end, other) if k < 3 else max(end, other)
                ranges[6 * (below + level + span) + k] = end
        below += level
        level = above


@hot_kernel
def spans_apart(pose_a: PoseMemory, pose_b: PoseMemory, span: int, radii: float, pad: float) -> bool:
    """Whether two root centres stay further apart than ``radii`` in a span; ``pad`` is a share of the size."""
    stay_one_function()
    a, b = 6 * span * pose_a.step, 6 * span * pose_b.step
    squared, size = 0.0, 2.0 * (pose_a.facts[1] + pose_b.facts[1])
    for k in range(3):
        size += max(abs(pose_a.ranges[a + k]), abs(pose_a.ranges[a + 3 + k]))
        size += max(abs(pose_b.ranges[b + k]), abs(pose_b.ranges[b + 3 + k]))
        between = max(pose_b.ranges[b + k] - pose_a.ranges[a + 3 + k], pose_a.ranges[a + k] - pose_b.ranges[b + 3 + k])
        if between > 0.0:
            squared += between * between
    apart: bool = np.sqrt(squared) > radii + pad * size
    return apart


@hot_kernel
def first_near(pose_a: PoseMemory, pose_b: PoseMemory, frame: int, radii: float, pad: float, work: Memory) -> int:
    """The first frame from ``frame`` on that no span dismisses; the number of frames if there is none.

    Climbs from the finest span that holds the frame as long as spans are apart. ``work[SPAN_TESTS]`` counts.
    """
    stay_one_function()
    frames = max(pose_a.frames, pose_b.frames)
    span, level, offset, width, near = frame >> SPAN_BITS, (frames + SPAN - 1) >> SPAN_BITS, 0, SPAN, frame
    while True:
        work[SPAN_TESTS] += 1
        if not spans_apart(pose_a, pose_b, offset + span, radii, pad):
            return near
        near = min((span + 1) * width, frames)
        if level == 1:
            return near
        offset += level
        span, level, width = span >> FAN_BITS, (level + FAN - 1) >> FAN_BITS, width << FAN_BITS
