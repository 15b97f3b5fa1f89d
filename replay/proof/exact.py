"""Triangles and rays, decided exactly for the doubles given: by a float filter where it is certain, else by integers.

Written apart from the collision core, by other routes: separating axes of the Minkowski difference, in integers.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from itertools import product
from typing import Final

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Vector = tuple[int, int, int]

SURE: Final = 2.0**-46
"""A determinant of differences errs by less than 48 u of the product of its vectors' largest components, u = 2^-53."""
SMALLEST: Final = 1e-250
"""A determinant below this may have lost terms to underflow."""
LARGEST: Final = 1e75
"""Differences above this may overflow in a determinant."""


def placed(points: Floats, rotation: Floats, translation: Floats) -> Floats:
    """World points (..., 3): ``x' = ((r00 x + r01 y) + r02 z) + t0`` in float64, each step rounded once."""
    x, y, z = points[..., 0, None], points[..., 1, None], points[..., 2, None]
    column = [rotation[..., :, k] for k in range(3)]
    world: Floats = ((column[0] * x + column[1] * y) + column[2] * z) + translation
    return world


def meeting(first: Floats, second: Floats) -> tuple[NDArray[np.bool_], int]:
    """Whether n pairs of closed triangles, (n, 3, 3) each, meet (touching counts); and how many integers decided."""
    meet = ((first.min(1) <= second.max(1)) & (second.min(1) <= first.max(1))).all(axis=1)
    rows = np.flatnonzero(meet)
    answer = _filtered(first[rows], second[rows])
    unsure = rows[answer < 0]
    meet[rows] = answer == 1
    for row in unsure.tolist():
        meet[row] = triangles_meet(first[row], second[row])
    return meet, len(unsure)


def _filtered(a: Floats, b: Floats) -> NDArray[np.int8]:
    """1 or 0 where floats are certain, else -1."""
    edges_a, edges_b = np.roll(a, -1, axis=1) - a, np.roll(b, -1, axis=1) - b
    between = b[:, None] - a[:, :, None]
    of_a = _signs(-between[:, :, 0], edges_b[:, None, 0], edges_b[:, None, 1])
    of_b = _signs(between[:, 0], edges_a[:, None, 0], edges_a[:, None, 1])
    turns = _signs(between, edges_a[:, :, None], edges_b[:, None])
    crossing = ((of_a * np.roll(of_a, -1, axis=1) < 0) & (np.abs(turns.sum(axis=2)) == 3)).any(axis=1)
    crossing |= ((of_b * np.roll(of_b, -1, axis=1) < 0) & (np.abs(turns.sum(axis=1)) == 3)).any(axis=1)
    one_side = (np.abs(of_a.sum(axis=1)) == 3) | (np.abs(of_b.sum(axis=1)) == 3)
    known = (of_a != 0).all(axis=1) & (of_b != 0).all(axis=1) & (turns != 0).all(axis=(1, 2))
    answer = np.where(crossing, 1, np.where(known | one_side, 0, -1))
    return answer.astype(np.int8)


def _signs(w: Floats, e: Floats, f: Floats) -> NDArray[np.int64]:
    """Certain signs of ``w . (e x f)``, 0 where it is not certain; vectors (..., 3)."""
    with np.errstate(over="ignore", invalid="ignore"):
        value = (w * np.cross(e, f)).sum(axis=-1)
        w, e, f = (np.abs(one).max(axis=-1) for one in (w, e, f))
        sure = (np.abs(value) > SURE * w * e * f + SMALLEST) & (w < LARGEST) & (e < LARGEST) & (f < LARGEST)
    return np.where(sure, np.sign(value), 0.0).astype(np.int64)


def triangles_meet(first: Floats, second: Floats) -> bool:
    """Whether two closed triangles (3, 3), points and segments among them, meet; in integers.

    They do not exactly if some direction separates them strictly, and one of finitely many then does: normals of faces
    and edges of their Minkowski difference, which may be flat, a segment or a point.
    """
    numbers = [float(value).as_integer_ratio() for value in (*first.ravel(), *second.ravel())]
    common = max(below for _, below in numbers)
    flat = [above * (common // below) for above, below in numbers]
    points: list[Vector] = [(flat[k], flat[k + 1], flat[k + 2]) for k in range(0, 18, 3)]
    a, b = points[:3], points[3:]
    return not any(_separates(along, a, b) for along in _directions(a, b))


def _directions(a: list[Vector], b: list[Vector]) -> Iterator[Vector]:
    edges_a, edges_b = ([_minus(t[(k + 1) % 3], t[k]) for k in range(3)] for t in (a, b))
    normals = [_cross(edges_a[0], edges_a[1]), _cross(edges_b[0], edges_b[1])]
    normals += [_cross(e, f) for e, f in product(edges_a, edges_b)]
    yield from normals
    between, edges = _minus(b[0], a[0]), edges_a + edges_b
    yield between
    for e in edges:
        yield e
        square, along = _dot(e, e), _dot(between, e)
        yield _minus(_scaled(between, square), _scaled(e, along))
    yield from (_cross(n, e) for n, e in product(normals, edges))


def _separates(along: Vector, a: list[Vector], b: list[Vector]) -> bool:
    first, second = [_dot(along, p) for p in a], [_dot(along, p) for p in b]
    return max(first) < min(second) or max(second) < min(first)


def _minus(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _scaled(a: Vector, by: int) -> Vector:
    return a[0] * by, a[1] * by, a[2] * by


def _dot(a: Vector, b: Vector) -> int:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def inside(point: Floats, triangles: Floats) -> bool:
    """Whether a point (3,) off a closed surface (n, 3, 3) is inside: the parity of a ray along +y, in fractions.

    The half-open rule moves the ray off every edge and corner, for all triangles alike.
    """
    low, high = triangles.min(axis=1), triangles.max(axis=1)
    beside = (low[:, [0, 2]] > point[[0, 2]]).any(axis=1) | (high < point).any(axis=1)
    p = [Fraction(value) for value in point.tolist()]
    odd = False
    for corners in triangles[~beside].tolist():
        a, b, c = ([Fraction(value) for value in corner] for corner in corners)
        if _passes(a, b, p) ^ _passes(b, c, p) ^ _passes(c, a, p):
            e, f, r = ([q[k] - a[k] for k in range(3)] for q in (b, c, p))
            normal = [e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]]
            odd ^= sum(n * x for n, x in zip(normal, r, strict=True)) * normal[1] < 0
    return odd


def _passes(a: list[Fraction], b: list[Fraction], p: list[Fraction]) -> bool:
    """Whether an edge, seen along y, crosses the line z = p.z beyond p.x; an end on the line counts as below."""
    if (a[2] > p[2]) == (b[2] > p[2]):
        return False
    if a[2] > b[2]:
        a, b = b, a
    return (b[2] - a[2]) * (p[0] - a[0]) < (b[0] - a[0]) * (p[2] - a[2])
