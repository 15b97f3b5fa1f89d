"""Unit quaternions (xyzw) as arrays: multiply, invert, turn vectors, blend along the shortest arc."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

IDENTITY: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)

# Below this angle (cosine this close to one) slerp divides by a sine that has lost its digits; the chord then differs
# from the arc by less than 1e-9 of its length.
SLERP_CHORD_COSINE = 1.0 - 1e-9


def quaternion_product(a: ArrayLike, b: ArrayLike) -> Array:
    """Hamilton product (..., 4): turning by ``b`` first, then by ``a``."""
    ax, ay, az, aw = np.moveaxis(np.asarray(a, dtype=np.float64), -1, 0)
    bx, by, bz, bw = np.moveaxis(np.asarray(b, dtype=np.float64), -1, 0)
    return np.stack(
        [
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
            aw * bw - ax * bx - ay * by - az * bz,
        ],
        axis=-1,
    )


def quaternion_inverse(q: ArrayLike) -> Array:
    """Inverse of unit quaternions (..., 4)."""
    return np.asarray(q, dtype=np.float64) * np.array([-1.0, -1.0, -1.0, 1.0])


def rotated_vectors(q: ArrayLike, v: ArrayLike) -> Array:
    """Vectors (..., 3) turned by unit quaternions (..., 4)."""
    given = np.asarray(q, dtype=np.float64)
    vector = np.asarray(v, dtype=np.float64)
    axis, scalar = given[..., :3], given[..., 3:]
    twice = 2.0 * np.cross(axis, vector)
    return vector + scalar * twice + np.cross(axis, twice)


def quaternion_about(axis: ArrayLike, angle: ArrayLike) -> Array:
    """Quaternions (..., 4) that turn by ``angle`` radians (...) about ``axis`` (3,), right-handed."""
    direction = np.asarray(axis, dtype=np.float64)
    direction = direction / np.linalg.norm(direction)
    half = np.asarray(angle, dtype=np.float64)[..., None] / 2.0
    return np.concatenate([np.sin(half) * direction, np.cos(half)], axis=-1)


def axis_angle_quaternion(axis: ArrayLike, angle: float) -> tuple[float, float, float, float]:
    """`quaternion_about` as four floats."""
    x, y, z, w = quaternion_about(axis, angle).tolist()
    return x, y, z, w


def quaternion_from_vector(rotation: ArrayLike) -> Array:
    """Quaternions (..., 4) of rotation vectors (..., 3): direction is the axis, length the angle in radians."""
    vector = np.asarray(rotation, dtype=np.float64)
    angle = np.linalg.norm(vector, axis=-1, keepdims=True)
    return np.concatenate([0.5 * np.sinc(angle / (2.0 * np.pi)) * vector, np.cos(angle / 2.0)], axis=-1)


def quaternion_facing(forward: ArrayLike) -> Array:
    """Quaternion (4,) that turns -Z to ``forward`` and keeps +Y as upright as it can.

    ValueError where ``forward`` is zero or vertical.
    """
    back = -np.asarray(forward, dtype=np.float64)
    right = np.cross((0.0, 1.0, 0.0), back)
    if not np.linalg.norm(right) > 0.0:
        raise ValueError(f"forward {np.asarray(forward).tolist()} is zero or vertical; look to one side")
    back, right = back / np.linalg.norm(back), right / np.linalg.norm(right)
    return quaternion_from_matrix(np.stack([right, np.cross(back, right), back], axis=1))


def quaternion_from_matrix(matrix: ArrayLike) -> Array:
    """Quaternion (4,) of a rotation matrix (3, 3), column convention; w is not negative.

    Source: Shepperd, "Quaternion from rotation matrix", J. Guidance and Control 1 (1978): take the largest of the
    four squares, so that no root loses its digits.
    """
    m = np.asarray(matrix, dtype=np.float64)
    table = np.array(
        [
            [1 + m[0, 0] - m[1, 1] - m[2, 2], m[0, 1] + m[1, 0], m[0, 2] + m[2, 0], m[2, 1] - m[1, 2]],
            [m[0, 1] + m[1, 0], 1 - m[0, 0] + m[1, 1] - m[2, 2], m[1, 2] + m[2, 1], m[0, 2] - m[2, 0]],
            [m[0, 2] + m[2, 0], m[1, 2] + m[2, 1], 1 - m[0, 0] - m[1, 1] + m[2, 2], m[1, 0] - m[0, 1]],
            [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], 1 + m[0, 0] + m[1, 1] + m[2, 2]],
        ]
    )
    row = table[int(np.argmax(np.diag(table)))]
    unit: Array = row / np.linalg.norm(row)
    return unit if unit[3] >= 0.0 else -unit


def slerp(start: ArrayLike, end: ArrayLike, fraction: ArrayLike) -> Array:
    """Blend unit quaternions (..., 4) along the shorter arc; ``fraction`` (...) runs from 0 to 1."""
    a, b = np.broadcast_arrays(np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64))
    u = np.asarray(fraction, dtype=np.float64)[..., None]
    cosine = np.sum(a * b, axis=-1, keepdims=True)
    b = np.where(cosine < 0.0, -b, b)
    cosine = np.abs(cosine)
    angle = np.arccos(np.minimum(cosine, SLERP_CHORD_COSINE))
    sine = np.sin(angle)
    arc = (np.sin((1.0 - u) * angle) * a + np.sin(u * angle) * b) / sine
    blend = np.where(cosine >= SLERP_CHORD_COSINE, (1.0 - u) * a + u * b, arc)
    return blend / np.linalg.norm(blend, axis=-1, keepdims=True)
