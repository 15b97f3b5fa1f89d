"""Two convex hulls at known distances, by the hull of all differences of their corners."""

import numpy as np
from scipy.spatial import ConvexHull
from support.shapes import random_rotations

from cdcore import Body, Motion, TriangleMesh


def convex(rng, size):
    """Random corners within ``size`` metres, and some within their hull that no face of the hull uses."""
    points = rng.normal(size=(rng.integers(8, 40), 3))
    return TriangleMesh(points * (size / np.ptp(points)), ConvexHull(points).simplices)


def hulls_at(seed, gaps):
    """Two hulls whose distance is each of the ``gaps``, below 0 their depth.

    Origins that make bodies touch form the hull of all differences of corners. From the middle of one of its faces
    straight out, the distance to it is the way gone.
    """
    rng = np.random.default_rng(seed)
    a, b, turn = convex(rng, 0.1), convex(rng, 0.05), random_rotations(rng, 1)[0]
    ways = a.referenced_vertices[:, None] - b.referenced_vertices @ turn.T
    touching = ConvexHull(ways.reshape(-1, 3))
    face = rng.integers(len(touching.simplices))
    middle, out = touching.points[touching.simplices[face]].mean(axis=0), touching.equations[face, :3]
    places = np.zeros((len(gaps), 2, 3))
    places[:, 1] = middle + np.outer(gaps, out)
    turns = np.broadcast_to([np.eye(3), turn], (len(gaps), 2, 3, 3))
    return [Body("a", a), Body("b", b)], Motion(np.arange(len(gaps)), places, turns)
