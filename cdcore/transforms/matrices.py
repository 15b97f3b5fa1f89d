"""Equations (1)-(14): points as rows, matrices that act from the right; each is the transpose of its column matrix.

``[x' y' z' 1] = [x y z 1] C``, so a product acts from left to right. The public poses of this project are column
matrices: ``to_column``. There is no sign error in the printed equations; what they leave out is the order of
composition and that a scale is about the origin.

Angles are radians.
"""

from __future__ import annotations

from functools import reduce

import numpy as np
from numpy.typing import ArrayLike

from cdcore.numerics import FloatArray


def row_translation(amount: ArrayLike) -> FloatArray:
    """C_1: moves by ``amount`` (3,), which stands in the last row. Source: equations (1), (2)."""
    matrix = np.eye(4)
    matrix[3, :3] = amount
    return matrix


def row_scale(scale: ArrayLike) -> FloatArray:
    """C_2 = diag(u, v, w, 1): scales about the origin by ``scale`` (3,) or one number. Source: equation (4)."""
    matrix = np.eye(4)
    matrix[[0, 1, 2], [0, 1, 2]] = scale
    return matrix


def row_scale_about(scale: ArrayLike, centre: ArrayLike) -> FloatArray:
    """Scales about a centre (3,), which stays where it is: ``T(-c) C_2 T(c)``.

    Differs: equation (4) moves a body centred at P to (u Px, v Py, w Pz), though the paper speaks of a scale about P.
    """
    middle = np.asarray(centre, dtype=np.float64)
    return row_product(row_translation(-middle), row_scale(scale), row_translation(middle))


def row_rotation_x(angle: float) -> FloatArray:
    """C_3: y' = y cos a - z sin a, z' = y sin a + z cos a. Source: equations (6)-(9)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1.0, 0, 0, 0], [0, c, s, 0], [0, -s, c, 0], [0, 0, 0, 1]])


def row_rotation_y(angle: float) -> FloatArray:
    """C_4: x' = x cos b + z sin b, z' = -x sin b + z cos b. Source: equation (11)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0, -s, 0], [0, 1.0, 0, 0], [s, 0, c, 0], [0, 0, 0, 1]])


def row_rotation_z(angle: float) -> FloatArray:
    """C_5: x' = x cos g - y sin g, y' = x sin g + y cos g. Source: equation (13)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, s, 0, 0], [-s, c, 0, 0], [0, 0, 1.0, 0], [0, 0, 0, 1]])


def row_product(*matrices: FloatArray) -> FloatArray:
    """The row matrix that acts as the first, then the second, and so on."""
    return reduce(np.matmul, matrices, np.eye(4))


def row_local_to_world(scale: ArrayLike, rotation: FloatArray, translation: ArrayLike) -> FloatArray:
    """``S R T``: scale, then rotate, then translate; ``R S T`` would shear.

    Parameters
    ----------
    scale, translation : (3,).
    rotation : (4, 4) row matrix.
    """
    return row_product(row_scale(scale), rotation, row_translation(translation))


def row_unity_euler(x: float, y: float, z: float) -> FloatArray:
    """Unity's Euler angles, which act about z, then x, then y: ``C_5(z) C_3(x) C_4(y)``, in Unity's own frame."""
    return row_product(row_rotation_z(z), row_rotation_x(x), row_rotation_y(y))


def apply_row(points: ArrayLike, matrix: FloatArray) -> FloatArray:
    """``[x y z 1] C`` for points (..., 3). Source: equations (3), (5), (10), (12), (14)."""
    given = np.asarray(points, dtype=np.float64)
    moved: FloatArray = given @ matrix[:3, :3] + matrix[3, :3]
    return moved


def to_column(matrix: FloatArray) -> FloatArray:
    """The column matrix of a row matrix, and back: the transpose of the last two axes."""
    return np.ascontiguousarray(np.swapaxes(matrix, -1, -2))
