"""Whether moving spheres, boxes and faces certainly stay apart.

**Spheres** over whole segments: a sphere's centre follows its body's origin along a line and turns about it; it leaves
the chord between its ends by at most an eighth of the squared angle times its distance from the origin.

**Boxes and faces**, one moving and one at rest: a direction must separate them at both ends of a part of the motion, by
more than the motion can leave its chord. Each direction is measured on the corners at both ends, however it was found.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from cdcore.bounding.bounding_sphere import Sphere
from cdcore.kernels.compiling import always_inlined, hot_kernel, never_inlined
from cdcore.kernels.memory import Memory
from cdcore.kernels.vectors import Vector, between, beyond, cross, dot, rotated_vector, vector_at
from cdcore.numerics import BoolArray, FloatArray, IntArray
from cdcore.poses import place_points
from cdcore.poses.kernels import placed_by_row
from cdcore.tolerances import EPS, UNDERFLOW_PAD

SWEPT_ULPS: Final = 4096.0
"""Pad in eps of both bodies' sizes, for rotations as far from orthonormal as a motion allows."""

ANGLE_OF_CHORD: Final = 1.1108
"""An angle of at most half a turn is at most pi / (2 sqrt 2) times the Frobenius norm of the rotations' difference."""

CORNERS = 27
"""Doubles of the corners of one face pair: A's at the start 9 and at the end 9, B's 9."""

Three = tuple[Vector, Vector, Vector]


class SweptSpheres:
    """Finds the legs on which the bounding spheres of a pair, one a body, may meet."""

    def __init__(self, spheres: Sequence[Sphere]) -> None:
        self._spheres = tuple(spheres)

    def may_meet(
        self, rotations: FloatArray, translations: FloatArray, valid: BoolArray, pairs: IntArray, searched: BoolArray
    ) -> BoolArray:
        """Marks legs (T, P), of those searched, on which the spheres may meet; row t is from frame t-1 to t.

        Rows whose poses are not valid must not be asked about.
        """
        near = np.zeros_like(searched)
        if not searched.any():
            return near
        used = np.unique(pairs)
        centres, slack = {}, {}
        for body in used.tolist():
            centres[body], slack[body] = self._path(body, rotations[:, body], translations[:, body], valid[:, body])
        for column, (i, j) in enumerate(pairs.tolist()):
            reach = self._spheres[i].radius + self._spheres[j].radius + slack[i][1:] + slack[j][1:]
            # "not above": a distance that overflowed to NaN counts as near
            separated = _least_distance(centres[i] - centres[j]) > reach + UNDERFLOW_PAD
            near[1:, column] = searched[1:, column] & ~separated
        return near

    def _path(
        self, body: int, rotations: FloatArray, translations: FloatArray, valid: BoolArray
    ) -> tuple[FloatArray, FloatArray]:
        """World centres (T, 3), and how far off the chord to frame t the sphere may reach, rounding included, (T,)."""
        sphere = self._spheres[body]
        off = float(np.linalg.norm(sphere.centre))
        slack = np.zeros(len(rotations))
        with np.errstate(invalid="ignore", over="ignore"):
            centres = place_points(sphere.centre[None], rotations, translations)[:, 0]
            angle = ANGLE_OF_CHORD * np.sqrt(((rotations[1:] - rotations[:-1]) ** 2).sum(axis=(1, 2)))
            far = np.abs(translations).max(axis=1)
            slack[1:] = angle**2 * (off / 8.0)
            slack[1:] += SWEPT_ULPS * EPS * (off + sphere.radius + np.maximum(far[1:], far[:-1]))
        return np.where(valid[:, None], centres, np.nan), slack


def _least_distance(translations: FloatArray) -> FloatArray:
    """Distance from the origin, (T - 1,), of the chords from each of the places (T, 3) to the next."""
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        start, displacement = translations[:-1], translations[1:] - translations[:-1]
        along, length = -(start * displacement).sum(axis=1), (displacement * displacement).sum(axis=1)
        fraction = np.where(length > 0.0, np.clip(along / length, 0.0, 1.0), 0.0)
        nearest = start + fraction[:, None] * displacement
        return np.sqrt((nearest * nearest).sum(axis=1))


@hot_kernel
def separates(c: Memory, direction: Vector, margin: float) -> bool:
    """Whether the direction keeps the corners ``c`` (27,) apart by more than ``margin`` at both ends.

    Compared as squares, so that no direction need be divided by its length; where a square underflows, the answer is
    False or right.
    """
    lower_a = upper_a = dot(direction, vector_at(c, 0))
    for k in range(3, 18, 3):
        length = dot(direction, vector_at(c, k))
        lower_a, upper_a = min(lower_a, length), max(upper_a, length)
    lower_b = upper_b = dot(direction, vector_at(c, 18))
    for k in range(21, 27, 3):
        length = dot(direction, vector_at(c, k))
        lower_b, upper_b = min(lower_b, length), max(upper_b, length)
    gap = max(lower_a - upper_b, lower_b - upper_a)
    if gap * gap == np.inf:
        longest = max(abs(direction[0]), max(abs(direction[1]), abs(direction[2])))
        direction, gap = (direction[0] / longest, direction[1] / longest, direction[2] / longest), gap / longest
    return bool(gap > 0.0 and gap * gap > margin * margin * dot(direction, direction))


