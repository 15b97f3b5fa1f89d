"""A round hollow body cut into convex pieces: by height where its outline bends, and by angle around its axis.

Choose it over CoACD (``replay.prepare.convex_pieces``) for glassware: it needs no extra, takes a second where
CoACD takes ten, and its pieces cover the whole solid. It cannot cut what is not round about an axis, such as a hand.
"""

from collections.abc import Sequence
from functools import cache
from itertools import combinations
from typing import Any, Final

import numpy as np

from cdcore.bounding.hull import hull_of
from cdcore.mesh import TriangleMesh
from cdcore.numerics import FloatArray
from replay.prepare.convex_pieces import beyond_planes, manifold_of, within_triangles

ROUND: Final = 0.8
"""Share of the corners that must have others of their radius and height all around: a spout may differ."""

AROUND: Final = 8
"""Parts of the circle that are compared: a cylinder seen from its side looks alike in four of them."""

NEAR: Final = 0.03
"""Of the size of a body: as near are the radius and height of two corners that are called the same."""

SECTORS: Final = 16
"""Cuts by angle. A chord of so small a part of a circle stands off the circle by 2 % of its radius."""

BENDS: Final = 8
"""Cuts by height at most."""

COUNTS: Final = (1, 2, 3, 4, 6, 8, 10, 12, 14, 16, 18, 20, 24, 28, 32, 40, 48, 64, 96)
"""Numbers of pieces that are kept, beside the largest."""

SOLID: Final = 0.97
"""A part that fills this share of its hull is its own piece."""

LEAST: Final = 1e-6
"""Share of the volume of a body below which a piece is a rounding of the cuts."""


