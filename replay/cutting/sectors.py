"""A round hollow body cut into convex pieces: by height where its outline bends, and by angle around its axis.

Choose it over V-HACD and CoACD for glassware: it takes a second where CoACD takes ten, and its pieces cover the whole
solid. It cannot cut what is not round about an axis, such as a hand.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import combinations
from typing import Any, Final

import numpy as np

from cdcore.bounding.hull import hull_of
from cdcore.mesh import TriangleMesh
from cdcore.numerics import FloatArray, IntArray
from replay.cutting.convex_solids import manifold_of, volume_of

ROUND: Final = 0.8
"""Fraction of the corners that must have others of their radius and height all around: a spout may differ."""

AROUND: Final = 8
"""Parts of the circle that are compared: a cylinder seen from its side looks alike in four of them."""

NEAR: Final = 0.03
"""Of the size of a body: as near are the radius and height of two corners that are called the same."""

SECTORS: Final = 16
"""Cuts by angle. A chord of so small a part of a circle stands off the circle by 2 % of its radius."""

BENDS: Final = 8
"""Cuts by height at most."""

SOLID: Final = 0.97
"""A part that fills this fraction of its hull is its own piece."""

LEAST: Final = 1e-6
"""Fraction of the volume of a body below which a piece is a rounding of the cuts."""

VERSION: Final = "1"
"""Of the pieces that this module makes; another one whenever they change, so that kept ones are made again."""


@dataclass(frozen=True, eq=False)
class Ladder:
    """The finest pieces of a body, and the joins that make fewer of them.

    ``corners``: (n, 3) of all pieces; ``ends``: (k,) where those of each piece end; ``joins``: (j, 2) numbers of pieces
    that become one; a joined piece takes the next number after all before it.
    """

    corners: FloatArray
    ends: IntArray
    joins: IntArray

    def pieces(self, most: int) -> list[FloatArray]:
        """Corners (n, 3) of each of at most so many pieces, or of as few as there can be."""
        pieces = dict(enumerate(np.split(self.corners, self.ends[:-1])))
        number = len(pieces)
        for first, second in self.joins.tolist():
            if len(pieces) <= most:
                break
            pieces[number] = np.concatenate([pieces.pop(first), pieces.pop(second)])
            number += 1
        return list(pieces.values())


def round_axis(mesh: TriangleMesh) -> tuple[FloatArray, FloatArray] | None:
    """A point (3,) on the axis about which a mesh is round, and its direction (3,); ``None``: there is no such axis."""
    from scipy.spatial import cKDTree

    corners = mesh.referenced_vertices
    size = float(np.ptp(corners, axis=0).max())
    best: tuple[float, FloatArray, FloatArray] | None = None
    for axis in np.eye(3):
        across = np.flatnonzero(axis == 0)
        point = _middle_of_rings(corners, axis)
        flat = (corners - point)[:, across]
        profile = np.column_stack([np.hypot(*flat.T), corners @ axis])
        sector = (np.arctan2(flat[:, 1], flat[:, 0]) // (2 * np.pi / AROUND)).astype(np.int64) % AROUND
        near = [
            cKDTree(some).query(profile)[0] < NEAR * size if len(some := profile[sector == number]) else False
            for number in np.unique(sector)
        ]
        fraction = float(np.mean(np.all(near, axis=0))) if len(near) == AROUND else 0.0
        if fraction >= ROUND and (best is None or fraction > best[0]):
            best = fraction, point, axis
    return None if best is None else best[1:]


def _middle_of_rings(corners: FloatArray, axis: FloatArray) -> FloatArray:
    """The middle between the extremes of the median ring: a spout moves that of the whole body."""
    height = corners @ axis
    ring = corners[np.abs(height - np.sort(height)[len(height) // 2]) < 0.1 * max(float(np.ptp(height)), 1e-12)]
    return np.asarray((ring.min(axis=0) + ring.max(axis=0)) / 2)


def sector_ladder(mesh: TriangleMesh) -> Ladder | None:
    """The convex pieces of a round body, and how they join until one is left; ``None``: it is not round.

    However many are joined, they cover the whole solid.
    """
    axis = round_axis(mesh) if mesh.is_closed else None
    solid = None if axis is None else manifold_of(mesh)
    if axis is None or solid is None or solid.volume() <= 0.0:
        return None
    corner_sets: list[FloatArray] = []
    for band in _bands(solid, mesh, axis[1]):
        corner_sets += [
            np.asarray(corner_set.to_mesh64().vert_properties[:, :3]) for corner_set in _sectors(band, *axis)
        ]
    pieces = [piece for corner_set in corner_sets if (piece := hull_of(corner_set)) is not None]
    least = LEAST * abs(solid.volume())
    pieces = [piece for piece in pieces if volume_of(piece) > least]
    if not pieces:
        return None
    corners = np.concatenate([piece.vertices for piece in pieces])
    ends = np.cumsum([len(piece.vertices) for piece in pieces])
    return Ladder(corners, ends, np.array(_joins(pieces), dtype=np.int64).reshape(-1, 2))


def _bands(solid: Any, mesh: TriangleMesh, axis: FloatArray) -> list[Any]:
    """The solid cut across its axis at the heights where its outline bends most."""
    heights = np.sort(mesh.referenced_vertices @ axis)
    lower, upper = heights[0], heights[-1]
    levels = np.linspace(lower, upper, 66)[1:-1]
    areas = np.array([_area_at(solid, axis, level) for level in levels])
    # A bend is where the area of the section changes its slope: the floor, a shoulder, a flange.
    bend = np.abs(np.diff(areas, 2))
    cuts: list[float] = []
    for number in np.argsort(bend)[::-1].tolist():
        level = float(levels[number + 1])
        if bend[number] > 0.02 * areas.max() and all(abs(level - cut) > 0.03 * (upper - lower) for cut in cuts):
            cuts.append(level)
        if len(cuts) == BENDS:
            break
    bands, rest = [], solid
    for cut in sorted(cuts):
        above, below = rest.split_by_plane(tuple(axis), cut)
        bands.append(below)
        rest = above
    return [component for band in (*bands, rest) for component in band.decompose() if component.volume() > 0.0]


def _area_at(solid: Any, axis: FloatArray, level: float) -> float:
    """Area of a section across the axis, by the volume of a thin slice."""
    thin = 1e-5
    return float(solid.trim_by_plane(tuple(axis), level).trim_by_plane(tuple(-axis), -level - thin).volume()) / thin


def _sectors(solid: Any, point: FloatArray, axis: FloatArray) -> list[Any]:
    """A band as it is where it is nearly convex; else cut by angle around the axis."""
    hull = solid.hull()
    if hull.volume() <= solid.volume() / SOLID:
        return [solid]
    first = np.eye(3)[(int(np.argmax(axis)) + 1) % 3]
    second = np.cross(axis, first)
    pieces = []
    for number in range(SECTORS):
        angles = 2 * np.pi * np.array([number, number + 1]) / SECTORS
        begin, end = (np.cos(angle) * second - np.sin(angle) * first for angle in angles)
        wedge = solid.trim_by_plane(tuple(begin), float(begin @ point)).trim_by_plane(tuple(-end), float(-end @ point))
        pieces += [component for component in wedge.decompose() if component.volume() > 0.0]
    return pieces


def _joins(pieces: Sequence[TriangleMesh]) -> list[tuple[int, int]]:
    """From these pieces down to one: each time the two are joined whose hull adds least.

    Least of their own volume: a thin ring closes the mouth of a beaker with little volume, and much of its own.
    """
    merged, current = [*pieces], [*range(len(pieces))]
    joins: list[tuple[int, int]] = []

    @cache
    def join(a: int, b: int) -> tuple[float, TriangleMesh | None]:
        """The fraction that the hull of two pieces adds, and that hull; pieces with a gap between them have none."""
        (lower, upper), (other_lower, other_upper) = _box(merged[a]), _box(merged[b])
        hull = None
        if (lower <= other_upper + 1e-4).all() and (other_lower <= upper + 1e-4).all():
            hull = hull_of(np.concatenate([merged[a].vertices, merged[b].vertices]))
        if hull is None:
            return np.inf, None
        separate = volume_of(merged[a]) + volume_of(merged[b])
        return (volume_of(hull) - separate) / separate, hull

    while len(current) > 1:
        # Of joins that add the same, the one that was there first.
        best = min(combinations(current, 2), key=lambda pair: (join(*pair)[0], max(pair[1], len(pieces) - 1), pair))
        hull = join(*best)[1]
        if hull is None:
            break
        joins.append(best)
        merged.append(hull)
        current = [*(number for number in current if number not in best), len(merged) - 1]
    return joins


def _box(piece: TriangleMesh) -> tuple[FloatArray, FloatArray]:
    return piece.vertices.min(axis=0), piece.vertices.max(axis=0)
