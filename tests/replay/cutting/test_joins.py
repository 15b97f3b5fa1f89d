"""Pieces are joined two at a time, those first whose hull adds least."""

import numpy as np
import pytest
from support.shapes import box_mesh, shift_mesh

from replay.cutting.joins import joins_by_volume

CUBE = box_mesh((1.0, 1.0, 1.0))
"""A cube of 1 m about the origin."""


@pytest.mark.parametrize(
    ("shift", "joins"),
    [
        pytest.param((1.0, 0.0, 0.0), 1, id="touching"),
        pytest.param((1.00009, 0.0, 0.0), 1, id="0.09 mm apart"),
        pytest.param((1.0002, 0.0, 0.0), 0, id="0.2 mm apart"),
        pytest.param((2.0, 2.0, 2.0), 0, id="apart in every axis"),
    ],
)
@pytest.mark.parametrize("side", [1, -1])
def test_cubes_join_across_a_tenth_of_a_millimetre(shift, joins, side):
    """Two cubes of 1 m, the second shifted, or shifted the other way: up to a gap of 0.1 mm they join.

    A ladder has pieces for each number that is allowed: where they join, one of at most one.
    """
    ladder = joins_by_volume([CUBE, shift_mesh(CUBE, side * np.array(shift))])
    assert len(ladder.joins) == joins
    assert len(ladder.pieces(most_pieces=2)) == 2
    assert len(ladder.pieces(most_pieces=1)) == 2 - joins


def test_pieces_that_add_least_of_their_volume_join_first():
    """Two cubes side by side are a box, which adds nothing; a thin bar at the end of both adds half of itself or more.

    The bar is piece 0, the cubes are 1 and 2 and become piece 3, of 16 corners; then all are one.
    """
    bar = shift_mesh(box_mesh((1.0, 0.5, 0.5)), (2.0, 0.0, 0.0))
    ladder = joins_by_volume([bar, CUBE, shift_mesh(CUBE, (1.0, 0.0, 0.0))])
    assert ladder.joins.tolist() == [[1, 2], [0, 3]]
    assert sorted(len(corners) for corners in ladder.pieces(most_pieces=2)) == [8, 16]
