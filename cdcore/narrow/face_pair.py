"""One face of each body at the reference vertices: they meet, they do not, or only integers can tell.

The leaf test of every hierarchy. It is compiled once, so that a search which calls it compiles in a second.
"""

import numpy as np

from cdcore.kernels.compiling import always_inlined, kernel, never_inlined
from cdcore.kernels.memory import doubles_of, integers_of
from cdcore.narrow.triangles.filter import pair_intersects
from cdcore.numerics import FloatArray, IntArray


@kernel
def place_face(
    corners: FloatArray, face: int, rotation: FloatArray, move: FloatArray, pair: FloatArray, o: int
) -> None:
    """World corners of a face, nine numbers, to ``pair[o:]``, rounded as the reference vertices."""
    never_inlined()
    for c in range(3):
        x, y, z = corners[face, c, 0], corners[face, c, 1], corners[face, c, 2]
        for k in range(3):
            pair[o + 3 * c + k] = ((rotation[k, 0] * x + rotation[k, 1] * y) + rotation[k, 2] * z) + move[k]


@kernel
def placed_pair_meets(pair: FloatArray, digits: IntArray) -> int:
    """1 or 0 for the faces in the two halves of ``pair`` (18,); UNDECIDED where only integers can tell."""
    never_inlined()
    return pair_intersects(doubles_of(pair), integers_of(digits))


@kernel
def keep_hit(hits: IntArray, count: int, row: int, face_a: int, face_b: int) -> IntArray:
    """Write entry ``count`` of ``hits`` (n, 3); the array, or one twice as long where it was full."""
    always_inlined()
    if count == hits.shape[0]:
        longer = np.empty((2 * count, 3), dtype=np.int64)
        for k in range(count):  # assigning a slice compiles its error message, some four seconds
            for column in range(3):
                longer[k, column] = hits[k, column]
        hits = longer
    hits[count, 0], hits[count, 1], hits[count, 2] = row, face_a, face_b
    return hits
