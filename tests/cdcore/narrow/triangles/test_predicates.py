"""The public triangle test refuses what is no triangle, and answers everything else, whatever its exponents."""

import numpy as np
import pytest
from support.predicate_work import left_open

from cdcore.errors import InvalidTrianglesError
from cdcore.narrow.triangles.predicates import triangles_intersect

FLOOR = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


def test_touching_counts_and_a_gap_of_one_ulp_does_not():
    touching = [[0.25, 0.25, 0], [0.25, 0.5, 1], [0.5, 0.25, 1]]
    above = [[0.25, 0.25, 5e-324], [0.25, 0.5, 1], [0.5, 0.25, 1]]
    assert triangles_intersect([[FLOOR, touching], [FLOOR, above]]).tolist() == [True, False]


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_a_coordinate_that_is_not_finite_is_refused_by_its_pair(bad):
    pairs = np.zeros((3, 2, 3, 3))
    pairs[1, 0, 2, 1] = bad
    with pytest.raises(InvalidTrianglesError, match="pair 1"):
        triangles_intersect(pairs)


@pytest.mark.parametrize("shape", [(2, 3, 3), (4, 6, 3), (1, 2, 3, 2)])
def test_a_wrong_shape_is_refused(shape):
    with pytest.raises(InvalidTrianglesError, match="shape"):
        triangles_intersect(np.zeros(shape))


def test_words_are_refused():
    with pytest.raises(InvalidTrianglesError, match="numbers"):
        triangles_intersect([["a", "b"]])


def test_no_pairs_give_no_answers():
    assert triangles_intersect([]).shape == (0,)
    assert triangles_intersect(np.zeros((0, 2, 3, 3))).shape == (0,)


def test_each_stage_decides_what_the_one_before_left_open():
    wild = np.array([FLOOR, FLOOR], dtype=float)
    wild[1] += [2.0**-300, 0, 0]
    wild[1, 0] = [2.0**-300, 2.0**-300, 0]
    pairs = [[FLOOR, [[9, 9, 9], [8, 9, 9], [9, 8, 9]]], [FLOOR, FLOOR], wild]
    assert triangles_intersect(pairs).tolist() == [False, True, True]
    assert left_open(pairs) == (2, 1)


def test_the_input_is_left_as_it_was():
    pairs = np.random.default_rng(0).random((10, 2, 3, 3))
    before = pairs.copy()
    triangles_intersect(pairs)
    assert np.array_equal(pairs, before)
