"""Rotations that are rotations: quaternions and matrices are checked, renormalised in float64, or refused.

Source: equations (6)-(14) for the meaning of a rotation; the bounds are those of ``cdcore.numerics``.
"""

from __future__ import annotations

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


def orthonormality_error(rotation: FloatArray) -> FloatArray:
    """Largest entry of ``|R^T R - I|`` for each matrix (..., 3, 3); infinity for a reflection, NaN where not finite."""
    with np.errstate(invalid="ignore", over="ignore"):
        columns = [rotation[..., :, k] for k in range(3)]
        error = np.zeros(rotation.shape[:-2])
        for i in range(3):
            for j in range(i, 3):
                a, b = columns[i], columns[j]
                dot = a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]
                error = np.maximum(error, np.abs(dot - (i == j)))
        a, b, c = columns
        determinant = (
            a[..., 0] * (b[..., 1] * c[..., 2] - b[..., 2] * c[..., 1])
            + a[..., 1] * (b[..., 2] * c[..., 0] - b[..., 0] * c[..., 2])
            + a[..., 2] * (b[..., 0] * c[..., 1] - b[..., 1] * c[..., 0])
        )
        return np.where(determinant < 0, np.inf, error)


def nearest_rotation(matrix: FloatArray) -> FloatArray:
    """The rotation nearest to each matrix (..., 3, 3) in the Frobenius norm, by singular value decomposition.

    Choose it for matrices that should be rotations and lost digits on the way; a reflection has no nearest rotation
    worth having and is the caller's to refuse.
    """
    u, _, vt = np.linalg.svd(matrix)
    rotation: FloatArray = u @ vt
    return rotation
