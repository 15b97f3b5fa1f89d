"""Decides whether a connected part of a body is inside another, where their surfaces do not meet.

Solids with disjoint surfaces overlap exactly there. A ball in a box is contained; a rod in an open beaker is not, even
if the beaker's mesh is closed: the cavity is outside the glass.

Sound closed meshes are decided by exact parity of rays. Where parity refuses, because of holes, doubled faces, or parts
that cross or lie in each other, the winding number decides, or the answer is UNRESOLVED: it is never CLEAR by default.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Final, NamedTuple

import numpy as np

from cdcore.containment.closed_parts import connected_components, parity_is_inside
from cdcore.containment.inner_parts import (
    AT_HOLE,
    BESIDE,
    InnerComponents,
    OuterBoxes,
    fill_clearances,
    reach_of_component,
)
from cdcore.containment.inside_by_winding import (
    MAY_REACH,
    UNDECIDED,
    decide_by_winding,
    hulls_separated,
    outline_of,
    side_of_component,
    side_of_surface,
    worse,
)
from cdcore.containment.placed_points import margin_at, margin_of, point_in_outer
from cdcore.containment.ray_parity import (
    INSIDE,
    OUTSIDE,
    UNCERTAIN,
    InsideGrid,
    build_inside_grid,
    crossed_faces,
    point_inside,
    point_state,
)
from cdcore.containment.winding_surface import ComponentKind, winding_surface
from cdcore.kernels.compiling import hot_kernel, kernel
from cdcore.mesh import TriangleMesh, once_a_mesh
from cdcore.narrow.bvh.box_tree import BoxTree, build_box_trees
from cdcore.narrow.bvh.whole_motion import FrameLooks, MotionSearch
from cdcore.narrow.pair_frames import rows_of_columns
from cdcore.numerics import ByteArray, FloatArray, IntArray
from cdcore.poses import place_points, relative_pose
from cdcore.protocol import DECIDED, INSIDE_UNDECIDED, PARTLY_DECIDED, REFUSED, Body, Motion, Verdict

ROOM_SLACK: Final = 1e-9
"""A part longer than the other's box by less than this share is still asked about."""

WORTH_A_FILTER: Final = 3
"""Parts that may lie in the other body: from so many on, one look at all of them saves more than it takes."""

PROBES: Final = 4
"""Points tried before the exact answer."""

PROBE_WEIGHTS: Final = np.array([[0.21], [0.33], [0.46]])
"""Where in its face a probe lies: rays through corners and the middles of edges would run along edges of the other."""

FIRST_FRAME: Final = np.zeros(1, dtype=np.int64)

REFUSAL: Final = f"{REFUSED}containment=False"
"""What ``Detection.containment`` says of every pair where a setting turned the question off."""


class Component(NamedTuple):
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
    component: Component
    boxes: FloatArray
    grid: InsideGrid
    size: float


class NestingGroup(NamedTuple):
    """All nestings of one body in another: their parts, the box of the outer body, and the largest of their sizes."""

    nestings: list[Nesting]
    components: InnerComponents
    boxes: OuterBoxes
    size: float

    @property
    def ends(self) -> tuple[int, int]:
        """Numbers of the inner and the outer body."""
        return self.nestings[0].inner, self.nestings[0].outer

    @property
    def is_simple(self) -> bool:
        """Whether there is one nesting in one box: its clearance alone says whether the box may hold it."""
        return len(self.nestings) == 1 and len(self.nestings[0].boxes) == 1


@once_a_mesh
def components_of(mesh: TriangleMesh) -> list[Component]:
    """The connected parts of a mesh."""
    components = []
    for triangles in connected_components(mesh):
        points, probed = triangles.reshape(-1, 3), np.arange(PROBES) * len(triangles) // PROBES
        extremes = points[np.unique([points.argmin(axis=0), points.argmax(axis=0)])]
        length = float(np.linalg.norm(extremes[:, None] - extremes, axis=2).max())
        probes = (triangles[probed] * PROBE_WEIGHTS).sum(axis=1)
        box = np.stack([points.min(axis=0), points.max(axis=0)])
        components.append(Component(extremes, box, probes, length, float(np.abs(points).sum(axis=1).max())))
    return components


@once_a_mesh
def grid_of(mesh: TriangleMesh) -> InsideGrid:
    """The grid of a closed mesh that rays are cast through."""
    return build_inside_grid(mesh.triangles)


@once_a_mesh
def parity_decides(mesh: TriangleMesh) -> bool:
    """Whether parity of rays tells inside from outside of a mesh."""
    return mesh.is_closed and parity_is_inside(mesh)


