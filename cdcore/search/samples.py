"""Feature samples: a search over S faces of a mesh, drawn by area, each larger sample holding every smaller one.

A sampled search misses in two ways: no pair that meets is left in the sample, or it is there and is not found.
"""

from dataclasses import replace

import numpy as np

from cdcore.numerics import FloatArray, IntArray, readonly
from cdcore.search.features import CORNERS, NEIGHBOURS, RADIUS, Features
from cdcore.search.rng import stream_of


def sample_of(features: Features, size: int | None, seed: int, name: str) -> Features:
    """Draw ``size`` faces of a body to search; ``None`` or as many as there are: all, as the features are.

    Of fewer, the neighbours are the 14 nearest centroids, because few of them share a corner. ``seed`` and ``name`` are
    the key of the draw; the same key draws nested samples.
    """
    if size is None or size >= len(features):
        return features
    stream = stream_of(seed, "samples", name, name, 0.0)
    with np.errstate(divide="ignore"):
        # the S largest u^(1/area): a draw by weight without repeats (Efraimidis and Spirakis 2006)
        rank = np.log(stream.random(len(features))) / _areas(features)
    pick = np.sort(np.argsort(-rank, kind="stable")[:size])
    near_picked = readonly(_nearest(features.rows[:, :RADIUS], pick))
    return replace(features, pick=readonly(pick), near_picked=near_picked)


def _areas(features: Features) -> FloatArray:
    """Areas over the largest of them; all 1 where none has an area."""
    corners = features.rows[:, CORNERS:].reshape(-1, 3, 3)
    span = float(np.abs(corners).max())
    corners = corners / (span if span > 0.0 else 1.0)
    edges = corners[:, 1:] - corners[:, :1]
    area: FloatArray = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    largest = float(area.max())
    return area / largest if largest > 0.0 else np.ones(len(area))


def _nearest(points: FloatArray, pick: IntArray) -> IntArray:
    from scipy.spatial import cKDTree

    near = np.full((len(points), NEIGHBOURS + 1), -1, dtype=np.int64)
    count = min(NEIGHBOURS + 1, len(pick))
    _, index = cKDTree(points[pick]).query(points, k=np.arange(1, count + 1))
    others = pick[index]
    own = others == np.arange(len(points))[:, None]
    others[own] = -1
    others = np.take_along_axis(others, np.argsort(own, axis=1, kind="stable"), axis=1)
    near[:, : min(count, NEIGHBOURS)] = others[:, :NEIGHBOURS]
    return near
