"""Which bodies have a connected part inside a closed other, where their surfaces do not meet: by exact parity.

Solids with disjoint surfaces overlap exactly there. A ball in a box is contained; a rod in an open beaker is not, even
if the beaker's mesh is closed: the cavity is outside the glass.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Final

import numpy as np

from cdcore.kernels.compiling import kernel
from cdcore.kernels.memory import doubles_of
from cdcore.mesh import TriangleMesh
from cdcore.narrow.containment.closed_parts import connected_parts, parity_is_inside
from cdcore.narrow.containment.nesting_boxes import PoseMemory, largest_of, may_be_inside, way_to_point
from cdcore.narrow.containment.ray_parity import (
    INSIDE,
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
the sum of 192, to which a rotation's transpose is its inverse (``ORTHONORMAL_KEEP``), and 64 for placing it twice."""

PAD: Final = MARGIN_ULPS * EPS

ROOM_SLACK: Final = 1e-9
"""A part longer than the other's box by less than this share is still asked about."""

PROBES_PER_PART: Final = 4
"""Vertices tried before the exact answer: from one of them a ray may run along an edge, hardly from four."""

FIRST_FRAME: Final = np.zeros(1, dtype=np.int64)

Pose = tuple[FloatArray, FloatArray]
REFUSAL: Final = "refused: containment=False"
"""What ``Detection.containment`` says of every pair where a setting turned the question off."""


class ContainmentStage:
    """Decides containment for pair-frames of ``pairs`` (P, 2) whose surfaces do not meet.

    Where ``asked`` is False every pair is refused.
    """

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, *, asked: bool = True) -> None:
        self._asked = asked
        self.solids = [_Solid(body.mesh) for body in bodies] if asked else []
        self.pairs, self._may_now = pairs.tolist(), np.empty(1, dtype=np.bool_)
        self.words = tuple(containment_word(bodies[i], bodies[j]) if asked else REFUSAL for i, j in self.pairs)
        """As ``containment_word``, per pair; what lies inside a closed body is found all the same."""

    def mark(self, motion: Motion, frames: IntArray, columns: IntArray, verdict: ByteArray) -> int:
        """Mark as CONTAINED in ``verdict`` (T, P) which of K pair-frames are; returns how many were asked about."""
        inside = self.contained(motion, frames, columns)
        verdict[frames[inside], columns[inside]] = Verdict.CONTAINED
        return len(frames) if self._asked else 0

    def contained(self, motion: Motion, frames: IntArray, columns: IntArray) -> BoolArray:
        """Whether a part of one body of the pair is inside the other, (K,) for K pair-frames without contact."""
        inside = np.zeros(len(frames), dtype=np.bool_)
        for column, rows in rows_of_columns(columns if self._asked else columns[:0]):
            at = frames[rows]
            for inner, outer, parts in self.nestings[column]:
                left = np.flatnonzero(~inside[rows])
                inside[rows[left]] = self.inside(motion, inner, outer, parts, at[left])
        return inside

    @property
    def question(self) -> Callable[[Motion, int], bool] | None:
        """``inside_now``, or ``None`` where containment is not asked."""
        return self.inside_now if self._asked else None

    def inside_now(self, now: Motion, column: int) -> bool:
        """The same for one pair in a motion of one frame."""
        for inner, outer, parts in self.nestings[column]:
            for part in parts:
                self._fill_may(now, inner, outer, part.extremes, FIRST_FRAME, self._may_now)
                if self._may_now[0] and self.inside(now, inner, outer, (part,), FIRST_FRAME)[0]:
                    return True
        return False

    @cached_property
    def nestings(self) -> list[list[tuple[int, int, list[_Part]]]]:
        """Per pair, which parts of which body could lie in which at all: (inner, outer, parts)."""
        solids, ways = self.solids, [((i, j), (j, i)) for i, j in self.pairs]
        fitting = [[(i, j, solids[i].parts_that_fit(solids[j])) for i, j in two] for two in ways]
        return [[one for one in two if one[2]] for two in fitting]

    def _fill_may(
        self, motion: Motion, inner: int, outer: int, points: FloatArray, rows: IntArray, may: BoolArray
    ) -> None:
        """Fill ``may`` (K,): whether all these points of the inner body are in the box of a part of the outer."""
        a, b, turn, place = self.solids[inner], self.solids[outer], motion.rotations, motion.translations
        may_be_inside(turn, place, rows, inner, outer, points, b.boxes, a.size + b.size, PAD, may)

    def inside(self, motion: Motion, inner: int, outer: int, parts: Sequence[_Part], rows: IntArray) -> BoolArray:
        """Whether one of these parts of a body is inside the other, (K,) for K frames without contact."""
        turn, place, a, b = motion.rotations, motion.translations, self.solids[inner], self.solids[outer]
        inside, near = np.zeros(len(rows), dtype=np.bool_), np.arange(len(rows))
        for part in parts:
            may = np.empty(len(near), dtype=np.bool_)
            self._fill_may(motion, inner, outer, part.extremes, rows[near], may)
            left = near[may]
            if len(left):
                states = np.empty(len(left), dtype=np.uint8)
                nesting_states(turn, place, rows[left], inner, outer, part.probes, b.grid, a.size + b.size, PAD, states)
                inside[left] = states == INSIDE
                for k in left[states == UNCERTAIN].tolist():
                    of_a, of_b = ((turn[rows[k], side], place[rows[k], side]) for side in (inner, outer))
                    inside[k] = _any_inside(part.probes[:1], of_a, b.mesh, of_b)
                near = near[~inside[near]]
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


