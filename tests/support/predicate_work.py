"""How many pairs of triangles each stage of the exact test has to decide."""

import numpy as np

from cdcore.kernels.compiling import kernel
from cdcore.kernels.memory import doubles_of
from cdcore.narrow.triangles import filter as triangle_filter
from cdcore.narrow.triangles.filter import UNDECIDED
from cdcore.narrow.triangles.predicates import answer_pairs, checked_triangles
from cdcore.narrow.triangles.sums import new_digits
from cdcore.numerics import readonly


@kernel
def filtered(pair):
    """0, 1 or UNDECIDED for one pair (6, 3)."""
    return triangle_filter.pair_intersects_filtered(doubles_of(pair))


def left_open(triangles):
    """How many pairs the float filter leaves open, and how many of them exact sums leave to integers."""
    pairs = checked_triangles(triangles)
    answers = np.empty(len(pairs), dtype=np.uint8)
    answer_pairs(readonly(pairs[:]), answers, new_digits())
    undecided = [filtered(pair.reshape(6, 3)) == UNDECIDED for pair in pairs]
    return sum(undecided), int((answers == UNDECIDED).sum())
