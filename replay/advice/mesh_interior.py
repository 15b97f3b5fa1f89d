"""The inside of a mesh, for bodies that its surface does not meet, by rays and by the rims of its openings.

The exact detector reports a body as contained in a connected component of a surface that is closed, or that lost a
few faces; within a component with an opening, such as a beaker of one wall, it reports nothing, since nobody can tell
whether that is filled. So a body is inside here where contact is reported for it.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sessions import MeshData

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

RAY_COUNT: Final = 40
"""Directions in which a point looks for a way out of a component."""

RAYS_OF_THE_INSIDE: Final = 5
"""Of the first so many all must leave a closed component an odd number of times for a point that is inside."""

RAYS_OF_THE_OUTSIDE: Final = 20
"""So many rays that meet nothing prove the outside of a surface with holes: inside, at most a third leaves by one."""

MOST_CORNERS_AT_HOLES: Final = 12
"""Corners of a body, at most, that must all be outside of a component with holes: it may reach in by a hole."""

MOST_RIM_EDGES: Final = 6
"""A hole with more edges around it is an opening, where it is not tiny."""

TINY_HOLE_FRACTION: Final = 1.01e-3
"""Of a component's area: smaller holes may be a crack or a lost face."""

LARGEST_CAP_FRACTION: Final = 0.101
"""Of a component's area: holes that are larger together are openings, whatever their rims."""


def sphere_directions(direction_count: int) -> Array:
    """Returns unit vectors (count, 3) evenly about a sphere, along a spiral that turns by the golden angle."""
    height = 1.0 - (2.0 * np.arange(direction_count) + 1.0) / direction_count
    angle = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(direction_count)
    radius = np.sqrt(1.0 - height * height)
    return np.stack([radius * np.cos(angle), height, radius * np.sin(angle)], axis=1)


RAY_DIRECTIONS: Final = sphere_directions(RAY_COUNT)
"""Unit vectors (``RAY_COUNT``, 3) of the rays."""


@dataclass(frozen=True, eq=False)
class SurfaceComponent:
    """A connected component of a surface.

    Parameters
    ----------
    triangles : (f, 3, 3).
    is_closed : every edge belongs to two faces.
    has_opening : a hole is too large to be lost faces.
    """

    triangles: Array
    is_closed: bool
    has_opening: bool

    def holds(self, corners: Array) -> bool | None:
        """Returns whether a body of one component with these corners (n, 3) is inside; ``None``: unknown."""
        if self.has_opening:
            return False
        if self.is_closed:
            return self._holds_point(corners[0])
        sampled_corners = np.linspace(0, len(corners) - 1, min(MOST_CORNERS_AT_HOLES, len(corners))).astype(np.intp)
        return False if all(self._holds_point(corner) is False for corner in corners[sampled_corners]) else None

    def _holds_point(self, point: Array) -> bool | None:
        """Whether a point (3,) is inside; ``None``: rays leave it open."""
        is_inside, escaping_rays = True, 0
        for ray_number, crossings in enumerate(self._crossings_of_rays(point)):
            escaping_rays += crossings == 0
            # A ray that meets nothing proves the outside of a closed component, of one that crosses itself too.
            if escaping_rays >= (1 if self.is_closed else RAYS_OF_THE_OUTSIDE):
                return False
            is_inside &= crossings % 2 == 1
            if is_inside and self.is_closed and ray_number + 1 == RAYS_OF_THE_INSIDE:
                return True
        return None

    @cached_property
    def _edges(self) -> tuple[Array, Array, Array]:
        """The first corner of each face and its two edges from there, (f, 3) each."""
        base = self.triangles[:, 0]
        return base, self.triangles[:, 1] - base, self.triangles[:, 2] - base

    def _crossings_of_rays(self, point: Array) -> Iterator[int]:
        """Number of faces that each ray from a point meets.

        Source: Moeller and Trumbore, "Fast, minimum storage ray/triangle intersection", 1997.
        """
        first_corners, first_edges, second_edges = self._edges
        offset = point - first_corners
        second_normal = np.cross(offset, first_edges)
        scaled_distance = (second_edges * second_normal).sum(axis=1)
        for direction in RAY_DIRECTIONS:
            normal = np.cross(direction, second_edges)
            with np.errstate(divide="ignore", invalid="ignore"):
                inverse_determinant = 1.0 / (first_edges * normal).sum(axis=1)
                u = (offset * normal).sum(axis=1) * inverse_determinant
                v = (second_normal @ direction) * inverse_determinant
                distance = scaled_distance * inverse_determinant
                crossings = (u >= 0) & (v >= 0) & (u + v <= 1) & (distance > 0)
            yield int(np.count_nonzero(crossings))


