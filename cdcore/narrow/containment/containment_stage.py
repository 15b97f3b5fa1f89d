"""Which bodies have a connected part inside a closed other, where their surfaces do not meet: by exact parity.

Solids with disjoint surfaces overlap exactly there. A ball in a box is contained; a rod in an open beaker is not, even
if the beaker's mesh is closed: the cavity is outside the glass.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property, lru_cache
from typing import Final, NamedTuple

import numpy as np

from cdcore.kernels.compiling import become_part_of_caller, hot_kernel, kernel
from cdcore.mesh import TriangleMesh
from cdcore.narrow.containment.closed_parts import connected_parts, parity_is_inside
from cdcore.narrow.containment.ray_parity import (
    UNCERTAIN,
    InsideGrid,
    build_inside_grid,
    point_inside,
    point_state,
)  # fmt: skip
from cdcore.narrow.pair_frames import rows_of_columns
from cdcore.numerics import EPS, ByteArray, FloatArray, IntArray, place_points
from cdcore.protocol import DECIDED, Body, Motion, Verdict

PAD: Final = 1024.0 * EPS
"""How far a point seen from the other body may be from the reference vertices, as a share of both bodies' size: over
twice the sum of 192, to which a rotation's transpose is its inverse (``ORTHONORMAL_KEEP``), and 64 for placing it."""

ROOM_SLACK: Final = 1e-9
"""A part longer than the other's box by less than this share is still asked about."""

PROBES: Final = 4
"""Points tried before the exact answer."""

PROBE_WEIGHTS: Final = np.array([[0.21], [0.33], [0.46]])
"""Where in its face a probe lies: rays through corners and the middles of edges would run along edges of the other."""

FIRST_FRAME: Final = np.zeros(1, dtype=np.int64)

REFUSAL: Final = "refused: containment=False"
"""What ``Detection.containment`` says of every pair where a setting turned the question off."""


class Part(NamedTuple):
    """A connected part of a mesh: outermost vertices (E, 3), points (n, 3) of its faces; metres: its length, and
    how far it lies from the origin at most.
    """

    extremes: FloatArray
    probes: FloatArray
    length: float
    size: float


class Nesting(NamedTuple):
    """A part of the inner body that may lie in the outer one, and the size of both, metres."""

    inner: int
    outer: int
    part: Part
    grid: InsideGrid
    size: float


@lru_cache(maxsize=256)
def parts_of(mesh: TriangleMesh) -> list[Part]:
    """The connected parts of a mesh."""
    parts = []
    for triangles in connected_parts(mesh):
        points, probed = triangles.reshape(-1, 3), np.arange(PROBES) * len(triangles) // PROBES
        extremes = points[np.unique([points.argmin(axis=0), points.argmax(axis=0)])]
        length = float(np.linalg.norm(extremes[:, None] - extremes, axis=2).max())
        probes = (triangles[probed] * PROBE_WEIGHTS).sum(axis=1)
        parts.append(Part(extremes, probes, length, float(np.abs(points).sum(axis=1).max())))
    return parts


@lru_cache(maxsize=256)
def grid_of(mesh: TriangleMesh) -> InsideGrid:
    """What a closed mesh is asked with."""
    return build_inside_grid(mesh.triangles)


class ContainmentStage:
    """Decides containment for pair-frames of ``pairs`` (P, 2) whose surfaces do not meet.

    Where ``asked`` is False every pair is refused.
    """

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, *, asked: bool = True) -> None:
        self._meshes = [body.mesh for body in bodies]
        self._asked, self._pairs = asked, pairs.tolist()
        self.words = tuple(containment_word(bodies[i], bodies[j]) if asked else REFUSAL for i, j in self._pairs)
        """As ``containment_word``, per pair; what lies inside a closed body is found all the same."""

    def mark(self, motion: Motion, frames: IntArray, columns: IntArray, verdict: ByteArray) -> int:
        """Mark as CONTAINED in ``verdict`` (T, P) which of K pair-frames are; returns how many were asked about."""
        if not self._asked:
            return 0
        for column, rows in rows_of_columns(columns):
            left = frames[rows]
            for nesting in self._nestings[column]:
                inside = self._inside(motion, nesting, left).view(np.bool_)
                verdict[left[inside], column] = Verdict.CONTAINED
                left = left[~inside]
        return len(frames)

    @property
    def question(self) -> Callable[[Motion, int], bool] | None:
        """``inside_now``, or ``None`` where containment is not asked."""
        return self.inside_now if self._asked else None

    def inside_now(self, now: Motion, column: int) -> bool:
        """Whether one body of a pair is inside the other in a motion of one frame."""
        for nesting in self._nestings[column]:
            states = self._inside(now, nesting, FIRST_FRAME)
            if states[0]:
                return True
        return False

    @cached_property
    def _nestings(self) -> list[list[Nesting]]:
        """Per pair, the parts that could lie inside the other body at all."""
        return [self._fitting(i, j) + self._fitting(j, i) for i, j in self._pairs]

    def _fitting(self, inner: int, outer: int) -> list[Nesting]:
        """The parts of a body that are no longer than the other one's box, if that is closed."""
        if not self._meshes[outer].is_closed:
            return []
        grid = grid_of(self._meshes[outer])
        longest = np.linalg.norm(grid.box[1] - grid.box[0]) * (1 + ROOM_SLACK)
        parts = [part for part in parts_of(self._meshes[inner]) if part.length <= longest]
        return [Nesting(inner, outer, part, grid, part.size + grid.size) for part in parts]

    def _inside(self, motion: Motion, nesting: Nesting, frames: IntArray) -> ByteArray:
        """1 where the part is inside the other body, else 0, (K,) for K frames without contact."""
        inner, outer, part, grid, size = nesting
        turns, places, states = motion.rotations, motion.translations, np.zeros(len(frames), dtype=np.uint8)
        if mark_held(turns, places, frames, inner, outer, part.extremes, grid.box, size, states):
            decide_by_rays(turns, places, frames, inner, outer, part.probes, grid, size, states)
            for k in np.flatnonzero(states == UNCERTAIN).tolist():
                (point,), surface = (
                    place_points(points, turns[frames[k], body], places[frames[k], body])
                    for points, body in ((part.extremes[:1], inner), (grid.triangles, outer))
                )
                states[k] = point_inside(point, surface)
        return states


