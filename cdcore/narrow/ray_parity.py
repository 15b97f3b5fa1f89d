"""Whether a point is inside a closed mesh, by exact ray parity: no tolerance, any finite input.

The ray starts at the point and runs along +x. The half-open rule (an edge belongs to the side its lower end is on; a
point on an edge's line counts as above it) moves the ray infinitesimally off every vertex and edge, the same for all
triangles.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from cdcore.numerics import FloatArray

Point = tuple[Fraction, Fraction, Fraction]


def point_inside(point: FloatArray, triangles: FloatArray) -> bool:
    """Whether a point (3,) is inside the surface of triangles (n, 3, 3) that is closed and does not hold the point.

    Exact for the numbers given: floats decide what can be decided by comparing them, fractions the rest. Source: parity
    of crossings; the half-open rule is the usual one of polygon filling.
    """
    low, high = triangles.min(axis=1), triangles.max(axis=1)
    column = (low[:, 1:] <= point[1:]).all(axis=1) & (high[:, 1:] >= point[1:]).all(axis=1)
    column &= high[:, 0] >= point[0]
    start = _exact(point)
    inside = False
    for corners in triangles[column]:
        a, b, c = (_exact(corner) for corner in corners)
        if _above(a, b, start) ^ _above(b, c, start) ^ _above(c, a, start):
            inside ^= _lies_ahead(a, b, c, start)
    return inside


def _exact(point: FloatArray) -> Point:
    x, y, z = (Fraction(float(value)) for value in np.asarray(point))
    return x, y, z


def _above(a: Point, b: Point, p: Point) -> bool:
    """Whether the projection of edge ab along x passes above p (larger z at p's y), half open."""
    if (a[1] > p[1]) == (b[1] > p[1]):
        return False
    if a[1] > b[1]:
        a, b = b, a
    return (b[1] - a[1]) * (p[2] - a[2]) < (b[2] - a[2]) * (p[1] - a[1])


def _lies_ahead(a: Point, b: Point, c: Point, p: Point) -> bool:
    """Whether the plane of the triangle lies beyond p along +x."""
    e, f, r = ([q[k] - a[k] for k in range(3)] for q in (b, c, p))
    nx, ny, nz = (e[i] * f[j] - e[j] * f[i] for i, j in ((1, 2), (2, 0), (0, 1)))
    return (nx * r[0] + ny * r[1] + nz * r[2]) * nx < 0
