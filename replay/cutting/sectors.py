"""A round hollow body cut into convex pieces: by height where its outline bends, and by angle around its axis.

Choose it over V-HACD and CoACD for glassware: it takes a second where CoACD takes ten, and its pieces cover the whole
solid. It cannot cut what is not round about an axis, such as a hand.
"""

from typing import Any, Final

import numpy as np

from cdcore.bounding.hull import hull_of
from cdcore.mesh import TriangleMesh
from cdcore.numerics import FloatArray
from replay.cutting.convex_solids import facing_outward, manifold_of, volume_of
from replay.cutting.joins import Ladder, joins_by_volume

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
        has_neighbour = np.ones(len(profile), dtype=np.bool_)
        for number in range(AROUND):
            sector_profile = profile[sector == number]
            has_neighbour &= cKDTree(sector_profile).query(profile)[0] < NEAR * size if len(sector_profile) else False
            # Each sector takes corners away: a hand is known not to be round after the first.
            if has_neighbour.mean() < ROUND:
                break
        fraction = float(has_neighbour.mean())
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
    solid = None if axis is None else manifold_of(facing_outward(mesh))
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
    return joins_by_volume(pieces)


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
    bands, uncut = [], solid
    for cut in sorted(cuts):
        above, below = uncut.split_by_plane(tuple(axis), cut)
        bands.append(below)
        uncut = above
    return [component for band in (*bands, uncut) for component in band.decompose() if component.volume() > 0.0]


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
