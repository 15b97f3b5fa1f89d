"""A hollow body of any form cut by planes into parts that are nearly convex, however many that takes.

Choose it where a body is not round: unlike the pieces of V-HACD its pieces cover the whole solid, and it takes seconds
where CoACD takes a minute. Fewer pieces come from joining them, by volume or by the motion of a session.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from cdcore.bounding.hull import hull_of
from cdcore.mesh import TriangleMesh
from cdcore.numerics import FloatArray
from replay.cutting.convex_solids import enclosed_solid, volume_of
from replay.cutting.joins import Ladder, joins_by_volume

if TYPE_CHECKING:
    from manifold3d import Manifold

MOST_REGIONS: Final = 96
"""Regions after which no more are cut."""

HULL_EXCESS_FRACTION: Final = 0.005
"""Fraction of the body's volume that hulls of all regions may add before no more are cut."""

PLANE_NORMALS: Final = np.array(
    [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 0, -1), (1, 1, 0), (1, -1, 0), (0, 1, 1), (0, 1, -1)], dtype=float
)
"""Normals of planes: the axes, and halfway between two of them."""

LEVELS_PER_NORMAL: Final = 3
"""Planes of each direction at the levels at which most corners lie."""

EXTENT_FRACTIONS: Final = (0.25, 0.5, 0.75)
"""Planes of each direction at these fractions of the extent of a region."""

LEAST_VOLUME_FRACTION: Final = 1e-6
"""Fraction of the volume of a body below which a region is a rounding of the cuts."""

PLANE_ROUNDING: Final = 1e-6
"""Fraction by which equal volumes may differ."""

PIECES_VERSION: Final = "1"
"""Of the pieces that this module makes; another one whenever they change, so that kept ones are made again."""


def plane_ladder(mesh: TriangleMesh) -> Ladder | None:
    """The pieces of a body, and how they join until one is left; ``None``: it is no solid."""
    solid = enclosed_solid(mesh)
    if solid is None:
        return None
    pieces = [hull for region in _convex_regions(solid) if (hull := hull_of(_corners(region))) is not None]
    least_volume = LEAST_VOLUME_FRACTION * solid.volume()
    pieces = [piece for piece in pieces if volume_of(piece) > least_volume]
    return joins_by_volume(pieces) if pieces else None


def _convex_regions(solid: Manifold) -> list[Manifold]:
    """The solid cut until the hulls of its regions add next to nothing, the region whose hull adds most first."""
    excess_and_region = [(_hull_excess(region), region) for region in solid.decompose()]
    allowed_excess, spent_excess = HULL_EXCESS_FRACTION * solid.volume(), 0.0
    finished_regions: list[Manifold] = []
    while (
        excess_and_region
        and len(excess_and_region) + len(finished_regions) < MOST_REGIONS
        and sum(excess for excess, _ in excess_and_region) + spent_excess > allowed_excess
    ):
        excess_and_region.sort(key=lambda item: item[0])
        excess, region = excess_and_region.pop()
        halves = best_cut(region)
        # A ring cut in two has hulls that add as much as its own: only the next cut pays.
        if not halves or sum(half_excess for half_excess, _ in halves) > excess * (1.0 + PLANE_ROUNDING):
            finished_regions.append(region)
            spent_excess += excess
        else:
            excess_and_region += halves
    return [*finished_regions, *(region for _, region in excess_and_region)]


def cut_in_two(piece: TriangleMesh, solid: Manifold) -> list[TriangleMesh]:
    """The pieces of what a convex piece holds of a solid, cut by one plane; fewer than two: no plane helps."""
    from manifold3d import Manifold

    halves = best_cut(solid ^ Manifold.hull_points(piece.vertices))
    least_volume = LEAST_VOLUME_FRACTION * solid.volume()
    hulls = [
        hull for _, half in halves if half.volume() > least_volume and (hull := hull_of(_corners(half))) is not None
    ]
    return hulls if len(hulls) > 1 else []


def best_cut(region: Manifold) -> list[tuple[float, Manifold]]:
    """The components on both sides of the plane that leaves least for hulls to add, each with what its hull adds."""
    corners, best_halves, least_excess = _corners(region), [], np.inf
    for normal in PLANE_NORMALS / np.linalg.norm(PLANE_NORMALS, axis=1, keepdims=True):
        for plane_level in _levels(corners @ normal):
            sides = region.split_by_plane(tuple(normal), plane_level)
            halves = [(_hull_excess(side), side) for side in sides if not side.is_empty()]
            excess = sum(half_excess for half_excess, _ in halves)
            if len(halves) == 2 and excess < least_excess:
                best_halves, least_excess = halves, excess
    return [
        (_hull_excess(piece), piece) for _, half in best_halves for piece in half.decompose() if piece.volume() > 0.0
    ]


def _levels(heights: FloatArray) -> list[float]:
    """Levels at which most corners lie, and some between the ends."""
    lower, upper = float(heights.min()), float(heights.max())
    height_bins = np.round((heights - lower) / max(upper - lower, 1e-12) * 1000.0).astype(np.int64)
    corners_in_bin = np.bincount(height_bins, minlength=1001)
    corners_in_bin[[*range(11), *range(990, 1001)]] = 0
    most_cut_levels = [
        step for step in np.argsort(-corners_in_bin, kind="stable")[:LEVELS_PER_NORMAL].tolist() if corners_in_bin[step]
    ]
    # The level of the corners themselves, not of the step: a plane beside a floor leaves a sliver of it.
    at_corners = [float(np.median(heights[height_bins == step])) for step in most_cut_levels]
    return [*at_corners, *(lower + fraction * (upper - lower) for fraction in EXTENT_FRACTIONS)]


def _hull_excess(region: Manifold) -> float:
    """Cubic metres that the hull of a region adds to it."""
    return float(region.hull().volume() - region.volume())


def _corners(region: Manifold) -> FloatArray:
    return np.asarray(region.to_mesh64().vert_properties[:, :3])
