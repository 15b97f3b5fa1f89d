"""Joint angles over time beside an MJCF: poses of all bodies by the library's forward kinematics.

``.npz`` holds ``time`` (T,) in seconds and either ``qpos`` (T, nq) or arrays (T, k) that together are the joints in the
order of the model; an array (T, 7) of a position and a quaternion wxyz also stands for three slides and three hinges.
A CSV has a column ``time`` and one for each joint by its name. Pickles are never loaded.
"""

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from sessions.errors import SceneSourceError
from sessions.input_files import read_text
from sessions.scene_formats.mjcf import mujoco_of

Numbers = NDArray[np.float64]

TIME: Final = "time"
WHOLE: Final = "qpos"
POSE_COLUMNS: Final = 7
POSE_JOINTS: Final = 6
MOST_NUMBERS: Final = 100_000_000
"""Of an array: 800 MB. A file of a few bytes may claim more."""


def read_joint_motion(path: Path, model: Any) -> tuple[Numbers, Numbers]:
    """Seconds (T,) and configurations (T, nq) of a motion.

    Raises ``SceneSourceError``: it is none of this model, or holds Python objects.
    """
    if path.suffix.lower() == ".csv":
        return _of_csv(path, model)
    if path.suffix.lower() != ".npz":
        raise SceneSourceError(f"{path} is no joint motion; give .npz or .csv (pickles are never loaded)")
    arrays = _arrays(path)
    times = arrays.pop(TIME, None)
    if times is None or times.ndim != 1 or not len(times):
        raise SceneSourceError(f"{path} has no array {TIME!r} of seconds; add one")
    tables = {name: array for name, array in arrays.items() if array.ndim == 2 and len(array) == len(times)}
    if WHOLE in tables:
        tables = {WHOLE: tables[WHOLE]}
    return times, _configurations(path, tables, model)


def _arrays(path: Path) -> dict[str, Numbers]:
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
        parts = [_as_joints(array) if is_pose else array for array, is_pose in zip(tables.values(), poses, strict=True)]
        return np.concatenate(parts, axis=1)
    raise SceneSourceError(f"{path} has columns of joints: {joints}; the model has {model.nq}; give one for each")


def _as_joints(poses: Numbers) -> Numbers:
    """Positions and quaternions wxyz (T, 7) as three slides and three hinges about x, y and z in turn, (T, 6)."""
    from scipy.spatial.transform import Rotation

    rotations = Rotation.from_quat(poses[:, [4, 5, 6, 3]])
    return np.concatenate([poses[:, :3], rotations.as_euler("XYZ")], axis=1)


def _of_csv(path: Path, model: Any) -> tuple[Numbers, Numbers]:
    rows = [row for row in csv.reader(read_text(path, "joint motion", SceneSourceError).splitlines()) if row]
    head = [name.strip() for name in rows[0]] if rows else []
    names = {model.joint(number).name: int(model.jnt_qposadr[number]) for number in range(model.njnt)}
    single = {name: place for name, place in names.items() if _width(model, name) == 1}
    missing = [name for name in (TIME, *single) if name not in head]
    if missing or len(single) < len(names):
        which = missing or sorted(names.keys() - single.keys())
        raise SceneSourceError(f"{path} has no column {which[0]!r}; it needs {TIME} and one for each joint")
    try:
        table = np.array([[float(cell) for cell in row] for row in rows[1:]], dtype=np.float64)
    except ValueError as error:
        raise SceneSourceError(f"{path} holds a cell that is no number ({error}); correct it") from error
    if table.ndim != 2 or table.shape[1] != len(head):
        raise SceneSourceError(f"{path} has rows of different lengths, or none; correct it")
    configurations = np.zeros((len(table), model.nq))
    for name, place in single.items():
        configurations[:, place] = table[:, head.index(name)]
    return table[:, head.index(TIME)], configurations


def _width(model: Any, joint: str) -> int:
    mujoco = mujoco_of()
    kind = mujoco.mjtJoint(int(model.joint(joint).type[0]))
    return {mujoco.mjtJoint.mjJNT_FREE: 7, mujoco.mjtJoint.mjJNT_BALL: 4}.get(kind, 1)


def body_poses(model: Any, configurations: Numbers, bodies: Sequence[int]) -> tuple[Numbers, Numbers]:
    """Positions (T, N, 3) and quaternions wxyz (T, N, 4) of bodies in the world of the model, by forward kinematics."""
    mujoco = mujoco_of()
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
