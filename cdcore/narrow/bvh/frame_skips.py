"""Frames that need no search: those that repeat the one before, and those in which two bodies certainly stay apart.

How long these last is known from the gap of two root boxes now and the lengths of both bodies' paths.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from cdcore.kernels.compiling import always_inlined, hot_kernel, never_inlined
from cdcore.kernels.memory import Memory
from cdcore.narrow.bvh.bounds import LARGEST_SIZE, LARGEST_SKEW, SMALLEST_SIZE
from cdcore.narrow.bvh.tree_memory import BEYOND, GAP_TESTS, REUSED, SKIPPED, Pair, PoseMemory

SHORTEST_SKIP: Final = 4
"""Frames: a shorter skip saves less than the half-used block after it costs."""
GAP_FRACTION: Final = 1.0 - 1e-12
"""Share of a gap that two paths may use up: covers the rounding of what each moved, and of the sum."""


@hot_kernel
def distance_to_box(pose: PoseMemory, frame: int, box: Memory, x: float, y: float, z: float) -> float:
    """Distance of a point, given by its world offset from a root box's centre, to that box."""
    always_inlined()
    entries, stride = pose.entries, pose.stride
    bx = entries[frame] * x + entries[3 * stride + frame] * y + entries[6 * stride + frame] * z
    by = entries[stride + frame] * x + entries[4 * stride + frame] * y + entries[7 * stride + frame] * z
    bz = entries[2 * stride + frame] * x + entries[5 * stride + frame] * y + entries[8 * stride + frame] * z
    squared = 0.0
    for k in range(3):
        over = abs(box[3 + k] * bx + box[6 + k] * by + box[9 + k] * bz) - box[12 + k]
        if over > 0.0:
            squared += over * over
    distance: float = np.sqrt(squared)
    return distance


@hot_kernel
def root_gap(pair: Pair, frame: int, pad: float) -> float:
    """A distance the bodies certainly keep in this frame; not positive where none is certain."""
    never_inlined()
    pose_a, pose_b, boxes_a, boxes_b = pair.pose_a, pair.pose_b, pair.tree_a.boxes, pair.tree_b.boxes
    f_a, f_b = frame * pose_a.step, frame * pose_b.step
    x = pose_a.centres[f_a] - pose_b.centres[f_b]
    y = pose_a.centres[pose_a.stride + f_a] - pose_b.centres[pose_b.stride + f_b]
    z = pose_a.centres[2 * pose_a.stride + f_a] - pose_b.centres[2 * pose_b.stride + f_b]
    to_b = distance_to_box(pose_b, f_b, boxes_b, x, y, z) - boxes_a[15]
    to_a = distance_to_box(pose_a, f_a, boxes_a, x, y, z) - boxes_b[15]
    gap: float = max(to_a, to_b) - pad
    return gap


@hot_kernel
def uses_up(pair: Pair, frame: int, later: int, gap: float) -> bool:
    """Whether two bodies may have moved by the gap between two frames.

    The difference of each path comes first: a path of 18 million km is rounded to 4 micrometres, and so is its sum with
    another, which let bodies come nearer by that without a test.
    """
    always_inlined()
    pose_a, pose_b = pair.pose_a, pair.pose_b
    moved_a = pose_a.path[later * pose_a.step] - pose_a.path[frame * pose_a.step]
    moved_b = pose_b.path[later * pose_b.step] - pose_b.path[frame * pose_b.step]
    # asked this way round, paths that overflowed to NaN use up any gap
    return not moved_a + moved_b < gap * GAP_FRACTION


@hot_kernel
def first_unsafe(pair: Pair, frame: int, gap: float) -> int:
    """First frame by which the two paths together may have used up the gap; at most the last asked about and one."""
    never_inlined()
    step, safe, stop = 1, frame, pair.stop
    while safe + step < stop and not uses_up(pair, frame, safe + step, gap):
        safe += step
        step *= 2
    while step > 0:
        if safe + step < stop and not uses_up(pair, frame, safe + step, gap):
            safe += step
        step //= 2
    return safe + 1


@hot_kernel
def size_at(pair: Pair, frame: int) -> float:
    """The size S of ``cdcore.narrow.bvh.bounds`` in a frame."""
    always_inlined()
    a, b = pair.pose_a, pair.pose_b
    size: float = a.facts[1] + b.facts[1] + a.away[frame * a.step] + b.away[frame * b.step]
    return size


@hot_kernel
def poses_repeat(pair: Pair, frame: int) -> bool:
    """Whether both poses are those of the frame before."""
    always_inlined()
    a, b = pair.pose_a, pair.pose_b
    return bool(a.changed[frame * a.step] == 0 and b.changed[frame * b.step] == 0)


@hot_kernel
def frames_left_out(pair: Pair, frame: int, pad: float, work: Memory) -> int:
    """The next frame that is to be searched: marks frames that repeat the one before, or lie beyond the kernels.

    Bodies are certainly apart in the others that it passes. ``pad``: as a share of the size.
    """
    never_inlined()
    if frame > 0 and poses_repeat(pair, frame):
        pair.repeats[frame] = 1
        work[REUSED] += 1
        return frame + 1
    size, skew = size_at(pair, frame), pair.pose_a.facts[0] + pair.pose_b.facts[0]
    # asked this way round, a size that is not a number is beyond them
    if not (size >= SMALLEST_SIZE and size <= LARGEST_SIZE and skew <= LARGEST_SKEW):
        pair.volumes[frame] = BEYOND
        return frame + 1
    following = frame
    work[GAP_TESTS] += 1
    gap = root_gap(pair, frame, pad * size)
    if gap > 0.0:
        # sizes, and what a dismissal keeps, grow by no more than the bodies move
        following = first_unsafe(pair, frame, gap * (1.0 - 2.0 * pad))
        if following - frame < SHORTEST_SKIP and following < pair.stop:
            following = frame
    work[SKIPPED] += following - frame
    return following