@once_a_mesh
def inner_components_of(mesh: TriangleMesh) -> InnerComponents:
    """The connected parts of a mesh in arrays, for the winding number of the other body."""
    return components_in_arrays(components_of(mesh))


def components_in_arrays(components: Sequence[Component]) -> InnerComponents:
    """Parts as kernels read them."""
    counts = np.array([[len(component.probes), len(component.extremes)] for component in components])
    first_point = np.concatenate([[0], np.cumsum(counts.sum(axis=1))])
    boxes = np.array([component.box for component in components])
    lower, upper = boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)
    return InnerComponents(
        boxes=boxes,
        points=np.concatenate(
            [points for component in components for points in (component.probes, component.extremes)]
        ),
        first_point=first_point,
        first_extreme=first_point[:-1] + counts[:, 0],
        centre=0.5 * (lower + upper),
        radius=float(np.linalg.norm(0.5 * (upper - lower))),
    )


@once_a_mesh
def farthest_corner(mesh: TriangleMesh) -> float:
    """How far a mesh reaches from the origin of its body at most, metres."""
    return float(np.abs(mesh.referenced_vertices).sum(axis=1).max())


class WindingQuestion:
    """Asks whether a part of one body is inside another that parity refuses, in frames without contact."""

    def __init__(self, inner: int, outer: int, meshes: Sequence[TriangleMesh]) -> None:
        self._ends, self._bodies = (inner, outer), len(meshes)
        self._inner_mesh = meshes[inner]
        self._components, self._surface = inner_components_of(meshes[inner]), winding_surface(meshes[outer])
        self._boxes = OuterBoxes(self._surface.boxes, self._surface.holes, self._surface.first_hole)
        self._outlines = outline_of(meshes[inner]), outline_of(meshes[outer])
        self._size = farthest_corner(meshes[inner]) + farthest_corner(meshes[outer])

    def states(self, motion: Motion, frames: IntArray) -> IntArray:
        """INSIDE, OUTSIDE or UNDECIDED, (K,) for K frames."""
        states = np.zeros(len(frames), dtype=np.int64)
        near = ~(clearances_over(motion, frames, self._ends, self._components, self._boxes, self._size) > 0.0)
        if not near.any():
            return states
        states[near] = self._by_points(motion, frames[near])
        reaching = np.flatnonzero(states == MAY_REACH)
        if len(reaching):
            meet = self._caps_over_motion.decide(motion.take(frames[reaching])).hits[:, 0]
            states[reaching] = np.where(meet, UNDECIDED, OUTSIDE)
        return states

    def state_now(self, now: Motion) -> tuple[int, float]:
        """INSIDE, OUTSIDE or UNDECIDED in a motion of one frame, and metres of motion for which OUTSIDE stays."""
        # Few arrays: to hand over those of both surfaces takes ten times as long as to compare boxes (2026-11).
        clearance = float(clearances_over(now, FIRST_FRAME, self._ends, self._components, self._boxes, self._size)[0])
        if clearance > 0.0:
            return OUTSIDE, clearance
        state = int(self._by_points(now, FIRST_FRAME)[0])
        if state != MAY_REACH:
            return state, 0.0
        meet, _ = self._caps_now.decide(now, 0, 0.0)
        return (UNDECIDED if meet == Verdict.CONTACT else OUTSIDE), 0.0

    def _by_points(self, motion: Motion, frames: IntArray) -> IntArray:
        """The same as far as points of the parts tell; MAY_REACH where caps must be asked."""
        states = np.zeros(len(frames), dtype=np.int64)
        poses = motion.rotations, motion.translations
        decide_by_winding(
            poses, frames, self._ends, self._components, self._surface, self._outlines, self._size, states
        )
        for k in np.flatnonzero(states == UNCERTAIN).tolist():
            states[k] = self._exactly(motion, int(frames[k]))
        return states

    @property
    def has_caps(self) -> bool:
        """Whether the outer body has holes that caps close."""
        return len(self._surface.caps) > 0

    @cached_property
    def cap_trees(self) -> list[BoxTree]:
        """The tree of the inner body at its number, those of the caps at all others."""
        caps = self._surface.caps
        inner, of_caps = build_box_trees([np.ascontiguousarray(self._inner_mesh.triangles), caps])
        return [inner if body == self._ends[0] else of_caps for body in range(self._bodies)]

    @cached_property
    def _caps_over_motion(self) -> MotionSearch:
        """Whether the inner body meets caps of the outer one, over a motion."""
        return MotionSearch(self.cap_trees, np.array([self._ends]))

    @cached_property
    def _caps_now(self) -> FrameLooks:
        """The same of one frame after another."""
        return FrameLooks(self.cap_trees, np.array([self._ends]))

    def _exactly(self, motion: Motion, frame: int) -> int:
        """The same in one frame, from crossings of rays with placed faces, counted in whole numbers."""
        inner, outer = self._ends
        rotations, translations, components = motion.rotations, motion.translations, self._components
        margin = margin_of(translations[frame], inner, outer, self._size)
        rotation, move = relative_pose(
            rotations[frame, outer], translations[frame, outer], rotations[frame, inner], translations[frame, inner]
        )
        placed = place_points(self._surface.grid.triangles, rotations[frame, outer], translations[frame, outer])
        state = OUTSIDE
        for component in range(len(components.boxes)):
            reach = reach_of_component(components, component, self._boxes, rotation, move, margin)
            if reach == BESIDE:
                continue
            # Vertices alone: where a point on a face lies is rounded.
            own = components.points[components.first_extreme[component] : components.first_point[component + 1]]
            points = place_points(own, rotations[frame, inner], translations[frame, inner])
            side = MAY_REACH if reach == AT_HOLE else UNDECIDED
            for local, point in zip(own @ rotation.T + move, points, strict=True):
                crossings = np.zeros(len(self._surface.kinds), dtype=np.int64)
                numbers, facings = crossed_faces(point, placed)
                np.add.at(crossings, self._surface.component[numbers], facings)
                point_side = side_of_surface(self._surface, local, margin, crossings)
                side = side_of_component(side, point_side, reach == AT_HOLE)
                if side == INSIDE or (side == OUTSIDE and reach != AT_HOLE):
                    break
            state = worse(state, side)
        if state in (UNDECIDED, MAY_REACH) and hulls_separated(self._outlines, rotation, move, margin):
            return OUTSIDE
        return int(state)


