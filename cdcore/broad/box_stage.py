"""The box stage: separating axes of whole-body boxes reject what the spheres let through, never bodies that touch."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from cdcore.bounding.box import Box
from cdcore.broad.sphere_stage import Arrays
from cdcore.kernels.box_against_box import relative_box, separated_on_all_axes
from cdcore.kernels.compiling import always_inlined, hot_kernel, kernel
from cdcore.numerics import BoolArray, IntArray
from cdcore.poses.kernels import relative_pose
from cdcore.protocol import Motion
from cdcore.tolerances import EPS, UNDERFLOW_PAD

BOX_PAD_ULPS: Final = 1024.0
"""Pad of the box stage in eps of both bodies' size.

A rotation may be off orthonormal by 64 eps per entry of R^T R (``ORTHONORMAL_KEEP``), 192 eps as a map; the axes of B
seen from A twice that: 384 eps of a half diagonal for each body. Placing vertices, centres and axes rounds by less
than 64 eps of size more. 1024 is above twice the sum; at 1 m it is 0.2 nanometres of lost tightness.
"""


@hot_kernel
def boxes_may_meet(t: int, a: int, b: int, poses: Arrays, boxes: Arrays, room: Arrays) -> bool:
    """Whether the boxes of bodies ``a`` and ``b`` may meet in frame ``t``: False only where they are certainly apart.

    ``boxes``: centres, axes, one a row, halves and sizes; ``room``: as ``box_room`` makes it.
    """
    always_inlined()
    rotation, translation = poses
    centres, axes, halves, sizes = boxes
    relative_rotation, move, m, d = room
    move_a, move_b = translation[t, a], translation[t, b]
    largest_a = max(abs(move_a[0]), abs(move_a[1]), abs(move_a[2]))
    largest_b = max(abs(move_b[0]), abs(move_b[1]), abs(move_b[2]))
    size = sizes[a] + sizes[b] + largest_a + largest_b
    pad = BOX_PAD_ULPS * EPS * size + UNDERFLOW_PAD
    relative_pose(rotation[t, a], move_a, rotation[t, b], move_b, relative_rotation, move)
    relative_box(centres[a], axes[a], centres[b], axes[b], relative_rotation, move, m, d)
    return not separated_on_all_axes(m, d, halves[a], halves[b], pad)


def box_room() -> Arrays:
    """Scratch memory of ``boxes_may_meet``."""
    return np.empty((3, 3)), np.empty(3), np.empty((3, 3)), np.empty(3)


@kernel
def fill_may_meet(
    frames: IntArray, first: IntArray, second: IntArray, poses: Arrays, boxes: Arrays, room: Arrays, meets: BoolArray
) -> None:
    """Fill ``meets`` (K,) of bodies ``first[k]`` and ``second[k]``."""
    for k in range(len(frames)):
        meets[k] = boxes_may_meet(frames[k], first[k], second[k], poses, boxes, room)


class BoxStage:
    """Tests oriented boxes of all bodies for separation, 15 axes, for many pair-frames at once."""

    def __init__(self, boxes: Sequence[Box], pairs: IntArray) -> None:
        centres = np.array([box.centre for box in boxes]).reshape(-1, 3)
        axes = np.array([box.axes.T for box in boxes]).reshape(-1, 3, 3)
        halves = np.array([box.half for box in boxes]).reshape(-1, 3)
        with np.errstate(over="ignore"):
            sizes = np.linalg.norm(centres, axis=1) + np.linalg.norm(halves, axis=1)
        self.boxes = centres, axes, halves, sizes
        self._pairs = pairs

    def may_meet(self, motion: Motion, frames: IntArray, columns: IntArray) -> BoolArray:
        """(K,): False only where the bodies are certainly apart.

        ``frames`` and ``columns`` (K,): frame numbers and columns of the pairs; both bodies have a pose there.
        """
        meets = np.empty(len(frames), dtype=np.bool_)
        first, second = np.ascontiguousarray(self._pairs[columns].T)
        poses = motion.rotations, motion.translations
        fill_may_meet(np.ascontiguousarray(frames), first, second, poses, self.boxes, box_room(), meets)
        return meets
