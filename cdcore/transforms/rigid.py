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
    matrix = np.empty((*q.shape[:-1], 3, 3))
    matrix[..., 0, 0] = 1 - 2 * (y * y + z * z)
    matrix[..., 0, 1] = 2 * (x * y - z * w)
    matrix[..., 0, 2] = 2 * (x * z + y * w)
    matrix[..., 1, 0] = 2 * (x * y + z * w)
    matrix[..., 1, 1] = 1 - 2 * (x * x + z * z)
    matrix[..., 1, 2] = 2 * (y * z - x * w)
    matrix[..., 2, 0] = 2 * (x * z - y * w)
    matrix[..., 2, 1] = 2 * (y * z + x * w)
    matrix[..., 2, 2] = 1 - 2 * (x * x + y * y)
    return matrix