class MeshInterior:
    """The connected components of a mesh: their points, and whether a component of another mesh is inside one."""

    def __init__(self, mesh: MeshData) -> None:
        self._vertices = mesh.vertices
        self._faces = np.asarray(mesh.faces, dtype=np.intp)
        self._bounds = mesh.bounds

    def component_points(self) -> tuple[Array, Indices]:
        """Returns the corners (n, 3) of all components, one after the other, and where each begins, (p,)."""
        return self._vertices[self._order], self._starts

    def holds(self, points: Array, component_starts: Indices) -> bool | None:
        """Returns whether a component of a body is inside, of ``component_points`` in the axes of this mesh.

        ``None``: holes, or components in each other, leave it open.
        """
        lower, upper = np.minimum.reduceat(points, component_starts), np.maximum.reduceat(points, component_starts)
        overlaps_box = ((upper >= self._bounds[0]) & (lower <= self._bounds[1])).all(axis=1)
        if not overlaps_box.any():
            return False
        components = np.split(points, component_starts[1:])
        answers = {self._holds_component(components[number]) for number in np.flatnonzero(overlaps_box)}
        if True in answers:
            return True
        return None if None in answers else False

    def _holds_component(self, corners: Array) -> bool | None:
        """Whether a body of one component with these corners (n, 3) is inside."""
        component_bounds = self._component_bounds
        lower, upper = corners.min(axis=0), corners.max(axis=0)
        overlaps_box = ((upper >= component_bounds[:, 0]) & (lower <= component_bounds[:, 1])).all(axis=1)
        is_within = ((lower >= component_bounds[:, 0]) & (upper <= component_bounds[:, 1])).all(axis=1)
        answers = [
            self._component(number).holds(corners)
            for number in np.flatnonzero(overlaps_box).tolist()
            # Through a hole a body may reach in; into a closed component it cannot.
            if is_within[number] or not self._component(number).is_closed
        ]
        if not any(answer is None or answer for answer in answers):
            return False
        # Of components in each other one may undo what another says.
        return answers[0] if len(answers) == 1 else None

    @cached_property
    def _labels(self) -> Indices:
        """The component of each vertex, numbered by its least vertex, (n,); equal vertices are one."""
        labels = component_labels(self._faces, len(self._vertices))
        if (labels[self._faces] == labels[self._faces[0, 0]]).all():
            return labels
        return component_labels(self._merged_faces, len(self._vertices))[self._merged_vertices]

    @cached_property
    def _order(self) -> Indices:
        """Vertices that faces have, component by component."""
        used_vertices = np.unique(self._faces)
        order: Indices = used_vertices[np.argsort(self._labels[used_vertices], kind="stable")]
        return order

    @cached_property
    def _starts(self) -> Indices:
        """Index in the order at which each component begins, (p,)."""
        labels = self._labels[self._order]
        return np.concatenate([[0], np.flatnonzero(np.diff(labels)) + 1]).astype(np.intp)

    @cached_property
    def _component_bounds(self) -> Array:
        """Least and largest coordinates of each component, (p, 2, 3)."""
        points, starts = self.component_points()
        return np.stack([np.minimum.reduceat(points, starts), np.maximum.reduceat(points, starts)], axis=1)

    @cached_property
    def _merged_vertices(self) -> Indices:
        """For each vertex the least number of those in the same place, (n,)."""
        order = np.lexsort(self._vertices.T)
        ordered = self._vertices[order]
        is_new = np.concatenate([[True], (ordered[1:] != ordered[:-1]).any(axis=1)])
        position = np.cumsum(is_new) - 1
        least_vertex = np.minimum.reduceat(order, np.flatnonzero(is_new))
        merged_of_vertex = np.empty(len(order), dtype=np.intp)
        merged_of_vertex[order] = least_vertex[position]
        return merged_of_vertex

    @cached_property
    def _merged_faces(self) -> Indices:
        """Faces (f, 3) by merged vertices."""
        return self._merged_vertices[self._faces]

    @cached_property
    def _components(self) -> dict[int, SurfaceComponent]:
        return {}

    def _component(self, component_number: int) -> SurfaceComponent:
        if component_number not in self._components:
            label = self._labels[self._order[self._starts[component_number]]]
            faces = self._merged_faces[self._labels[self._faces[:, 0]] == label]
            self._components[component_number] = surface_component(self._vertices, faces)
        return self._components[component_number]


