"""The motion of a body between two recorded poses: origin along a line, rotation at constant rate, shortest arc.

At both ends a segment gives the recorded pose bit for bit. Between them it is off the exact motion by at most
``leg_pads``.

**How far off the chord.** Seen from B, a point ``a`` of A is at ``x = R_B^T (R_A a + d)`` with ``d = p_A - p_B``. With
constant angular velocities w_A, w_B and D = w_A - w_B its acceleration, per unit of the leg, is in B's frame
``D x (D x R_A a) + (D x w_B) x R_A a + w_B x (w_B x d) - 2 w_B x d'``, of length at most

    ``(|D|^2 + |D| |w_B|) |a| + |w_B|^2 |d| + 2 |w_B| |d'|``.

On a part of width h the point stays within ``h^2 / 8`` times that of the chord between its places at the part's ends.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from cdcore.kernels.compiling import hot_kernel, never_inlined
from cdcore.kernels.memory import Memory
from cdcore.narrow.bvh.bounds import LARGEST_SIZE, LARGEST_SKEW, ROUNDOFF, position_pad
from cdcore.numerics import FloatArray, IntArray

ANGLE: Final = 27
"""Where the angle stands in a leg, radians: rotation 9 and place 3 at the start, the same at the end, axis (body frame)
3, angle."""

LEG_WIDTH: Final = ANGLE + 1
"""Doubles of a leg."""

LEG_ULPS: Final = 512.0
"""Twice what a pose between the ends may be off, in 2^-53 of the size: the axis and the angle from two rotations 24
each, sine and cosine 2, Rodrigues' formula and its product with the first rotation 60, all of them over one half turn
(a factor pi/2) at most, the line of the origin 6; one leg for each body.
"""

LEG_SKEW_FACTOR: Final = 16.0
"""Twice what two rotations off orthonormal by delta may add to the angle, the axis and the product, rounded up."""

BOUND_SLACK: Final = 1.0 + 2.0**-30
"""Covers the rounding of speeds and accelerations, relative to them."""

STRAIGHT_ANGLE_SLACK: Final = 1e-9
"""Radians from half a turn at which rounding decides which way round is the shorter."""


def legs_of(rotations: FloatArray, translations: FloatArray, frames: IntArray) -> FloatArray:
    """Legs (28, K) of a body from ``frames - 1`` to ``frames`` (K,), of its rotations (T, 3, 3) and places (T, 3).

    Here and below legs stand side by side, so that a step is one pass over all of them.
    """
    before, after = (np.ascontiguousarray(rotations[k].reshape(-1, 9).T) for k in (frames - 1, frames))
    quaternions = quaternions_of(_products_with_inverse(before, after))
    length = _length(quaternions[:3])
    angle = 2.0 * np.arctan2(length, np.abs(quaternions[3]))
    # A rotation that is not exactly orthonormal would turn from itself to itself.
    angle[(before == after).all(axis=0)] = 0.0
    axis = quaternions[:3] / np.copysign(np.where(length > 0.0, length, 1.0), quaternions[3])
    return np.concatenate([before, translations[frames - 1].T, after, translations[frames].T, axis, angle[None]])


def quaternions_of(rotations: FloatArray) -> FloatArray:
    """Quaternions xyzw (4, K), of any length, of rotations (3, 3, K).

    Each is the row of ``4 q q^T`` with its largest component squared, so that nothing cancels (Shepperd 1978).
    """
    squares = np.empty((4, 4, rotations.shape[2]))
    squares[:3, :3] = rotations + rotations.swapaxes(0, 1)
    squares[:3, 3] = squares[3, :3] = rotations[[2, 0, 1], [1, 2, 0]] - rotations[[1, 2, 0], [2, 0, 1]]
    diagonal, trace = np.einsum("iik->ik", squares), np.einsum("iik->k", rotations)
    diagonal[:3] += 1.0 - trace
    diagonal[3] = 1.0 + trace
    return squares[diagonal.argmax(axis=0), :, np.arange(len(trace))].T


def _products_with_inverse(first: FloatArray, second: FloatArray) -> FloatArray:
    """Products R^T S (3, 3, K) of matrices (9, K)."""
    return np.einsum("iak,ibk->abk", first.reshape(3, 3, -1), second.reshape(3, 3, -1))


def _length(vectors: FloatArray) -> FloatArray:
    return np.sqrt((vectors * vectors).sum(axis=0))


@hot_kernel
def pose_at(leg: Memory, fraction: float, pose: Memory) -> None:
    """Rotation 9 and place 3 at a share 0 to 1 of the leg, to ``pose`` (12,)."""
    never_inlined()
    if fraction <= 0.0 or fraction >= 1.0:
        first = 0 if fraction <= 0.0 else 12
        for k in range(12):
            pose[k] = leg[first + k]
        return
    x, y, z = leg[24], leg[25], leg[26]
    angle = fraction * leg[ANGLE]
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
        pose[9 + i] = leg[9 + i] + fraction * (leg[21 + i] - leg[9 + i])


def angular_velocities(legs: FloatArray) -> FloatArray:
    """In the world, per unit of the leg, (3, K)."""
    return np.einsum("ijk,jk->ik", legs[:9].reshape(3, 3, -1), legs[24:27]) * legs[ANGLE]


def leg_bounds(legs_a: FloatArray, reach_a: float, legs_b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Bounds (K,) of speed and acceleration, per unit of the leg, of any point of A seen from B."""
    angular_speed = _length(angular_velocities(legs_a) - angular_velocities(legs_b))
    # A turn of both by rounding alone must not vanish.
    angular_speed += 8.0 * ROUNDOFF * (legs_a[ANGLE] + legs_b[ANGLE])
    before, after = legs_a[9:12] - legs_b[9:12], legs_a[21:24] - legs_b[21:24]
    distance, speed = np.maximum(_length(before), _length(after)), _length(after - before)
    rotation_b = legs_b[ANGLE]
    first = angular_speed * reach_a + speed + rotation_b * distance
    second = (
        (angular_speed * angular_speed + angular_speed * rotation_b) * reach_a
        + rotation_b * rotation_b * distance
        + 2.0 * rotation_b * speed
    )
    return first * BOUND_SLACK, second * BOUND_SLACK


def leg_pads(legs_a: FloatArray, reach_a: float, legs_b: FloatArray, reach_b: float) -> FloatArray:
    """The distances, metres (K,), that proofs of *apart* keep for rounding; infinite where the bounds do not hold."""
    size: FloatArray = np.full(legs_a.shape[1], reach_a + reach_b)
    skew = np.zeros_like(size)
    for legs in (legs_a, legs_b):
        residuals = [
            _products_with_inverse(angular_speed, angular_speed).reshape(9, -1) - np.eye(3).reshape(9, 1)
            for angular_speed in (legs[:9], legs[12:21])
        ]
        size += np.maximum(_length(legs[9:12]), _length(legs[21:24]))
        skew += np.maximum(*(_length(error) for error in residuals))
    pad = position_pad(size, skew) + (LEG_ULPS * ROUNDOFF + LEG_SKEW_FACTOR * skew) * size
    return np.where((size <= LARGEST_SIZE) & (skew <= LARGEST_SKEW), pad, np.inf)
