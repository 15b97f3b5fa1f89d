"""Boxes along the world's axes around the reference vertices: comparing them does not round, so they need no pad.

Both trees are fitted to each pose from the leaves up; then the box with the longer side is opened.

Source: G. van den Bergen, Efficient collision detection of complex deformable models using AABB trees (1997), for
refitting.
"""

from typing import NamedTuple

import numpy as np

from cdcore.kernels.compiling import hot_kernel, kernel, runtime_int, stay_one_function
from cdcore.narrow.face_pair import keep_found, place_face, placed_pair_meets
from cdcore.narrow.level_tree import extents, grow_tree
from cdcore.numerics import ByteArray, FloatArray, IntArray


class WorldBoxTree(NamedTuple):
    """Which faces share a box; the boxes themselves belong to a pose.

    ``corners`` (f, 3, 3), body frame; ``child`` (n,) first of two neighbouring children or -1; ``leaf`` (n,) face of a
    leaf.
    """

    corners: FloatArray
    child: IntArray
    leaf: IntArray


def build_world_box_tree(corners: FloatArray) -> tuple[WorldBoxTree, int]:
    """The tree and its depth: cut at the median of the centroids along the longest side of their box."""
    centroids = corners[:, 0] / 3 + corners[:, 1] / 3 + corners[:, 2] / 3

    def along_longest_side(faces: IntArray, node: IntArray, first: IntArray) -> FloatArray:
        low, high = extents(centroids[faces, None], first)
        return centroids[faces, np.argmax(high / 2 - low / 2, axis=1)[node]]

    shape = grow_tree(len(corners), 1, along_longest_side, balanced=True)
    return WorldBoxTree(corners, shape.child, shape.order[shape.start]), shape.depth


@hot_kernel
def fit_boxes(world: FloatArray, child: IntArray, leaf: IntArray, boxes: FloatArray) -> None:
    """Fill ``boxes`` (n, 6), least and largest x, y, z of each node, from placed faces ``world`` (f, 3, 3)."""
    stay_one_function()
    for step in range(len(child)):
        node = len(child) - 1 - step
        first = child[node]
        for k in range(3):
            if first < 0:
                x, y, z = world[leaf[node], 0, k], world[leaf[node], 1, k], world[leaf[node], 2, k]
                boxes[node, k], boxes[node, 3 + k] = min(x, y, z), max(x, y, z)
            else:
                boxes[node, k] = min(boxes[first, k], boxes[first + 1, k])
                boxes[node, 3 + k] = max(boxes[first, 3 + k], boxes[first + 1, 3 + k])


@hot_kernel
def boxes_apart(a: FloatArray, b: FloatArray) -> bool:
    """Whether two boxes (6,) have no point in common."""
    stay_one_function()
    for k in range(3):  # noqa: SIM110 - kernels have no any()
        if a[k] > b[3 + k] or b[k] > a[3 + k]:
            return True
    return False


@hot_kernel
def longest_side(box: FloatArray) -> float:
    """The longest side of a box (6,)."""
    return max(box[3] - box[0], box[4] - box[1], box[5] - box[2])


@hot_kernel
def is_as_before(turn: FloatArray, move: FloatArray, row: int) -> bool:
    """Whether the pose of a row is bit for bit that of the row before."""
    if row == 0:
        return False
    for i in range(3):
        if move[row, i] != move[row - 1, i]:
            return False
        for j in range(3):
            if turn[row, i, j] != turn[row - 1, i, j]:
                return False
    return True


@kernel
def place_and_fit(tree: WorldBoxTree, turn: FloatArray, move: FloatArray, world: FloatArray, boxes: FloatArray) -> None:
    """The placed faces and boxes of a body in one pose."""
    stay_one_function()
    for face in range(len(tree.corners)):
        place_face(tree.corners, face, turn, move, world[face], runtime_int(0))
    fit_boxes(world, tree.child, tree.leaf, boxes)


@kernel
def search_rows(  # noqa: C901 - one loop with its stack
    tree_a: WorldBoxTree, tree_b: WorldBoxTree, stack: IntArray, turn_a: FloatArray, move_a: FloatArray,
    turn_b: FloatArray, move_b: FloatArray, pad: FloatArray, every: bool, budget: int, digits: IntArray,
    counts: IntArray, truncated: ByteArray,
) -> IntArray:  # fmt: skip
    """Faces that meet, (M, 4), in K poses; ``counts`` (K, 3) gets boxes fitted last; of ``pad`` only the length."""
    world_a, world_b = np.empty(tree_a.corners.shape), np.empty(tree_b.corners.shape)
    child_a, leaf_a, child_b, leaf_b = tree_a.child, tree_a.leaf, tree_b.child, tree_b.leaf
    boxes_a, boxes_b = np.empty((len(child_a), 6)), np.empty((len(child_b), 6))
    pair = np.empty((6, 3))
    found, known = np.empty((64, 4), dtype=np.int64), 0
    for row in range(len(pad)):
        if not is_as_before(turn_a, move_a, row):
            place_and_fit(tree_a, turn_a[row], move_a[row], world_a, boxes_a)
            counts[row, 2] += len(child_a)
        if not is_as_before(turn_b, move_b, row):
            place_and_fit(tree_b, turn_b[row], move_b[row], world_b, boxes_b)
            counts[row, 2] += len(child_b)
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
            if boxes_apart(boxes_a[a], boxes_b[b]):
                continue
            first_a, first_b = child_a[a], child_b[b]
            if first_a < 0 and first_b < 0:
                if tests == budget:
                    truncated[row] = 1
                    break
                tests += 1
                counts[row, 1] += 1
                for corner in range(3):
                    for k in range(3):
                        pair[corner, k] = world_a[leaf_a[a], corner, k]
                        pair[3 + corner, k] = world_b[leaf_b[b], corner, k]
                answer = placed_pair_meets(pair, digits)
                if answer != 0:
                    found = keep_found(found, known, row, leaf_a[a], leaf_b[b], answer)
                    known += 1
                    if answer == 1 and not every:
                        break
                continue
            open_a = first_b < 0 or (first_a >= 0 and longest_side(boxes_a[a]) >= longest_side(boxes_b[b]))
            for k in range(2):
                stack[depth, 0] = first_a + 1 - k if open_a else a
                stack[depth, 1] = b if open_a else first_b + 1 - k
                depth += 1
    return found[:known]
