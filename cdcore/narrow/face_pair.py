"""One face of each body at the reference vertices: they meet, they do not, or only integers can tell.

The leaf test of every hierarchy. It is compiled once, so that a search which calls it compiles in a second.
"""

import numpy as np

from cdcore.kernels.compiling import become_part_of_caller, kernel, stay_one_function
from cdcore.kernels.memory import doubles_of, words_of
from cdcore.narrow.triangles.filter import pair_intersects
from cdcore.numerics import FloatArray, IntArray


@kernel
def place_face(corners: FloatArray, face: int, turn: FloatArray, move: FloatArray, pair: FloatArray, o: int) -> None:
    """World corners of a face, nine numbers, to ``pair[o:]``, rounded as the reference vertices."""
    stay_one_function()
    for c in range(3):
        x, y, z = corners[face, c, 0], corners[face, c, 1], corners[face, c, 2]
        for k in range(3):
            pair[o + 3 * c + k] = ((turn[k, 0] * x + turn[k, 1] * y) + turn[k, 2] * z) + move[k]


@kernel
def placed_pair_meets(pair: FloatArray, digits: IntArray) -> int:
    """1 or 0 for the faces in the two halves of ``pair`` (18,); UNDECIDED where only integers can tell."""
    stay_one_function()
    return pair_intersects(doubles_of(pair), words_of(digits))


@kernel
def keep_found(found: IntArray, count: int, row: int, face_a: int, face_b: int) -> IntArray:
    """Write entry ``count`` of ``found`` (n, 3); the array, or one twice as long where it was full."""
    become_part_of_caller()
    if count == found.shape[0]:
        longer = np.empty((2 * count, 3), dtype=np.int64)
        for k in range(count):  # assigning a slice compiles its error message, some four seconds
            for column in range(3):
                longer[k, column] = found[k, column]
        found = longer
    found[count, 0], found[count, 1], found[count, 2] = row, face_a, face_b
    return found
