"""Level sections of meshes, and the distance at which a body pushed along a level line begins to touch another.

Two bounds enclose that distance, both plain formulas on vertices:

*possible* - farther apart than this, a vertical plane lies between the two bodies at every height;
*sure* - nearer than this, a surface point of the mover lies inside the circle inscribed in the target's outline at its
height, while the rest of the mover's section is outside: the surfaces cross.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sessions.geometry.rotations import Array, rotated_vectors
from sessions.mesh_data import MeshData

# Between two sections the surfaces are bounded by straight edges, so a finer step only narrows the gap between the
# bounds: on the steepest wall here (a flask's, 15 degrees off the vertical) 0.5 mm leaves 0.14 mm.
SECTION_STEP_M = 0.0005

# Only sections whose outermost points could touch within this of the first are searched for a sure contact: the rest
# could only lower the bound, and hulls are what takes the time.
FOREMOST_BAND_M = 0.001

# A section through the outermost points of a rim or a tip is a few points and no outline.
END_INSET_M = 1e-6


@dataclass(frozen=True)
class Approach:
    """When a body pushed along ``direction`` (3,), unit and level, meets an upright turned one; lengths in metres.

    ``height``: of the mover's origin over the target's. ``aside``: the mover's origin lies this far to the right of the
    line through the target's axis, so that its foremost point is on that line. ``sure <= possible``: distances of the
    origins along the direction.
    """

    direction: Array
    height: float
    aside: float
    sure: float
    possible: float

    @property
    def distance(self) -> float:
        """The nominal distance of first contact: half-way between the bounds."""
        return 0.5 * (self.sure + self.possible)

    @property
    def slack(self) -> float:
        """How far either bound is from the nominal distance."""
        return 0.5 * (self.possible - self.sure)

    def origin_at(self, target: ArrayLike, gap: float) -> Array:
        """The mover's origin when it is ``gap`` metres short of first contact (negative: deeper)."""
        right = np.cross(self.direction, (0.0, 1.0, 0.0))
        up = np.array([0.0, self.height, 0.0])
        return np.asarray(target) - (self.distance + gap) * self.direction + self.aside * right + up


def inscribed_radius(points: Array) -> float:
    """Radius of the largest circle about the Y axis inside the convex hull of level points (k, 3); 0 if none."""
    from scipy.spatial import ConvexHull, QhullError

    order = np.unique(points[:, [0, 2]], axis=0)
    try:
        hull = order[ConvexHull(order).vertices]  # counter-clockwise
    except (QhullError, ValueError):  # fewer than three points, or all on a line
        return 0.0
    step = np.roll(hull, -1, axis=0) - hull
    length = np.linalg.norm(step, axis=1)
    distance = (hull[:, 0] * step[:, 1] - hull[:, 1] * step[:, 0]) / length
    return max(0.0, float(distance.min()))


def approach(mover: MeshData, rotation: ArrayLike, target: MeshData, direction: ArrayLike, height: float) -> Approach:
    """Bound the distance at which ``mover``, turned by the quaternion ``rotation``, meets an upright turned target.

    ValueError where the two share no height.
    """
    forward = np.asarray(direction, dtype=np.float64)
    right = np.cross(forward, (0.0, 1.0, 0.0))
    placed = _Posed(rotated_vectors(rotation, mover.vertices) + np.array([0.0, height, 0.0]), mover.faces)
    other = _Posed(target.vertices, target.faces)
    lower, upper = max(placed.bottom, other.bottom), min(placed.top, other.top)
    if not lower < upper:
        raise ValueError(f"mover and target share no height (mover's origin {height} m up); change the height")
    planes = _planes(lower, upper)
    sections = [(placed.section(y), other.section(y)) for y in planes]
    aside, sure = _foremost(sections, forward, right)
    possible = max(
        placed.reach(forward, (below[0], above[0]), span) + other.reach(-forward, (below[1], above[1]), span)
        for (below, above), span in zip(pairwise(sections), pairwise(planes.tolist()), strict=True)
    )
    return Approach(forward, height, aside, sure, float(max(possible, sure)))


def round_in_round(inside: MeshData, outside: MeshData, height: float) -> tuple[float, float]:
    """Bound the distance of two upright turned bodies' axes at which one touches the other's wall from within.

    Returns (sure, possible) in metres, ``possible <= sure``; contact begins at an axis distance between them.
    ``height`` is how far the inner body's origin lies above the outer's. The bounds hold whatever the direction:
    beyond *sure* the inner body's inscribed circle leaves the wall's circumscribed one at some height, below
    *possible* its circumscribed circle is within the wall's inscribed one at every height.
    """
    shift = np.array([0.0, height, 0.0])
    inner, outer = _Posed(inside.vertices + shift, inside.faces), _Posed(outside.vertices, outside.faces)
    lower, upper = inner.bottom, min(inner.top, outer.top)
    planes = _planes(lower, upper, END_INSET_M)
    possible = min(_clear_radius(outer.cuts(y)) - float(_radii(inner.section(y)).max(initial=0.0)) for y in planes)
    sections = [(inner.section(y), outer.section(y)) for y in planes]
    sections = [(rod, wall) for rod, wall in sections if len(rod) > 2 and len(wall) > 2]
    widths = np.array([_radii(wall).max() for _, wall in sections])
    plain = [pair for pair, width in zip(sections, widths, strict=True) if width < 1.01 * np.median(widths)]
    sure = min(_inner_radius(wall) - inscribed_radius(rod) for rod, wall in plain)
    return float(max(sure, possible)), float(possible)