def containment_word(a: Body, b: Body) -> str:
    """Whether containment of a pair is decided, as ``Detection.containment`` says it."""
    opened = [body.name for body in (a, b) if not body.mesh.is_closed]
    if opened:
        return f"refused: {_are(opened, 'is open', 'are open')}"
    doubled = [body.name for body in (a, b) if not parity_is_inside(body.mesh)]
    what = "doubled or overlapping faces"
    return f"refused: {_are(doubled, f'has {what}', f'have {what}')}" if doubled else DECIDED


def _are(names: Sequence[str], one: str, several: str) -> str:
    return f"{names[0]} {one}" if len(names) == 1 else f"{' and '.join(sorted(names))} {several}"


@kernel
def mark_held(
    turns: FloatArray, places: FloatArray, frames: IntArray, inner: int, outer: int, extremes: FloatArray,
    box: FloatArray, size: float, states: ByteArray,
) -> int:  # fmt: skip
    """Mark as UNCERTAIN in ``states`` (K,) where the outer body's box (2, 3) may hold all points (E, 3) of the inner
    body; returns how often. Poses (F, n, 3, 3), (F, n, 3); ``size``: of both bodies.
    """
    count = 0
    for k in range(len(frames)):
        margin, held = margin_at(places, frames[k], inner, outer, size), True
        for e in range(len(extremes)):
            for i in range(3):
                seen = seen_coordinate(turns, places, frames[k], inner, outer, extremes, e, i)
                if seen < box[0, i] - margin or seen > box[1, i] + margin:
                    held = False
            if not held:
                break
        if held:
            states[k] = UNCERTAIN
            count += 1
    return count


@kernel
def decide_by_rays(
    turns: FloatArray, places: FloatArray, frames: IntArray, inner: int, outer: int, probes: FloatArray,
    grid: InsideGrid, size: float, states: ByteArray,
) -> None:  # fmt: skip
    """Say in ``states`` (K,), where they are UNCERTAIN, on which side of the outer body's surface the inner one's part
    is: it meets no surface, so any of its ``probes`` (n, 3) tells.
    """
    seen = np.empty(3)
    for k in range(len(frames)):
        margin = margin_at(places, frames[k], inner, outer, size)
        for probe in range(len(probes)):
            if states[k] == UNCERTAIN:
                for i in range(3):
                    seen[i] = seen_coordinate(turns, places, frames[k], inner, outer, probes, probe, i)
                states[k] = point_state(grid, seen, margin)


@hot_kernel
def margin_at(places: FloatArray, frame: int, inner: int, outer: int, size: float) -> float:
    """Metres by which a point seen from the other body may be off."""
    become_part_of_caller()
    for i in range(3):
        size += abs(places[frame, inner, i]) + abs(places[frame, outer, i])
    return PAD * size


@hot_kernel
def seen_coordinate(
    turns: FloatArray, places: FloatArray, frame: int, inner: int, outer: int, points: FloatArray, e: int, i: int
) -> float:
    """A coordinate, in the outer body's frame, of a point of the inner body."""
    become_part_of_caller()
    total = 0.0
    for k in range(3):
        way = places[frame, inner, k] - places[frame, outer, k]
        for j in range(3):
            way += turns[frame, inner, k, j] * points[e, j]
        total += turns[frame, outer, k, i] * way
    return total
