"""Where two triangles that meet have points in common: a segment, computed in doubles, for pictures and lengths.

Each edge is clipped by the other triangle: by its plane, from both sides, and by its three edges. Who asks knows from
the exact test that the two meet; a point within rounding of the other triangle counts as on it.
"""

from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from cdcore.kernels.compiling import hot_kernel, kernel, stay_one_function
from cdcore.narrow.triangles.predicates import checked_triangles
from cdcore.numerics import EPS, FloatArray

SLACK_ULPS: Final = 64.0
"""How far outside of a triangle a point still counts as on it, in eps of the pair's extent."""


def triangle_pair_sections(triangles: ArrayLike) -> FloatArray:
    """The ends (n, 2, 3) of the segments in which the ``triangles`` (n, 2, 3, 3) of each pair meet, in their frame.

    Of a coplanar overlap, which is a polygon, this is the polygon's longest chord between corners. A single common
    point gives a segment with nearly equal ends. Pairs that do not meet, or of which neither has an area, give NaN.
    InvalidTrianglesError for a wrong shape, or a coordinate that is not finite.
    """
    pairs = checked_triangles(triangles).reshape(-1, 6, 3)
    segments = np.full((len(pairs), 2, 3), np.nan)
    # Scaled by a power of two, so that no product over- or underflows.
    exponent = np.frexp(np.abs(pairs).max(axis=(1, 2), keepdims=True, initial=0.0))[1]
    fill_sections(np.ldexp(pairs, -exponent), segments)
    return np.ldexp(segments, exponent)


@kernel
def fill_sections(pairs: FloatArray, segments: FloatArray) -> None:
    """Of the points where edges of each pair (n, 6, 3) enter and leave the other triangle, the two farthest apart."""
    points = np.empty((12, 3))
    for pair in range(len(pairs)):
        p, count, extent = pairs[pair], 0, 0.0
        for corner in range(1, 6):
            for k in range(3):
                extent = max(extent, abs(p[corner, k] - p[0, k]))
        for edge in range(6):
            face = 0 if edge >= 3 else 3
            a, b = edge, 3 - face + (edge + 1) % 3
            begin, end = clipped(p, a, b, face, SLACK_ULPS * EPS * extent)
            if begin <= end:
                for k in range(3):
                    points[count, k] = p[a, k] + begin * (p[b, k] - p[a, k])
                    points[count + 1, k] = p[a, k] + end * (p[b, k] - p[a, k])
                count += 2
        farthest = -1.0
        for i in range(count):
            for j in range(i):
                apart = 0.0
                for k in range(3):
                    apart += (points[i, k] - points[j, k]) ** 2
                if apart > farthest:
                    farthest = apart
                    for k in range(3):
                        segments[pair, 0, k], segments[pair, 1, k] = points[j, k], points[i, k]


@hot_kernel
def clipped(p: FloatArray, a: int, b: int, face: int, slack: float) -> tuple[float, float]:
    """Shares of the way from row a to b between which it is within ``slack`` of the triangle of rows face..face+2.

    The first is above the second where it is nowhere.
    """
    stay_one_function()
    begin, end = 0.0, 1.0
    for side in range(5):
        row = face + side % 3
        following = face + (side + 1) % 3
        from_a = from_b = square = 0.0
        for k in range(3):
            way = inward(p, face, row, following, side, k)
            square += way * way
            from_a += way * (p[a, k] - p[row, k])
            from_b += way * (p[b, k] - p[row, k])
        if square == 0.0:
            return 1.0, 0.0
        from_a = from_a / np.sqrt(square) + slack
        from_b = from_b / np.sqrt(square) + slack
        if from_a < 0.0 and from_b < 0.0:
            return 1.0, 0.0
        if from_a < 0.0:
            begin = max(begin, from_a / (from_a - from_b))
        if from_b < 0.0:
            end = min(end, from_a / (from_a - from_b))
    return begin, end


@hot_kernel
def inward(p: FloatArray, face: int, row: int, following: int, side: int, k: int) -> float:
    """A coordinate of the direction inward: across an edge (sides 0 to 2), along the normal (3) or against it (4)."""
    i, j = (k + 1) % 3, (k + 2) % 3
    if side < 3:
        edge_i, edge_j = p[following, i] - p[row, i], p[following, j] - p[row, j]
        return normal(p, face, i) * edge_j - normal(p, face, j) * edge_i
    return normal(p, face, k) if side == 3 else -normal(p, face, k)


@hot_kernel
def normal(p: FloatArray, face: int, k: int) -> float:
    """A coordinate of the normal of rows face..face+2."""
    i, j = (k + 1) % 3, (k + 2) % 3
    u, v = p[face + 1, i] - p[face, i], p[face + 1, j] - p[face, j]
    across: float = u * (p[face + 2, j] - p[face, j]) - v * (p[face + 2, i] - p[face, i])
    return across