def _planes(lower: float, upper: float, inset: float = 0.0) -> Array:
    return np.linspace(lower + inset, upper - inset, max(2, int(np.ceil((upper - lower) / SECTION_STEP_M)) + 1))


def _radii(points: Array) -> Array:
    return np.hypot(points[:, 0], points[:, 2])


def _clear_radius(wall: Array) -> float:
    """Distance of the axis from the nearest of the segments (k, 2, 3) in which faces cross a level plane."""
    start, step = wall[:, 0][:, [0, 2]], (wall[:, 1] - wall[:, 0])[:, [0, 2]]
    length = np.einsum("ij,ij->i", step, step)
    fraction = np.clip(-np.einsum("ij,ij->i", start, step) / np.where(length > 0.0, length, 1.0), 0.0, 1.0)
    nearest = start + fraction[:, None] * step
    return float(np.hypot(nearest[:, 0], nearest[:, 1]).min(initial=np.inf))


def _inner_radius(wall: Array) -> float:
    """Largest distance of the inner wall from the axis in a section without a spout: the radii fall in two groups."""
    radii = np.sort(_radii(wall))
    return float(radii[np.diff(radii).argmax()])


def _foremost(sections: list[tuple[Array, Array]], forward: Array, right: Array) -> tuple[float, float]:
    """Sideways shift that brings the mover's foremost point onto the line, and the sure distance it then gives."""
    bounds = [_farthest(points, outline, forward) for points, outline in sections]
    near = max(bounds) - FOREMOST_BAND_M
    chosen = [pair for pair, bound in zip(sections, bounds, strict=True) if bound >= near]
    touching = [(points, inscribed_radius(outline)) for points, outline in chosen]
    points, radius = max(touching, key=lambda pair: float((pair[0] @ forward + pair[1]).max()))
    aside = -float(points[(points @ forward + radius).argmax()] @ right)
    sure = -np.inf
    for points, radius in touching:
        across = points @ right + aside
        within = np.abs(across) < radius
        if within.any():
            sure = max(sure, float((points @ forward + np.sqrt(np.maximum(radius**2 - across**2, 0.0)))[within].max()))
    return aside, sure


def _farthest(points: Array, outline: Array, forward: Array) -> float:
    """No distance at which these two sections touch is greater."""
    if not len(points) or not len(outline):
        return -np.inf
    return float((points @ forward).max() + _radii(outline).max())


class _Posed:
    """A mesh in its turned pose, with what sections need at hand."""

    def __init__(self, vertices: Array, faces: NDArray[np.int64]) -> None:
        self._vertices = vertices
        following = np.roll(faces, -1, axis=1)
        self._starts: Array = vertices[faces]  # edges of faces: start and way, (f, 3, 3)
        self._edge_vectors: Array = vertices[following] - self._starts
        heights = np.stack([self._starts[..., 1], vertices[following, 1]])
        self._lowest, self._highest = heights.min(axis=0), heights.max(axis=0)
        self._once = (faces < following) & (self._edge_vectors[..., 1] != 0.0)  # of a closed mesh: each edge once
        self.bottom, self.top = float(vertices[:, 1].min()), float(vertices[:, 1].max())

    def section(self, height: float) -> Array:
        """Points (k, 3) in which edges cross or touch a level plane."""
        return self._crossed(height, self._once & (self._lowest <= height) & (self._highest >= height))

    def cuts(self, height: float) -> Array:
        """Segments (k, 2, 3) in which faces cross a level plane that goes through none of their corners."""
        return self._crossed(height, (self._lowest < height) & (self._highest >= height)).reshape(-1, 2, 3)

    def _crossed(self, height: float, edges: NDArray[np.bool_]) -> Array:
        start, direction = self._starts[edges], self._edge_vectors[edges]
        return start + ((height - start[:, 1]) / direction[:, 1])[:, None] * direction

    def reach(self, direction: Array, sections: tuple[Array, Array], heights: tuple[float, float]) -> float:
        """Farthest the surface between two level planes extends along a direction (-inf where there is none)."""
        points = self._vertices
        between = points[(points[:, 1] >= heights[0]) & (points[:, 1] <= heights[1])]
        return max((float((block @ direction).max()) for block in (*sections, between) if len(block)), default=-np.inf)