def round_axis(mesh: TriangleMesh) -> tuple[FloatArray, FloatArray] | None:
    """A point (3,) on the axis about which a mesh is round, and its direction (3,); ``None``: there is no such axis."""
    from scipy.spatial import cKDTree

    corners = mesh.referenced_vertices
    size = float(np.ptp(corners, axis=0).max())
    best: tuple[float, FloatArray, FloatArray] | None = None
    for way in np.eye(3):
        across = np.flatnonzero(way == 0)
        point = _middle_of_rings(corners, way)
        flat = (corners - point)[:, across]
        places = np.column_stack([np.hypot(*flat.T), corners @ way])
        part_of_circle = (np.arctan2(flat[:, 1], flat[:, 0]) // (2 * np.pi / AROUND)).astype(np.int64) % AROUND
        near = [
            cKDTree(some).query(places)[0] < NEAR * size if len(some := places[part_of_circle == number]) else False
            for number in np.unique(part_of_circle)
        ]
        share = float(np.mean(np.all(near, axis=0))) if len(near) == AROUND else 0.0
        if share >= ROUND and (best is None or share > best[0]):
            best = share, point, way
    return None if best is None else best[1:]


def _middle_of_rings(corners: FloatArray, way: FloatArray) -> FloatArray:
    """The middle between the extremes of the median ring: a spout moves that of the whole body."""
    height = corners @ way
    ring = corners[np.abs(height - np.sort(height)[len(height) // 2]) < 0.1 * max(float(np.ptp(height)), 1e-12)]
    return np.asarray((ring.min(axis=0) + ring.max(axis=0)) / 2)


def sector_pieces(mesh: TriangleMesh) -> list[list[TriangleMesh]] | None:
    """Convex pieces of a round body, one list for each number of pieces, the hull first; ``None``: it is not round.

    Every list covers the whole solid. The next one has more pieces, until they fill little more than the body. Each
    piece has at most 255 triangles.
    """
    found = round_axis(mesh) if mesh.is_closed else None
    solid = None if found is None else manifold_of(mesh)
    if found is None or solid is None or solid.volume() <= 0.0:
        return None
    parts: list[FloatArray] = []
    for band in _bands(solid, mesh, found[1]):
        parts += [np.asarray(part.to_mesh64().vert_properties[:, :3]) for part in _sectors(band, *found)]
    pieces = [piece for part in parts if (piece := hull_of(part)) is not None]
    least = LEAST * abs(solid.volume())
    return _merged([piece for piece in pieces if _volume(piece) > least])


def _bands(solid: Any, mesh: TriangleMesh, way: FloatArray) -> list[Any]:
    """The solid cut across its axis at the heights where its outline bends most."""
    heights = np.sort(mesh.referenced_vertices @ way)
    low, high = heights[0], heights[-1]
    levels = np.linspace(low, high, 66)[1:-1]
    areas = np.array([_area_at(solid, way, level) for level in levels])
    # A bend is where the area of the section changes its slope: the floor, a shoulder, a flange.
    bend = np.abs(np.diff(areas, 2))
    cuts: list[float] = []
    for number in np.argsort(bend)[::-1].tolist():
        level = float(levels[number + 1])
        if bend[number] > 0.02 * areas.max() and all(abs(level - cut) > 0.03 * (high - low) for cut in cuts):
            cuts.append(level)
        if len(cuts) == BENDS:
            break
    bands, rest = [], solid
    for cut in sorted(cuts):
        above, below = rest.split_by_plane(tuple(way), cut)
        bands.append(below)
        rest = above
    return [part for band in (*bands, rest) for part in band.decompose() if part.volume() > 0.0]


def _area_at(solid: Any, way: FloatArray, level: float) -> float:
    """Area of a section across the axis, by the volume of a thin slice."""
    thin = 1e-5
    return float(solid.trim_by_plane(tuple(way), level).trim_by_plane(tuple(-way), -level - thin).volume()) / thin


def _sectors(part: Any, point: FloatArray, way: FloatArray) -> list[Any]:
    """A band as it is where it is nearly convex; else cut by angle around the axis."""
    hull = part.hull()
    if hull.volume() <= part.volume() / SOLID:
        return [part]
    first = np.eye(3)[(int(np.argmax(way)) + 1) % 3]
    second = np.cross(way, first)
    pieces = []
    for number in range(SECTORS):
        angles = 2 * np.pi * np.array([number, number + 1]) / SECTORS
        begin, end = (np.cos(angle) * second - np.sin(angle) * first for angle in angles)
        wedge = part.trim_by_plane(tuple(begin), float(begin @ point)).trim_by_plane(tuple(-end), float(-end @ point))
        pieces += [one for one in wedge.decompose() if one.volume() > 0.0]
    return pieces


def _merged(pieces: list[TriangleMesh]) -> list[list[TriangleMesh]]:
    """From these pieces down to one: each time the two are joined whose hull adds least; the one piece first.

    Least of their own volume: a thin ring closes the mouth of a beaker with little volume, and much of its own.
    """
    parts, current = [*pieces], [*range(len(pieces))]
    lists = [pieces]  # the most pieces first

    @cache
    def join(a: int, b: int) -> tuple[float, TriangleMesh | None]:
        """The share that the hull of two pieces adds, and that hull; of pieces apart there is none."""
        (low, high), (other_low, other_high) = _box(parts[a]), _box(parts[b])
        hull = None
        if (low <= other_high + 1e-4).all() and (other_low <= high + 1e-4).all():
            hull = hull_of(np.concatenate([parts[a].vertices, parts[b].vertices]))
        if hull is None:
            return np.inf, None
        apart = _volume(parts[a]) + _volume(parts[b])
        return (_volume(hull) - apart) / apart, hull

    while len(current) > 1:
        # Of joins that add the same, the one that was there first.
        best = min(combinations(current, 2), key=lambda pair: (join(*pair)[0], max(pair[1], len(pieces) - 1), pair))
        hull = join(*best)[1]
        if hull is None:
            break
        parts.append(hull)
        current = [*(number for number in current if number not in best), len(parts) - 1]
        lists.append([parts[number] for number in current])
    limited: dict[int, TriangleMesh] = {}
    kept = [some for some in reversed(lists) if len(some) in COUNTS or some is lists[0]]
    for piece in (piece for some in kept for piece in some):
        limited.setdefault(id(piece), within_triangles(piece))
    return [[limited[id(piece)] for piece in some] for some in kept]


def _box(piece: TriangleMesh) -> tuple[FloatArray, FloatArray]:
    return piece.vertices.min(axis=0), piece.vertices.max(axis=0)


def _volume(piece: TriangleMesh) -> float:
    a, b, c = np.moveaxis(piece.triangles, 1, 0)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def outside_by(mesh: TriangleMesh, pieces: Sequence[TriangleMesh]) -> float:
    """Metres by which corners and middles of the faces of a mesh lie outside all of some convex pieces, at most."""
    points = np.concatenate([mesh.referenced_vertices, mesh.triangles.mean(axis=1)])
    beyond = np.stack([beyond_planes(points, piece) for piece in pieces])
    nearest = beyond.argmin(axis=0)
    away = np.flatnonzero(beyond.min(axis=0) > 0.0)
    return max((_distance(points[k], pieces[nearest[k]].vertices) for k in away.tolist()), default=0.0)


def _distance(point: FloatArray, corners: FloatArray) -> float:
    """Metres from a point (3,) to the convex hull of corners (n, 3): to the nearest mean of them with weights."""
    from scipy.optimize import nnls

    size = float(np.ptp(corners, axis=0).max())
    weights, _ = nnls(np.vstack([(corners - point).T / size, np.ones(len(corners))]), np.array([0.0, 0.0, 0.0, 1.0]))
    return float(np.linalg.norm((corners - point).T @ (weights / weights.sum())))
