"""What one search of one pair of bodies found and took; a hit in it has passed the exact triangle test."""

from typing import NamedTuple

Pair = tuple[int, int]
"""Places of two faces in the order of the search, one of each body."""


class SearchResult(NamedTuple):
    """What one search found, a pair that meets or ``None``, and took.

    ``closest``: the pair whose centroids came closest, at ``distance`` metres. ``evaluations``: distances of centroids;
    ``tests``: of triangles; ``restarts``: populations drawn anew; ``iterations``: of the colony. ``reason``: "hit",
    "budget" or "broken" (the equations as printed gave a probability that is none).
    """

    hit: Pair | None
    closest: Pair
    distance: float
    evaluations: int
    tests: int
    restarts: int
    iterations: int
    reason: str
