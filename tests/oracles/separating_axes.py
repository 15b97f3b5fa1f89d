"""A second exact triangle test that shares no step with the first: separating axes of the Minkowski difference, in
integers.

Two convex hulls are disjoint exactly when some axis separates their projections strictly. For triangles with integer
corners the axes listed here suffice, flat and pointlike triangles included.
"""

import numpy as np


def integer_points(pair: np.ndarray) -> list[tuple[int, int, int]]:
    """Six corners (2, 3, 3) as integer triples on one common power-of-two scale."""
    ratios = [float(value).as_integer_ratio() for value in np.asarray(pair, dtype=np.float64).ravel()]
    common = max(bottom for _, bottom in ratios)
    whole = [top * (common // bottom) for top, bottom in ratios]
    return [(whole[k], whole[k + 1], whole[k + 2]) for k in range(0, 18, 3)]


def minus(a, b):
    """The difference of two vectors."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def outer(a, b):
    """The cross product of two vectors."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def inner(a, b):
    """The scalar product of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def separates(axis, first, second) -> bool:
    """Whether a plane across the axis is between two sets of points."""
    x, y, z = axis
    p = [x * a + y * b + z * c for a, b, c in first]
    q = [x * a + y * b + z * c for a, b, c in second]
    return max(p) < min(q) or max(q) < min(p)


def candidate_axes(first, second):
    """Every axis that may be the only one to separate; generated lazily, cheapest first."""
    yield from ((1, 0, 0), (0, 1, 0), (0, 0, 1))
    edges_first = [minus(first[(k + 1) % 3], first[k]) for k in range(3)]
    edges_second = [minus(second[(k + 1) % 3], second[k]) for k in range(3)]
    normals = [outer(edges_first[0], edges_first[1]), outer(edges_second[0], edges_second[1])]
    yield from normals
    yield from (outer(e, f) for e in edges_first for f in edges_second)
    edges = edges_first + edges_second
    yield from (outer(n, e) for n in normals for e in edges)
    if any(normals[0]) and any(normals[1]):
        return  # the difference is a solid or a flat polygon: these are the normals of all its sides
    yield from edges
    between = [minus(q, p) for p in first for q in second]
    for gap in between:
        # component of one difference point across an edge: apart (e.e) - e (apart.e)
        for edge in edges:
            along, length = inner(gap, edge), inner(edge, edge)
            yield tuple(a * length - e * along for a, e in zip(gap, edge, strict=True))
        yield gap


def meets_by_axes(pair: np.ndarray) -> bool:
    """Whether the closed triangles of one pair (2, 3, 3) of finite doubles have a point in common."""
    points = integer_points(pair)
    first, second = points[:3], points[3:]
    return not any(separates(axis, first, second) for axis in candidate_axes(first, second))
