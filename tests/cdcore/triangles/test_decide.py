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
"""A right triangle in z = 0."""


def test_touching_triangles_meet_and_smallest_gap_separates():
    """A corner at (0.25, 0.25, 0), on a right triangle in z = 0, or above it by the least positive double."""
    touching = [[0.25, 0.25, 0], [0.25, 0.5, 1], [0.5, 0.25, 1]]
    above = [[0.25, 0.25, 5e-324], [0.25, 0.5, 1], [0.5, 0.25, 1]]
    assert triangles_intersect([[FLOOR, touching], [FLOOR, above]]).tolist() == [True, False]


@pytest.mark.parametrize("pairs", [[], np.zeros((0, 2, 3, 3))], ids=["empty list", "empty array"])
def test_no_triangle_pairs_have_no_answers(pairs):
    """No pairs, as a list and as an array (0, 2, 3, 3): answers of shape (0,)."""
    assert triangles_intersect(pairs).shape == (0,)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_non_finite_coordinates_are_refused_by_pair(bad):
    """One coordinate of pair 1, the second of three, is ``bad``."""
    pairs = np.zeros((3, 2, 3, 3))
    pairs[1, 0, 2, 1] = bad
    with pytest.raises(InvalidTrianglesError, match="pair 1 has a coordinate that is not finite"):
        triangles_intersect(pairs)


@pytest.mark.parametrize(
    ("pairs", "text"),
    [
        pytest.param(np.zeros((2, 3, 3)), "shape", id="a single pair"),
        pytest.param(np.zeros((4, 6, 3)), "shape", id="six corners"),
        pytest.param(np.zeros((1, 2, 3, 2)), "shape", id="two coordinates"),
        pytest.param([["a", "b"]], "numbers", id="texts"),
    ],
)
def test_arrays_that_are_no_triangle_pairs_are_refused(pairs, text):
    """Triangle pairs are numbers of shape (n, 2, 3, 3)."""
    with pytest.raises(InvalidTrianglesError, match=text):
        triangles_intersect(pairs)


def test_filter_decides_ordinary_pairs():
    """``left_open``: how many of 2,000 random pairs the filter leaves undecided, and how many of these exact sums."""
    undecided_by_filter, undecided_by_sums = left_open(triangle_family("generic control").pairs(2_000, seed=22))
    assert (undecided_by_filter, undecided_by_sums) == (0, 0)


def test_exact_integers_decide_pairs_that_float_stages_leave_open():
    """A right triangle and one metres away, which the filter decides; itself, which takes exact sums; and itself
    shifted by 2^-300, whose digits sums cannot hold, so that integers decide.
    """
    distant, step = [[9, 9, 9], [8, 9, 9], [9, 8, 9]], 2.0**-300
    shifted = [[step, step, 0], [1 + step, 0, 0], [step, 1, 0]]
    pairs = np.array([[FLOOR, distant], [FLOOR, FLOOR], [FLOOR, shifted]])
    assert triangles_intersect(pairs).tolist() == [False, True, True]
    undecided_by_filter, undecided_by_sums = left_open(pairs)
    assert (undecided_by_filter, undecided_by_sums) == (2, 1)


@pytest.mark.sampled(3)
@pytest.mark.parametrize("family", FAMILIES, ids=lambda family: family.name)
def test_an_answer_of_the_filter_is_that_of_integers(family):
    """60 random pairs of each family, hard to decide in the way its name says; UNDECIDED is no answer."""
    pairs = family.pairs(60, seed=31)
    answers = np.array([filtered(pair.reshape(6, 3)) for pair in pairs])
    certain = answers != UNDECIDED
    assert np.array_equal(answers[certain], [pair_intersects_integers(pair.tolist()) for pair in pairs[certain]])


@pytest.mark.parametrize("name", ["products underflow", "products overflow"])
def test_filter_guesses_no_contact_where_products_leave_the_range(name):
    """60 random pairs: the filter may say that some are apart (0), leaves some open, and says of none that they meet
    (1).
    """
    answers = [filtered(pair.reshape(6, 3)) for pair in triangle_family(name).pairs(60, seed=31)]
    assert UNDECIDED in answers
    assert 1 not in answers


