"""The side of a line against rational arithmetic, where float64 alone gets it wrong."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sessions.geometry.orientation import exact_orientation, orientation, winding

NUMBER = st.floats(-1e30, 1e30, allow_subnormal=True)
POINT = st.tuples(NUMBER, NUMBER)


def sign(number):
    """-1, 0 or 1."""
    return (number > 0) - (number < 0)


def determinant(a, b, c):
    """Twice the area of a triangle, in rationals."""
    (ax, ay), (bx, by), (cx, cy) = [[Fraction(x) for x in point] for point in (a, b, c)]
    return ax * by - ay * bx + bx * cy - by * cx + cx * ay - cy * ax


@given(POINT, POINT, POINT)
def test_the_side_of_any_points_is_that_of_rational_arithmetic(a, b, c):
    """Three random points, from nearly on a line to far from it, wind left (1), right (-1) or are on a line (0)."""
    assert orientation(a, b, c) == sign(determinant(a, b, c))


@given(st.integers(0, 255), st.integers(0, 255))
def test_points_an_ulp_from_a_line_are_on_their_side(i, j):
    """A point lies up to 255 ulps from (0.5, 0.5), which is on the line of (12, 12) and (24, 24)."""
    ulp = 2.0**-53
    points = (0.5 + i * ulp, 0.5 + j * ulp), (12.0, 12.0), (24.0, 24.0)
    assert orientation(*points) == sign(determinant(*points))


def test_float64_alone_would_be_wrong_about_such_points():
    """For 256 points up to 15 ulps from (0.5, 0.5) the usual determinant in doubles has a wrong sign somewhere."""
    ulp, (bx, by), (cx, cy) = 2.0**-53, (12.0, 12.0), (24.0, 24.0)
    grid = [(0.5 + i * ulp, 0.5 + j * ulp) for i in range(16) for j in range(16)]
    rounded = [sign((x - cx) * (by - cy) - (y - cy) * (bx - cx)) for x, y in grid]
    assert rounded != [orientation(point, (bx, by), (cx, cy)) for point in grid]


def test_rational_arithmetic_alone_gives_the_side():
    """The slow function, which decides where doubles cannot, is right about 50 triangles of whole coordinates."""
    for points in np.random.default_rng(6).integers(-9, 10, (50, 3, 2)).tolist():
        assert exact_orientation(*points) == sign(determinant(*points))


@pytest.mark.parametrize("scale", [1.0, 1e-180, 1e155])
def test_winding_is_the_sign_of_the_shoelace_sum(scale):
    """200 random polygons of 3 to 8 corners have whole coordinates from -3 to 3, times ``scale``.

    Products of doubles overflow at 1e155 and underflow at 1e-180; the expected sum is of fractions.
    """
    random = np.random.default_rng(5)
    for _ in range(200):
        points = (scale * random.integers(-3, 4, (random.integers(3, 9), 2))).tolist()
        exact = [[Fraction(x) for x in point] for point in points]
        pairs = zip(exact, exact[1:] + exact[:1], strict=True)
        assert winding(points) == sign(sum(a[0] * b[1] - a[1] * b[0] for a, b in pairs))
