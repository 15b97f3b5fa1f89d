"""Findings about scale and axes: positions that are not in metres, a head at an impossible place or angle.

And about meshes that lie far from the origin of their body.
"""

from collections.abc import Collection, Iterator, Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sessions.doctor.finding import Finding, Span
from sessions.doctor.pose_pass import PosePass
from sessions.errors import SessionError
from sessions.geometry.rotations import rotated_vectors
from sessions.mesh_data import MeshData
from sessions.model.scene import Scene
from sessions.names import DEVICE_TOKENS, HAND_TOKENS, HEAD_TOKENS, SIDES, name_tokens
from sessions.quantities import length, number

FAR_M: Final = 25.0  # Metres from the origin in the median: no tracked room is that large (VIVE: 10 m by 10 m)
MILLIMETRES_M: Final = 400.0  # Beyond this a head would be 4 m up even in centimetres
METRES_PER_UNIT: Final = {"millimetres": 1e-3, "centimetres": 1e-2}
FAST_M: Final = 20.0  # Metres per second in the ordinary step of a moving body: no hand does that

LEAST_HEAD_M, MOST_HEAD_M = 0.7, 2.3
"""Heights of a head, seated to tall; bending over a bench turns the crown but does not leave them."""

MOST: Final = 0.8  # A share of the session that is no accident
LEAST_SAMPLES: Final = 20
LATERAL_GAP_M: Final = 0.05  # Hands closer to each other sideways than this do not tell left from right

LEVEL_M: Final = 0.5  # Metres that a head moves up and down, 10th to 90th percentile; it walks farther

PIVOT_M: Final = 0.5
"""A mesh that begins so far from the origin of its body was not drawn about it: no arm is that long."""
PIVOT_SIZES: Final = 2.0  # ... and so many of its own diagonals: a room may be drawn about a corner of it
AT_ORIGIN_M: Final = 0.1  # Poses that stay so near the origin leave a mesh where it was drawn, as of a table

_HAND_TOKENS = HAND_TOKENS | DEVICE_TOKENS | {*SIDES, "palm"}
FloatArray = NDArray[np.float64]
Roles = dict[str, int]
"""``head``, ``left`` and ``right`` -> column, those that are there."""


def roles_of(names: tuple[str, ...], scene: Scene) -> Roles:
    """Who is head and who is hand, by name; bodies with a parent are in another frame and left out."""
    roles: Roles = {}
    for column, name in enumerate(names):
        declared = scene.body(name)
        tokens = frozenset(name_tokens(name))
        if (declared is not None and declared.parent) or not tokens:
            continue
        if tokens & HEAD_TOKENS and tokens <= HEAD_TOKENS | DEVICE_TOKENS:
            roles.setdefault("head", column)
        elif tokens <= _HAND_TOKENS:
            for side in SIDES:
                if side in tokens:
                    roles.setdefault(side, column)
    return roles


def scale_findings(pose_pass: PosePass, scene: Scene, metadata: Mapping[str, str]) -> Iterator[Finding]:
    """Everything about units and axes that poses alone can tell."""
    for column, name in enumerate(pose_pass.names):
        declared = scene.body(name)
        if declared is None or not declared.parent:
            yield from _units(pose_pass, column, name)
    roles = roles_of(pose_pass.names, scene)
    yield from _up(pose_pass, roles)
    yield from _sides(pose_pass, roles)
    if metadata.get("handedness") == "left" and "hand" not in metadata.get("conversions", ""):
        message = "the facts say that the source was left-handed and name no conversion"
        yield Finding("handedness", message)


def pivot_findings(pose_pass: PosePass, meshes: Mapping[str, MeshData], names: Collection[str]) -> Iterator[Finding]:
    """Meshes, of some names, far from the origin of their body: drawn where they stood in a scene."""
    for column, name in enumerate(pose_pass.names):
        position = _finite_rows(pose_pass.position[:, column])
        if name not in names or not len(position) or _middle_distance(position) < AT_ORIGIN_M:
            continue
        try:
            least, most = meshes[name].bounds
        except SessionError:  # a finding of its own
            continue
        size = float(np.linalg.norm(most - least))
        away = float(np.linalg.norm(np.maximum(0.0, np.maximum(least, -most))))
        if away > max(PIVOT_M, PIVOT_SIZES * size):
            message = f"it is {length(size)} long and lies {length(away)} from the origin of its body"
            yield Finding("mesh-pivot", message, name)


def _middle_distance(position: NDArray[np.float64]) -> float:
    """Largest coordinate of the median of positions (n, 3): how far off the origin a body usually is along an axis."""
    with np.errstate(over="ignore"):
        return float(np.abs(np.median(position, axis=0)).max())


