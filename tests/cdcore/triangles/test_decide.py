"""The triangle test and its three stages (filter, exact sums, integers) agree and refuse what is no triangle."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from support.second_opinions import filtered, left_open
from support.shapes import triangle_family

from cdcore.errors import InvalidTrianglesError
from cdcore.kernels.compiling import kernel
from cdcore.kernels.memory import doubles_of, integers_of
from cdcore.triangles import exact_pairs as triangle_exact
from cdcore.triangles.decide import triangles_intersect
from cdcore.triangles.filter import UNDECIDED
from cdcore.triangles.integers import pair_intersects_integers
from cdcore.triangles.sums import new_digits
from replay.studies.stress.families import FAMILIES

FLOOR = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


def test_touching_triangles_meet_and_smallest_gap_separates():
    """The corner lies on the floor triangle, or above by the least positive double."""
    touching = [[0.25, 0.25, 0], [0.25, 0.5, 1], [0.5, 0.25, 1]]
    above = [[0.25, 0.25, 5e-324], [0.25, 0.5, 1], [0.5, 0.25, 1]]
    assert triangles_intersect([[FLOOR, touching], [FLOOR, above]]).tolist() == [True, False]
    assert triangles_intersect([]).shape == triangles_intersect(np.zeros((0, 2, 3, 3))).shape == (0,)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_non_finite_coordinates_are_refused_by_pair(bad):
    """One coordinate of the second of three pairs is ``bad``."""
    pairs = np.zeros((3, 2, 3, 3))
    pairs[1, 0, 2, 1] = bad
    with pytest.raises(InvalidTrianglesError, match="pair 1"):
        triangles_intersect(pairs)


@pytest.mark.parametrize(
    ("given", "text"),
    [*((np.zeros(shape), "shape") for shape in ((2, 3, 3), (4, 6, 3), (1, 2, 3, 2))), ([["a", "b"]], "numbers")],
)
def test_arrays_that_are_no_triangle_pairs_are_refused(given, text):
    """Triangle pairs are numbers of shape (n, 2, 3, 3)."""
    with pytest.raises(InvalidTrianglesError, match=text):
        triangles_intersect(given)


def test_exact_integers_decide_pairs_that_float_stages_leave_open():
    """``left_open``: how many pairs the filter, and then the exact sums, leave undecided.

    The filter decides a gap of metres, sums a face upon itself, integers one that is shifted by 2^-300.
    """
    assert left_open(triangle_family("generic control").pairs(2_000, seed=22)) == (0, 0)
    wild = np.array([FLOOR, FLOOR], dtype=float)  # moved by so little that exact sums hold not all digits
    wild[1] += [2.0**-300, 0, 0]
    wild[1, 0] = [2.0**-300, 2.0**-300, 0]
    pairs = [[FLOOR, [[9, 9, 9], [8, 9, 9], [9, 8, 9]]], [FLOOR, FLOOR], wild]
    assert triangles_intersect(pairs).tolist() == [False, True, True]
    assert left_open(pairs) == (2, 1)


@pytest.mark.sampled(3)
@pytest.mark.parametrize("family", FAMILIES, ids=lambda family: family.name)
def test_an_answer_of_the_filter_is_that_of_integers(family):
    """60 random pairs of each family; where the filter answers UNDECIDED nothing is compared."""
    pairs = family.pairs(60, seed=31)
    answers = np.array([filtered(pair.reshape(6, 3)) for pair in pairs])
    certain = answers != UNDECIDED
    assert np.array_equal(answers[certain], [pair_intersects_integers(pair.tolist()) for pair in pairs[certain]])
    # products out of range are left open, not guessed
    assert family.name not in ("products underflow", "products overflow") or (1 not in answers and UNDECIDED in answers)


@kernel
def pair_intersects_exact(p, w):
    """Whether two triangles meet by exact arithmetic, from compiled code."""
    return triangle_exact.pair_intersects_exact(doubles_of(p), integers_of(w))


@pytest.mark.slow
@pytest.mark.parametrize("upper", [2, 3, 4])
def test_exact_decision_equals_integers_on_a_lattice(upper):
    """Corners at whole numbers below ``upper``, so that most pairs touch or are degenerate."""
    rng, w = np.random.default_rng(upper), new_digits()
    pairs = rng.integers(0, upper, (1_000, 6, 3)).astype(float)
    for pair in pairs:
        assert pair_intersects_exact(pair, w) == pair_intersects_integers(pair.reshape(2, 3, 3).tolist())


@pytest.mark.parametrize("upper", [2, 3])
def test_pairs_on_a_lattice_are_decided_as_by_integers(upper):
    """Corners at whole numbers below ``upper``: most pairs touch, lie in one plane, or are segments and points."""
    pairs = np.random.default_rng(upper).integers(0, upper, (200, 2, 3, 3)).astype(float)
    expected = [pair_intersects_integers(pair) for pair in pairs]
    assert 20 < sum(expected) < 180
    assert triangles_intersect(pairs).tolist() == expected


def test_smallest_gap_between_huge_triangles_separates():
    """The first lies in the plane z = x; a corner of the second is 2^-900 m above it, too little to scale with."""
    first = [[0, 0, 0], [2.0**900, 0, 2.0**900], [0, 2.0**900, 0]]
    second = [[0, 2.0**898, 2.0**-900], [0, 2.0**899, 2.0**900], [2.0**898, 2.0**898, 2.0**900]]
    assert not triangles_intersect([[first, second]])[0]


def test_disjoint_collinear_edges_do_not_meet():
    """An edge of each triangle lies on the y axis, from 0 to 1 and from 2 to 3; the same with axes exchanged."""
    first, second = [[0, 0, 0], [0, 1, 0], [-4, 9, 0]], [[0, 2, 0], [0, 3, 0], [4, -5, 0]]
    for rotation in range(3):
        pair = np.roll(np.array([first, second], dtype=float), rotation, axis=2)
        for mirrored in (pair, pair[:, :, ::-1]):
            # The filter leaves the pair open, and exact sums decide it.
            assert left_open([mirrored]) == (1, 0)
            assert not triangles_intersect([mirrored])[0]


VISIBLE = tomllib.loads(Path(__file__).with_name("seen.toml").read_text("utf-8"))
TRIANGLES_BESIDE_FLOOR = [(other, word == "meets") for word in VISIBLE for other in VISIBLE[word].values()]


@pytest.mark.parametrize("scale", [1.0, 2.0**-270, 2.0**-900, 2.0**900])
def test_visible_cases_are_decided(scale):
    """Rows of seen.toml: triangles beside 4 times FLOOR whose answer one can see, at four scales.

    At 2^-270 products of three lengths lie just above what the filter holds for lost in underflow.
    """
    for other, meets in TRIANGLES_BESIDE_FLOOR:
        first, second = ((np.array(triangle) * scale).tolist() for triangle in (4 * np.array(FLOOR), other))
        assert triangles_intersect([[first, second], [first[::-1], second]]).tolist() == [meets, meets], other
        assert pair_intersects_integers([first, second]) is meets, other
        assert pair_intersects_integers([second, first]) is meets, other
