"""Joint angles over time beside an MJCF: poses of all bodies by the library's forward kinematics.

``.npz`` holds ``time`` (T,) in seconds and either ``qpos`` (T, nq) or arrays (T, k) that together are the joints in the
order of the model; an array (T, 7) of a position and a quaternion wxyz also stands for three slides and three hinges.
A CSV has a column ``time`` and one for each joint by its name. Pickles are never loaded. A body is lost where a joint
above it has no number, or a quaternion that is not of length 1.
"""

import csv
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final
from zipfile import BadZipFile, is_zipfile

import numpy as np
from numpy.typing import NDArray

from sessions.errors import SceneSourceError
from sessions.input_files import kind_of_file, open_input, read_text
from sessions.scene_formats.mjcf import mujoco_of

Numbers = NDArray[np.float64]

TIME: Final = "time"
WHOLE: Final = "qpos"
QUATERNION_TOLERANCE: Final = 1e-3
"""A quaternion whose length is further off 1 is no rotation."""
UNLIKELY_BEYOND_RAD: Final = 0.2
"""A simulator lets a hinge give way by less beyond its range."""
POSE_COLUMNS: Final = 7
POSE_JOINTS: Final = 6
MOST_NUMBERS: Final = 100_000_000
"""Of an array: 800 MB. A file of a few bytes may claim more."""


@dataclass(frozen=True, eq=False)
class JointMotion:
    """Joint angles over time.

    Parameters
    ----------
    seconds : (T,), finite.
    configurations : (T, nq).
    notes : sentences on what is not read, and on what is unlikely.
    """

    seconds: Numbers
    configurations: Numbers
    notes: tuple[str, ...] = ()


def read_joint_motion(path: Path, model: Any) -> JointMotion:
    """The joint motion in a file.

    Raises ``SceneSourceError``: it is none of this model, holds Python objects or a row without a time, or its angles
    are in degrees.
    """
    if path.suffix.lower() == ".csv":
        motion = _of_csv(path, model)
    elif path.suffix.lower() == ".npz":
        motion = _of_npz(path, model)
    else:
        raise SceneSourceError(f"{path} is no joint motion; give .npz or .csv (pickles are never loaded)")
    timeless = np.flatnonzero(~np.isfinite(motion.seconds))
    if len(timeless):
        raise SceneSourceError(f"{path}: row {int(timeless[0]) + 1} has no time; remove it or repair the file")
    return replace(motion, notes=(*motion.notes, *_angles_beyond_ranges(path, motion.configurations, model)))


def _angles_beyond_ranges(path: Path, configurations: Numbers, model: Any) -> Iterator[str]:
    """A sentence on each hinge that leaves its range; SceneSourceError where it does so by more than a turn."""
    mujoco = mujoco_of()
    for number in range(model.njnt):
        joint = model.joint(number)
        if joint.type[0] != mujoco.mjtJoint.mjJNT_HINGE or not model.jnt_limited[number]:
            continue
        angles = configurations[:, model.jnt_qposadr[number]]
        angles = angles[np.isfinite(angles)]
        lower, upper = model.jnt_range[number]
        beyond = float(np.maximum(angles - upper, lower - angles).max(initial=0.0))
        if beyond > 2.0 * np.pi:
            raise SceneSourceError(
                f"{path}: joint {joint.name!r} leaves its range of {lower:.3g} to {upper:.3g} rad by {beyond:.3g} rad, "
                "more than a turn; write angles in radians"
            )
        if beyond > UNLIKELY_BEYOND_RAD:
            yield f"joint {joint.name!r} leaves its range by up to {beyond:.3g} rad; are its angles in radians?"


def _of_npz(path: Path, model: Any) -> JointMotion:
    arrays = _arrays(path)
    times = arrays.pop(TIME, None)
    if times is None or times.ndim != 1 or not len(times):
        raise SceneSourceError(f"{path} has no array {TIME!r} of seconds; add one")
    tables = {name: array for name, array in arrays.items() if array.ndim == 2 and len(array) == len(times)}
    if WHOLE in tables:
        tables = {WHOLE: tables[WHOLE]}
    unread = [name for name in arrays if name not in tables]
    notes = (f"arrays that are not read: {', '.join(unread)}",) if unread else ()
    return JointMotion(times, _configurations(path, tables, model), notes)


def _arrays(path: Path) -> dict[str, Numbers]:
    with open_input(path, "joint motion", SceneSourceError) as stream:
        is_empty = not stream.read(1)
    kind = kind_of_file(path)
    if is_empty or (kind is not None and not is_zipfile(path)):
        raise SceneSourceError(f"joint motion {path} is {kind or 'empty; save it again'}")
    try:
        with np.load(path, allow_pickle=False) as archive:
            for name in archive.files:
                size = archive.zip.getinfo(f"{name}.npy").file_size
                if size > 8 * MOST_NUMBERS:
                    raise SceneSourceError(f"{path}: array {name!r} has {size / 1e6:,.0f} MB; a motion has fewer")
            return {name: np.asarray(archive[name], dtype=np.float64) for name in archive.files}
    except (ValueError, TypeError, OSError, KeyError, EOFError, BadZipFile) as error:
        raise SceneSourceError(
            f"{path} is no readable .npz of numbers ({error}); save it with numpy.savez, without objects"
        ) from error