@hot_kernel
def edges_of(corners: Three) -> Three:
    """From each corner of a face to the next."""
    always_inlined()
    first, second, third = corners
    return between(first, second), between(second, third), between(third, first)


@hot_kernel
def faces_stay_separated(c: Memory, margin: float) -> bool:
    """Whether the faces with corners ``c`` (27,) are certainly apart all the way.

    Directions are those of the middle of the way: both planes, pairs of edges, the nearest points of edges.
    """
    never_inlined()
    still = vector_at(c, 18), vector_at(c, 21), vector_at(c, 24)
    edges_b = edges_of(still)
    if separates(c, cross(edges_b[0], edges_b[1]), margin):
        return True
    middle = direction_halfway(c, 0), direction_halfway(c, 3), direction_halfway(c, 6)
    edges_a = edges_of(middle)
    if separates(c, cross(edges_a[0], edges_a[1]), margin):
        return True
    for edge_a in edges_a:
        for edge_b in edges_b:
            if separates(c, cross(edge_a, edge_b), margin):
                return True
    return bool(separates(c, direction_between_edges(middle, edges_a, still, edges_b), margin))


@hot_kernel
def direction_halfway(c: Memory, k: int) -> Vector:
    """The corner ``c[k:k + 3]`` of A in the middle of its way."""
    always_inlined()
    return 0.5 * (c[k] + c[9 + k]), 0.5 * (c[k + 1] + c[10 + k]), 0.5 * (c[k + 2] + c[11 + k])


@hot_kernel
def direction_between_edges(corners_a: Three, edges_a: Three, corners_b: Three, edges_b: Three) -> Vector:
    """The way between the nearest points of the edges of two faces, to the first. An edge may be a point.

    Source: C. Ericson, Real-Time Collision Detection, 2005, section 5.1.
    """
    best, nearest = np.inf, (0.0, 0.0, 0.0)
    for i in range(3):
        u = edges_a[i]
        uu = dot(u, u)
        for j in range(3):
            v, w = edges_b[j], between(corners_b[j], corners_a[i])
            vv, uv, uw, vw = dot(v, v), dot(u, v), dot(u, w), dot(v, w)
            spread = uu * vv - uv * uv
            s = min(1.0, max(0.0, (uv * vw - vv * uw) / spread)) if spread > 0.0 else 0.0
            t = (uv * s + vw) / vv if vv > 0.0 else 0.0
            if t < 0.0 or t > 1.0 or vv == 0.0:
                t = min(1.0, max(0.0, t))
                s = min(1.0, max(0.0, (uv * t - uw) / uu)) if uu > 0.0 else 0.0
            direction = beyond(beyond(w, s, u), -t, v)
            distance = dot(direction, direction)
            if distance < best:
                best, nearest = distance, direction
    return nearest


@hot_kernel
def axis_of(box: Memory, n: int) -> Vector:
    """An axis of a node box (16,), in its body's frame."""
    always_inlined()
    return box[3 + n], box[6 + n], box[9 + n]


@hot_kernel
def boxes_stay_separated(
    box_a: Memory, box_b: Memory, before: Memory, after: Memory, chord: float, margin: float
) -> bool:
    """Whether node boxes (16,) of A and B are certainly apart while A goes from pose ``before`` to ``after`` (12,).

    ``chord`` bounds the norm of the difference of both rotations: rotated, a box reaches further by at most that times
    its half diagonal.
    """
    never_inlined()
    wide = margin + chord * box_a[15]
    first = between(vector_at(box_b, 0), placed_by_row(before, vector_at(box_a, 0)))
    last = between(vector_at(box_b, 0), placed_by_row(after, vector_at(box_a, 0)))
    axes_a = (
        rotated_vector(before, axis_of(box_a, 0)),
        rotated_vector(before, axis_of(box_a, 1)),
        rotated_vector(before, axis_of(box_a, 2)),
    )
    for k in range(3):
        axis = axis_of(box_b, k)
        reach = box_b[12 + k] + wide
        for n in range(3):
            reach += box_a[12 + n] * abs(dot(axis, axes_a[n]))
        if separated_along(axis, reach, first, last):
            return True
    for n in range(3):
        reach = box_a[12 + n] + wide
        for k in range(3):
            reach += box_b[12 + k] * abs(dot(axes_a[n], axis_of(box_b, k)))
        if separated_along(axes_a[n], reach, first, last):
            return True
    return False


@hot_kernel
def separated_along(axis: Vector, reach: float, first: Vector, last: Vector) -> bool:
    """Whether both ways between the centres go beyond ``reach`` on one side."""
    always_inlined()
    start, stop = dot(axis, first), dot(axis, last)
    return bool(min(start, stop) > reach or max(start, stop) < -reach)


@hot_kernel
def angle_between(before: Memory, after: Memory) -> float:
    """Bound of the norm of the difference of two rotations (first 9 of each): the Frobenius norm, rounded up."""
    total = 0.0
    for k in range(9):
        change = after[k] - before[k]
        total += change * change
    norm: float = np.sqrt(total) * (1.0 + 2.0**-40)
    return norm
