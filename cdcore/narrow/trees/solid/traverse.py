"""SOLID's tree and its descent: boxes along the body's own axes, cut at the middle of their longest side.

Two boxes are tested on six axes and the larger is opened; two faces are asked with GJK, then in exact arithmetic.

Source: G. van den Bergen, Efficient collision detection of complex deformable models using AABB trees (1997);
Collision detection in interactive 3D environments (2003).
"""

from typing import NamedTuple

import numpy as np

from cdcore.kernels.box_axes import apart_on_face_axes, pose_seen_from
from cdcore.kernels.compiling import hot_kernel, kernel, stay_one_function
from cdcore.narrow.face_pair import faces_meet, keep_found
from cdcore.narrow.level_tree import extents, grow_tree
from cdcore.narrow.trees.solid.gjk import MEETING, steps_to_separate
from cdcore.numerics import ByteArray, FloatArray, IntArray


class SolidTree(NamedTuple):
    """Boxes of n nodes in the body's frame, one face a leaf.

    ``corners`` (f, 3, 3); ``child`` (n,) first of two neighbouring children or -1; ``leaf`` (n,) face of a leaf;
    ``centre`` (n, 3), ``half`` (n, 3), ``size`` (n,) longest half.
    """

    corners: FloatArray
    child: IntArray
    leaf: IntArray
    centre: FloatArray
    half: FloatArray
    size: FloatArray


def build_solid_tree(corners: FloatArray) -> tuple[SolidTree, int]:
    """The tree and its depth; a node whose faces all lie on one side of the middle is cut into halves of their number.

    A face lies where the middle of its own box lies.
    """
    middles = corners.min(axis=1) / 2 + corners.max(axis=1) / 2
    boxes: list[tuple[FloatArray, FloatArray]] = []

    def fit(faces: IntArray, node: IntArray, first: IntArray) -> FloatArray:
        low, high = extents(corners[faces], first)
        centre, half = low / 2 + high / 2, high / 2 - low / 2
        boxes.append((centre, half))
        longest = np.argmax(half, axis=1)
        return middles[faces, longest[node]] - centre[np.arange(len(first)), longest][node]

    shape = grow_tree(len(corners), 1, fit, balanced=False)
    centre, half = (np.concatenate(part) for part in zip(*boxes, strict=True))
    return SolidTree(corners, shape.child, shape.order[shape.start], centre, half, half.max(axis=1)), shape.depth


@hot_kernel
def offset_of_centres(
    centre_a: FloatArray, centre_b: FloatArray, turn: FloatArray, move: FloatArray, d: FloatArray
) -> None:
    """The way from A's box centre to B's, in A's frame."""
    for i in range(3):
        d[i] = turn[i, 0] * centre_b[0] + turn[i, 1] * centre_b[1] + turn[i, 2] * centre_b[2] + move[i] - centre_a[i]


@hot_kernel
def bring_faces(
    corners_a: FloatArray, face_a: int, corners_b: FloatArray, face_b: int, turn: FloatArray, move: FloatArray,
    points: FloatArray,
) -> None:  # fmt: skip
    """Both faces in A's frame, rows 0-2 and 3-5."""
    stay_one_function()
    for c in range(3):
        x, y, z = corners_b[face_b, c, 0], corners_b[face_b, c, 1], corners_b[face_b, c, 2]
        for k in range(3):
            points[c, k] = corners_a[face_a, c, k]
            points[3 + c, k] = turn[k, 0] * x + turn[k, 1] * y + turn[k, 2] * z + move[k]


@kernel
def search_rows(  # noqa: C901 - one loop with its stack
    tree_a: SolidTree, tree_b: SolidTree, stack: IntArray, turn_a: FloatArray, move_a: FloatArray, turn_b: FloatArray,
    move_b: FloatArray, pad: FloatArray, every: bool, budget: int, digits: IntArray, counts: IntArray,
    truncated: ByteArray,
) -> IntArray:  # fmt: skip
    """Faces that meet, (M, 4), in K poses.

    ``counts`` (K, 5): node tests, leaf tests, leaf tests that the cached axis ended, steps of GJK, exact face tests.
    """
    turn, move, d = np.empty((3, 3)), np.empty(3), np.empty(3)
    pair, points, room = np.empty((6, 3)), np.empty((6, 3)), np.empty((14, 3))
    axis = np.array([1.0, 0.0, 0.0])
    found, known = np.empty((64, 4), dtype=np.int64), 0
    for row in range(len(pad)):
        pose_seen_from(turn_a[row], move_a[row], turn_b[row], move_b[row], turn, move)
        tests, depth = 0, 1
        stack[0, 0], stack[0, 1] = 0, 0
        while depth > 0:
            if tests == budget:
                truncated[row] = 1
                break
            depth -= 1
            a, b = stack[depth, 0], stack[depth, 1]
            tests += 1
            counts[row, 0] += 1
            offset_of_centres(tree_a.centre[a], tree_b.centre[b], turn, move, d)
            if apart_on_face_axes(turn, d, tree_a.half[a], tree_b.half[b], pad[row]):
                continue
            first_a, first_b = tree_a.child[a], tree_b.child[b]
            if first_a < 0 and first_b < 0:
                if tests == budget:
                    truncated[row] = 1
                    break
                tests += 1
                counts[row, 1] += 1
                face_a, face_b = tree_a.leaf[a], tree_b.leaf[b]
                bring_faces(tree_a.corners, face_a, tree_b.corners, face_b, turn, move, points)
                steps = steps_to_separate(points, axis, pad[row], room)
                if steps != MEETING:
                    counts[row, 2] += 1 if steps == 0 else 0
                    counts[row, 3] += steps
                    continue
                counts[row, 4] += 1
                answer = faces_meet(
                    tree_a.corners, face_a, turn_a[row], move_a[row], tree_b.corners, face_b, turn_b[row],
                    move_b[row], pair, digits,
                )  # fmt: skip
                if answer != 0:
                    found = keep_found(found, known, row, face_a, face_b, answer)
                    known += 1
                    if answer == 1 and not every:
                        break
                continue
            open_a = first_b < 0 or (first_a >= 0 and tree_a.size[a] >= tree_b.size[b])
            for k in range(2):
                stack[depth, 0] = first_a + 1 - k if open_a else a
                stack[depth, 1] = b if open_a else first_b + 1 - k
                depth += 1
    return found[:known]
