"""How many pairs of triangles each stage of the exact test has to decide."""

import numpy as np

from cdcore.kernels.memory import row_of
from cdcore.narrow.triangles.filter import UNDECIDED, pairs_intersect_compiled
from cdcore.narrow.triangles.predicates import checked_triangles
from cdcore.narrow.triangles.sums import new_digits


def left_open(triangles):
    """How many pairs the float filter leaves open, and how many of them exact sums leave to integers."""
    pairs = checked_triangles(triangles)
    answers, digits = np.empty(len(pairs), dtype=np.uint8), new_digits()
    undecided = pairs_intersect_compiled(row_of([pairs, answers, digits]), len(pairs))
    return undecided, int((answers == UNDECIDED).sum())
