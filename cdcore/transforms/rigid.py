"""Rotation matrices of quaternions, renormalised in float64."""

import numpy as np

from cdcore.numerics import FloatArray


def rotation_from_quaternion(quaternion_xyzw: FloatArray) -> FloatArray:
    """Rotation matrices (..., 3, 3), column convention, of unit quaternions (..., 4), xyzw.

    The quaternion is divided by its norm in float64 first: a float32 quaternion left as it is stretches a rotation by
    up to 1.4e-7. The caller checks the norm; zero gives NaN.
    """
    q = np.asarray(quaternion_xyzw, dtype=np.float64)
    x, y, z, w = np.moveaxis(q, -1, 0)
    norm = np.sqrt(((x * x + y * y) + z * z) + w * w)
    with np.errstate(invalid="ignore", divide="ignore"):
        x, y, z, w = x / norm, y / norm, z / norm, w / norm
    entries = [
        1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w),
        2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
        2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y),
    ]  # fmt: skip
    return np.stack(entries, axis=-1).reshape(*q.shape[:-1], 3, 3)
