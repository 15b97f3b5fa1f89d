"""Result and cost of one search of one pair of bodies; a hit has passed the exact triangle test."""

from typing import NamedTuple

Pair = tuple[int, int]
"""Places of two faces in the order of the search, one of each body."""


class SearchResult(NamedTuple):
    """A pair of faces that meets or ``None``, and the cost of the search.

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
