"""Compares connected parts of a body with the parts and holes of another one, by their boxes.

A part beside the boxes of all parts of the other body, or neither within such a box nor near a hole, is outside. How
far it keeps from the boxes says how far it may move before it has to be asked about again.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from cdcore.containment.placed_points import margin_at
from cdcore.kernels.box_against_box import gap_on_face_axes, separated_on_all_axes
from cdcore.kernels.compiling import hot_kernel, kernel, never_inlined
from cdcore.numerics import FloatArray, IntArray
from cdcore.poses.kernels import copy_pose, length_moved, relative_pose

BESIDE: Final = 0
"""A part of the inner body that is not within the box of any part of the outer one, nor near a hole: outside."""
WITHIN: Final = 1
"""It is within such a box and keeps away from holes: on one side of every part."""
AT_HOLE: Final = 2
"""It is near a hole, through which it may reach."""

CLEARANCE_MARGINS: Final = 8.0
"""Margins of rounding that are taken off a clearance, so that boxes are still found apart when it is used up: a gap of
two boxes is at most the square root of three times as long as that along the best of their fifteen axes."""


class InnerComponents(NamedTuple):
    """I connected parts of a body: ``boxes`` (I, 2, 3) and ``points`` (p, 3), on faces first, then outermost vertices.

    Those of part i begin at ``first_point[i]``, its vertices at ``first_extreme[i]``; next is ``first_point[i + 1]``.
    ``centre`` (3,) and ``radius``: of a ball around the boxes of all parts.
    """

    boxes: FloatArray
    points: FloatArray
    first_point: IntArray
    first_extreme: IntArray
    centre: FloatArray
    radius: float


class OuterBoxes(NamedTuple):
    """Boxes (K, 2, 3) of the parts of a surface, and those of holes (h, 2, 3): of part k from ``first_hole[k]`` on."""

    boxes: FloatArray
    holes: FloatArray
    first_hole: IntArray


@kernel
def reach_of_component(
    components: InnerComponents, i: int, outer: OuterBoxes, rotation: FloatArray, move: FloatArray, margin: float
) -> int:
    """BESIDE, WITHIN or AT_HOLE for part ``i`` of the inner body, whose pose in the outer one's frame is given."""
    never_inlined()
    half, half_inner, d = np.empty(3), np.empty(3), np.empty(3)
    reach = BESIDE
    for k in range(len(outer.boxes)):
        place_boxes(components, i, outer.boxes[k], rotation, move, half, half_inner, d)
        if separated_on_all_axes(rotation, d, half, half_inner, margin):
            continue
        for hole in range(outer.first_hole[k], outer.first_hole[k + 1]):
            place_boxes(components, i, outer.holes[hole], rotation, move, half, half_inner, d)
            if not separated_on_all_axes(rotation, d, half, half_inner, margin):
                return AT_HOLE
        # Asked this way round, what is not a number is kept: in poses far out a difference may be none.
        if reach == BESIDE and not length_beyond_box(components, i, outer.boxes[k], rotation, move) > margin:
            reach = WITHIN
    return reach


@kernel
def fill_clearances(
    poses: tuple[FloatArray, FloatArray],
    frames: IntArray,
    ends: tuple[int, int],
    components: InnerComponents,
    outer: OuterBoxes,
    size: float,
    clearances: FloatArray,
) -> None:
    """Fill in (K,) how far points may move while all parts stay BESIDE, for K frames of poses (T, N, 3, 3), (T, N, 3).

    0 where a part may not be BESIDE. ``ends``: the inner and the outer body.
    """
    rotations, translations = poses
    centre, radius = components.centre, components.radius
    rotation, move = np.empty((3, 3)), np.empty(3)
    clear_rotation, clear_move, clearance = np.empty((3, 3)), np.empty(3), 0.0
    for k in range(len(frames)):
        pose_of_inner(rotations, translations, frames[k], ends, rotation, move)
        # A tenth of the time of comparing boxes for every part and hole in frame after frame (2026-11).
        if clearance > 0.0:
            clearances[k] = clearance - length_moved(rotation, move, clear_rotation, clear_move, centre, radius)
            if clearances[k] > 0.0:
                continue
        margin = margin_at(translations, frames[k], ends[0], ends[1], size)
        clearance = clearance_of_components(components, outer, rotation, move, margin)
        clearances[k] = clearance
        copy_pose(rotation, move, clear_rotation, clear_move)