@kernel
def pair_intersects_exact(corners, digits):
    """Whether two triangles meet by exact sums, from compiled code; ``digits``: room for them."""
    return triangle_exact.pair_intersects_exact(doubles_of(corners), integers_of(digits))


@pytest.mark.slow
@pytest.mark.parametrize("upper", [2, 3, 4])
def test_exact_decision_equals_integers_on_a_lattice(upper):
    """1,000 pairs with corners at whole numbers below ``upper``, so that most touch or are degenerate."""
    digits = new_digits()
    pairs = np.random.default_rng(upper).integers(0, upper, (1_000, 6, 3)).astype(float)
    for pair in pairs:
        assert pair_intersects_exact(pair, digits) == pair_intersects_integers(pair.reshape(2, 3, 3).tolist())


@pytest.mark.parametrize("upper", [2, 3])
def test_pairs_on_a_lattice_are_decided_as_by_integers(upper):
    """200 pairs with corners at whole numbers below ``upper``: most touch, lie in one plane, or are no triangles."""
    pairs = np.random.default_rng(upper).integers(0, upper, (200, 2, 3, 3)).astype(float)
    expected = [pair_intersects_integers(pair) for pair in pairs]
    assert 20 < sum(expected) < 180, "both answers are frequent"
    assert triangles_intersect(pairs).tolist() == expected


def test_smallest_gap_between_huge_triangles_separates():
    """The first lies in the plane z = x; a corner of the second, at x = 0, is 2^-900 m above it, the others 2^900 m.

    Scaled so that 2^900 is a moderate number the gap would vanish.
    """
    first = [[0, 0, 0], [2.0**900, 0, 2.0**900], [0, 2.0**900, 0]]
    second = [[0, 2.0**898, 2.0**-900], [0, 2.0**899, 2.0**900], [2.0**898, 2.0**898, 2.0**900]]
    assert triangles_intersect([[first, second]]).tolist() == [False]


@pytest.mark.parametrize("shift", [0, 1, 2], ids=["axes x, y, z", "axes z, x, y", "axes y, z, x"])
@pytest.mark.parametrize("reverse", [False, True], ids=["as they are", "corners in reverse order"])
def test_disjoint_collinear_edges_do_not_meet(shift, reverse):
    """An edge of each triangle lies on the y axis, from 0 to 1 and from 2 to 3, or on another axis.

    The filter leaves the pair open, and exact sums decide it.
    """
    first, second = [[0, 0, 0], [0, 1, 0], [-4, 9, 0]], [[0, 2, 0], [0, 3, 0], [4, -5, 0]]
    pair = np.roll(np.array([first, second], dtype=float), shift, axis=2)
    pair = pair[:, ::-1] if reverse else pair
    undecided_by_filter, undecided_by_sums = left_open([pair])
    assert (undecided_by_filter, undecided_by_sums) == (1, 0)
    assert triangles_intersect([pair]).tolist() == [False]


VISIBLE = tomllib.loads(Path(__file__).with_name("seen.toml").read_text("utf-8"))
TRIANGLES_BESIDE_FLOOR = [(other, word == "meets") for word in VISIBLE for other in VISIBLE[word].values()]


@pytest.mark.parametrize("scale", [1.0, 2.0**-270, 2.0**-900, 2.0**900], ids=["1", "2^-270", "2^-900", "2^900"])
def test_visible_cases_are_decided(scale):
    """Rows of seen.toml: triangles beside (0, 0, 0), (4, 0, 0), (0, 4, 0) that one can see to meet it, or not.

    At 2^-270 products of three lengths lie just above what the filter holds for lost in underflow. Integers agree, and
    neither the order of corners nor that of the triangles matters.
    """
    floor = (4 * np.array(FLOOR) * scale).tolist()
    for other, meets in TRIANGLES_BESIDE_FLOOR:
        triangle = (np.array(other) * scale).tolist()
        assert triangles_intersect([[floor, triangle], [floor[::-1], triangle]]).tolist() == [meets, meets], other
        assert pair_intersects_integers([floor, triangle]) is meets, other
        assert pair_intersects_integers([triangle, floor]) is meets, other
