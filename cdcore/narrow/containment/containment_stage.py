"""Which bodies lie wholly inside a closed other, where their surfaces do not meet: decided by exact parity.

A ball in a box is contained; a rod in an open beaker is not, even if the beaker's mesh is closed: the cavity is
outside the glass.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Final

import numpy as np

from cdcore.kernels.compiling import hot_kernel, kernel, stay_one_function
from cdcore.kernels.memory import Memory, doubles_of
from cdcore.mesh import TriangleMesh
from cdcore.narrow.containment.closed_parts import parity_is_inside
from cdcore.narrow.containment.ray_parity import (
    INSIDE,
    OUTSIDE,
    UNCERTAIN,
    InsideGrid,
    build_inside_grid,
    point_inside,
    point_state,
)  # fmt: skip
from cdcore.narrow.pair_frames import rows_of_columns
from cdcore.numerics import EPS, BoolArray, ByteArray, FloatArray, IntArray, place_points
from cdcore.protocol import DECIDED, Body, Motion, Verdict

MARGIN_ULPS: Final = 1024.0
"""How far a point seen from the other body may be from the reference vertices, in eps of both bodies' size: over twice
the sum of 192, to which a rotation's transpose is its inverse (``ORTHONORMAL_KEEP``), and 64 for placing a point twice.
"""

PAD: Final = MARGIN_ULPS * EPS

ROOM_SLACK: Final = 1e-9
"""A body longer than the other's box by less than this share is still asked about."""

PROBES_PER_COMPONENT: Final = 4
"""Vertices tried before the exact answer: from one of them a ray may run along an edge, hardly from four."""

FIRST_FRAME: Final = np.zeros(1, dtype=np.int64)

Pose = tuple[FloatArray, FloatArray]

REFUSAL: Final = "refused: containment=False"
"""What ``Detection.containment`` says of every pair where a setting turned the question off."""


class ContainmentStage:
    """Decides containment for pair-frames of ``pairs`` (P, 2) whose surfaces do not meet.

    Where ``asked`` is False every pair is refused, with ``refusal`` as the reason.
    """

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, *, asked: bool = True, refusal: str = REFUSAL) -> None:
        self._asked = asked
        self._solids = [_Solid(body.mesh) for body in bodies] if asked else []
        self._pairs, self._may_now = pairs.tolist(), np.empty(1, dtype=np.bool_)
        self.words = tuple(containment_word(bodies[i], bodies[j]) if asked else refusal for i, j in self._pairs)
        """As ``containment_word``, per pair; what lies inside a closed body is found all the same."""

    def mark(self, motion: Motion, frames: IntArray, columns: IntArray, verdict: ByteArray) -> int:
        """Mark as CONTAINED in ``verdict`` (T, P) which of K pair-frames are; returns how many were asked about."""
        inside = self.contained(motion, frames, columns)
        verdict[frames[inside], columns[inside]] = Verdict.CONTAINED
        return len(frames) if self._asked else 0

    def contained(self, motion: Motion, frames: IntArray, columns: IntArray) -> BoolArray:
        """Whether one body of the pair is wholly inside the other, (K,) for K pair-frames without contact."""
        inside = np.zeros(len(frames), dtype=np.bool_)
        for column, rows in rows_of_columns(columns) if self._asked else ():
            for inner, outer in self._nestings[column]:
                left = rows[~inside[rows]]
                inside[left] = self._inside(motion, inner, outer, frames[left])
        return inside

    @property
    def question(self) -> Callable[[Motion, int], bool] | None:
        """``inside_now``, or ``None`` where containment is not asked."""
        return self.inside_now if self._asked else None

    def inside_now(self, now: Motion, column: int) -> bool:
        """The same for one pair in a motion of one frame."""
        for inner, outer in self._nestings[column]:
            self._fill_may(now, inner, outer, FIRST_FRAME, self._may_now)
            if self._may_now[0] and self._inside(now, inner, outer, FIRST_FRAME)[0]:
                return True
        return False

    @cached_property
    def _nestings(self) -> list[list[tuple[int, int]]]:
        """Per pair, which body could lie in which at all: (inner, outer)."""
        solids, ways = self._solids, [((i, j), (j, i)) for i, j in self._pairs]
        return [[one for one in two if solids[one[1]].has_room_for(solids[one[0]])] for two in ways]

    def _fill_may(self, motion: Motion, inner: int, outer: int, frames: IntArray, may: BoolArray) -> None:
        a, b = self._solids[inner], self._solids[outer]
        may_be_inside(
            motion.rotations, motion.translations, frames, inner, outer, a.extremes, b.box, a.size + b.size, PAD, may
        )

    def _inside(self, motion: Motion, inner: int, outer: int, frames: IntArray) -> BoolArray:
        a, b = self._solids[inner], self._solids[outer]
        inside, may = np.zeros(len(frames), dtype=np.bool_), np.empty(len(frames), dtype=np.bool_)
        self._fill_may(motion, inner, outer, frames, may)
        rows = np.flatnonzero(may)
        if len(rows):
            states = np.empty(len(rows), dtype=np.uint8)
            nesting_states(
                motion.rotations, motion.translations, frames[rows], inner, outer, a.probes, b.grid, a.size + b.size,
                PAD, states,
            )  # fmt: skip
            inside[rows] = states == INSIDE
            for k in rows[states == UNCERTAIN].tolist():
                of_a, of_b = (
                    (motion.rotations[frames[k], o], motion.translations[frames[k], o]) for o in (inner, outer)
                )
                inside[k] = wholly_inside(a.mesh, of_a, b.mesh, of_b)
        return inside


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


