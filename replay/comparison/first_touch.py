"""The moment between two frames at which two bodies first touch: when, in which faces, at which point."""

from dataclasses import replace
from typing import Final

import numpy as np

from cdcore import Motion
from cdcore.numerics import FloatArray, IntArray, place_points
from replay.comparison.outcome import FirstTouch
from replay.effects.output import vector_of
from replay.prepare.assembly import Assembly

PARALLEL: Final = 1e-9
"""Two directions whose cross product is shorter, of unit vectors, span no plane."""

AS_NEAR: Final = 1e-9
"""Metres: a corner over a face is as near as an edge that is nearer by less; edges end in the corner that touches."""

NO_GAP: Final = 1e-9
"""Metres of gap below which rounding of places decides its direction."""


def first_touch(assembly: Assembly, pair: int, frame: int) -> FirstTouch | None:
    """When a pair first touches between ``frame`` and the next; ``None`` where no touch is known."""
    from cdcore import time_of_impact  # with its compiler: only an oracle of intervals needs it

    ends, motion = assembly.pairs[pair], assembly.motion
    a, b = ends.tolist()
    rows = slice(frame, frame + 2)
    if frame < 0 or frame + 1 >= len(motion) or not motion.valid[rows][:, ends].all():
        return None
    meshes = [assembly.bodies[body].mesh for body in (a, b)]
    times = float(motion.times[frame]), float(motion.times[frame + 1])
    found = time_of_impact(meshes[0], _matrices(motion, rows, a), meshes[1], _matrices(motion, rows, b), times=times)
    if found.toi is None or found.faces is None:  # a hit alone has faces
        return None
    # At ``free`` they are still apart, by what they move in a microsecond: there the gap has a direction.
    there = poses_between(motion, ends, np.array([found.toi[0]]))
    placed = [
        place_points(mesh.triangles[face], there.rotations[0, k], there.translations[0, k])
        for k, (mesh, face) in enumerate(zip(meshes, found.faces, strict=True))
    ]
    here, other, across = nearest_points(placed[0], placed[1])
    middles = [
        there.rotations[0, k] @ mesh.referenced_vertices.mean(axis=0) + there.translations[0, k]
        for k, mesh in enumerate(meshes)
    ]
    normal = _direction(other - here, across, middles[1] - middles[0])
    later = round((found.toi[1] - times[0]) * 1e9)
    return FirstTouch(
        frame, found.toi[0], found.toi[1], later, found.faces, vector_of((here + other) / 2), vector_of(normal)
    )


def _direction(gap: FloatArray, across: FloatArray, toward: FloatArray) -> FloatArray:
    """Unit vector along a gap; without a gap, ``across`` turned towards the second body."""
    length = float(np.linalg.norm(gap))
    if length > NO_GAP:
        return gap / length
    return across if across @ toward >= 0.0 else -across


def poses_between(motion: Motion, bodies: IntArray, moments: FloatArray) -> Motion:
    """These bodies at moments between frames (n,), as a motion of n frames with a separate clock.

    Origins move along lines, rotations at a constant rate along the shorter arc, as ``continuous`` moves them.
    """
    from scipy.spatial.transform import Rotation

    times = motion.times
    after = np.clip(np.searchsorted(times, moments), 1, len(times) - 1)
    before = after - 1
    share = (moments - times[before]) / (times[after] - times[before])
    rows = np.ix_(before, bodies), np.ix_(after, bodies)
    place, there = (motion.translations[row] for row in rows)
    turn, other = (Rotation.from_matrix(motion.rotations[row].reshape(-1, 3, 3)) for row in rows)
    spin = (turn.inv() * other).as_rotvec() * np.repeat(share, len(bodies))[:, None]
    rotations = (turn * Rotation.from_rotvec(spin)).as_matrix().reshape(*place.shape, 3)
    return Motion(np.arange(len(moments), dtype=np.float64), place + share[:, None, None] * (there - place), rotations)


def at_touch(assembly: Assembly, pair: int, touch: FirstTouch) -> Assembly:
    """The assembly as one frame: the pair where it touches, all others where the frame before has them."""
    ends, row = assembly.pairs[pair], slice(touch.frame, touch.frame + 1)
    motion = assembly.motion
    pair_there = poses_between(motion, ends, np.array([touch.moment]))
    places, turns = motion.translations[row].copy(), motion.rotations[row].copy()
    places[:, ends], turns[:, ends] = pair_there.translations, pair_there.rotations
    return replace(assembly, motion=Motion(np.array([touch.moment]), places, turns, motion.valid[row]))


def nearest_points(one: FloatArray, other: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The nearest points of two triangles (3, 3) that are apart or touch, and a unit normal of the contact.

    The normal is the face's where a corner is over a face, else the direction across both edges; for parallel edges and
    faces without area it is arbitrary.
    """
    corners = [_corner(point, other) for point in one]
    corners += [near and (near[0], near[2], near[1], near[3]) for near in (_corner(point, one) for point in other)]
    edges = [_edges(one[k], one[k - 1], other[j], other[j - 1]) for k in range(3) for j in range(3)]
    nearest = min(edges, key=lambda near: near[0])
    over = min((near for near in corners if near is not None), key=lambda near: near[0], default=nearest)
    return (over if over[0] <= nearest[0] + AS_NEAR else nearest)[1:]


_Near = tuple[float, FloatArray, FloatArray, FloatArray]
"""Distance, a point of the first, one of the second, a unit vector across."""

_UP: Final = np.array([0.0, 1.0, 0.0])


def _corner(point: FloatArray, triangle: FloatArray) -> _Near | None:
    """A corner over the inside of a triangle, else ``None``: outside, the edges are at least as near."""
    a, edge_b, edge_c = triangle[0], triangle[1] - triangle[0], triangle[2] - triangle[0]
    normal = np.cross(edge_b, edge_c)
    area = float(np.linalg.norm(normal))
    if area <= PARALLEL * float(np.linalg.norm(edge_b) * np.linalg.norm(edge_c)):
        return None
    away = point - a
    u, v = (float(normal @ np.cross(*sides)) / area**2 for sides in ((away, edge_c), (edge_b, away)))
    if u < 0.0 or v < 0.0 or u + v > 1.0:
        return None
    foot = a + u * edge_b + v * edge_c
    return float(np.linalg.norm(point - foot)), point, foot, normal / area


def _edges(p: FloatArray, p_end: FloatArray, q: FloatArray, q_end: FloatArray) -> _Near:
    """The nearest points of two edges.

    Source: Ericson, "Real-Time Collision Detection", 2005, section 5.1.9.
    """
    d, e, r = p_end - p, q_end - q, p - q
    dd, ee, de, dr, er = float(d @ d), float(e @ e), float(d @ e), float(d @ r), float(e @ r)
    flat = dd * ee - de * de
    s = _share(de * er - dr * ee, flat) if flat > PARALLEL**2 * dd * ee else 0.0
    t = _share(de * s + er, ee)
    s = _share(de * t - dr, dd)
    here, there = p + s * d, q + t * e
    across = np.cross(d, e)
    length = float(np.linalg.norm(across))
    return (
        float(np.linalg.norm(here - there)),
        here,
        there,
        across / length if length > PARALLEL * (dd * ee) ** 0.5 else _UP,
    )


def _share(part: float, whole: float) -> float:
    return min(1.0, max(0.0, part / whole)) if whole > 0.0 else 0.0


def _matrices(motion: Motion, rows: slice, body: int) -> FloatArray:
    poses = np.tile(np.eye(4), (2, 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = motion.rotations[rows, body], motion.translations[rows, body]
    return poses
