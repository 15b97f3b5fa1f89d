"""The motion of a body between two recorded poses: origin along a line, rotation at constant rate, shortest arc.

At both ends a segment gives the recorded pose bit for bit. Between them it is off the exact motion by at most
``segment_pad``.

**How far off the chord.** Seen from B, a point ``a`` of A is at ``x = R_B^T (R_A a + d)`` with ``d = p_A - p_B``. With
constant angular velocities w_A, w_B and D = w_A - w_B its acceleration, per unit of the leg, is in B's frame
``D x (D x R_A a) + (D x w_B) x R_A a + w_B x (w_B x d) - 2 w_B x d'``, of length at most

    ``(|D|^2 + |D| |w_B|) |a| + |w_B|^2 |d| + 2 |w_B| |d'|``.

On a part of width h the point stays within ``h^2 / 8`` times that of the chord between its places at the part's ends.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from cdcore.kernels.compiling import kernel, stay_one_function
from cdcore.narrow.spacetime.bounds import LARGEST_SIZE, LARGEST_SKEW, ROUNDOFF, position_pad
from cdcore.numerics import FloatArray, IntArray

LEG_WIDTH: Final = 28
"""Doubles of a leg: rotation 9 and place 3 at the start, the same at the end, axis (body frame) 3, angle 1."""

ANGLE: Final = 27
"""Where the angle stands, radians."""

LEG_ULPS: Final = 512.0
"""Twice what a pose between the ends may be off, in 2^-53 of the size: the axis and the angle from two rotations 24
each, sine and cosine 2, Rodrigues' formula and its product with the first rotation 60, all of them over one half turn
(a factor pi/2) at most, the line of the origin 6; one leg for each body.
"""

LEG_SKEW_FACTOR: Final = 16.0
"""Twice what two rotations off orthonormal by delta may add to the angle, the axis and the product, rounded up."""

BOUND_SLACK: Final = 1.0 + 2.0**-30
"""Covers the rounding of speeds and accelerations, relative to them."""

HALF_TURN_SLACK: Final = 1e-9
"""Radians from half a turn at which rounding decides which way round is the shorter."""


def legs_of(rotations: FloatArray, places: FloatArray, frames: IntArray) -> FloatArray:
    """Legs (K, 28) of a body from ``frames - 1`` to ``frames`` (K,), of its rotations (T, 3, 3) and places (T, 3)."""
    before, after = rotations[frames - 1], rotations[frames]
    # a rotation that is not exactly orthonormal would turn from itself to itself
    moved = (before != after).any(axis=(1, 2))
    turn = np.where(moved[:, None, None], np.einsum("kia,kib->kab", before, after), np.eye(3))
    way = Rotation.from_matrix(turn).as_rotvec()
    angle = np.linalg.norm(way, axis=1, keepdims=True)
    axis = np.where(angle > 0.0, way / np.where(angle > 0.0, angle, 1.0), [1.0, 0.0, 0.0])
    ends = before.reshape(-1, 9), places[frames - 1], after.reshape(-1, 9), places[frames]
    return np.concatenate([*ends, axis, angle], axis=1)


@kernel
def pose_at(leg: FloatArray, share: float, pose: FloatArray) -> None:
    """Rotation 9 and place 3 at a share 0 to 1 of the leg, to ``pose`` (12,)."""
    stay_one_function()
    if share <= 0.0 or share >= 1.0:
        first = 0 if share <= 0.0 else 12
        for k in range(12):
            pose[k] = leg[first + k]
        return
    x, y, z = leg[24], leg[25], leg[26]
    angle = share * leg[ANGLE]
    sine, half = np.sin(angle), np.sin(0.5 * angle)
    versine = 2.0 * half * half
    m00, m01, m02 = 1.0 - versine * (y * y + z * z), versine * x * y - sine * z, versine * x * z + sine * y
    m10, m11, m12 = versine * x * y + sine * z, 1.0 - versine * (x * x + z * z), versine * y * z - sine * x
    m20, m21, m22 = versine * x * z - sine * y, versine * y * z + sine * x, 1.0 - versine * (x * x + y * y)
    for i in range(3):
        a, b, c = leg[3 * i], leg[3 * i + 1], leg[3 * i + 2]
        pose[3 * i] = a * m00 + b * m10 + c * m20
        pose[3 * i + 1] = a * m01 + b * m11 + c * m21
        pose[3 * i + 2] = a * m02 + b * m12 + c * m22
        pose[9 + i] = leg[9 + i] + share * (leg[21 + i] - leg[9 + i])


@kernel
def seen_from(pose: FloatArray, other: FloatArray, relative: FloatArray) -> None:
    """The pose (12,) in the frame of the other, to ``relative`` (12,)."""
    stay_one_function()
    for i in range(3):
        total = 0.0
        for k in range(3):
            total += other[3 * k + i] * (pose[9 + k] - other[9 + k])
        relative[9 + i] = total
        for j in range(3):
            relative[3 * i + j] = other[i] * pose[j] + other[3 + i] * pose[3 + j] + other[6 + i] * pose[6 + j]


def angular_velocities(legs: FloatArray) -> FloatArray:
    """In the world, per unit of the leg, (K, 3)."""
    return np.einsum("kij,kj->ki", legs[:, :9].reshape(-1, 3, 3), legs[:, 24:27]) * legs[:, ANGLE:]


def leg_bounds(legs_a: FloatArray, reach_a: float, legs_b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Bounds (K,) of speed and acceleration, per unit of the leg, of any point of A seen from B."""
    turn = np.linalg.norm(angular_velocities(legs_a) - angular_velocities(legs_b), axis=1)
    # a turn of both by rounding alone must not vanish
    turn += 8.0 * ROUNDOFF * (legs_a[:, ANGLE] + legs_b[:, ANGLE])
    before, after = legs_a[:, 9:12] - legs_b[:, 9:12], legs_a[:, 21:24] - legs_b[:, 21:24]
    apart = np.maximum(np.linalg.norm(before, axis=1), np.linalg.norm(after, axis=1))
    speed, turn_b = np.linalg.norm(after - before, axis=1), legs_b[:, ANGLE]
    first = turn * reach_a + speed + turn_b * apart
    second = (turn * turn + turn * turn_b) * reach_a + turn_b * turn_b * apart + 2.0 * turn_b * speed
    return first * BOUND_SLACK, second * BOUND_SLACK


def leg_pads(legs_a: FloatArray, reach_a: float, legs_b: FloatArray, reach_b: float) -> FloatArray:
    """The distances, metres (K,), that proofs of *apart* keep for rounding; infinite where the bounds do not hold."""
    size, skew = np.full(len(legs_a), reach_a + reach_b), np.zeros(len(legs_a))
    for legs in (legs_a, legs_b):
        ends = legs[:, :24].reshape(-1, 2, 12)
        turns = ends[..., :9].reshape(-1, 2, 3, 3)
        with np.errstate(over="ignore"):
            size += np.linalg.norm(ends[..., 9:], axis=-1).max(axis=1)
        error = np.einsum("keab,keac->kebc", turns, turns) - np.eye(3)
        skew += np.linalg.norm(error, axis=(-2, -1)).max(axis=1)
    pad = position_pad(size, skew) + (LEG_ULPS * ROUNDOFF + LEG_SKEW_FACTOR * skew) * size
    return np.where((size <= LARGEST_SIZE) & (skew <= LARGEST_SKEW), pad, np.inf)
