"""A round hollow body cut into convex pieces: by height where its outline bends, and by angle around its axis.

Choose it over V-HACD and CoACD for glassware: it takes a second where CoACD takes ten, and its pieces cover the whole
solid. It cannot cut what is not round about an axis, such as a hand.
"""

from typing import Any, Final

import numpy as np

from cdcore.bounding.hull import hull_of
from cdcore.mesh import TriangleMesh
from cdcore.numerics import FloatArray
from replay.cutting.convex_solids import enclosed_solid, volume_of
from replay.cutting.joins import Ladder, joins_by_volume

ROUND_FRACTION: Final = 0.8
"""Fraction of the corners that must have others of their radius and height all around: a spout may differ."""

CIRCLE_DIVISIONS: Final = 8
"""Parts of the circle that are compared: a cylinder seen from its side looks alike in four of them."""

RING_TOLERANCE: Final = 0.03
"""Of the size of a body: as near are the radius and height of two corners that are called the same."""

SECTOR_COUNT: Final = 16
"""Cuts by angle. A chord of so small a part of a circle stands off the circle by 2 % of its radius."""

MOST_BENDS: Final = 8
"""Cuts by height at most."""

SOLID_HULL_FRACTION: Final = 0.97
"""A part that fills this fraction of its hull is its own piece."""

LEAST_VOLUME_FRACTION: Final = 1e-6
"""Fraction of the volume of a body below which a piece is a rounding of the cuts."""

PIECES_VERSION: Final = "1"
"""Of the pieces that this module makes; another one whenever they change, so that kept ones are made again."""


def round_axis(mesh: TriangleMesh) -> tuple[FloatArray, FloatArray] | None:
    """A point (3,) on the axis about which a mesh is round, and its direction (3,); ``None``: there is no such axis."""
    from scipy.spatial import cKDTree

    corners = mesh.referenced_vertices
    mesh_size = float(np.ptp(corners, axis=0).max())
    best_axis: tuple[float, FloatArray, FloatArray] | None = None
    for axis in np.eye(3):
        cross_columns = np.flatnonzero(axis == 0)
        point = _middle_of_rings(corners, axis)
        cross_coordinates = (corners - point)[:, cross_columns]
        radius_and_height = np.column_stack([np.hypot(*cross_coordinates.T), corners @ axis])
        sector_of_corner = (
            np.arctan2(cross_coordinates[:, 1], cross_coordinates[:, 0]) // (2 * np.pi / CIRCLE_DIVISIONS)
        ).astype(np.int64) % CIRCLE_DIVISIONS
        has_neighbour = np.ones(len(radius_and_height), dtype=np.bool_)
        for number in range(CIRCLE_DIVISIONS):
            sector_profile = radius_and_height[sector_of_corner == number]
            has_neighbour &= (
                cKDTree(sector_profile).query(radius_and_height)[0] < RING_TOLERANCE * mesh_size
                if len(sector_profile)
                else False
            )
            # Each sector takes corners away: a hand is known not to be round after the first.
            if has_neighbour.mean() < ROUND_FRACTION:
                break
        fraction = float(has_neighbour.mean())
        if fraction >= ROUND_FRACTION and (best_axis is None or fraction > best_axis[0]):
            best_axis = fraction, point, axis
    return None if best_axis is None else best_axis[1:]


def _middle_of_rings(corners: FloatArray, axis: FloatArray) -> FloatArray:
    """The middle between the extremes of the median ring: a spout moves that of the whole body."""
    height = corners @ axis
    ring = corners[np.abs(height - np.sort(height)[len(height) // 2]) < 0.1 * max(float(np.ptp(height)), 1e-12)]
    return np.asarray((ring.min(axis=0) + ring.max(axis=0)) / 2)


def sector_ladder(mesh: TriangleMesh) -> Ladder | None:
    """The convex pieces of a round body, and how they join until one is left; ``None``: it is not round.

    However many are joined, they cover the whole solid.
    """
    solid = enclosed_solid(mesh)
    if solid is None:
        return None
    axis = round_axis(mesh)
    if axis is None:
        return None
    corner_sets: list[FloatArray] = []
    for band in _outline_bands(solid, mesh, axis[1]):
        corner_sets += [
            np.asarray(corner_set.to_mesh64().vert_properties[:, :3]) for corner_set in _angular_sectors(band, *axis)
        ]
    pieces = [piece for corner_set in corner_sets if (piece := hull_of(corner_set)) is not None]
    least_volume = LEAST_VOLUME_FRACTION * solid.volume()
    pieces = [piece for piece in pieces if volume_of(piece) > least_volume]
    if not pieces:
        return None
    return joins_by_volume(pieces)


def _outline_bands(solid: Any, mesh: TriangleMesh, axis: FloatArray) -> list[Any]:
    """The solid cut across its axis at the heights where its outline bends most."""
    heights = np.sort(mesh.referenced_vertices @ axis)
    lower, upper = heights[0], heights[-1]
    levels = np.linspace(lower, upper, 66)[1:-1]
    areas = np.array([_area_at(solid, axis, level) for level in levels])
    # A bend is where the area of the section changes its slope: the floor, a shoulder, a flange.
    area_curvature = np.abs(np.diff(areas, 2))
    cuts: list[float] = []
    for number in np.argsort(area_curvature)[::-1].tolist():
        level = float(levels[number + 1])
        if area_curvature[number] > 0.02 * areas.max() and all(
            abs(level - cut) > 0.03 * (upper - lower) for cut in cuts
        ):
            cuts.append(level)
        if len(cuts) == MOST_BENDS:
            break
    bands, remaining_solid = [], solid
    for cut in sorted(cuts):
        above, below = remaining_solid.split_by_plane(tuple(axis), cut)
        bands.append(below)
        remaining_solid = above
    return [
        component for band in (*bands, remaining_solid) for component in band.decompose() if component.volume() > 0.0
    ]


def _area_at(solid: Any, axis: FloatArray, level: float) -> float:
    """Area of a section across the axis, by the volume of a thin slice."""
    slice_thickness = 1e-5
    return (
        float(solid.trim_by_plane(tuple(axis), level).trim_by_plane(tuple(-axis), -level - slice_thickness).volume())
        / slice_thickness
    )


def _angular_sectors(solid: Any, point: FloatArray, axis: FloatArray) -> list[Any]:
    """A band as it is where it is nearly convex; else cut by angle around the axis."""
    hull = solid.hull()
    if hull.volume() <= solid.volume() / SOLID_HULL_FRACTION:
        return [solid]
    first_direction = np.eye(3)[(int(np.argmax(axis)) + 1) % 3]
    second_direction = np.cross(axis, first_direction)
    pieces = []
    for number in range(SECTOR_COUNT):
        angles = 2 * np.pi * np.array([number, number + 1]) / SECTOR_COUNT
        begin_normal, end_normal = (
            np.cos(angle) * second_direction - np.sin(angle) * first_direction for angle in angles
        )
        wedge = solid.trim_by_plane(tuple(begin_normal), float(begin_normal @ point)).trim_by_plane(
            tuple(-end_normal), float(-end_normal @ point)
        )
        pieces += [component for component in wedge.decompose() if component.volume() > 0.0]
    return pieces
