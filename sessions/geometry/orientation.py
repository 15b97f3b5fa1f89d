"""On which side of a line a point lies, in the plane: decided exactly for any float64 coordinates.

Source: J. R. Shewchuk, *Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates* (1997),
the error bound of the first stage of ``orient2d``.
Differs: where that bound does not decide, rational arithmetic does; the later stages are left out.
"""

from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise
from typing import Final

ERROR_BOUND: Final = 3.3306690738754716e-16
"""(3 + 16 u) u with u = 2**-53: the rounding error of the determinant, as a fraction of its two products' sizes."""

UNDERFLOW: Final = 1e-300
"""Products below this lose digits that the relative bound does not count."""

Point = Sequence[float]


def orientation(a: Point, b: Point, c: Point) -> int:
    """Return 1 where ``c`` lies left of the line from ``a`` to ``b``, -1 where right of it, 0 where exactly on it."""
    left = (a[0] - c[0]) * (b[1] - c[1])
    right = (a[1] - c[1]) * (b[0] - c[0])
    determinant = left - right
    bound = ERROR_BOUND * (abs(left) + abs(right)) + UNDERFLOW
    if determinant > bound:
        return 1
    if determinant < -bound:
        return -1
    return exact_orientation(a, b, c)


def exact_orientation(a: Point, b: Point, c: Point) -> int:
    """Return what ``orientation`` does, by rational arithmetic alone; raises ``OverflowError`` for infinities."""
    if a[0] == b[0] == c[0] or a[1] == b[1] == c[1]:
        return 0
    ax, ay, bx, by, cx, cy = (Fraction(coordinate) for coordinate in (*a[:2], *b[:2], *c[:2]))
    determinant = (ax - cx) * (by - cy) - (ay - cy) * (bx - cx)
    return (determinant > 0) - (determinant < 0)


def winding(points: Sequence[Point]) -> int:
    """Return 1 where a closed path of at least three points encloses its area to its left, -1 to its right, 0: none."""
    x0, y0 = points[0][:2]
    products = [
        product for a, b in pairwise(points[1:]) for product in ((a[0] - x0) * (b[1] - y0), -(a[1] - y0) * (b[0] - x0))
    ]
    doubled = sum(products)
    bound = len(products) * ERROR_BOUND * sum(map(abs, products)) + UNDERFLOW
    if not abs(doubled) > bound:  # nor where products overflow and their sum is NaN
        rational = [(Fraction(point[0]), Fraction(point[1])) for point in points]
        neighbours = zip(rational, rational[1:] + rational[:1], strict=True)
        exact = sum(((ax * by - ay * bx) for (ax, ay), (bx, by) in neighbours), start=Fraction(0))
        return (exact > 0) - (exact < 0)
    return 1 if doubled > 0 else -1