def wholly_inside(inner: TriangleMesh, inner_pose: Pose, outer: TriangleMesh, outer_pose: Pose) -> bool:
    """Whether every component of one mesh is inside a closed other that it does not meet, by exact arithmetic.

    Choose it for single poses; it places the whole outer mesh. Poses are (rotation, translation).
    """
    surface = place_points(outer.vertices, *outer_pose)[outer.faces]
    starts = place_points(_component_vertices(inner, 1)[:, 0], *inner_pose)
    return all(point_inside(start, surface) for start in starts)


class _Solid:
    """What the containment of or in one mesh needs, made when it is first needed."""

    def __init__(self, mesh: TriangleMesh) -> None:
        self.mesh = mesh

    def has_room_for(self, other: _Solid) -> bool:
        """Whether the other could lie inside at all: this one is closed and its box is as long as the other is."""
        if not self.mesh.is_closed:
            return False
        apart = other.extremes[:, None] - other.extremes
        longest = float(np.sqrt((apart**2).sum(axis=2)).max())
        return longest <= float(np.linalg.norm(self.box[1] - self.box[0])) * (1 + ROOM_SLACK)

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
    def grid(self) -> InsideGrid:
        return build_inside_grid(self.mesh.triangles)


def _component_vertices(mesh: TriangleMesh, count: int) -> FloatArray:
    """(C, count, 3) vertices of each connected component, spread over its faces."""
    order = np.argsort(mesh.components, kind="stable")
    _, first, sizes = np.unique(mesh.components[order], return_index=True, return_counts=True)
    spread = first[:, None] + (np.arange(count) * sizes[:, None]) // count
    corner = np.arange(count) % 3
    return np.ascontiguousarray(mesh.vertices[mesh.faces[order[spread], corner]])