class ContainmentStage:
    """Decides containment for pair-frames of ``pairs`` (P, 2) whose surfaces do not meet.

    Where ``enabled`` is False every pair is refused.
    """

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, *, enabled: bool = True) -> None:
        self._meshes = [body.mesh for body in bodies]
        self._enabled, self._pairs = enabled, pairs.tolist()
        self.labels = tuple(containment_word(bodies[i], bodies[j]) if enabled else REFUSAL for i, j in self._pairs)
        """As ``containment_word``, per pair; what lies inside a closed body is found all the same."""

    def mark(self, motion: Motion, frames: IntArray, columns: IntArray, verdict: ByteArray) -> int:
        """Mark as CONTAINED or UNRESOLVED in ``verdict`` (T, P) which of K pair-frames are; returns how many it asked.

        All of them must be CLEAR as far as surfaces tell.
        """
        if not self._enabled:
            return 0
        for column, rows in rows_of_columns(columns):
            left = frames[rows]
            for group in self._nestings[column]:
                near = self._frames_near(motion, group, left)
                for nesting in group.nestings if len(near) else ():
                    inside = self._inside(motion, nesting, near).view(np.bool_)
                    verdict[near[inside], column] = Verdict.CONTAINED
                    near = near[~inside]
                left = left[verdict[left, column] != Verdict.CONTAINED]
            for question in self.winding_questions[column]:
                states = question.states(motion, left)
                verdict[left[states == UNDECIDED], column] = Verdict.UNRESOLVED
                verdict[left[states == INSIDE], column] = Verdict.CONTAINED
                left = left[states != INSIDE]
        return len(frames)

    @property
    def question(self) -> Callable[[Motion, int, float], tuple[Verdict, float]] | None:
        """``verdict_now``, or ``None`` where containment is not asked."""
        return self.verdict_now if self._enabled else None

    def verdict_now(self, now: Motion, column: int, clearance: float = 0.0) -> tuple[Verdict, float]:
        """CONTAINED, CLEAR or UNRESOLVED for a pair whose surfaces do not meet, in a motion of one frame.

        Beside it, the metres by which points may move against each other while it certainly stays CLEAR;
        ``clearance``: what is left of those of an earlier frame.
        """
        if clearance > 0.0:
            return Verdict.CLEAR, clearance
        verdict, clearance = Verdict.CLEAR, np.inf
        for group in self._nestings[column]:
            stays = float(clearances_over(now, FIRST_FRAME, group.ends, group.components, group.boxes, group.size)[0])
            clearance = min(clearance, stays)
            if stays <= 0.0 and any(self._inside_now(now, group, nesting) for nesting in group.nestings):
                return Verdict.CONTAINED, 0.0
        for question in self.winding_questions[column]:
            state, stays = question.state_now(now)
            clearance = min(clearance, stays)
            if state == INSIDE:
                return Verdict.CONTAINED, 0.0
            if state == UNDECIDED:
                verdict = Verdict.UNRESOLVED
        return verdict, clearance

    @cached_property
    def holed(self) -> list[int]:
        """Pairs whose answer may change though no surfaces meet, as one body can pass through a hole of the other."""
        if not self._enabled:
            return []
        holed = [has_holes(mesh) for mesh in self._meshes]
        return [column for column, (i, j) in enumerate(self._pairs) if holed[i] or holed[j]]

    @cached_property
    def winding_questions(self) -> list[list[WindingQuestion]]:
        """Per pair, what is asked of the winding number; nothing where parity decides."""
        return [
            [
                WindingQuestion(inner, outer, self._meshes)
                for inner, outer in ((i, j), (j, i))
                if not parity_decides(self._meshes[outer]) and len(winding_surface(self._meshes[outer]).kinds)
            ]
            for i, j in self._pairs
        ]

    @cached_property
    def _nestings(self) -> list[list[NestingGroup]]:
        """Per pair, the parts that could lie inside the other body at all."""
        return [
            [
                group_of(nestings)
                for nestings in (self._possible_nestings(i, j), self._possible_nestings(j, i))
                if nestings
            ]
            for i, j in self._pairs
        ]

    def _frames_near(self, motion: Motion, group: NestingGroup, frames: IntArray) -> IntArray:
        """Those of K frames in which the outer body's box may hold a part of the group; all of them where few parts
        are asked about.
        """
        if len(group.nestings) < WORTH_A_FILTER:
            return frames
        clearances = clearances_over(motion, frames, group.ends, group.components, group.boxes, group.size)
        return frames[~(clearances > 0.0)]

    def _possible_nestings(self, inner: int, outer: int) -> list[Nesting]:
        """The parts of a body that are no longer than the box of a part of the other one, if parity decides there."""
        if not parity_decides(self._meshes[outer]):
            return []
        grid = grid_of(self._meshes[outer])
        boxes = np.array([component.box for component in components_of(self._meshes[outer])])
        room = np.linalg.norm(boxes[:, 1] - boxes[:, 0], axis=1) * (1 + ROOM_SLACK)
        nestings = []
        for component in components_of(self._meshes[inner]):
            large = boxes[room >= component.length]
            holding_boxes = large if len(boxes) == 1 else np.concatenate([grid.box[None], large])
            if len(large):
                nestings.append(Nesting(inner, outer, component, holding_boxes, grid, component.size + grid.size))
        return nestings

    def _inside(self, motion: Motion, nesting: Nesting, frames: IntArray) -> ByteArray:
        """1 where the part is inside the other body, else 0, (K,) for K frames without contact."""
        inner, outer, component, boxes, _, size = nesting
        poses, states = (motion.rotations, motion.translations), np.zeros(len(frames), dtype=np.uint8)
        if mark_fitting(poses, frames, (inner, outer), component.extremes, boxes, size, states):
            self._decide_fitting(motion, nesting, frames, states)
        return states

    def _inside_now(self, now: Motion, group: NestingGroup, nesting: Nesting) -> bool:
        """Whether a part of a group without clearance is inside the other body, in a motion of one frame."""
        if not group.is_simple:
            return bool(self._inside(now, nesting, FIRST_FRAME)[0])
        states = np.full(1, UNCERTAIN, dtype=np.uint8)
        self._decide_fitting(now, nesting, FIRST_FRAME, states)
        return bool(states[0])

    def _decide_fitting(self, motion: Motion, nesting: Nesting, frames: IntArray, states: ByteArray) -> None:
        """Say where ``states`` (K,) are UNCERTAIN whether the part is inside; exactly where rounding leaves it open."""
        inner, outer, component, _, grid, size = nesting
        rotations, translations = motion.rotations, motion.translations
        decide_by_rays((rotations, translations), frames, (inner, outer), component.probes, grid, size, states)
        for k in np.flatnonzero(states == UNCERTAIN).tolist():
            (point,), surface = (
                place_points(points, rotations[frames[k], body], translations[frames[k], body])
                for points, body in ((component.extremes[:1], inner), (grid.triangles, outer))
            )
            states[k] = point_inside(point, surface)


