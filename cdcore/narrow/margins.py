"""How far triangles and surfaces are from the other answer: clearance, penetration, and moves that separate them.

``overlap_bounds``    float bounds of both that are always on the safe side, for many pairs of triangles
``triangle_margins``  both of one pair, in integers; an exact answer can hang on 1e-15 m, where a float64 distance is
                      all rounding, so only the root at the end rounds
``can_be_separated``  whether surfaces in contact come apart when no face moves by more than a step

The depth of face pairs does not tell how deep surfaces are: it is 0 for cubes that stand in each other with faces in
common planes. A move that ends the contact proves that it is no deeper than the step. Two kinds are tried: shifts of a
body along the normals of what meets, and shells, where every face of a body moves along its own normal, so that a plug
comes out of its hole.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from math import isqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdcore.narrow.brute_force import near_faces
from cdcore.numerics import BoolArray, FloatArray
from cdcore.tolerances import EPS
from cdcore.triangles.decide import checked_triangles, triangles_intersect
from cdcore.triangles.integers import Triangle, Vector, cross, difference, dot, integer_points, normal

PROJECTION_ULPS = 16.0
"""Rounding of a difference, a dot product and a division, in eps of the triangles' extent."""
DIRECTION_ULPS = 64.0
"""Rounding of a cross product turns an axis: by this many eps of the edges' lengths over the product's."""
PARALLEL = 1e-9
"""Edges whose cross product is shorter than this share of their lengths count as parallel. Their axis, if they have
one, is across both; and across a common edge the least overlap is along a face's normal, so it adds nothing."""
PARALLEL_PAD = 1e-8
"""Of the extent: covers the angle below which edges count as parallel."""
ROOT_BITS = 120
"""Bits under the integer root: its result has 60, seven more than a float64."""
LONGEST_MITRE = 3.0
"""A corner of a shell moves by at most so many steps, however sharp it is; a cube's needs the root of 3."""
FLATTEST = 1e-6
"""Directions in which the faces around a corner span less than this share of their normals are left to the others."""
DIRECTIONS = 6
"""Shifts are tried along the normals of so many faces of each body, the most frequent ones."""
ROUNDING_ULPS = 16
"""Added to a step, times the size of the coordinates: moving rounds, and surfaces that just touch still meet."""
FIRST_TESTED = 64
"""Face pairs that meet and are asked first: a move that leaves one of them meeting separates nothing."""