@hot_kernel
def way_to_point(
    points: Memory, e: int, turns: Memory, places: Memory, a: int, b: int
) -> tuple[float, float, float]:  # fmt: skip
    """The way from the origin of a body with pose ``b`` to point ``e`` of one with pose ``a``, world axes."""
    p, q, r = points[3 * e], points[3 * e + 1], points[3 * e + 2]
    t, v, w = 9 * a, 3 * a, 3 * b
    x = turns[t] * p + turns[t + 1] * q + turns[t + 2] * r + (places[v] - places[w])
    y = turns[t + 3] * p + turns[t + 4] * q + turns[t + 5] * r + (places[v + 1] - places[w + 1])
    z = turns[t + 6] * p + turns[t + 7] * q + turns[t + 8] * r + (places[v + 2] - places[w + 2])
    return x, y, z


@hot_kernel
def point_in_box(
    points: Memory, e: int, turns: Memory, places: Memory, a: int, b: int, box: Memory, margin: float
) -> bool:
    """Whether point ``e`` of a body with pose ``a`` may lie in the box (6,), low and high, of one with pose ``b``."""
    stay_one_function()
    x, y, z = way_to_point(points, e, turns, places, a, b)
    for k in range(3):
        seen = turns[9 * b + k] * x + turns[9 * b + 3 + k] * y + turns[9 * b + 6 + k] * z
        if seen < box[k] - margin or seen > box[3 + k] + margin:
            return False
    return True


@hot_kernel
def largest_of(places: Memory, pose: int) -> float:
    """Largest absolute coordinate of the translation of one pose."""
    x, y, z = abs(places[3 * pose]), abs(places[3 * pose + 1]), abs(places[3 * pose + 2])
    largest: float = max(max(x, y), z)
    return largest


@kernel
def may_be_inside(
    rotation: FloatArray, translation: FloatArray, frames: IntArray, inner: int, outer: int, extremes: FloatArray,
    box: FloatArray, size: float, pad: float, may: BoolArray,
) -> None:  # fmt: skip
    """Fill ``may`` (K,): False where an outermost vertex of the inner body lies outside the box of the outer one.

    ``extremes`` (E, 3) of the inner body and ``box`` (2, 3); the margin is ``pad`` times both bodies' size.
    """
    turns, places, points, ends = doubles_of(rotation), doubles_of(translation), doubles_of(extremes), doubles_of(box)
    bodies = rotation.shape[1]
    for k in range(len(frames)):
        a, b = frames[k] * bodies + inner, frames[k] * bodies + outer
        margin = pad * (size + (largest_of(places, a) + largest_of(places, b)))
        may[k] = True
        for e in range(len(extremes)):
            if not point_in_box(points, e, turns, places, a, b, ends, margin):
                may[k] = False
                break


@kernel
def nesting_states(
    rotation: FloatArray, translation: FloatArray, frames: IntArray, inner: int, outer: int, probes: FloatArray,
    grid: InsideGrid, size: float, pad: float, states: ByteArray,
) -> None:  # fmt: skip
    """Fill ``states`` (K,): whether all components of the inner body are INSIDE the outer one.

    A component meets no surface, so any of its ``probes`` (C, 4, 3), along any axis, tells about it.
    """
    turns, places, points = doubles_of(rotation), doubles_of(translation), doubles_of(probes)
    bodies, seen = rotation.shape[1], np.empty(3)
    for k in range(len(frames)):
        a, b = frames[k] * bodies + inner, frames[k] * bodies + outer
        margin, whole = pad * (size + (largest_of(places, a) + largest_of(places, b))), INSIDE
        for component in range(len(probes)):
            state = UNCERTAIN
            for probe in range(PROBES_PER_COMPONENT * component, PROBES_PER_COMPONENT * (component + 1)):
                x, y, z = way_to_point(points, probe, turns, places, a, b)
                for i in range(3):
                    seen[i] = turns[9 * b + i] * x + turns[9 * b + 3 + i] * y + turns[9 * b + 6 + i] * z
                for axis in range(3):
                    if state == UNCERTAIN:
                        state = point_state(grid, seen, margin, axis)
            whole = max(whole, state) if state != OUTSIDE else OUTSIDE
            if whole == OUTSIDE:
                break
        states[k] = whole
