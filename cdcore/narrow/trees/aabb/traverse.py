"""Boxes along the world's axes, placed where the descent reaches them; then the box with the longer side is opened.

A node keeps its box in the body's frame; the world box around it is a little larger than that of its faces, and takes
no pass over them. Fitting all world boxes of two bodies of 5,000 faces took 250 microseconds a pose (2026-11).

Source: G. van den Bergen, Efficient collision detection of complex deformable models using AABB trees (1997).
"""

from typing import NamedTuple

import numpy as np

from cdcore.kernels.compiling import hot_kernel, kernel, stay_one_function
from cdcore.narrow.face_pair import faces_meet, keep_found
from cdcore.narrow.level_tree import extents, grow_tree
from cdcore.numerics import ByteArray, FloatArray, IntArray


class WorldBoxTree(NamedTuple):
    """Boxes of n nodes in the body's frame, one face a leaf.

    ``corners`` (f, 3, 3); ``child`` (n,) first of two neighbouring children or -1; ``leaf`` (n,) face of a leaf;
    ``centre`` and ``half`` (n, 3).
    """

    corners: FloatArray
    child: IntArray
    leaf: IntArray
    centre: FloatArray
    half: FloatArray


def build_world_box_tree(corners: FloatArray) -> tuple[WorldBoxTree, int]:
    """The tree and its depth: cut at the median of the centroids along the longest side of their box."""
    centroids = corners[:, 0] / 3 + corners[:, 1] / 3 + corners[:, 2] / 3
    boxes: list[tuple[FloatArray, FloatArray]] = []

    def along_longest_side(faces: IntArray, node: IntArray, first: IntArray) -> FloatArray:
        low, high = extents(corners[faces], first)
        boxes.append((low / 2 + high / 2, high / 2 - low / 2))
        low, high = extents(centroids[faces, None], first)
        return centroids[faces, np.argmax(high / 2 - low / 2, axis=1)[node]]

    shape = grow_tree(len(corners), 1, along_longest_side, balanced=True)
    centre, half = (np.concatenate(part) for part in zip(*boxes, strict=True))
    return WorldBoxTree(corners, shape.child, shape.order[shape.start], centre, half), shape.depth


@hot_kernel
def place_box(tree: WorldBoxTree, node: int, turn: FloatArray, move: FloatArray, box: FloatArray) -> None:
    """Fill ``box`` (6,), least and largest x, y, z, with the world box around that of a node."""
    stay_one_function()
    for k in range(3):
        middle, reach = move[k], 0.0
        for i in range(3):
            middle += turn[k, i] * tree.centre[node, i]
            reach += abs(turn[k, i]) * tree.half[node, i]
        box[k], box[3 + k] = middle - reach, middle + reach


@hot_kernel
def boxes_apart(a: FloatArray, b: FloatArray, pad: float) -> bool:
    """Whether two boxes (6,) are further apart than the pad along an axis."""
    stay_one_function()
    for k in range(3):  # noqa: SIM110 - kernels have no any()
        if a[k] > b[3 + k] + pad or b[k] > a[3 + k] + pad:
            return True
    return False


@hot_kernel
def longest_side(box: FloatArray) -> float:
    """The longest side of a box (6,)."""
    return max(box[3] - box[0], box[4] - box[1], box[5] - box[2])


@kernel
def search_rows(  # noqa: C901 - one loop with its stack
    tree_a: WorldBoxTree, tree_b: WorldBoxTree, stack: IntArray, turn_a: FloatArray, move_a: FloatArray,
    turn_b: FloatArray, move_b: FloatArray, pad: FloatArray, every: bool, budget: int, digits: IntArray,
    counts: IntArray, truncated: ByteArray,
) -> IntArray:  # fmt: skip
    """Faces that meet, (M, 4), in K poses; ``counts`` (K, 2): node tests, leaf tests."""
    child_a, leaf_a, child_b, leaf_b = tree_a.child, tree_a.leaf, tree_b.child, tree_b.leaf
    box_a, box_b, pair = np.empty(6), np.empty(6), np.empty((6, 3))
    found, known = np.empty((64, 4), dtype=np.int64), 0
    for row in range(len(pad)):
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
            place_box(tree_a, a, turn_a[row], move_a[row], box_a)
            place_box(tree_b, b, turn_b[row], move_b[row], box_b)
            if boxes_apart(box_a, box_b, pad[row]):
                continue
            first_a, first_b = child_a[a], child_b[b]
            if first_a < 0 and first_b < 0:
                if tests == budget:
                    truncated[row] = 1
                    break
                tests += 1
                counts[row, 1] += 1
                answer = faces_meet(
                    tree_a.corners, leaf_a[a], turn_a[row], move_a[row], tree_b.corners, leaf_b[b], turn_b[row],
                    move_b[row], pair, digits,
                )  # fmt: skip
                if answer != 0:
                    found = keep_found(found, known, row, leaf_a[a], leaf_b[b], answer)
                    known += 1
                    if answer == 1 and not every:
                        break
                continue
            open_a = first_b < 0 or (first_a >= 0 and longest_side(box_a) >= longest_side(box_b))
            for k in range(2):
                stack[depth, 0] = first_a + 1 - k if open_a else a
                stack[depth, 1] = b if open_a else first_b + 1 - k
                depth += 1
    return found[:known]