def overlap_bounds(pairs: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Bounds, lower and upper, of the least overlap of triangle pairs (n, 2, 3, 3) along the eleven axes of a pair,
    two normals and nine cross products of edges, and a distance that the triangles certainly keep; (n,) each.
    """
    points = pairs - pairs[:, :1, :1]
    extent = 2.0 * np.abs(points).max(axis=(1, 2, 3))[:, None]
    edges = np.roll(points, -1, axis=2) - points
    first = np.concatenate([edges[:, :, 0], np.repeat(edges[:, 0], 3, axis=1)], axis=1)
    second = np.concatenate([edges[:, :, 1], np.tile(edges[:, 1], (1, 3, 1))], axis=1)
    axes = np.cross(first, second)
    lengths = np.linalg.norm(first, axis=2) * np.linalg.norm(second, axis=2)
    length = np.linalg.norm(axes, axis=2)
    known = length > PARALLEL * lengths
    length[~known] = 1.0
    along = np.einsum("nbck,nak->nbac", points, axes) / length[:, None, :, None]
    lower, upper = along.min(axis=3), along.max(axis=3)
    overlap = np.minimum(upper[:, 0] - lower[:, 1], upper[:, 1] - lower[:, 0])
    rounding = PROJECTION_ULPS * EPS * extent
    turning = DIRECTION_ULPS * EPS * extent * lengths / length
    # along the normal of a triangle that has none anything may be less, across edges that are nearly parallel little
    unknown = np.where(np.arange(known.shape[1]) < 2, -np.inf, np.inf)
    least = np.where(known, overlap - rounding - turning, unknown).min(axis=1)
    least -= np.where(known.all(axis=1), 0.0, PARALLEL_PAD * extent[:, 0])
    most = np.where(known, overlap + rounding + turning, np.inf).min(axis=1)
    return least, most, np.where(known, -overlap - rounding, -np.inf).max(axis=1)


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


def shell_vectors(triangles: FloatArray, faces: NDArray[np.integer]) -> FloatArray:
    """Moves of the corners of each face when all faces of a body move outward by 1, (f, 3, 3), in units of the step.

    A corner moves so that every face around it moves by 1 along its normal, if that can be; by least squares if not.
    ``triangles`` (f, 3, 3) corners, ``faces`` (f, 3) vertex numbers; faces without area do not count.
    """
    normal = unit(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]))
    count = int(faces.max()) + 1
    squares, sums = np.zeros((count, 3, 3)), np.zeros((count, 3))
    np.add.at(squares, faces.ravel(), np.repeat(normal[:, :, None] * normal[:, None, :], 3, axis=0))
    np.add.at(sums, faces.ravel(), np.repeat(normal, 3, axis=0))
    vectors = (np.linalg.pinv(squares, rcond=FLATTEST, hermitian=True) @ sums[:, :, None])[:, :, 0]
    length = np.sqrt((vectors * vectors).sum(axis=1, keepdims=True))
    vectors *= np.minimum(1.0, LONGEST_MITRE / np.maximum(length, 1.0))
    return vectors[faces]


def can_be_separated(
    first: FloatArray,
    second: FloatArray,
    shell_a: FloatArray,
    shell_b: FloatArray,
    meeting: NDArray[np.integer],
    step: float,
) -> bool:
    """Whether some move of the surfaces by ``step`` metres leaves no face pair that meets.

    True proves that a move by ``step``, and what rounding adds, ends the contact; False says that no tried move does.
    ``first`` and ``second`` are placed triangles, the shells their placed :func:`shell_vectors`; ``meeting`` (k, 2) are
    the face pairs that meet, at least one.
    """
    step += ROUNDING_ULPS * EPS * float(max(np.abs(first).max(), np.abs(second).max()))
    close = near_faces(first, second, 2 * LONGEST_MITRE * step)
    tested = meeting[np.unique(np.linspace(0, len(meeting) - 1, FIRST_TESTED).astype(np.int64))]
    for x, y in _moves(first, second, shell_a, shell_b, meeting):
        if not any(_meet(first, second, rows, step * x, step * y) for rows in (tested, close)):
            return True
    return False


def _meet(first: FloatArray, second: FloatArray, rows: NDArray[np.integer], x: FloatArray, y: FloatArray) -> bool:
    i, j = rows[:, 0], rows[:, 1]
    a, b = first[i] + (x[i] if x.ndim == 3 else x), second[j] + (y[j] if y.ndim == 3 else y)
    return bool(triangles_intersect(np.stack([a, b], axis=1)).any())


def _moves(
    first: FloatArray, second: FloatArray, shell_a: FloatArray, shell_b: FloatArray, meeting: NDArray[np.integer]
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """How the one and the other move, per step: their faces together by no more than one."""
    still = np.zeros(3)
    for direction in (*_directions(second, meeting[:, 1]), *_directions(first, meeting[:, 0])):
        yield direction, still
        yield -direction, still
    yield from ((-shell_a, still), (still, -shell_b), (shell_a, still), (still, shell_b))
    yield -shell_a / 2, -shell_b / 2


def _directions(placed: FloatArray, meeting: NDArray[np.integer]) -> FloatArray:
    """Unit normals of the faces that meet, the most frequent first, then their mean."""
    some = placed[np.unique(meeting)]
    normals = unit(np.cross(some[:, 1] - some[:, 0], some[:, 2] - some[:, 0]))
    _, row, count = np.unique(np.round(normals, 6), axis=0, return_index=True, return_counts=True)
    frequent = normals[row[np.argsort(-count, kind="stable")[:DIRECTIONS]]]
    return np.concatenate([frequent, unit(normals.mean(axis=0, keepdims=True))])


def unit(vectors: FloatArray) -> FloatArray:
    """Vectors (..., 3) of length 1; those without length stay zero."""
    length = np.sqrt((vectors * vectors).sum(axis=-1, keepdims=True))
    return vectors / np.where(length > 0, length, 1.0)