def group_of(nestings: list[Nesting]) -> NestingGroup:
    """The nestings of one body in another as a group."""
    no_holes = np.zeros((0, 2, 3)), np.zeros(2, dtype=np.int64)
    return NestingGroup(
        nestings=nestings,
        components=components_in_arrays([nesting.component for nesting in nestings]),
        boxes=OuterBoxes(nestings[0].grid.box[None], *no_holes),
        size=max(nesting.size for nesting in nestings),
    )


def clearances_over(
    motion: Motion, frames: IntArray, ends: tuple[int, int], components: InnerComponents, boxes: OuterBoxes, size: float
) -> FloatArray:
    """Metres by which points of one body may move in each of K frames before a part can lie in a box or at a hole of
    the other, (K,); not positive where one may lie there already.
    """
    clearances = np.empty(len(frames))
    fill_clearances((motion.rotations, motion.translations), frames, ends, components, boxes, size, clearances)
    return clearances


def has_holes(mesh: TriangleMesh) -> bool:
    """Whether a mesh has a part with holes."""
    return not parity_decides(mesh) and bool((winding_surface(mesh).kinds != ComponentKind.CLOSED).any())


def containment_word(a: Body, b: Body) -> str:
    """Whether containment of a pair is decided everywhere, as ``Detection.containment`` says it."""
    causes = []
    for body in sorted((a, b), key=lambda body: body.name):
        cause = doubt(body.mesh)
        if cause:
            causes.append(f"{body.name} {cause}")
    return f"{PARTLY_DECIDED}{INSIDE_UNDECIDED}{' and '.join(causes)}" if causes else DECIDED


