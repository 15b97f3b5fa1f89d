"""Findings about rotations that another program wrote in another way: scalar first, or as their inverse.

A head that is upside down at the height of a head shows a quaternion in another order. What a body carries keeps its
place in the body's own frame; where it keeps its place under the inverse rotation only, the inverse was written.
"""

from collections.abc import Iterator
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sessions.doctor.finding import Finding
from sessions.doctor.pose_pass import PosePass
from sessions.doctor.scale import LEAST_HEAD_M, LEAST_SAMPLES, MOST, MOST_HEAD_M, Roles, roles_of
from sessions.geometry.rotations import quaternion_inverse, rotated_vectors
from sessions.model.scene import Scene

WINDOW: Final = 12
"""Samples of an interval in which a body may carry another; about a second."""
MOST_WINDOWS: Final = 100
"""Intervals of each body that are compared, so that an hour takes no longer than minutes."""
MOST_BODIES: Final = 32
LEAST_ROTATION_COSINE: Final = 0.966
"""Cosine of half of 30 degrees, by which a body rotates at least in an interval that tells."""
LEAST_DISTANCE_M: Final = 0.03
"""What is nearer to the origin of its carrier hardly moves with it."""
CARRIED_M: Final = 0.005
"""A carried body keeps its place by this much: twice the noise of a tracker at rest."""
LEAST_DRIFT_M: Final = 0.02
"""Under the wrong rotation it moves by this much."""
LEAST_INTERVALS: Final = 3

FloatArray = NDArray[np.float64]


def rotation_findings(pose_pass: PosePass, scene: Scene) -> Iterator[Finding]:
    """Everything that poses tell about the way in which rotations were written."""
    yield from _upside_down(pose_pass, roles_of(pose_pass.names, scene))
    yield from _inverted(pose_pass, scene)


def _upside_down(pose_pass: PosePass, roles: Roles) -> Iterator[Finding]:
    if "head" not in roles:
        return
    head = roles["head"]
    position, quaternion = pose_pass.position[:, head], pose_pass.quaternion[:, head]
    is_known = np.isfinite(position).all(axis=1) & np.isfinite(quaternion).all(axis=1)
    if is_known.sum() < LEAST_SAMPLES:
        return
    height = float(np.median(position[is_known, 1]))
    is_down = rotated_vectors(quaternion[is_known], (0.0, 1.0, 0.0))[:, 1] < -0.5
    if LEAST_HEAD_M <= height <= MOST_HEAD_M and is_down.mean() > MOST:
        message = f"the crown points down {100 * is_down.mean():.0f} % of the time, at a height of {height:.2f} m"
        yield Finding("rotation-order", message, pose_pass.names[head])


def _inverted(pose_pass: PosePass, scene: Scene) -> Iterator[Finding]:
    names = pose_pass.names[:MOST_BODIES]
    # A body with a parent is in the frame of that, and no room.
    free = [
        column for column, name in enumerate(names) if (declared := scene.body(name)) is None or not declared.parent
    ]
    windows = len(pose_pass.position) // WINDOW
    if len(free) < 2 or not windows:
        return
    shape = windows, WINDOW, len(free)
    position = pose_pass.position[: windows * WINDOW, free].reshape(*shape, 3)
    quaternion = pose_pass.quaternion[: windows * WINDOW, free].reshape(*shape, 4)
    intervals, contrary = 0, 0
    carriers = dict[str, int]()
    for index, column in enumerate(free):
        carried, inverse = _carried_intervals(position, quaternion[:, :, index], index)
        intervals, contrary = intervals + carried, contrary + inverse
        if inverse:
            carriers[names[column]] = inverse
    if contrary >= LEAST_INTERVALS and not intervals:
        for name, count in carriers.items():
            message = f"in {count} intervals of {WINDOW} samples a body keeps its place only if it turns the other way"
            yield Finding("rotation-inverse", message, name, count=count)


def _carried_intervals(position: FloatArray, quaternion: FloatArray, column: int) -> tuple[int, int]:
    """How often another body keeps its place in the frame of a body that rotates, and how often in the inverse frame.

    Parameters
    ----------
    position : (windows, samples, bodies, 3).
    quaternion : (windows, samples, 4) of the body in ``column``.
    """
    cosine = np.abs((quaternion * quaternion[:, :1]).sum(axis=2)).min(axis=1)
    rotating = np.flatnonzero(cosine < LEAST_ROTATION_COSINE)[:MOST_WINDOWS]
    if not len(rotating):
        return 0, 0
    own = position[rotating, :, column, None]
    offset = position[rotating] - own
    rotation = quaternion[rotating][:, :, None]
    # NaN, where a pose is missing, is neither.
    inward = _drift(rotated_vectors(quaternion_inverse(rotation), offset))
    outward = _drift(rotated_vectors(rotation, offset))
    is_distant = np.linalg.norm(offset, axis=3).min(axis=1) > LEAST_DISTANCE_M
    carried = is_distant & (inward < CARRIED_M) & (outward > LEAST_DRIFT_M)
    inverse = is_distant & (outward < CARRIED_M) & (inward > LEAST_DRIFT_M)
    return int(carried.sum()), int(inverse.sum())


def _drift(points: FloatArray) -> FloatArray:
    """Metres that points (windows, samples, bodies, 3) move within a window, the largest along an axis."""
    return np.asarray(np.ptp(points, axis=1).max(axis=2), dtype=np.float64)
