"""A polygon cut into the triangles whose areas add up to the least, for outlines that touch themselves.

Signed areas add up to the outline's own whichever triangles are taken. So where the sum without signs is the same, none
winds against the others and they cover the polygon once; a polygon that crosses itself has no such cut.

Source: G. D. Gilbert (1979) and G. T. Klincsek (1980), minimum-weight triangulation of a polygon by dynamic
programming, with area in place of length.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

MOST_CORNERS: Final = 256
"""So many corners take 0.05 s, and twice as many eight times as long."""


def least_area_triangles(points: Array, flat: float) -> list[tuple[int, int, int]]:
    """Return the n - 2 triangles of an outline of n points (n, 2), each with its corners in the outline's order.

    ``flat``: twice the area up to which a triangle is flat. Of cuts with equal area, one with fewest flat triangles.
    Cost: n^3 / 6 triangles are compared.
    """
    count = len(points)
    x, y = points.T
    cost = np.zeros((count, count))  # of the corners from i to j, cut off by the edge from j to i
    apex = np.zeros((count, count), dtype=np.int64)
    for length in range(2, count):
        first = np.arange(count - length)[:, None]
        last = first + length
        middle = first + np.arange(1, length)
        doubled = (x[middle] - x[first]) * (y[last] - y[first]) - (y[middle] - y[first]) * (x[last] - x[first])
        area = np.abs(doubled)
        area[area <= flat] += flat
        total = cost[first, middle] + cost[middle, last] + area
        best = total.argmin(axis=1)[:, None]
        cost[first, last] = np.take_along_axis(total, best, axis=1)
        apex[first, last] = first + 1 + best
    triangles = []
    intervals = [(0, count - 1)]
    while intervals:
        start, end = intervals.pop()
        if end - start >= 2:
            middle_corner = int(apex[start, end])
            triangles.append((start, middle_corner, end))
            intervals += [(middle_corner, end), (start, middle_corner)]
    return triangles
