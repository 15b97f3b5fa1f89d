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

from cdcore.kernels.compiling import kernel, stay_one_function
from cdcore.narrow.spacetime.bounds import LARGEST_SIZE, LARGEST_SKEW, ROUNDOFF, position_pad
from cdcore.numerics import FloatArray

LEG_WIDTH: Final = 28
"""Doubles of a leg: rotation 9 and place 3 at the start, the same at the end, axis (body frame) 3, angle 1."""

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


@kernel
def fill_segment(
    rotation: FloatArray, place: FloatArray, rotation_after: FloatArray, place_after: FloatArray, segment: FloatArray
) -> None:
    """Write the leg between two poses to ``segment`` (28,)."""
    stay_one_function()
    for i in range(3):
        for j in range(3):
            segment[3 * i + j] = rotation[i, j]
            segment[12 + 3 * i + j] = rotation_after[i, j]
        segment[9 + i], segment[21 + i] = place[i], place_after[i]
    m = np.empty((3, 3))
    moved = False
    for i in range(3):
        for j in range(3):
            moved |= rotation[i, j] != rotation_after[i, j]
            first = rotation[0, i] * rotation_after[0, j] + rotation[1, i] * rotation_after[1, j]
            m[i, j] = first + rotation[2, i] * rotation_after[2, j]
    x, y, z, w = 0.0, 0.0, 0.0, 1.0
    if moved:
        x, y, z, w = quaternion_of(m)
    if w < 0.0:
        x, y, z, w = -x, -y, -z, -w
    length = np.sqrt(x * x + y * y + z * z)
    segment[27] = 2.0 * np.arctan2(length, w)
    if length > 0.0:
        segment[24], segment[25], segment[26] = x / length, y / length, z / length
    else:
        segment[24], segment[25], segment[26], segment[27] = 1.0, 0.0, 0.0, 0.0


@kernel
def quaternion_of(m: FloatArray) -> tuple[float, float, float, float]:
    """Quaternion xyzw of a rotation, its largest component first found, so that nothing cancels (Shepperd 1978)."""
    stay_one_function()
    trace = m[0, 0] + m[1, 1] + m[2, 2]
    if trace >= m[0, 0] and trace >= m[1, 1] and trace >= m[2, 2]:
        x, y, z, w = m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], 1.0 + trace
    elif m[0, 0] >= m[1, 1] and m[0, 0] >= m[2, 2]:
        x, y, z, w = 1.0 + 2.0 * m[0, 0] - trace, m[0, 1] + m[1, 0], m[0, 2] + m[2, 0], m[2, 1] - m[1, 2]
    elif m[1, 1] >= m[2, 2]:
        x, y, z, w = m[0, 1] + m[1, 0], 1.0 + 2.0 * m[1, 1] - trace, m[1, 2] + m[2, 1], m[0, 2] - m[2, 0]
    else:
        x, y, z, w = m[0, 2] + m[2, 0], m[1, 2] + m[2, 1], 1.0 + 2.0 * m[2, 2] - trace, m[1, 0] - m[0, 1]
    norm = np.sqrt(x * x + y * y + z * z + w * w)
    return x / norm, y / norm, z / norm, w / norm


@kernel
def pose_at(segment: FloatArray, share: float, pose: FloatArray) -> None:
    """Rotation 9 and place 3 at a share 0 to 1 of the leg, to ``pose`` (12,)."""
    stay_one_function()
    if share <= 0.0 or share >= 1.0:
        first = 0 if share <= 0.0 else 12
        for k in range(12):
            pose[k] = segment[first + k]
        return
    x, y, z = segment[24], segment[25], segment[26]
    angle = share * segment[27]
    sine, half = np.sin(angle), np.sin(0.5 * angle)
    versine = 2.0 * half * half
    m00, m01, m02 = 1.0 - versine * (y * y + z * z), versine * x * y - sine * z, versine * x * z + sine * y
    m10, m11, m12 = versine * x * y + sine * z, 1.0 - versine * (x * x + z * z), versine * y * z - sine * x
    m20, m21, m22 = versine * x * z - sine * y, versine * y * z + sine * x, 1.0 - versine * (x * x + y * y)
    for i in range(3):
        a, b, c = segment[3 * i], segment[3 * i + 1], segment[3 * i + 2]
        pose[3 * i] = a * m00 + b * m10 + c * m20
        pose[3 * i + 1] = a * m01 + b * m11 + c * m21
        pose[3 * i + 2] = a * m02 + b * m12 + c * m22
        pose[9 + i] = segment[9 + i] + share * (segment[21 + i] - segment[9 + i])


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


