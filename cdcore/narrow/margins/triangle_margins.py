"""How far two triangles are from the other answer: their clearance or their penetration.

An exact answer can hang on 1e-15 m, where a float64 distance is all rounding. So the whole computation is in integers
on one power-of-two scale, shifted to a common origin there, and only the root at the end rounds.
"""

from collections.abc import Iterator
from fractions import Fraction
from math import isqrt

import numpy as np
from numpy.typing import ArrayLike

from cdcore.numerics import BoolArray, FloatArray
from cdcore.triangles.decide import checked_triangles, triangles_intersect
from cdcore.triangles.integers import Triangle, Vector, cross, difference, dot, integer_points, normal

ROOT_BITS = 120
"""Bits under the integer root: its result has 60, seven more than a float64."""


def triangle_margins(triangles: ArrayLike) -> tuple[BoolArray, FloatArray]:
    """Whether the triangles of each pair meet, and their penetration or clearance.

    Clearance is the smallest distance of the closed triangles. Penetration is the smallest overlap along the unit
    normals and the unit cross products of edges; 0 when coplanar, and 0 where no such axis exists. Choose it to judge
    a disagreement between engines, not to find contacts.

    ``triangles`` (n, 2, 3, 3) give (n,) bool and (n,) float64 metres, correct to 1e-15 relative; InvalidTrianglesError
    for a wrong shape, or a coordinate that is not finite. Source: section 7.2 of the project's specification, tolerance
    rule.

    Examples
    --------
    >>> floor = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    >>> triangle_margins([[floor, [[0, 0, 1e-15], [1, 0, 1], [0, 1, 1]]]])
    (array([False]), array([1.e-15]))
    """
    pairs = checked_triangles(triangles)
    meets = triangles_intersect(pairs)
    distance = [_margin(pair, meet) for pair, meet in zip(pairs, meets.tolist(), strict=True)]
    return meets, np.array(distance, dtype=np.float64)


def _margin(pair: FloatArray, meet: bool) -> float:
    """Penetration or clearance of one pair (2, 3, 3)."""
    points, scale = integer_points(pair)
    p = [difference(point, points[0]) for point in points]
    first, second = (p[0], p[1], p[2]), (p[3], p[4], p[5])
    squares = _overlaps(first, second) if meet else _distances(first, second)
    return _root(min(squares, default=Fraction(0)), scale)


def _root(square: Fraction, scale: int) -> float:
    """Square root of a fraction, over ``scale``; rounds once, at the end."""
    shift = max(0, ROOT_BITS - square.numerator.bit_length() + square.denominator.bit_length())
    shift += shift % 2
    root = isqrt((square.numerator << shift) // square.denominator)
    return float(Fraction(root, scale << (shift // 2)))


def _edges(t: Triangle) -> list[tuple[Vector, Vector]]:
    return [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])]


def _overlaps(first: Triangle, second: Triangle) -> Iterator[Fraction]:
    """Squared overlap along each axis; triangles without area leave out the axes they do not have."""
    axes = [normal(first), normal(second)]
    axes += [cross(difference(b, a), difference(d, c)) for a, b in _edges(first) for c, d in _edges(second)]
    for axis in axes:
        length = dot(axis, axis)
        if length:
            p, q = [dot(axis, point) for point in first], [dot(axis, point) for point in second]
            yield Fraction(min(max(p) - min(q), max(q) - min(p)) ** 2, length)


def _distances(first: Triangle, second: Triangle) -> Iterator[Fraction]:
    """Squared distances of edges, and of each corner from the other face, where its foot is inside."""
    yield from (_between_edges(*edge, *other) for edge in _edges(first) for other in _edges(second))
    for face, points in ((first, second), (second, first)):
        n = normal(face)
        length = dot(n, n)
        for p in points if length else ():
            if all(dot(cross(difference(b, a), difference(p, a)), n) >= 0 for a, b in _edges(face)):
                yield Fraction(dot(difference(p, face[0]), n) ** 2, length)


def _between_edges(a: Vector, b: Vector, c: Vector, d: Vector) -> Fraction:
    """Squared distance of two edges, either of which may be a point.

    Source: C. Ericson, Real-Time Collision Detection, 2005, section 5.1.9.
    """
    u, v, w = difference(b, a), difference(d, c), difference(a, c)
    uu, vv, uv, uw, vw = dot(u, u), dot(v, v), dot(u, v), dot(u, w), dot(v, w)
    s, whole_s = _fraction(uv * vw - vv * uw, uu * vv - uv * uv)
    t, whole_t = _fraction(uv * s + vw * whole_s, vv * whole_s)
    s, whole_s = _fraction(uv * t - uw * whole_t, uu * whole_t)
    away = [(x * whole_s + s * y) * whole_t - t * whole_s * z for x, y, z in zip(w, u, v, strict=True)]
    return Fraction(sum(x * x for x in away), (whole_s * whole_t) ** 2)


def _fraction(numerator: int, whole: int) -> tuple[int, int]:
    """A share of an edge, between both its ends; 0 where all shares, or those of a point, are as near."""
    if not 0 < numerator < whole:
        return int(0 < whole <= numerator), 1
    return numerator, whole
