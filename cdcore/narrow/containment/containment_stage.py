"""Which bodies have a connected part inside a closed other, where their surfaces do not meet: by exact parity.

Solids with disjoint surfaces overlap exactly there. A ball in a box is contained; a rod in an open beaker is not, even
if the beaker's mesh is closed: the cavity is outside the glass.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Final, NamedTuple

import numpy as np

from cdcore.kernels.compiling import become_part_of_caller, hot_kernel, kernel
from cdcore.mesh import TriangleMesh, once_a_mesh
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
    """A connected part of a mesh: outermost vertices (E, 3), its box (2, 3), points (n, 3) of its faces; metres: its
    length, and how far it lies from the origin at most.
    """

    extremes: FloatArray
    box: FloatArray
    probes: FloatArray
    length: float
    size: float


class Nesting(NamedTuple):
    """A part of the inner body that may lie in the outer one, of which a box (B, 2, 3) must hold it: the first, and one
    of the others if there are any; and the size of both, metres.
    """

    inner: int
    outer: int
    part: Part
    boxes: FloatArray
    grid: InsideGrid
    size: float


@once_a_mesh
def parts_of(mesh: TriangleMesh) -> list[Part]:
    """The connected parts of a mesh."""
    parts = []
    for triangles in connected_parts(mesh):
        points, probed = triangles.reshape(-1, 3), np.arange(PROBES) * len(triangles) // PROBES
        extremes = points[np.unique([points.argmin(axis=0), points.argmax(axis=0)])]
        length = float(np.linalg.norm(extremes[:, None] - extremes, axis=2).max())
        probes = (triangles[probed] * PROBE_WEIGHTS).sum(axis=1)
        box = np.stack([points.min(axis=0), points.max(axis=0)])
        parts.append(Part(extremes, box, probes, length, float(np.abs(points).sum(axis=1).max())))
    return parts


@once_a_mesh
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
        """The parts of a body that are no longer than the box of a part of the other one, if that is closed."""
        if not self._meshes[outer].is_closed:
            return []
        grid = grid_of(self._meshes[outer])
        boxes = np.array([part.box for part in parts_of(self._meshes[outer])])
        room = np.linalg.norm(boxes[:, 1] - boxes[:, 0], axis=1) * (1 + ROOM_SLACK)
        nestings = []
        for part in parts_of(self._meshes[inner]):
            large = boxes[room >= part.length]
            held_by = large if len(boxes) == 1 else np.concatenate([grid.box[None], large])
            if len(large):
                nestings.append(Nesting(inner, outer, part, held_by, grid, part.size + grid.size))
        return nestings

    def _inside(self, motion: Motion, nesting: Nesting, frames: IntArray) -> ByteArray:
        """1 where the part is inside the other body, else 0, (K,) for K frames without contact."""
        inner, outer, part, boxes, grid, size = nesting
        turns, places, states = motion.rotations, motion.translations, np.zeros(len(frames), dtype=np.uint8)
        if mark_held(turns, places, frames, inner, outer, part.extremes, boxes, size, states):
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
    boxes: FloatArray, size: float, states: ByteArray,
) -> int:  # fmt: skip
    """Mark as UNCERTAIN in ``states`` (K,) where boxes (B, 2, 3) of the outer body may hold all points (E, 3) of the
    inner one, as in a ``Nesting``; returns how often. Poses (F, n, 3, 3), (F, n, 3); ``size``: of both bodies.
    """
    count = 0
    for k in range(len(frames)):
        margin = margin_at(places, frames[k], inner, outer, size)
        held = box_holds(turns, places, frames[k], inner, outer, extremes, boxes[0], margin)
        if held and len(boxes) > 1:
            held = False
            for b in range(1, len(boxes)):
                held = held or box_holds(turns, places, frames[k], inner, outer, extremes, boxes[b], margin)
        if held:
            states[k] = UNCERTAIN
            count += 1
    return count


@kernel
def box_holds(
    turns: FloatArray, places: FloatArray, frame: int, inner: int, outer: int, extremes: FloatArray, box: FloatArray,
    margin: float,
) -> bool:  # fmt: skip
    """Whether a box (2, 3) of the outer body may hold all points (E, 3) of the inner one."""
    for e in range(len(extremes)):
        x, y, z = seen_point(turns, places, frame, inner, outer, extremes, e)
        # What is not a number is kept: in poses far out a difference may be none.
        outside = (x < box[0, 0] - margin) | (x > box[1, 0] + margin)
        outside |= (y < box[0, 1] - margin) | (y > box[1, 1] + margin)
        outside |= (z < box[0, 2] - margin) | (z > box[1, 2] + margin)
        if outside:
            return False
    return True


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
                seen[0], seen[1], seen[2] = seen_point(turns, places, frames[k], inner, outer, probes, probe)
                states[k] = point_state(grid, seen, margin)


@hot_kernel
def margin_at(places: FloatArray, frame: int, inner: int, outer: int, size: float) -> float:
    """Metres by which a point seen from the other body may be off."""
    become_part_of_caller()
    for i in range(3):
        size += abs(places[frame, inner, i]) + abs(places[frame, outer, i])
    return PAD * size


@hot_kernel
def seen_point(
    turns: FloatArray, places: FloatArray, frame: int, inner: int, outer: int, points: FloatArray, e: int
) -> tuple[float, float, float]:
    """A point of the inner body in the outer body's frame."""
    become_part_of_caller()
    x = y = z = 0.0
    for k in range(3):
        way = places[frame, inner, k] - places[frame, outer, k]
        for j in range(3):
            way += turns[frame, inner, k, j] * points[e, j]
        x += turns[frame, outer, k, 0] * way
        y += turns[frame, outer, k, 1] * way
        z += turns[frame, outer, k, 2] * way
    return x, y, z