@kernel
def angular_velocity(segment: FloatArray) -> tuple[float, float, float]:
    """In the world, per unit of the leg."""
    x = segment[0] * segment[24] + segment[1] * segment[25] + segment[2] * segment[26]
    y = segment[3] * segment[24] + segment[4] * segment[25] + segment[5] * segment[26]
    z = segment[6] * segment[24] + segment[7] * segment[25] + segment[8] * segment[26]
    return segment[27] * x, segment[27] * y, segment[27] * z


@kernel
def segment_bounds(segment_a: FloatArray, reach_a: float, segment_b: FloatArray) -> tuple[float, float]:
    """Bounds of speed and acceleration, per unit of the leg, of any point of A seen from B."""
    stay_one_function()
    wa, wb, turn_b = angular_velocity(segment_a), angular_velocity(segment_b), segment_b[27]
    turn = np.sqrt((wa[0] - wb[0]) ** 2 + (wa[1] - wb[1]) ** 2 + (wa[2] - wb[2]) ** 2)
    before = after = speed = 0.0
    for k in range(3):
        d0, d1 = segment_a[9 + k] - segment_b[9 + k], segment_a[21 + k] - segment_b[21 + k]
        before, after, speed = before + d0 * d0, after + d1 * d1, speed + (d1 - d0) ** 2
    apart, speed = np.sqrt(max(before, after)), np.sqrt(speed)
    # a turn of both by rounding alone must not vanish
    turn += 8.0 * ROUNDOFF * (segment_a[27] + turn_b)
    first = turn * reach_a + speed + turn_b * apart
    second = (turn * turn + turn * turn_b) * reach_a + turn_b * turn_b * apart + 2.0 * turn_b * speed
    return first * BOUND_SLACK, second * BOUND_SLACK


@kernel
def skew_of(segment: FloatArray, first: int) -> float:
    """Frobenius norm of ``R^T R - I`` of the leg's rotation at its start (``first`` 0) or end (12)."""
    total = 0.0
    for i in range(3):
        for j in range(3):
            dot = 0.0
            for k in range(3):
                dot += segment[first + 3 * k + i] * segment[first + 3 * k + j]
            if i == j:
                dot -= 1.0
            total += dot * dot
    return float(np.sqrt(total))


@kernel
def segment_pad(segment_a: FloatArray, reach_a: float, segment_b: FloatArray, reach_b: float) -> float:
    """The distance, metres, that a proof of *apart* keeps for rounding; infinite where the bounds do not hold."""
    stay_one_function()
    size, skew = reach_a + reach_b, 0.0
    for number in range(2):
        segment = segment_a if number == 0 else segment_b
        longest = 0.0
        for end in (9, 21):
            x, y, z = segment[end], segment[end + 1], segment[end + 2]
            longest = max(longest, np.sqrt(x * x + y * y + z * z))
        size += longest
        skew += max(skew_of(segment, 0), skew_of(segment, 12))
    if not size <= LARGEST_SIZE or not skew <= LARGEST_SKEW:
        return np.inf
    return float(position_pad_compiled(size, skew) + (LEG_ULPS * ROUNDOFF + LEG_SKEW_FACTOR * skew) * size)


position_pad_compiled = kernel(position_pad)
