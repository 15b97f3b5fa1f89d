"""The paper's equations (1) to (14): points are rows, matrices act from the right.

``[x' y' z' 1] = [x y z 1] C``, so the product ``A @ B`` acts with A first, and a body goes to the world by scale, then
rotation, then translation. Poses in this project are column matrices: the transpose. The printed equations contain no
sign error; they leave out the order of composition, and that a scale is about the origin. Angles are radians.
"""

import numpy as np
from numpy.typing import ArrayLike

from cdcore.numerics import FloatArray


def row_translation(amount: ArrayLike) -> FloatArray:
    """C_1: moves by ``amount`` (3,), which stands in the last row. Source: equations (1), (2)."""
    matrix = np.eye(4)
    matrix[3, :3] = amount
    return matrix


def row_scale(scale: ArrayLike, centre: ArrayLike = 0.0) -> FloatArray:
    """C_2 = diag(u, v, w, 1): scales by ``scale`` (3,) about ``centre`` (3,). Source: equation (4).

    Differs: the paper speaks of a scale about the centre P of a body, but its matrix scales about the origin.
    """
    middle, matrix = np.asarray(centre, dtype=np.float64), np.eye(4)
    matrix[[0, 1, 2], [0, 1, 2]] = scale
    return row_translation(-middle) @ matrix @ row_translation(middle)


def row_rotation(axis: int, angle: float) -> FloatArray:
    """C_3, C_4 or C_5: turns about x (``axis`` 0), y (1) or z (2). Source: equations (6)-(9), (11), (13)."""
    matrix, i, j = np.eye(4), (axis + 1) % 3, (axis + 2) % 3
    matrix[i, i] = matrix[j, j] = np.cos(angle)
    matrix[i, j], matrix[j, i] = np.sin(angle), -np.sin(angle)
    return matrix


def apply_row(points: ArrayLike, matrix: FloatArray) -> FloatArray:
    """``[x y z 1] C`` for points (..., 3). Source: equations (3), (5), (10), (12), (14)."""
    return np.asarray(points, dtype=np.float64) @ matrix[:3, :3] + matrix[3, :3]
