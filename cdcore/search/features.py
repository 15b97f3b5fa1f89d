"""Faces as features: neighbours in number are neighbours in space, and every face knows those it shares a corner with.

A rotation step of an ant is meaningful only if a small change of the index is a small change of place; so faces are
numbered along a Morton curve through their centroids, in the body's own frame.

A sample is S faces of a mesh to search, drawn by area, each larger sample holding every smaller one. A sampled search
misses in two ways: no pair that meets is left in the sample, or the search does not reach it.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cdcore.mesh import TriangleMesh, once_a_mesh
from cdcore.numerics import FloatArray, IntArray, readonly
from cdcore.search.state import stream_of

NEIGHBOURS: Final = 14
"""Neighbours kept of each face for local search: the three across its edges, then up to eleven at its corners.

Where six faces meet at every vertex, nine meet a face at a corner alone.
"""
FAN: Final = 3 * (NEIGHBOURS + 1)
"""Faces examined around a corner: among so many are the face and 14 others, though each may be there three times."""

CENTROID, RADIUS, CORNERS, ROW = 0, 3, 4, 13
"""Columns of a feature row: centroid, radius, the nine coordinates of the corners."""

MORTON_BITS: Final = 10
"""Bits of a position on the Morton curve, each axis."""


@dataclass(frozen=True, eq=False)
class Features:
    """The faces of a mesh in the order of the search, and which of them a search may draw."""

    face: IntArray
    """(f,) number in the mesh of the face at each index of the order."""
    rows: FloatArray
    """(f, 13) centroid, radius of the ball around it that holds the face, corners; body frame, metres."""
    near: IntArray
    """(f, 15) indices of up to 14 faces sharing a corner, those sharing an edge first, -1 where there is none; last
    column: how many share an edge."""
    links: IntArray
    """(6 f + v + 1,) three vertices of each face; for each vertex where its faces start; the faces at each vertex."""
    size: float
    """Largest distance of a point of the mesh to the origin of the body."""
    pick: IntArray
    """(S,) ascending indices of the faces that are searched: all, or a sample; the flood fill goes over all still."""
    near_picked: IntArray
    """(f, 15) as ``near``, of neighbours that are searched; of a sample the last column is not used."""

    def __len__(self) -> int:
        return len(self.face)

    @property
    def mean_radius(self) -> float:
        """Mean radius of the faces, metres."""
        return float(self.rows[:, RADIUS].mean())


@once_a_mesh
def features_of(mesh: TriangleMesh) -> Features:
    """The features of a mesh. Cost: a few microseconds a face."""
    triangles = mesh.triangles
    centroid = triangles[:, 0] / 3.0 + triangles[:, 1] / 3.0 + triangles[:, 2] / 3.0
    face = np.argsort(morton_codes(centroid), kind="stable")
    rows = np.empty((len(face), ROW))
    rows[:, :RADIUS] = centroid[face]
    rows[:, RADIUS] = _length(triangles - centroid[:, None]).max(axis=1)[face]
    rows[:, CORNERS:] = triangles.reshape(-1, 9)[face]
    corners = np.ascontiguousarray(mesh.merged_faces[face])
    members = np.argsort(corners.ravel(), kind="stable") // 3
    start = np.concatenate([[0], np.cumsum(np.bincount(corners.ravel()))]).astype(np.int64)
    near = _neighbours(corners, start, members)
    size = float(_length(rows[:, CENTROID:RADIUS]).max() + rows[:, RADIUS].max())
    links = np.concatenate([corners.ravel(), 3 * len(face) + len(start) + start, members])
    every = readonly(np.arange(len(face)))
    return Features(readonly(face), readonly(rows), readonly(near), readonly(links), size, every, near)


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


def morton_codes(points: FloatArray) -> IntArray:
    """Position of each point (n, 3) along a Morton curve: 10 bits per axis, scaled by the longest side of their box."""
    lower, upper = points.min(axis=0), points.max(axis=0)
    half_side = float((upper / 2.0 - lower / 2.0).max())
    code = np.zeros(len(points), dtype=np.int64)
    if half_side == 0.0:
        return code
    fraction = (points / 2.0 - lower / 2.0) / half_side
    cell = np.minimum((fraction * 2.0**MORTON_BITS).astype(np.int64), 2**MORTON_BITS - 1)
    for bit in range(MORTON_BITS):
        for axis in range(3):
            code |= ((cell[:, axis] >> bit) & 1) << (3 * bit + axis)
    return code


def _length(vectors: FloatArray) -> FloatArray:
    """Norms over the last axis; nothing overflows that is not itself too long for a double."""
    scale = np.abs(vectors).max(axis=-1)
    safe = np.where(scale > 0.0, scale, 1.0)
    # one rounding more than the true length must not cut off a corner
    return scale * np.sqrt(((vectors / safe[..., None]) ** 2).sum(axis=-1)) * (1.0 + 2.0**-48)


def _neighbours(corners: IntArray, start: IntArray, members: IntArray) -> IntArray:
    """Up to 14 neighbours a face, across edges first: a greedy descent goes further over an edge than over a corner."""
    faces = len(corners)
    by_edge, by_corner = _edge_neighbours(corners), _corner_neighbours(corners, start, members)
    owner, other = np.concatenate([by_edge, by_corner], axis=1)
    order = np.argsort(owner, kind="stable")
    order = order[owner[order] != other[order]]
    _, first = np.unique(owner[order] * faces + other[order], return_index=True)
    kept = order[np.sort(first)]
    owner, other = owner[kept], other[kept]
    rank = np.arange(len(kept)) - np.searchsorted(owner, owner)
    near = np.full((faces, NEIGHBOURS + 1), -1, dtype=np.int64)
    room = rank < NEIGHBOURS
    near[owner[room], rank[room]] = other[room]
    across = owner[room & (kept < by_edge.shape[1])]
    near[:, NEIGHBOURS] = np.bincount(across, minlength=faces)
    return near


def _edge_neighbours(corners: IntArray) -> IntArray:
    """Faces and others that share two of their corners (2, n); an edge of many faces gives each its next ones."""
    edges = np.sort(corners[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    owner = np.repeat(np.arange(len(corners)), 3)
    keep = edges[:, 0] != edges[:, 1]
    edges, owner = edges[keep], owner[keep]
    order = np.lexsort((owner, edges[:, 1], edges[:, 0]))
    edges, owner = edges[order], owner[order]
    links = [np.empty((2, 0), dtype=np.int64)]
    for step in range(1, NEIGHBOURS + 1):
        same = np.flatnonzero((edges[step:] == edges[:-step]).all(axis=1))
        if not len(same):
            break
        face, other = owner[same], owner[same + step]
        links.append(np.stack([np.stack([face, other], axis=1).ravel(), np.stack([other, face], axis=1).ravel()]))
    return np.concatenate(links, axis=1)


def _corner_neighbours(corners: IntArray, start: IntArray, members: IntArray) -> IntArray:
    """Faces and those at each of their corners (2, n); a fan of thousands of faces is left when there are enough."""
    vertex = corners.ravel()
    count = np.minimum(start[vertex + 1] - start[vertex], FAN)
    step = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    return np.stack([np.repeat(np.arange(len(vertex)) // 3, count), members[np.repeat(start[vertex], count) + step]])


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
    """Indices (f, 15) of the picked points nearest to each point (f, 3), without itself; -1 where there is none."""
    from scipy.spatial import cKDTree

    # By a power of two, which rounds nothing: squares of 2^600 m overflow, those of 1e-300 m vanish.
    points = np.ldexp(points, -int(np.frexp(np.abs(points).max())[1]))
    near = np.full((len(points), NEIGHBOURS + 1), -1, dtype=np.int64)
    count = min(NEIGHBOURS + 1, len(pick))
    _, index = cKDTree(points[pick]).query(points, k=np.arange(1, count + 1))
    others = pick[index]
    own = others == np.arange(len(points))[:, None]
    others[own] = -1
    others = np.take_along_axis(others, np.argsort(own, axis=1, kind="stable"), axis=1)
    near[:, : min(count, NEIGHBOURS)] = others[:, :NEIGHBOURS]
    return near
