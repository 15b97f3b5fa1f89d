"""Face pairs that the filter left open, in exact arithmetic at the reference vertices.

It is a separate kernel, so that it is compiled only when the first such pair occurs.
"""

from __future__ import annotations

import numpy as np

from cdcore.kernels.compiling import hot_kernel, kernel, runtime_int, stay_one_function
from cdcore.kernels.memory import Memory, address_of, doubles_at, words_of
from cdcore.kernels.simd import first3
from cdcore.narrow.bvh.block import EXACT_TESTS, INTEGER_TESTS, place_face
from cdcore.narrow.bvh.tree_memory import pair_memory, question_memory
from cdcore.narrow.triangles.filter import UNDECIDED, Corners, pair_intersects
from cdcore.narrow.triangles.predicates import triangles_intersect
from cdcore.narrow.triangles.sums import new_digits
from cdcore.numerics import ByteArray, IntArray


@hot_kernel
def write_corners(corners: Corners, pair: Memory, first: int) -> None:
    """The three corners to nine numbers from ``pair[first]`` on."""
    stay_one_function()
    p = pair
    p[first], p[first + 3], p[first + 6] = first3(corners.x)
    p[first + 1], p[first + 4], p[first + 7] = first3(corners.y)
    p[first + 2], p[first + 5], p[first + 8] = first3(corners.z)


@kernel
def answer_keys(row: IntArray, keys: IntArray, corners: int, digits: IntArray, answers: ByteArray) -> int:
    """Fill ``answers`` with 0, 1, or UNDECIDED for integers, and set hits; returns how many pairs were asked.

    ``keys`` (n,) change from leaf order to face numbers. ``corners``: address of (n, 18) numbers, which are filled.
    Without every face pair a frame that is in contact already is asked no more.
    """
    pair, question, sums, asked = pair_memory(row), question_memory(row), words_of(digits), 0
    for k in range(len(keys)):
        frame = question.start + (keys[k] >> question.bits)
        face_b = keys[k] & ((1 << question.bits_b) - 1)
        face_a = (keys[k] >> question.bits_b) & ((1 << (question.bits - question.bits_b)) - 1)
        faces = (runtime_int(pair.tree_a.faces[face_a]) << question.bits_b) | runtime_int(pair.tree_b.faces[face_b])
        keys[k] = (keys[k] >> question.bits << question.bits) | faces
        answers[k] = 0
        if question.hits[frame] != 0 and not question.every:
            continue
        points = doubles_at(corners + 144 * k)
        write_corners(place_face(pair.tree_a.placed, face_a, pair.pose_a, frame), points, runtime_int(0))
        write_corners(place_face(pair.tree_b.placed, face_b, pair.pose_b, frame), points, runtime_int(9))
        asked += 1
        answers[k] = pair_intersects(points, sums)
        if answers[k] == 1:
            question.hits[frame] = 1
    return asked


@kernel
def mark_hits(row: IntArray, keys: IntArray) -> None:
    """Note contact in the frames of face pairs."""
    question = question_memory(row)
    for k in range(len(keys)):
        question.hits[question.start + (keys[k] >> question.bits)] = 1


def settled(row: IntArray, later: IntArray, work: IntArray) -> IntArray:
    """Of the face pairs left open in a pair's row, packed in leaf order, those that meet, by the numbers of faces.

    Notes contact, and counts in ``work``.
    """
    keys, corners, answers = later.copy(), np.empty((len(later), 18)), np.empty(len(later), dtype=np.uint8)
    asked = answer_keys(row, keys, address_of(corners), new_digits(), answers)
    left = np.flatnonzero(answers == UNDECIDED)
    work[EXACT_TESTS] += asked - len(left)
    work[INTEGER_TESTS] += len(left)
    if len(left):
        answers[left] = triangles_intersect(corners[left].reshape(-1, 2, 3, 3))
        mark_hits(row, keys[left[answers[left] == 1]])
    return keys[answers == 1]
