"""Face pairs that the filter of the world test left open, in exact arithmetic at the reference vertices.

It is a separate kernel, so that it is compiled only when the first such pair occurs.
"""

from __future__ import annotations

import numpy as np

from cdcore.kernels.compiling import hot_kernel, kernel, runtime_int, stay_one_function
from cdcore.kernels.memory import Memory, bytes_at, doubles_at, row_of, words_at
from cdcore.narrow.spacetime.box_tree import BoxTree
from cdcore.narrow.spacetime.pose_lanes import PoseLanes
from cdcore.narrow.triangles.exact import pair_intersects_exact
from cdcore.narrow.triangles.filter import UNDECIDED
from cdcore.narrow.triangles.sums import exponents_are_moderate, new_digits
from cdcore.numerics import ByteArray, IntArray


@hot_kernel
def place_rows(placed: Memory, face: int, entries: Memory, stride: int, frame: int, pair: Memory, first: int) -> None:
    """World corners of a face to nine numbers from ``pair[first]`` on, rounded as the reference vertices."""
    stay_one_function()
    for corner in range(3):
        at = 12 * face + corner
        x, y, z = placed[at], placed[at + 4], placed[at + 8]
        for k in range(3):
            row = 3 * k * stride + frame
            total = (entries[row] * x + entries[row + stride] * y) + entries[row + 2 * stride] * z
            pair[first + 3 * corner + k] = total + entries[(9 + k) * stride + frame]


@kernel
def answer_keys(row: IntArray, count: int, start: int, faces: bool) -> tuple[int, int]:
    """Fill ``answers`` with 0, 1, or UNDECIDED for integers, and set ``hits``; returns the numbers of both kinds.

    ``row`` holds the numbers of bits of a face of A and of B, then of each body the address of its corners, of its
    poses, their stride and step, then the addresses of the keys, hits, answers, digits and eighteen doubles of scratch.
    """
    bits_a, bits_b, stride_a, step_a, stride_b, step_b = row[0], row[1], row[4], row[5], row[8], row[9]
    placed_a, entries_a, placed_b, entries_b = (
        doubles_at(row[2]), doubles_at(row[3]), doubles_at(row[6]), doubles_at(row[7]),
    )  # fmt: skip
    keys, hits, answers, digits, pair = (
        words_at(row[10]), bytes_at(row[11]), bytes_at(row[12]), words_at(row[13]), doubles_at(row[14]),
    )  # fmt: skip
    exact, integers = runtime_int(0), runtime_int(0)
    for k in range(count):
        frame = start + (keys[k] >> (bits_a + bits_b))
        answers[k] = 0
        if hits[frame] != 0 and not faces:
            continue
        face_a, face_b = (keys[k] >> bits_b) & ((1 << bits_a) - 1), keys[k] & ((1 << bits_b) - 1)
        place_rows(placed_a, face_a, entries_a, stride_a, frame * step_a, pair, runtime_int(0))
        place_rows(placed_b, face_b, entries_b, stride_b, frame * step_b, pair, runtime_int(9))
        if exponents_are_moderate(pair, runtime_int(18)):
            exact += 1
            if pair_intersects_exact(pair, digits):
                answers[k] = 1
                hits[frame] = 1
        else:
            integers += 1
            answers[k] = UNDECIDED
    return exact, integers


def decide_undecided(
    keys: IntArray, bits: tuple[int, int], start: int, trees: tuple[BoxTree, BoxTree], poses: tuple[PoseLanes, ...],
    faces: bool, hits: ByteArray,
) -> tuple[ByteArray, int, int]:  # fmt: skip
    """Answers 0, 1, or UNDECIDED for integers, and how many were asked exactly and are left for integers.

    ``keys`` are packed as frame from ``start``, face of A, face of B, both in leaf order, in ``bits`` bits. Sets
    ``hits``; without ``faces`` a frame that is in contact already is asked no more.
    """
    answers, digits, pair = np.empty(len(keys), dtype=np.uint8), new_digits(), np.empty(18)
    keys = np.ascontiguousarray(keys)
    row = row_of([
        *bits, *(part for tree, pose in zip(trees, poses, strict=True)
                 for part in (tree.placed, pose.entries, pose.stride, pose.step)),
        keys, hits, answers, digits, pair,
    ])  # fmt: skip
    exact, integers = answer_keys(row, len(keys), start, faces)
    return answers, exact, integers