def unit_guess(pose_pass: PosePass, column: int) -> tuple[str, float] | None:
    """The unit that the positions of a body seem to be in, and their median distance; ``None``: metres."""
    position = _finite_rows(pose_pass.position[:, column])
    if len(position) < 2:
        return None
    with np.errstate(over="ignore"):
        far = float(np.median(np.sqrt((position * position).sum(axis=1))))
    speed = _usual_speed(pose_pass, column)
    if far <= FAR_M and speed <= FAST_M:
        return None
    return ("millimetres" if far > MILLIMETRES_M or speed > FAST_M else "centimetres"), far


def _usual_speed(pose_pass: PosePass, column: int) -> float:
    """Metres per second in the ordinary step of a body, of those in which it moves; 0 where these are few."""
    moving = pose_pass.steps[:, column]
    moving = moving[moving > 0]
    step = float(np.median(np.diff(pose_pass.stamp_ns))) / 1e9
    return float(np.median(moving)) / step if len(moving) >= LEAST_SAMPLES and step > 0 else 0.0


def _units(pose_pass: PosePass, column: int, name: str) -> Iterator[Finding]:
    guess = unit_guess(pose_pass, column)
    if guess is not None:
        unit, far = guess
        span = Span.of(pose_pass.stamp_ns, 0, -1)
        if far > FAR_M:
            message = f"{length(far)} from the origin in the median: {unit}?"
            yield span.finding("unit-suspect", message, name, len(pose_pass.stamp_ns))
        else:
            message = f"{number(_usual_speed(pose_pass, column))} m/s in its ordinary step"
            yield span.finding("speed-suspect", message, name, len(pose_pass.stamp_ns))


def _up(pose_pass: PosePass, roles: Roles) -> Iterator[Finding]:
    if "head" not in roles:
        return
    head, name = roles["head"], pose_pass.names[roles["head"]]
    q, position = (_finite_rows(values[:, head]) for values in (pose_pass.quaternion, pose_pass.position))
    if len(q) >= LEAST_SAMPLES:
        # In a wrong unit every height is impossible: that alone says nothing about the axes.
        position = position * METRES_PER_UNIT.get((unit_guess(pose_pass, head) or ("metres",))[0], 1.0)
        height = float(np.median(position[:, 1]))
        up = np.median(rotated_vectors(q, (0.0, 1.0, 0.0)), axis=0)
        axis = int(np.abs(up).argmax())
        if (axis != 1 or up[1] < 0) and not LEAST_HEAD_M <= height <= MOST_HEAD_M:
            sign = "+" if up[axis] > 0 else "-"
            message = f"the crown points along {sign}{'XYZ'[axis]} and is at a height of {height:.2f} m"
            yield Finding("up-axis", message, name)
        else:
            yield from _head_height_elsewhere(position, name)


def _head_height_elsewhere(position: FloatArray, name: str) -> Iterator[Finding]:
    """A head that keeps the height of a head along another axis than Y, whatever its own axes are."""
    middle, spread = np.median(position, axis=0), np.ptp(np.quantile(position, [0.1, 0.9], axis=0), axis=0)
    kept = (middle >= LEAST_HEAD_M) & (middle <= MOST_HEAD_M) & (spread <= LEVEL_M)
    for axis in (2, 0):
        if kept[axis] and not kept[1] and spread.argmin() == axis:
            message = f"it keeps to {middle[axis]:.2f} m along {'XYZ'[axis]}, and its height is {middle[1]:.2f} m"
            yield Finding("up-axis", message, name)


def _sides(pose_pass: PosePass, roles: Roles) -> Iterator[Finding]:
    """The right hand belongs on the right of the head; mirrored coordinates or swapped devices put it on the left."""
    if len(roles) < 3:
        return
    right = rotated_vectors(pose_pass.quaternion[:, roles["head"]], (1.0, 0.0, 0.0))
    lateral_gap = ((pose_pass.position[:, roles["right"]] - pose_pass.position[:, roles["left"]]) * right).sum(axis=1)
    lateral_gap = lateral_gap[np.isfinite(lateral_gap)]
    clear = lateral_gap[np.abs(lateral_gap) > LATERAL_GAP_M]
    mirrored = float((clear < 0).mean()) if len(clear) >= LEAST_SAMPLES else 0.0
    if mirrored > MOST:
        right_name, left_name = (pose_pass.names[roles[side]] for side in ("right", "left"))
        message = f"{right_name} is on the left of {left_name}, as the head sees it, {100 * mirrored:.0f} % of the time"
        yield Finding("handedness", message)


def _finite_rows(rows: FloatArray) -> FloatArray:
    return rows[np.isfinite(rows).all(axis=1)]
