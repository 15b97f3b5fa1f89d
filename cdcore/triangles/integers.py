"""The exact triangle test in Python integers: slow, short, and right for every finite double of any exponent.

All eighteen coordinates are brought to integers on one common power-of-two scale; from there nothing rounds. It
serves pairs whose exponents lie too far apart for exact sums (2^-500 beside 1), and as the reference the compiled
test is checked against.

Source: S. Gottschalk, M. C. Lin, D. Manocha, OBBTree (1996), for separating axes of convex bodies.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike

from cdcore.numerics import FloatArray

Vector = tuple[int, int, int]
Triangle = tuple[Vector, Vector, Vector]


def integer_points(coordinates: FloatArray) -> tuple[list[Vector], int]:
    """Points (..., 3) of finite doubles, row by row, all multiplied by a power of two, which comes second."""
    fractions = [value.as_integer_ratio() for value in coordinates.ravel().tolist()]
    shared = max(denominator for _, denominator in fractions)
    whole = [numerator * (shared // denominator) for numerator, denominator in fractions]
    return list(zip(whole[::3], whole[1::3], whole[2::3], strict=True)), shared


def difference(a: Vector, b: Vector) -> Vector:
    """The vector a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """The vector a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def scaled_vector(a: Vector, factor: int) -> Vector:
    """The vector a times a number."""
    return a[0] * factor, a[1] * factor, a[2] * factor


def dot(a: Vector, b: Vector) -> int:
    """The number a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def normal(triangle: Triangle) -> Vector:
    """The normal, twice the area long; zero for a triangle without area."""
    return cross(difference(triangle[1], triangle[0]), difference(triangle[2], triangle[0]))


def candidate_axes(first: Triangle, second: Triangle) -> Iterator[Vector]:
    """Directions along which two closed triangles are apart if they are apart at all.

    The nearest points lie on an edge of each, on a corner and a face, or, where a triangle has no area and is a segment
    or a point, on two corners or a corner and an edge.
    """
    yield from ((1, 0, 0), (0, 1, 0), (0, 0, 1))  # not needed: dismisses most pairs
    edges = [difference(triangle[(k + 1) % 3], triangle[k]) for triangle in (first, second) for k in range(3)]
    normals = normal(first), normal(second)
    yield from normals
    if any(cross(*normals)):
        yield from (cross(first_edge, other) for first_edge in edges[:3] for other in edges[3:])
        return
    yield from (cross(upright, edge) for upright in normals for edge in edges)
    if any(normals[0]) and any(normals[1]):
        return
    yield from (cross(first_edge, other) for first_edge in edges[:3] for other in edges[3:])
    for offset in (difference(q, p) for p in first for q in second):
        yield offset
        for edge in edges:
            # what of it is at right angles to the edge, times the square of that
            along, square = dot(offset, edge), dot(edge, edge)
            yield difference(scaled_vector(offset, square), scaled_vector(edge, along))


def separates(axis: Vector, first: Triangle, second: Triangle) -> bool:
    """Whether all of one triangle lies before all of the other along an axis."""
    first_edge, other = [dot(axis, corner) for corner in first], [dot(axis, corner) for corner in second]
    return max(first_edge) < min(other) or max(other) < min(first_edge)


def pair_intersects_integers(pair: ArrayLike) -> bool:
    """Exact answer for one pair (2, 3, 3) of finite doubles."""
    (a, b, c, d, e, f), _ = integer_points(np.asarray(pair, dtype=np.float64))
    first, second = (a, b, c), (d, e, f)
    return not any(separates(axis, first, second) for axis in candidate_axes(first, second))
