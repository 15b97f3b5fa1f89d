"""Motion bounds: for how many frames two bodies certainly stay apart, from their gap now and their path lengths."""

from __future__ import annotations

import numpy as np

from cdcore.kernels.compiling import become_part_of_caller, hot_kernel, stay_one_function
from cdcore.kernels.memory import Memory
from cdcore.narrow.bvh.tree_memory import PoseMemory

GAP_SHARE = 1.0 - 1e-12
"""Share of a gap that two paths may use up: covers the rounding of what each moved, and of the sum."""


@hot_kernel
def distance_to_box(pose: PoseMemory, frame: int, box: Memory, x: float, y: float, z: float) -> float:
    """Distance of a point, given by its world offset from a root box's centre, to that box."""
    become_part_of_caller()
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
def root_gap(boxes_a: Memory, pose_a: PoseMemory, boxes_b: Memory, pose_b: PoseMemory, frame: int, pad: float) -> float:
    """A distance the bodies certainly keep in this frame; not positive where none is certain."""
    stay_one_function()
    f_a, f_b = frame * pose_a.step, frame * pose_b.step
    x = pose_a.centres[f_a] - pose_b.centres[f_b]
    y = pose_a.centres[pose_a.stride + f_a] - pose_b.centres[pose_b.stride + f_b]
    z = pose_a.centres[2 * pose_a.stride + f_a] - pose_b.centres[2 * pose_b.stride + f_b]
    to_b = distance_to_box(pose_b, f_b, boxes_b, x, y, z) - boxes_a[15]
    to_a = distance_to_box(pose_a, f_a, boxes_a, x, y, z) - boxes_b[15]
    gap: float = max(to_a, to_b) - pad
    return gap


@hot_kernel
def uses_up(pose_a: PoseMemory, pose_b: PoseMemory, frame: int, later: int, gap: float) -> bool:
    """Whether two bodies may have moved by the gap between two frames.

    The difference of each path comes first: a path of 18 million km is rounded to 4 micrometres, and so is its sum with
    another, which let bodies come nearer by that without a test.
    """
    become_part_of_caller()
    moved_a = pose_a.path[later * pose_a.step] - pose_a.path[frame * pose_a.step]
    moved_b = pose_b.path[later * pose_b.step] - pose_b.path[frame * pose_b.step]
    # asked this way round, paths that overflowed to NaN use up any gap
    return not moved_a + moved_b < gap * GAP_SHARE


@hot_kernel
def first_unsafe(pose_a: PoseMemory, pose_b: PoseMemory, frame: int, stop: int, gap: float) -> int:
    """First frame by which the two paths together may have used up the gap; at most ``stop``."""
    stay_one_function()
    step, safe = 1, frame
    while safe + step < stop and not uses_up(pose_a, pose_b, frame, safe + step, gap):
        safe += step
        step *= 2
    while step > 0:
        if safe + step < stop and not uses_up(pose_a, pose_b, frame, safe + step, gap):
            safe += step
        step //= 2
    return safe + 1
