"""Is a part of one body inside another, whose surface ray parity refuses? By its winding number, or undecided.

The parts of the inner body meet no face of the outer one. So a part that keeps away from every hole lies on one side of
each part of the outer body, and one point decides. A part near a hole may reach through it: it is inside where any of
its points clearly is, outside where all are and it meets no cap, else undecided. Where a plane keeps the bodies apart,
and so wherever any of their boxes or spheres do, the answer is outside, whatever holes there are: it is the same after
every broad phase.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from cdcore.bounding.hull import hull_of
from cdcore.containment.inner_parts import (
    AT_HOLE,
    BESIDE,
    WITHIN,
    InnerComponents,
    OuterBoxes,
    pose_of_inner,
    reach_of_component,
)
from cdcore.containment.placed_points import margin_at, point_in_outer
from cdcore.containment.ray_parity import INSIDE, OUTSIDE, UNCERTAIN
from cdcore.containment.winding_number import RAY_UNCERTAIN, ray_crossings, winding_number_at
from cdcore.containment.winding_surface import CLOSED, HOLED, OPEN, WindingSurface
from cdcore.kernels.compiling import hot_kernel, kernel, never_inlined
from cdcore.kernels.vectors import dot
from cdcore.mesh import TriangleMesh, once_a_mesh
from cdcore.narrow.published_trees.gjk import NO_PROGRESS, nearest_on_simplex, put
from cdcore.numerics import FloatArray, IntArray

UNDECIDED: Final = 3
"""Beside OUTSIDE, INSIDE and UNCERTAIN: the surface does not tell, whatever the arithmetic."""
MAY_REACH: Final = 4
"""All points that were tried are outside, near a hole: whether the surfaces meet a cap decides."""

HOLED_MARGIN: Final = 1.0 / 3.0
"""How far the winding number of a part with lost faces may be from a whole one: a third is as near to a round hole as
0.44 of its radius."""

OPEN_MARGIN: Final = 0.1
"""The same of a part with an opening, at a point outside its caps. For half a sphere it is 0.15 at the other pole."""

MOST_HULL_STEPS: Final = 64
"""Hulls of a thousand corners settle in twenty; those that go on are within rounding of touching."""


FEW_CORNERS: Final = 48
"""Corners of a hull that are asked first: where their hulls meet, the whole ones do. With all corners of a controller
of 20,000 faces a live sample took 3 times as long."""


@once_a_mesh
def outline_of(mesh: TriangleMesh) -> FloatArray:
    """Points (n, 3) that reach as far as the mesh in every direction: the corners of its hull, the outermost first."""
    hull = hull_of(mesh.referenced_vertices)
    points = mesh.referenced_vertices if hull is None else hull.vertices
    directions = np.random.default_rng(0).normal(size=(FEW_CORNERS, 3))
    outermost = np.unique((points @ directions.T).argmax(axis=0))
    return np.concatenate([points[outermost], np.delete(points, outermost, axis=0)])


@kernel
def decide_by_winding(
    poses: tuple[FloatArray, FloatArray],
    frames: IntArray,
    ends: tuple[int, int],
    components: InnerComponents,
    surface: WindingSurface,
    outlines: tuple[FloatArray, FloatArray],
    size: float,
    states: IntArray,
) -> None:
    """Write to ``states`` (K,) whether a part of one body is INSIDE another in K frames, OUTSIDE or UNDECIDED.

    MAY_REACH stands where caps must be asked, UNCERTAIN where rounding leaves a ray open. ``poses``: (T, N, 3, 3),
    (T, N, 3); ``ends``: the inner body and the outer one; ``outlines`` of both, in this order; ``size``: metres of both
    bodies from their origins.
    """
    rotations, translations = poses
    inner, outer = ends
    crossings = np.zeros(len(surface.kinds), dtype=np.int64)
    only_open = np.all(surface.kinds == OPEN)
    boxes = OuterBoxes(surface.boxes, surface.holes, surface.first_hole)
    point, rotation, move = np.empty(3), np.empty((3, 3)), np.empty(3)
    for k in range(len(frames)):
        frame = frames[k]
        margin = margin_at(translations, frame, inner, outer, size)
        pose_of_inner(rotations, translations, frame, ends, rotation, move)
        states[k] = OUTSIDE
        for i in range(len(components.boxes)):
            reach = reach_of_component(components, i, boxes, rotation, move, margin)
            if reach == BESIDE:
                continue
            state = MAY_REACH if reach == AT_HOLE else UNCERTAIN
            for n in range(components.first_point[i], components.first_point[i + 1]):
                point[0], point[1], point[2] = point_in_outer(
                    rotations, translations, frame, inner, outer, components.points, n
                )
                point_side = UNCERTAIN
                if ray_crossings(surface.grid, surface.component, point, margin, crossings) != RAY_UNCERTAIN:
                    point_side = side_of_surface(surface, point, margin, crossings)
                state = side_of_component(state, point_side, reach == AT_HOLE)
                # For certain nothing is inside a part with an opening: without others no more points are asked.
                if state == INSIDE or (state == OUTSIDE and reach == WITHIN) or (state == UNDECIDED and only_open):
                    break
            states[k] = worse(states[k], state)
            if state == INSIDE:
                break
        if states[k] in (UNDECIDED, MAY_REACH) and hulls_separated(outlines, rotation, move, margin):
            states[k] = OUTSIDE


@hot_kernel
def side_of_surface(surface: WindingSurface, point: FloatArray, margin: float, crossings: IntArray) -> int:
    """INSIDE, OUTSIDE or UNDECIDED for a point (3,) that each closed part goes round ``crossings`` (K,) times."""
    never_inlined()
    total, around, opposed, undecided = 0, False, False, False
    for k in range(len(surface.kinds)):
        beside = False
        for a in range(3):
            beside |= point[a] < surface.boxes[k, 0, a] - margin or point[a] > surface.boxes[k, 1, a] + margin
        if beside:
            continue
        windings = crossings[k]
        if surface.kinds[k] != CLOSED:
            undecided |= not decided_by_component(surface, k, point, windings)
        if windings != 0:
            total, around, opposed = total + windings, True, opposed or surface.opposed[k] != 0
    if undecided or (total == 0 and around and opposed):
        return UNDECIDED
    return INSIDE if total != 0 else OUTSIDE


@hot_kernel
def decided_by_component(surface: WindingSurface, k: int, point: FloatArray, windings: int) -> bool:
    """Whether part ``k``, which has holes and with its caps goes round a point so many times, tells its side."""
    never_inlined()
    lost = surface.kinds[k] == HOLED
    if windings != 0 and not lost:
        return False
    of_caps = winding_number_at(point, surface.caps, surface.first_cap[k], surface.first_cap[k + 1])
    if windings != 0:
        return abs(of_caps) <= HOLED_MARGIN
    # Outside, in front of a hole, the number rises towards one half; beside and behind it, it is below 0.
    in_front = abs(of_caps) if surface.signs[k] == 0 else -surface.signs[k] * of_caps
    return in_front <= (HOLED_MARGIN if lost else OPEN_MARGIN)


@hot_kernel
def side_of_component(so_far: int, point_side: int, at_hole: bool) -> int:
    """The side of a part of which ``point_side`` is that of one more point.

    One point that is inside tells; one that is outside tells where the part keeps away from holes.
    """
    never_inlined()
    if point_side == INSIDE or (point_side == OUTSIDE and not at_hole):
        return point_side
    if point_side == UNDECIDED or (at_hole and point_side == UNCERTAIN):
        return UNDECIDED
    return so_far


@hot_kernel
def worse(first: int, second: int) -> int:
    """The state of a body of which two parts have these: one that is inside decides, then what is open."""
    never_inlined()
    for state in (INSIDE, UNCERTAIN, UNDECIDED, MAY_REACH):
        if first == state or second == state:
            return state
    return OUTSIDE


@kernel
def hulls_separated(
    outlines: tuple[FloatArray, FloatArray], rotation: FloatArray, move: FloatArray, margin: float
) -> bool:
    """Whether the convex hulls of two bodies keep more than a margin; the pose is as for ``reach_of_component``."""
    never_inlined()
    inner, outer = outlines
    return corners_separated(inner[:FEW_CORNERS], outer[:FEW_CORNERS], rotation, move, margin) and corners_separated(
        inner, outer, rotation, move, margin
    )


@kernel
def corners_separated(
    inner: FloatArray, outer: FloatArray, rotation: FloatArray, move: FloatArray, margin: float
) -> bool:
    """The same of the hulls of some corners (n, 3) of each body.

    Source: GJK, as in ``cdcore.narrow.published_trees.gjk``.
    """
    never_inlined()
    placed, room = np.empty_like(inner), np.empty(36)
    for n in range(len(inner)):
        for a in range(3):
            placed[n, a] = move[a]
            for b in range(3):
                placed[n, a] += rotation[a, b] * inner[n, b]
    count, v = 0, (placed[0, 0] - outer[0, 0], placed[0, 1] - outer[0, 1], placed[0, 2] - outer[0, 2])
    for _ in range(MOST_HULL_STEPS):
        p, q = furthest(placed, v, -1.0), furthest(outer, v, 1.0)
        w = placed[p, 0] - outer[q, 0], placed[p, 1] - outer[q, 1], placed[p, 2] - outer[q, 2]
        far, ahead = dot(v, v), dot(v, w)
        if ahead > margin * np.sqrt(far):
            return True
        if far - ahead <= NO_PROGRESS * far or count == 4:
            return False
        put(room, count, w)
        count, v = nearest_on_simplex(room, count + 1)
        if count == 0 or dot(v, v) <= 0.0:
            return False
    return False


@hot_kernel
def furthest(points: FloatArray, direction: tuple[float, float, float], sign: float) -> int:
    """Number of the point (n, 3) that lies furthest along a direction, or with -1 furthest against it."""
    never_inlined()
    best, most = 0, -np.inf
    for n in range(len(points)):
        along = points[n, 0] * direction[0] + points[n, 1] * direction[1] + points[n, 2] * direction[2]
        if sign * along > most:
            best, most = n, sign * along
    return best