def _configurations(path: Path, tables: Mapping[str, Numbers], model: Any) -> Numbers:
    widths = [array.shape[1] for array in tables.values()]
    poses = [width == POSE_COLUMNS for width in widths]
    joints = ", ".join(f"{name} {array.shape[1]}" for name, array in tables.items()) or "none"
    if sum(widths) == model.nq:
        return np.concatenate([*tables.values()], axis=1)
    if sum(widths) - sum(poses) == model.nq:
        columns = [
            _as_joints(array) if is_pose else array for array, is_pose in zip(tables.values(), poses, strict=True)
        ]
        return np.concatenate(columns, axis=1)
    raise SceneSourceError(f"{path} has columns of joints: {joints}; the model has {model.nq}; give one for each")


def _as_joints(poses: Numbers) -> Numbers:
    """Positions and quaternions wxyz (T, 7) as three slides and three hinges about x, y and z in turn, (T, 6)."""
    from scipy.spatial.transform import Rotation

    rotations = Rotation.from_quat(poses[:, [4, 5, 6, 3]])
    return np.concatenate([poses[:, :3], rotations.as_euler("XYZ")], axis=1)


def _of_csv(path: Path, model: Any) -> JointMotion:
    rows = [row for row in csv.reader(read_text(path, "joint motion", SceneSourceError).splitlines()) if row]
    head = [name.strip() for name in rows[0]] if rows else []
    repeated = [name for name, count in Counter(head).items() if count > 1]
    if repeated:
        raise SceneSourceError(f"{path}: column {repeated[0]!r} occurs twice; rename or remove one")
    names = {model.joint(number).name: number for number in range(model.njnt)}
    single = {name: int(model.jnt_qposadr[number]) for name, number in names.items() if _width_of(model, number) == 1}
    missing = [name for name in (TIME, *single) if name not in head]
    if missing or len(single) < len(names):
        which = missing or sorted(names.keys() - single.keys())
        raise SceneSourceError(f"{path} has no column {which[0]!r}; it needs {TIME} and one for each joint")
    if len(rows) < 2 or any(len(row) != len(head) for row in rows):
        raise SceneSourceError(f"{path} has rows of different lengths, or none; correct it")
    try:
        table = np.array([[float(cell) for cell in row] for row in rows[1:]], dtype=np.float64)
    except ValueError as error:
        raise SceneSourceError(f"{path} holds a cell that is no number ({error}); correct it") from error
    configurations = np.zeros((len(table), model.nq))
    for name, address in single.items():
        configurations[:, address] = table[:, head.index(name)]
    unread = [name for name in head if name not in (TIME, *single)]
    notes = (f"columns that are not read: {', '.join(unread)}",) if unread else ()
    return JointMotion(table[:, head.index(TIME)], configurations, notes)


def _width_of(model: Any, joint: int) -> int:
    """How many numbers a joint has in a configuration."""
    mujoco = mujoco_of()
    kind = mujoco.mjtJoint(int(model.jnt_type[joint]))
    return {mujoco.mjtJoint.mjJNT_FREE: 7, mujoco.mjtJoint.mjJNT_BALL: 4}.get(kind, 1)


def posed_bodies(model: Any, configurations: Numbers, bodies: Sequence[int]) -> NDArray[np.bool_]:
    """Whether every joint above a body has a position, (T, N): numbers, and quaternions of length 1."""
    valid = np.ones((len(configurations), model.nbody), dtype=np.bool_)
    for number in range(model.njnt):
        start, width = int(model.jnt_qposadr[number]), _width_of(model, number)
        values = configurations[:, start : start + width]
        is_posed = np.isfinite(values).all(axis=1)
        if width > 1:
            with np.errstate(over="ignore", invalid="ignore"):
                lengths = np.linalg.norm(values[:, -4:], axis=1)
            is_posed &= np.abs(lengths - 1.0) <= QUATERNION_TOLERANCE
        valid[:, int(model.jnt_bodyid[number])] &= is_posed
    for body in range(1, model.nbody):  # a parent comes before its children
        valid[:, body] &= valid[:, int(model.body_parentid[body])]
    return valid[:, list(bodies)]


def body_poses(model: Any, configurations: Numbers, bodies: Sequence[int]) -> tuple[Numbers, Numbers]:
    """Positions (T, N, 3) and quaternions wxyz (T, N, 4) of bodies in the world of the model, by forward kinematics."""
    mujoco = mujoco_of()
    configurations = np.where(np.isfinite(configurations), configurations, model.qpos0)
    data = mujoco.MjData(model)
    positions, quaternions = (
        np.empty((len(configurations), len(bodies), 3)),
        np.empty((len(configurations), len(bodies), 4)),
    )
    for frame, configuration in enumerate(configurations):
        data.qpos[:] = configuration
        mujoco.mj_kinematics(model, data)
        positions[frame], quaternions[frame] = data.xpos[list(bodies)], data.xquat[list(bodies)]
    return positions, quaternions
