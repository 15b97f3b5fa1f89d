"""Face pairs that the filter left open, in exact arithmetic at the reference vertices.

It is a separate kernel, so that it is compiled only when the first such pair occurs.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from cdcore.kernels.compiling import hot_kernel, kernel, never_inlined
from cdcore.kernels.memory import Memory, doubles_of, integers_of
from cdcore.kernels.simd import first3
from cdcore.narrow.bvh.traverse import key_of, place_face
from cdcore.narrow.bvh.tree_memory import EXACT_TESTS, INTEGER_TESTS, pair_at
from cdcore.numerics import ByteArray, FloatArray, IntArray
from cdcore.triangles.decide import UNDECIDED, Corners, new_digits, undecided_pair_meets, unsummed_intersect

NOT_TESTED: Final = 3


@hot_kernel
def write_corners(corners: Corners, pair: Memory, first: int) -> None:
    """The three corners to nine numbers from ``pair[first]`` on."""
    never_inlined()
    p = pair
    p[first], p[first + 3], p[first + 6] = first3(corners.x)
    p[first + 1], p[first + 4], p[first + 7] = first3(corners.y)
    p[first + 2], p[first + 5], p[first + 8] = first3(corners.z)


@kernel
def answer_faces(
    row: IntArray, later: IntArray, keys: IntArray, points: FloatArray, digits: IntArray, answers: ByteArray
) -> int:
    """Put 0, 1, or UNDECIDED for integers, where ``answers`` (n,) are UNASKED, and note contact; returns how many
    were asked.

    ``later`` (n,): face pairs, faces in leaf order; ``keys`` (n,), the same with the numbers of faces, and ``points``
    (n, 18) are filled. Where any contact is asked for, a frame in contact already is asked no more.
    """
    pair, sums, exact_tests = pair_at(integers_of(row)), integers_of(digits), 0
    for k in range(len(later)):
        frame = later[k] >> (pair.bits_a + pair.bits_b)
        face_a, face_b = (later[k] >> pair.bits_b) & ((1 << pair.bits_a) - 1), later[k] & ((1 << pair.bits_b) - 1)
        keys[k] = key_of(pair, frame, pair.tree_a.faces[face_a], pair.tree_b.faces[face_b])
        if answers[k] == NOT_TESTED:
            answers[k] = 0
            if pair.hits[frame] == 0 or pair.every:
                corners = doubles_of(points[k])
                write_corners(place_face(pair.tree_a.placed, face_a, pair.pose_a, frame), corners, 0)
                write_corners(place_face(pair.tree_b.placed, face_b, pair.pose_b, frame), corners, 9)
                exact_tests += 1
                answers[k] = undecided_pair_meets(corners, sums)
        if answers[k] == 1:
            pair.hits[frame] = 1
    return exact_tests


def settled(row: IntArray, later: IntArray, work: IntArray) -> IntArray:
    """Returns the undecided face pairs (n,) of a pair's row that meet, by numbers of faces; input is in leaf order.

    Notes contact, and counts in ``work``.
    """
    keys, points, answers = np.empty_like(later), np.empty((len(later), 18)), np.full(len(later), NOT_TESTED, np.uint8)
    exact_tests = answer_faces(row, later, keys, points, new_digits(), answers)
    left = np.flatnonzero(answers == UNDECIDED)
    work[EXACT_TESTS] += exact_tests - len(left)
    work[INTEGER_TESTS] += len(left)
    if len(left):
        answers[left] = unsummed_intersect(points[left].reshape(-1, 2, 3, 3))
        answer_faces(row, later, keys, points, new_digits(), answers)
    return keys[answers == 1]
