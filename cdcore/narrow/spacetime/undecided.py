"""Face pairs that the filter of the world test left open, in exact arithmetic at the points that count.

A kernel of its own, so that it is compiled when the first such pair turns up and not before.
"""

from __future__ import annotations

import numpy as np

from cdcore.narrow.compiling import kernel, stay_one_function
from cdcore.narrow.exact_sums import exponents_are_moderate
from cdcore.narrow.triangle_exact import pair_intersects_exact
from cdcore.narrow.triangle_filter import UNDECIDED, pair_intersects_filtered
from cdcore.numerics import ByteArray, FloatArray, IntArray


@kernel
def place_rows(
    placed: FloatArray, face: int, entries: FloatArray, stride: int, frame: int, pair: FloatArray, first: int
) -> None:
    """World corners of a face to rows ``first`` to ``first + 2`` of ``pair``, rounded as the points that count."""
    stay_one_function()
    for corner in range(3):
        x, y, z = placed[face, corner], placed[face, 4 + corner], placed[face, 8 + corner]
        for k in range(3):
            row = 3 * k * stride + frame
            total = (entries[row] * x + entries[row + stride] * y) + entries[row + 2 * stride] * z
            pair[first + corner, k] = total + entries[(9 + k) * stride + frame]


@kernel
def decide_undecided(
    keys: IntArray, bits_a: int, bits_b: int, start: int, placed_a: FloatArray, entries_a: FloatArray, stride_a: int,
    step_a: int, placed_b: FloatArray, entries_b: FloatArray, stride_b: int, step_b: int, faces: bool, hits: ByteArray,
    answers: ByteArray, digits: IntArray,
) -> tuple[int, int]:  # fmt: skip
    """Fill ``answers`` with 0, 1, or UNDECIDED for integers, and set ``hits``; returns how many of each kind were
    asked.

    ``keys`` are packed as frame from ``start``, face of A, face of B, both in leaf order. Without ``faces`` a frame
    that is in contact already is asked no more.
    """
    pair = np.empty((6, 3))
    exact, integers = 0, 0
    for k in range(len(keys)):
        frame = start + (keys[k] >> (bits_a + bits_b))
        answers[k] = 0
        if hits[frame] != 0 and not faces:
            continue
        face_a, face_b = (keys[k] >> bits_b) & ((1 << bits_a) - 1), keys[k] & ((1 << bits_b) - 1)
        place_rows(placed_a, face_a, entries_a, stride_a, frame * step_a, pair, 0 * face_a)
        place_rows(placed_b, face_b, entries_b, stride_b, frame * step_b, pair, 0 * face_b + 3)
        answer = pair_intersects_filtered(pair)
        if answer == UNDECIDED:
            exact += 1
            if exponents_are_moderate(pair):
                answer = 1 if pair_intersects_exact(pair, digits) else 0
            else:
                integers += 1
        answers[k] = answer
        if answer == 1:
            hits[frame] = 1
    return exact, integers
