"""Face pairs that the filter left open, in exact arithmetic at the reference vertices.

It is a separate kernel, so that it is compiled only when the first such pair occurs.
"""

from __future__ import annotations

import numpy as np

from cdcore.kernels.compiling import hot_kernel, kernel, never_inlined
from cdcore.kernels.memory import Memory, doubles_of, integers_of
from cdcore.kernels.simd import first3
from cdcore.narrow.bvh.traverse import append, key_of, place_face
from cdcore.narrow.bvh.tree_memory import EXACT_TESTS, INTEGER_TESTS, pair_at, scratch_at
from cdcore.numerics import ByteArray, FloatArray, IntArray
from cdcore.triangles.decide import UNDECIDED, Corners, new_digits, undecided_pair_meets, unsummed_intersect

MEETS, NOT_TESTED, NOTED = 1, 3, 4
"""Answers beside 0 (apart) and ``UNDECIDED``; one that is noted has marked its frame and stands among the keys."""


@hot_kernel
def write_corners(corners: Corners, pair: Memory, first: int) -> None:
    """The three corners to nine numbers from ``pair[first]`` on."""
    never_inlined()
    p = pair
    p[first], p[first + 3], p[first + 6] = first3(corners.x)
    p[first + 1], p[first + 4], p[first + 7] = first3(corners.y)
    p[first + 2], p[first + 5], p[first + 8] = first3(corners.z)


@kernel
def answer_faces(row: IntArray, room: IntArray, points: FloatArray, digits: IntArray, answers: ByteArray) -> int:
    """Answer the face pairs of ``Scratch.later`` that are ``NOT_TESTED``, and note those that meet.

    Returns how many only integers can decide; ``points`` (n, 18) hold the corners of each face pair. Where any contact
    is asked for, a frame in contact already is tested no more.
    """
    pair, scratch, sums = pair_at(integers_of(row), 0), scratch_at(integers_of(room), 0), integers_of(digits)
    undecided = 0
    for k in range(scratch.later[0]):
        key = scratch.later[k + 1]
        frame = key >> (pair.bits_a + pair.bits_b)
        face_a, face_b = (key >> pair.bits_b) & ((1 << pair.bits_a) - 1), key & ((1 << pair.bits_b) - 1)
        if answers[k] == NOT_TESTED:
            answers[k] = 0
            if pair.hits[frame] == 0 or pair.every:
                corners = doubles_of(points[k])
                write_corners(place_face(pair.tree_a.placed, face_a, pair.pose_a, frame), corners, 0)
                write_corners(place_face(pair.tree_b.placed, face_b, pair.pose_b, frame), corners, 9)
                answers[k] = undecided_pair_meets(corners, sums)
                if answers[k] == UNDECIDED:
                    undecided += 1
                else:
                    scratch.work[EXACT_TESTS] += 1
        if answers[k] == MEETS:
            answers[k] = NOTED
            pair.hits[frame] = 1
            if pair.every:
                append(scratch.keys, key_of(pair, frame, pair.tree_a.faces[face_a], pair.tree_b.faces[face_b]))
    return undecided


class UndecidedFaces:
    """Decides the face pairs in the list ``later`` of a search, at most ``most``, in memory of its own."""

    def __init__(self, room: IntArray, most: int) -> None:
        self._room, self._digits = room, new_digits()
        self._points, self._answers = np.empty((most, 18)), np.empty(most, dtype=np.uint8)

    def decide(self, row: IntArray, count: int, work: IntArray) -> None:
        """Note the contacts among the ``count`` face pairs that a pair's row left open; counts in ``work``."""
        answers = self._answers[:count]
        answers[:] = NOT_TESTED
        undecided = answer_faces(row, self._room, self._points, self._digits, answers)
        if undecided:
            work[INTEGER_TESTS] += undecided
            rows = np.flatnonzero(answers == UNDECIDED)
            answers[rows] = unsummed_intersect(self._points[rows].reshape(-1, 2, 3, 3))
            answer_faces(row, self._room, self._points, self._digits, answers)