def doubt(mesh: TriangleMesh) -> str:
    """Why it may be undecided what is inside a mesh, as a verb and its object; "" where it always is decided."""
    if parity_decides(mesh):
        return ""
    surface = winding_surface(mesh)
    causes = []
    if (surface.kinds != ComponentKind.CLOSED).any():
        causes.append("has holes")
    if surface.opposed.any():
        causes.append("has crossing parts of opposite winding")
    return " and ".join(causes)


@kernel
def mark_fitting(
    poses: tuple[FloatArray, FloatArray],
    frames: IntArray,
    ends: tuple[int, int],
    extremes: FloatArray,
    boxes: FloatArray,
    size: float,
    states: ByteArray,
) -> int:
    """Mark as UNCERTAIN in ``states`` (K,) where boxes (B, 2, 3) of the outer body may hold all points (E, 3) of the
    inner one, as in a ``Nesting``; returns how often. Poses (F, n, 3, 3), (F, n, 3); ``ends``: the inner and the outer
    body; ``size``: of both.
    """
    (rotations, translations), (inner, outer) = poses, ends
    count = 0
    for k in range(len(frames)):
        margin = margin_at(translations, frames[k], inner, outer, size)
        fits = box_holds(rotations, translations, frames[k], inner, outer, extremes, boxes[0], margin)
        if fits and len(boxes) > 1:
            fits = False
            for b in range(1, len(boxes)):
                fits = fits or box_holds(rotations, translations, frames[k], inner, outer, extremes, boxes[b], margin)
        if fits:
            states[k] = UNCERTAIN
            count += 1
    return count


@hot_kernel
def box_holds(
    rotations: FloatArray,
    translations: FloatArray,
    frame: int,
    inner: int,
    outer: int,
    extremes: FloatArray,
    box: FloatArray,
    margin: float,
) -> bool:
    """Whether a box (2, 3) of the outer body may hold all points (E, 3) of the inner one."""
    for e in range(len(extremes)):
        x, y, z = point_in_outer(rotations, translations, frame, inner, outer, extremes, e)
        # What is not a number is kept: in poses far out a difference may be none.
        outside = (x < box[0, 0] - margin) | (x > box[1, 0] + margin)
        outside |= (y < box[0, 1] - margin) | (y > box[1, 1] + margin)
        outside |= (z < box[0, 2] - margin) | (z > box[1, 2] + margin)
        if outside:
            return False
    return True


@kernel
def decide_by_rays(
    poses: tuple[FloatArray, FloatArray],
    frames: IntArray,
    ends: tuple[int, int],
    probes: FloatArray,
    grid: InsideGrid,
    size: float,
    states: ByteArray,
) -> None:
    """Say in ``states`` (K,), where they are UNCERTAIN, on which side of the outer body's surface the inner one's part
    is: it meets no surface, so any of its ``probes`` (n, 3) tells. ``poses`` and ``ends``: as of ``mark_fitting``.
    """
    (rotations, translations), (inner, outer) = poses, ends
    point = np.empty(3)
    for k in range(len(frames)):
        margin = margin_at(translations, frames[k], inner, outer, size)
        for probe in range(len(probes)):
            if states[k] == UNCERTAIN:
                point[0], point[1], point[2] = point_in_outer(
                    rotations, translations, frames[k], inner, outer, probes, probe
                )
                states[k] = point_state(grid, point, margin)
