"""Which bodies lie wholly inside another, where their surfaces do not meet: exact parity, asked only of closed meshes.

A ball in a box is contained; a rod in an open beaker is not, even if the beaker's mesh is closed: the cavity is
outside the glass.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cdcore.mesh import TriangleMesh
from cdcore.narrow.containment_kernels import INSIDE, UNCERTAIN, contained_states, count_cells, fill_cells
from cdcore.narrow.ray_parity import point_inside
from cdcore.numerics import EPS, FloatArray, place_points
from cdcore.protocol import DECIDED, Body, Motion

MARGIN_ULPS: Final = 1024.0
"""How far a point seen from the other body may be from the points that count, in eps of both bodies' size.

The transpose of a rotation is its inverse to 192 eps (``ORTHONORMAL_KEEP``), applied to a distance of at most both
sizes; the roundings of both ways of placing a point add less than 64. Twice the sum, generously.
"""

PROBES_PER_COMPONENT: Final = 4
"""Vertices tried before the exact answer: from one of them a ray may run along an edge, hardly from four."""

MOST_CELLS: Final = 256
"""Cells per side of the grid over a mesh: finer ones gain nothing below a million faces."""


class ContainmentStage:
    """Decides containment for pair-frames whose surfaces do not meet.

    Parameters
    ----------
    bodies : N bodies.
    pairs : (P, 2) body numbers.
    """

    def __init__(self, bodies: Sequence[Body], pairs: NDArray[np.int64]) -> None:
        self._solids = [_Solid(body.mesh) for body in bodies]
        self._pairs = pairs.tolist()
        self.words = tuple(containment_word(bodies[i], bodies[j]) for i, j in self._pairs)
        """Per pair ``decided`` or ``refused: <name> is open``; what lies inside a closed one is found all the same."""

    def contained(self, motion: Motion, frames: NDArray[np.int64], columns: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Whether one body of the pair is wholly inside the other, (K,) for K pair-frames without contact."""
        inside = np.zeros(len(frames), dtype=np.bool_)
        for column in np.unique(columns).tolist():
            rows = np.flatnonzero(columns == column)
            i, j = self._pairs[column]
            for inner, outer in ((i, j), (j, i)):
                left = rows[~inside[rows]]
                inside[left] = self._inside(motion, inner, outer, frames[left])
        return inside

    def _inside(self, motion: Motion, inner: int, outer: int, frames: NDArray[np.int64]) -> NDArray[np.bool_]:
        a, b = self._solids[inner], self._solids[outer]
        if not b.mesh.is_closed or not len(frames):
            return np.zeros(len(frames), dtype=np.bool_)
        ra, ta = motion.rotations[frames, inner], motion.translations[frames, inner]
        rb, tb = motion.rotations[frames, outer], motion.translations[frames, outer]
        grid = b.grid
        states = np.empty(len(frames), dtype=np.int8)
        contained_states(
            ra,
            ta,
            rb,
            tb,
            a.extremes,
            a.probes,
            b.box,
            b.mesh.triangles,
            grid.low,
            grid.scale,
            grid.grow,
            grid.cells,
            grid.start,
            grid.items,
            a.size + b.size,
            MARGIN_ULPS * EPS,
            states,
        )
        inside: NDArray[np.bool_] = states == INSIDE
        for k in np.flatnonzero(states == UNCERTAIN).tolist():
            inside[k] = wholly_inside(a.mesh, (ra[k], ta[k]), b.mesh, (rb[k], tb[k]))
        return inside


def containment_word(a: Body, b: Body) -> str:
    """Whether containment of a pair is decided, as ``Detection.containment`` says it."""
    opened = [body.name for body in (a, b) if not body.mesh.is_closed]
    if not opened:
        return DECIDED
    return f"refused: {opened[0]} is open" if len(opened) == 1 else f"refused: {' and '.join(sorted(opened))} are open"


def wholly_inside(
    inner: TriangleMesh,
    inner_pose: tuple[FloatArray, FloatArray],
    outer: TriangleMesh,
    outer_pose: tuple[FloatArray, FloatArray],
) -> bool:
    """Whether every component of one mesh is inside a closed other that it does not meet; exact about the points that
    count.

    Choose it for single poses; it places the whole outer mesh. Poses are (rotation, translation).
    """
    surface = place_points(outer.vertices, *outer_pose)[outer.faces]
    starts = place_points(_component_vertices(inner, 1)[:, 0], *inner_pose)
    return all(point_inside(start, surface) for start in starts)


@dataclass(frozen=True, eq=False)
class _Grid:
    """Triangles by the cells of their projection along each axis: ``start`` (3, cells^2 + 1), ``items`` (3, ...)."""

    low: FloatArray
    scale: FloatArray
    grow: float
    cells: int
    start: NDArray[np.int64]
    items: NDArray[np.int32]


class _Solid:
    """What the containment of or in one mesh needs, made when it is first needed."""

    def __init__(self, mesh: TriangleMesh) -> None:
        self.mesh = mesh

    @cached_property
    def box(self) -> FloatArray:
        points = self.mesh.referenced_vertices
        return np.stack([points.min(axis=0), points.max(axis=0)])

    @cached_property
    def size(self) -> float:
        return float(np.linalg.norm(np.abs(self.mesh.referenced_vertices).max(axis=0)))

    @cached_property
    def extremes(self) -> FloatArray:
        points = self.mesh.referenced_vertices
        extremes: FloatArray = points[np.unique([points.argmin(axis=0), points.argmax(axis=0)])]
        return extremes

    @cached_property
    def probes(self) -> FloatArray:
        return _component_vertices(self.mesh, PROBES_PER_COMPONENT)

    @cached_property
    def grid(self) -> _Grid:
        return _grid(self.mesh.triangles, self.box)


def _component_vertices(mesh: TriangleMesh, count: int) -> FloatArray:
    """(C, count, 3) vertices of each connected component, spread over its faces."""
    order = np.argsort(mesh.components, kind="stable")
    _, first, sizes = np.unique(mesh.components[order], return_index=True, return_counts=True)
    spread = first[:, None] + (np.arange(count) * sizes[:, None]) // count
    corner = np.arange(count) % 3
    return np.ascontiguousarray(mesh.vertices[mesh.faces[order[spread], corner]])


def _grid(triangles: FloatArray, box: FloatArray) -> _Grid:
    cells = int(min(max(np.sqrt(len(triangles) / 2), 1), MOST_CELLS))
    extent = float((box[1] - box[0]).max())
    # Cells overlap by a thousandth of the mesh, far more than any margin; a larger margin is answered exactly instead.
    grow = extent * 1e-3
    low, scale = np.empty((3, 2)), np.empty((3, 2))
    start = np.empty((3, cells * cells + 1), dtype=np.int64)
    lists = []
    for w in range(3):
        u, v = (w + 1) % 3, (w + 2) % 3
        plane = [u, v]
        low[w] = box[0, plane] - 2 * grow
        span = box[1, plane] - box[0, plane] + 4 * grow
        scale[w] = cells / span if extent > 0 else 0.0
        total = count_cells(triangles, u, v, low[w], scale[w], grow, cells, start[w])
        items = np.empty(total, dtype=np.int32)
        fill_cells(triangles, u, v, low[w], scale[w], grow, cells, start[w], items)
        lists.append(items)
    items = np.zeros((3, max(len(one) for one in lists)), dtype=np.int32)
    for w, one in enumerate(lists):
        items[w, : len(one)] = one
    return _Grid(low, scale, grow, cells, start, items)
