"""The segment that two meeting triangles have in common, computed in doubles, for pictures and lengths.

Each edge is clipped by the other triangle: by its plane, from both sides, and by its three edges. Who asks knows from
the exact test that the two meet; a point within rounding of the other triangle counts as on it.
"""

from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from cdcore.kernels.compiling import hot_kernel, kernel, never_inlined
from cdcore.kernels.vectors import Vector, between, beyond, cross, dot, vector_at
from cdcore.numerics import FloatArray
from cdcore.tolerances import EPS
from cdcore.triangles.decide import checked_triangles

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
    fill_sections(np.ldexp(pairs, -exponent).reshape(-1, 18), segments)
    return np.ldexp(segments, exponent)


@kernel
def fill_sections(pairs: FloatArray, segments: FloatArray) -> None:
    """Fills the two farthest of the points where edges of each pair (n, 18) enter and leave the other triangle."""
    points = np.empty(36)
    for pair in range(len(pairs)):
        p, count, extent = pairs[pair], 0, 0.0
        for k in range(3, 18):
            extent = max(extent, abs(p[k] - p[k % 3]))
        for edge in range(6):
            face = 0 if edge >= 3 else 9
            a, b = vector_at(p, 3 * edge), vector_at(p, 9 - face + 3 * ((edge + 1) % 3))
            begin, end = clipped_interval(a, b, p, face, SLACK_ULPS * EPS * extent)
            if begin <= end:
                along = between(a, b)
                points[count], points[count + 1], points[count + 2] = beyond(a, begin, along)
                points[count + 3], points[count + 4], points[count + 5] = beyond(a, end, along)
                count += 6
        farthest = -1.0
        for i in range(0, count, 3):
            for j in range(0, i, 3):
                along = between(vector_at(points, j), vector_at(points, i))
                if dot(along, along) > farthest:
                    farthest = dot(along, along)
                    for k in range(3):
                        segments[pair, 0, k], segments[pair, 1, k] = points[j + k], points[i + k]


@hot_kernel
def clipped_interval(a: Vector, b: Vector, p: FloatArray, face: int, slack: float) -> tuple[float, float]:
    """Shares of the way from a to b between which it is within ``slack`` of the face ``p[face:face + 9]``.

    The first is above the second where it is nowhere.
    """
    never_inlined()
    begin, end = 0.0, 1.0
    corners = vector_at(p, face), vector_at(p, face + 3), vector_at(p, face + 6)
    normal = cross(between(corners[0], corners[1]), between(corners[0], corners[2]))
    across = between(normal, (0.0, 0.0, 0.0))
    # Directions inward: across each edge, along the normal, and against it.
    for side in range(5):
        corner, inward = corners[side % 3], normal if side == 3 else across
        if side < 3:
            inward = cross(normal, between(corner, corners[(side + 1) % 3]))
        square = dot(inward, inward)
        if square == 0.0:
            return 1.0, 0.0
        from_a = dot(inward, between(corner, a)) / np.sqrt(square) + slack
        from_b = dot(inward, between(corner, b)) / np.sqrt(square) + slack
        if from_a < 0.0 and from_b < 0.0:
            return 1.0, 0.0
        if from_a < 0.0:
            begin = max(begin, from_a / (from_a - from_b))
        if from_b < 0.0:
            end = min(end, from_a / (from_a - from_b))
    return begin, end