@hot_kernel
def pose_of_inner(
    rotations: FloatArray,
    translations: FloatArray,
    frame: int,
    ends: tuple[int, int],
    rotation: FloatArray,
    move: FloatArray,
) -> None:
    """Write the pose of the inner body in the outer one's frame to ``rotation`` (3, 3) and ``move`` (3,)."""
    never_inlined()
    inner, outer = ends
    relative_pose(
        rotations[frame, outer],
        translations[frame, outer],
        rotations[frame, inner],
        translations[frame, inner],
        rotation,
        move,
    )


@kernel
def clearance_of_components(
    components: InnerComponents, outer: OuterBoxes, rotation: FloatArray, move: FloatArray, margin: float
) -> float:
    """Metres by which points of the inner body may move while all of its parts stay BESIDE; 0 where none is certain."""
    never_inlined()
    half, half_inner, d = np.empty(3), np.empty(3), np.empty(3)
    kept, clearance = CLEARANCE_MARGINS * margin, np.inf
    for i in range(len(components.boxes)):
        for k in range(len(outer.boxes)):
            place_boxes(components, i, outer.boxes[k], rotation, move, half, half_inner, d)
            gap = gap_on_face_axes(rotation, d, half, half_inner)
            if not gap > kept:
                gap = length_beyond_box(components, i, outer.boxes[k], rotation, move)
                for hole in range(outer.first_hole[k], outer.first_hole[k + 1]):
                    if not gap > kept:
                        break
                    place_boxes(components, i, outer.holes[hole], rotation, move, half, half_inner, d)
                    gap_to_hole = gap_on_face_axes(rotation, d, half, half_inner)
                    if not gap_to_hole >= gap:
                        gap = gap_to_hole
                if not gap > kept:
                    return 0.0
            clearance = min(clearance, gap - kept)
    return clearance


@hot_kernel
def place_boxes(
    components: InnerComponents,
    i: int,
    box: FloatArray,
    rotation: FloatArray,
    move: FloatArray,
    half: FloatArray,
    half_inner: FloatArray,
    d: FloatArray,
) -> None:
    """Half lengths of a box (2, 3) of the outer body and of that of part ``i``, and the way ``d`` between centres."""
    never_inlined()
    for a in range(3):
        half[a] = 0.5 * (box[1, a] - box[0, a])
        half_inner[a] = 0.5 * (components.boxes[i, 1, a] - components.boxes[i, 0, a])
        d[a] = move[a] - 0.5 * (box[0, a] + box[1, a])
        for b in range(3):
            d[a] += rotation[a, b] * 0.5 * (components.boxes[i, 0, b] + components.boxes[i, 1, b])


@hot_kernel
def length_beyond_box(
    components: InnerComponents, i: int, box: FloatArray, rotation: FloatArray, move: FloatArray
) -> float:
    """Metres by which the outermost vertices of part ``i`` reach beyond a box (2, 3); not positive within it."""
    never_inlined()
    beyond = -np.inf
    for e in range(components.first_extreme[i], components.first_point[i + 1]):
        for a in range(3):
            x = move[a]
            for b in range(3):
                x += rotation[a, b] * components.points[e, b]
            # Compared, since the larger one of a number and none may be either.
            if box[0, a] - x > beyond:
                beyond = box[0, a] - x
            if x - box[1, a] > beyond:
                beyond = x - box[1, a]
    return beyond
