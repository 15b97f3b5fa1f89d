"""Rigid poses: a rotation (3, 3) body to world, column convention, and a translation (3,) in metres.

Every question about poses has one answer here for arrays and one in ``cdcore.poses.kernels`` for kernels; the tests
hold them against each other. ``cdcore.poses.corrupt_poses`` refuses poses that are not finite and rigid. This
module needs no compiler, so that a program that reads a session starts without one.
"""

import numpy as np

from cdcore.numerics import BoolArray, FloatArray


def place_points(points: FloatArray, rotation: FloatArray, translation: FloatArray) -> FloatArray:
    """Place body points in the world: the *reference vertices* of all exact tests.

    ``x' = ((r00 x + r01 y) + r02 z) + t0`` in float64, in this order, without BLAS and without fused multiply-add, so
    that every machine gets the same bits. Every confirmation of a contact uses these points; searches and trees may use
    any other arithmetic with a bound that covers the difference.

    ``points`` (..., n, 3) body coordinates, ``rotation`` (..., 3, 3) body to world, column convention, ``translation``
    (..., 3), in metres, give (..., n, 3) world coordinates.
    """
    x, y, z = points[..., 0], points[..., 1], points[..., 2]
    rows = [
        ((rotation[..., i, 0, None] * x + rotation[..., i, 1, None] * y) + rotation[..., i, 2, None] * z)
        + translation[..., i, None]
        for i in range(3)
    ]
    return np.stack(rows, axis=-1)


def relative_pose(
    rotation_a: FloatArray, translation_a: FloatArray, rotation_b: FloatArray, translation_b: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Poses of B in A's frame: rotations (..., 3, 3) and translations (..., 3).

    Products of matrices may round in any order: who dismisses by them keeps a pad (``cdcore.narrow.bvh.bounds``).
    """
    world_to_a = np.swapaxes(rotation_a, -1, -2)
    translation = world_to_a @ (translation_b - translation_a)[..., None]
    return world_to_a @ rotation_b, translation[..., 0]


def changed_poses(rotation: FloatArray, translation: FloatArray) -> BoolArray:
    """Whether each pose differs from the one before it in any number, (n,); the first one counts as changed.

    ``rotation`` (n, ..., 3, 3) and ``translation`` (n, ..., 3): axes between are bodies that change together.
    """
    changed = np.ones(len(rotation), dtype=np.bool_)
    rotations, translations = rotation.reshape(len(rotation), -1), translation.reshape(len(translation), -1)
    changed[1:] = (rotations[1:] != rotations[:-1]).any(axis=1) | (translations[1:] != translations[:-1]).any(axis=1)
    return changed


def length_moved(rotation: FloatArray, translation: FloatArray, centre: FloatArray, radius: float) -> FloatArray:
    """Metres (n - 1,) that no point of a ball moves more between poses (n, 3, 3), (n, 3) that follow each other.

    The centre moves by the length of its step, and other points by no more than the Frobenius norm of the change of
    rotation times the radius beside that. Rounding is not covered.
    """
    rotation_change, step = np.diff(rotation, axis=0), np.diff(translation, axis=0)
    moved = step + (rotation_change * centre).sum(axis=2)
    return np.sqrt((rotation_change**2).sum(axis=(1, 2))) * radius + np.sqrt((moved**2).sum(axis=1))


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
    row_x = [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)]
    row_y = [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)]
    row_z = [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]
    return np.stack(row_x + row_y + row_z, axis=-1).reshape(*q.shape[:-1], 3, 3)
