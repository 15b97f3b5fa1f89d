"""Pieces are joined two at a time, those first whose hull adds least."""

import numpy as np
import pytest
from support.shapes import box_mesh, shift_mesh

from replay.cutting.joins import joins_by_volume

CUBE = box_mesh((1.0, 1.0, 1.0))


@pytest.mark.parametrize(
    ("shift", "joined"),
    [((1.0, 0.0, 0.0), 1), ((1.00009, 0.0, 0.0), 1), ((1.0002, 0.0, 0.0), 0), ((2.0, 2.0, 2.0), 0)],
    ids=["touching", "0.09 mm apart", "0.2 mm apart", "apart in every axis"],
)
@pytest.mark.parametrize("side", [1, -1])
def test_cubes_join_across_a_tenth_of_a_millimetre(shift, joined, side):
    """The second unit cube is shifted by ``shift`` or its opposite: two pieces join up to a gap of 0.1 mm."""
    ladder = joins_by_volume([CUBE, shift_mesh(CUBE, side * np.array(shift))])
    assert len(ladder.joins) == joined
    assert [len(ladder.pieces(most)) for most in (2, 1)] == [2, 2 - joined]


def test_pieces_that_add_least_of_their_volume_join_first():
    """Two cubes side by side are a box, which adds nothing; a thin bar at the end of both adds half of itself or more.

    A joined piece has the next number: the cubes 1 and 2 become piece 3.
    """
    bar = shift_mesh(box_mesh((1.0, 0.5, 0.5)), (2.0, 0.0, 0.0))
    ladder = joins_by_volume([bar, CUBE, shift_mesh(CUBE, (1.0, 0.0, 0.0))])
    assert ladder.joins.tolist() == [[1, 2], [0, 3]]
    assert sorted(len(corners) for corners in ladder.pieces(2)) == [8, 16]