def surface_component(vertices: Array, faces: Indices) -> SurfaceComponent:
    """Returns a connected component of vertices (n, 3) and faces (f, 3), whose equal vertices have one number."""
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    edges = edges[np.lexsort(edges.T)]
    is_new = np.concatenate([[True], (edges[1:] != edges[:-1]).any(axis=1)])
    first_edge_rows = np.flatnonzero(is_new)
    faces_of_edge = np.diff(np.append(first_edge_rows, len(edges)))
    triangles = vertices[faces]
    is_sound = bool((faces_of_edge <= 2).all())
    rim_edges = edges[first_edge_rows[faces_of_edge == 1]]
    has_opening = (
        is_sound and len(rim_edges) > 0 and _is_opening(list(_rims(rim_edges, len(vertices))), vertices, triangles)
    )
    return SurfaceComponent(triangles, is_closed=is_sound and not len(rim_edges), has_opening=has_opening)


def _rims(edges: Indices, count: int) -> Iterator[Indices]:
    """Yields the edges (k, 2) of each rim; none of rims that touch themselves or each other."""
    if (np.bincount(edges.ravel(), minlength=count) > 2).any():
        return
    labels = component_labels(edges, count)[edges[:, 0]]
    for label in np.unique(labels):
        yield edges[labels == label]


def _is_opening(rims: list[Indices], vertices: Array, triangles: Array) -> bool:
    """Whether holes with these rims are too large to be lost faces."""
    cap_areas = [_fan_area(vertices[rim]) for rim in rims]
    closed_area = _area(triangles) + sum(cap_areas)
    large_areas = [area for rim, area in zip(rims, cap_areas, strict=True) if len(rim) > MOST_RIM_EDGES]
    return (
        sum(cap_areas) > LARGEST_CAP_FRACTION * closed_area
        or max(large_areas, default=0.0) > TINY_HOLE_FRACTION * closed_area
    )


def _fan_area(edges: Array) -> float:
    """Square metres of triangles from the middle of a rim to its edges (k, 2, 3)."""
    rim_middle = np.broadcast_to(edges.mean(axis=(0, 1)), edges[:, 0].shape)
    return _area(np.stack([edges[:, 0], edges[:, 1], rim_middle], axis=1))


def _area(triangles: Array) -> float:
    """Square metres of triangles (f, 3, 3)."""
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    return float(np.sqrt((normals * normals).sum(axis=1)).sum() / 2.0)


def component_labels(groups: Indices, number_count: int) -> Indices:
    """Returns the least number in the connected component of each of so many numbers; ``groups`` (k, m) join them."""
    labels = np.arange(number_count)
    while True:
        least_labels = labels[groups].min(axis=1)
        np.minimum.at(labels, groups.ravel(), np.repeat(least_labels, groups.shape[1]))
        labels = labels[labels]
        if (labels[groups] == labels[groups[:, :1]]).all():
            return labels
