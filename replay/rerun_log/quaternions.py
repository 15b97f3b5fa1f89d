"""Rotation matrices as unit quaternions, xyzw, accurate for every rotation: the largest component is found first."""

from __future__ import annotations

import numpy as np

from cdcore.numerics import FloatArray


def quaternions_xyzw(rotations: FloatArray) -> FloatArray:
    """Unit quaternions (n, 4), w >= 0, of rotation matrices (n, 3, 3), column convention.

    Source: Shepperd, "Quaternion from rotation matrix", Journal of Guidance and Control 1 (1978): of the four squares
    4x^2, 4y^2, 4z^2, 4w^2, which sum to 4, the largest is at least 1 and is divided by.
    """
    r = np.asarray(rotations, dtype=np.float64)
    d0, d1, d2 = r[:, 0, 0], r[:, 1, 1], r[:, 2, 2]
    outer = np.empty((len(r), 4, 4))  # outer[:, i, j] = 4 q_i q_j
    outer[:, 0, 0] = 1 + d0 - d1 - d2
    outer[:, 1, 1] = 1 - d0 + d1 - d2
    outer[:, 2, 2] = 1 - d0 - d1 + d2
    outer[:, 3, 3] = 1 + d0 + d1 + d2
    outer[:, 0, 1] = outer[:, 1, 0] = r[:, 0, 1] + r[:, 1, 0]
    outer[:, 0, 2] = outer[:, 2, 0] = r[:, 0, 2] + r[:, 2, 0]
    outer[:, 1, 2] = outer[:, 2, 1] = r[:, 1, 2] + r[:, 2, 1]
    outer[:, 0, 3] = outer[:, 3, 0] = r[:, 2, 1] - r[:, 1, 2]
    outer[:, 1, 3] = outer[:, 3, 1] = r[:, 0, 2] - r[:, 2, 0]
    outer[:, 2, 3] = outer[:, 3, 2] = r[:, 1, 0] - r[:, 0, 1]
    largest = np.argmax(np.diagonal(outer, axis1=1, axis2=2), axis=1)
    row = outer[np.arange(len(r)), largest]
    q: FloatArray = row / np.linalg.norm(row, axis=1, keepdims=True)
    return np.where(q[:, 3:] < 0, -q, q)
