"""Face pairs that the filter of the world test left open, in exact arithmetic at the reference vertices.

It is a separate kernel, so that it is compiled only when the first such pair occurs.
"""

from __future__ import annotations

import numpy as np

from cdcore.kernels.compiling import hot_kernel, runtime_int, stay_one_function
from cdcore.kernels.memory import Memory
from cdcore.narrow.spacetime.block import EXACT_TESTS, INTEGER_TESTS, BlockQuestion, Lists, append
from cdcore.narrow.spacetime.box_tree import BoxTree
from cdcore.narrow.spacetime.memory import PoseMemory, TreeMemory
from cdcore.narrow.spacetime.pose_lanes import PoseLanes
from cdcore.narrow.triangles.exact import pair_intersects_exact
from cdcore.narrow.triangles.predicates import triangles_intersect
from cdcore.narrow.triangles.sums import exponents_are_moderate
from cdcore.numerics import ByteArray, FloatArray, IntArray, place_points


@hot_kernel
def place_rows(tree: TreeMemory, face: int, pose: PoseMemory, frame: int, pair: Memory, first: int) -> None:
    """World corners of a face to nine numbers from ``pair[first]`` on, rounded as the reference vertices."""
    stay_one_function()
    placed, entries, stride, at = tree.placed, pose.entries, pose.stride, frame * pose.step
    for corner in range(3):
        x, y, z = placed[12 * face + corner], placed[12 * face + corner + 4], placed[12 * face + corner + 8]
        for k in range(3):
            row = 3 * k * stride + at
            total = (entries[row] * x + entries[row + stride] * y) + entries[row + 2 * stride] * z
            pair[first + 3 * corner + k] = total + entries[(9 + k) * stride + at]


@hot_kernel
def answer_later(
    tree_a: TreeMemory, pose_a: PoseMemory, tree_b: TreeMemory, pose_b: PoseMemory, question: BlockQuestion,
    lists: Lists, hits: Memory, work: Memory, pair: Memory, digits: Memory,
) -> int:  # fmt: skip
    """Decide the pairs of ``lists.later``: set ``hits``, and add those that meet to ``lists.keys`` if asked for faces.

    Leaves in ``later`` what only integers can tell, and returns how many; without ``faces`` a frame that is in contact
    already is asked no more. ``pair`` (18,) and ``digits`` are scratch; ``keys`` has room.
    """
    stay_one_function()
    later, both, left = lists.later, question.bits_a + question.bits_b, 0
    for k in range(1, later[0] + 1):
        key = later[k]
        frame = question.start + (key >> both)
        if hits[frame] != 0 and not question.faces:
            continue
        face_a, face_b = (key >> question.bits_b) & ((1 << question.bits_a) - 1), key & ((1 << question.bits_b) - 1)
        place_rows(tree_a, face_a, pose_a, frame, pair, runtime_int(0))
        place_rows(tree_b, face_b, pose_b, frame, pair, runtime_int(9))
        if not exponents_are_moderate(pair, runtime_int(18)):
            work[INTEGER_TESTS] += 1
            left += 1
            later[left] = key
            continue
        work[EXACT_TESTS] += 1
        if pair_intersects_exact(pair, digits):
            hits[frame] = 1
            if question.faces:
                faces = (runtime_int(tree_a.faces[face_a]) << question.bits_b) | runtime_int(tree_b.faces[face_b])
                append(lists.keys, (key >> both << both) | faces)
    later[0] = left
    return left


def decide_by_integers(
    keys: IntArray, bits: tuple[int, int], start: int, trees: tuple[BoxTree, BoxTree], poses: tuple[PoseLanes, ...],
    hits: ByteArray,
) -> IntArray:  # fmt: skip
    """Decide face pairs in integers, set ``hits``, and give the keys of those that meet, by face number.

    ``keys`` are packed as frame from ``start``, face of A, face of B, both in leaf order, in ``bits`` bits.
    """
    meeting = []
    for key in keys.tolist():
        frame, leaves = key >> sum(bits), ((key >> bits[1]) & ((1 << bits[0]) - 1), key & ((1 << bits[1]) - 1))
        sides = zip(trees, poses, leaves, strict=True)
        if triangles_intersect([[_placed(tree, pose, leaf, start + frame) for tree, pose, leaf in sides]])[0]:
            hits[start + frame] = 1
            faces = [int(tree.faces[leaf]) for tree, leaf in zip(trees, leaves, strict=True)]
            meeting.append((frame << sum(bits)) | (faces[0] << bits[1]) | faces[1])
    return np.array(meeting, dtype=np.int64)


def _placed(tree: BoxTree, pose: PoseLanes, leaf: int, frame: int) -> FloatArray:
    """World corners (3, 3) of a face in leaf order."""
    corners = tree.placed.reshape(-1, 3, 4)[leaf, :, :3].T
    entries = pose.entries.reshape(12, pose.stride)[:, frame * pose.step]
    return place_points(corners, entries[:9].reshape(3, 3), entries[9:])