def any_part_inside(inner: TriangleMesh, inner_pose: Pose, outer: TriangleMesh, outer_pose: Pose) -> bool:
    """Whether a connected part of one mesh is inside a closed other that it does not meet, by exact arithmetic.

    Choose it for single poses; it places the whole outer mesh. Poses are (rotation, translation).
    """
    return _any_inside(np.array([part[0, 0] for part in connected_parts(inner)]), inner_pose, outer, outer_pose)


def _any_inside(points: FloatArray, pose: Pose, outer: TriangleMesh, outer_pose: Pose) -> bool:
    surface = place_points(outer.vertices, *outer_pose)[outer.faces]
    return any(point_inside(point, surface) for point in place_points(points, *pose))


class _Part:
    """A connected part of a mesh: its outermost vertices (E, 3), and vertices (n, 3) spread over its faces."""

    def __init__(self, triangles: FloatArray) -> None:
        points, probe = triangles.reshape(-1, 3), np.arange(PROBES_PER_PART)
        self.extremes: FloatArray = points[np.unique([points.argmin(axis=0), points.argmax(axis=0)])]
        self.probes: FloatArray = triangles[probe * len(triangles) // PROBES_PER_PART, probe % 3]
        self.length = float(np.linalg.norm(self.extremes[:, None] - self.extremes, axis=2).max())


class _Solid:
    """What the containment of or in one mesh needs, made when it is first needed."""

    def __init__(self, mesh: TriangleMesh) -> None:
        self.mesh = mesh

    def parts_that_fit(self, outer: _Solid) -> list[_Part]:
        """The parts that could lie inside one of the other at all: it is closed, and that one's box as long as they."""
        if not outer.mesh.is_closed:
            return []
        most = float(np.linalg.norm(np.diff(outer.boxes, axis=1)[-len(outer.parts) :], axis=2).max()) * (1 + ROOM_SLACK)
        return [self.parts[k] for k in np.flatnonzero(self._lengths <= most)]

    @cached_property
    def parts(self) -> list[_Part]:
        return [_Part(triangles) for triangles in connected_parts(self.mesh)]

    @cached_property
    def _lengths(self) -> FloatArray:
        return np.array([part.length for part in self.parts])

    @cached_property
    def boxes(self) -> FloatArray:
        """(B, 2, 3): the box of the body; of several parts their boxes too, one of which holds what lies inside."""
        parts = [part.extremes for part in self.parts] if len(self.parts) > 1 else []
        return np.array([[some.min(axis=0), some.max(axis=0)] for some in (self.mesh.referenced_vertices, *parts)])

    @cached_property
    def size(self) -> float:
        return float(np.linalg.norm(np.abs(self.mesh.referenced_vertices).max(axis=0)))

    @cached_property
    def grid(self) -> InsideGrid:
        return build_inside_grid(self.mesh.triangles)


@kernel
def nesting_states(
    rotation: FloatArray, translation: FloatArray, frames: IntArray, inner: int, outer: int, probes: FloatArray,
    grid: InsideGrid, size: float, pad: float, states: ByteArray,
) -> None:  # fmt: skip
    """Fill ``states`` (K,): whether a part of the inner body is INSIDE the outer one.

    A part meets no surface, so any of its ``probes`` (n, 3), along any axis, tells about it.
    """
    poses, points = PoseMemory(doubles_of(rotation), doubles_of(translation)), doubles_of(probes)
    bodies, turns, seen = rotation.shape[1], poses.turns, np.empty(3)
    for k in range(len(frames)):
        a, b = frames[k] * bodies + inner, frames[k] * bodies + outer
        margin, state = pad * (size + (largest_of(poses.places, a) + largest_of(poses.places, b))), UNCERTAIN
        for probe in range(len(probes)):
            x, y, z = way_to_point(points, probe, poses, a, b)
            for i in range(3):
                seen[i] = turns[9 * b + i] * x + turns[9 * b + 3 + i] * y + turns[9 * b + 6 + i] * z
            for axis in range(3):
                if state == UNCERTAIN:
                    state = point_state(grid, seen, margin, axis)
        states[k] = state
