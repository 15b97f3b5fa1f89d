"""What a proof speaks of, read through ``sessions`` alone: meshes, and the poses that a recording gives its bodies.

A recorded pose is used as it is: its quaternion, divided by its norm, as a matrix; then parents, offsets and fixed
bodies of the scene. Where the recording holds no sample of a body in a frame, the proof gives the pose.
"""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Iterable, Sequence
from functools import reduce
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from replay.proof.claims import Flags, Floats, Mesh, Poses, Proof, WrongRecord
from sessions import Frames, Session, Status
from sessions.doctor.pose_pass import look_through
from sessions.doctor.pose_spans import pose_spans
from sessions.model.constants import BLOCK_FRAMES
from sessions.model.scene import Pose, SceneBody

USABLE: Final = (Status.VALID, Status.HELD, Status.INTERPOLATED)
ORIGINS: Final = {0: "left_out", 1: "recorded", 2: "held", 3: "interpolated", 4: "fixed"}
GIVEN: Final = (0, 2, 3)
"""Origins of poses that a proof may give."""


class Recorded(NamedTuple):
    """The T frames whose stamps increase, and where the recording alone puts N bodies in them."""

    stamp_ns: NDArray[np.int64]
    poses: Poses


def mesh_of(session: Session, name: str) -> Mesh:
    """The mesh of a body; ``WrongRecord``: there is none."""
    if name not in session.meshes:
        raise WrongRecord(f"the recording holds no mesh of {name}")
    mesh = session.meshes[name]
    return Mesh(np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int64))


def mesh_hash(mesh: Mesh) -> str:
    """SHA-256 of the numbers of a mesh."""
    parts = mesh.vertices.astype("<f8").tobytes(), mesh.faces.astype("<i4").tobytes()
    return hashlib.sha256(len(mesh.vertices).to_bytes(8, "little") + b"".join(parts)).hexdigest()


def scene_hash(session: Session) -> str:
    """SHA-256 of the declared scene."""
    return hashlib.sha256(repr(session.scene).encode()).hexdigest()


def chain(session: Session, name: str) -> list[str]:
    """A body and those that carry it."""
    names = [name]
    while (declared := session.scene.body(names[-1])) is not None and declared.parent:
        if declared.parent in names:
            raise WrongRecord(f"the parents of {name} run in a circle")
        names.append(declared.parent)
    return names


def recorded(session: Session, names: Sequence[str]) -> Recorded:
    """Where the recording puts these bodies, frame by frame."""
    frames = session.frames
    latest = np.maximum.accumulate(np.concatenate([[np.iinfo(np.int64).min], frames.stamp_ns]))
    kept = np.flatnonzero(frames.stamp_ns > latest[:-1])
    worlds = [_mesh_world(session, frames, kept, name) for name in names]
    shape = (len(kept), len(names))
    poses = Poses(np.zeros(shape, dtype=np.bool_), np.zeros((*shape, 3, 3)), np.zeros((*shape, 3)))
    for own, parts in zip(poses, zip(*worlds, strict=True), strict=True):
        for column, its in enumerate(parts):
            own[:, column] = its
    poses.rotation[~poses.valid], poses.translation[~poses.valid] = np.eye(3), 0.0
    return Recorded(frames.stamp_ns[kept], poses)


def _mesh_world(session: Session, frames: Frames, kept: NDArray[np.int64], name: str) -> Poses:
    """Of the mesh of one body, (T, ...)."""
    *parents, root = (_own(session.scene.body(one), frames, kept, one) for one in chain(session, name))
    world = reduce(_then, reversed(parents), root)
    declared = session.scene.body(name)
    return world if declared is None or declared.offset == Pose() else _then(world, _at_rest(declared.offset))


def _then(world: Poses, child: Poses) -> Poses:
    """Poses given in a body's frame, in the world; sums in a fixed order, each step rounded once."""
    x, y, z = (world.rotation[..., :, k] * child.translation[..., k, None] for k in range(3))
    moved = (x + y) + z + world.translation
    x, y, z = (world.rotation[..., :, k, None] * child.rotation[..., None, k, :] for k in range(3))
    return Poses(world.valid & child.valid, (x + y) + z, moved)


def _own(declared: SceneBody | None, frames: Frames, kept: NDArray[np.int64], name: str) -> Poses:
    if name in frames.names:
        column = frames.names.index(name)
        valid = np.isin(frames.status[kept, column], USABLE)
        with np.errstate(invalid="ignore", divide="ignore"):
            turn = matrices(frames.quaternion_xyzw[kept, column])
        return Poses(valid, turn, frames.position[kept, column])
    if declared is None or declared.fixed is None:
        raise WrongRecord(f"the recording holds no track of {name}")
    return _at_rest(declared.fixed)


def _at_rest(pose: Pose) -> Poses:
    turn = matrices(np.array([pose.quaternion_xyzw], dtype=np.float64))
    return Poses(np.ones(1, dtype=np.bool_), turn, np.array([pose.position], dtype=np.float64))


def matrices(quaternion: Floats) -> Floats:
    """Rotations (..., 3, 3) of quaternions (..., 4) xyzw, divided by their norm first, each step rounded once."""
    x, y, z, w = np.moveaxis(quaternion, -1, 0)
    norm = np.sqrt(((x * x + y * y) + z * z) + w * w)
    x, y, z, w = x / norm, y / norm, z / norm, w / norm
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def load(session: Session, proof: Proof) -> tuple[list[Mesh], Poses, Counter[str]]:
    """Meshes and poses that the proof speaks of, and how many poses came whence; ``WrongRecord``: other ones."""
    header = proof.header
    meshes = [mesh_of(session, name) for name in header["bodies"]]
    for name, mesh, digest in zip(header["bodies"], meshes, header["meshes"], strict=True):
        if mesh_hash(mesh) != digest:
            raise WrongRecord(f"body {name}: the recording holds another mesh")
    if scene_hash(session) != header["scene"]:
        raise WrongRecord("the recording holds another scene")
    known = recorded(session, header["bodies"])
    first, stop = header["frames"]
    if not 0 <= first < stop <= len(known.stamp_ns):
        raise WrongRecord(f"the recording holds no frames {first} to {stop - 1}")
    poses = known.poses.part(first, stop)
    told = _overlay(session, proof, known.stamp_ns[first:stop], poses)
    return meshes, poses, told


def _overlay(session: Session, proof: Proof, stamp_ns: NDArray[np.int64], poses: Poses) -> Counter[str]:
    """Put the poses that the proof gives where the recording has none, or where a policy replaced one."""
    names, told = proof.header["bodies"], Counter[str]()
    _check_flags(session, proof.header["flags"])
    flagged = [_flagged(proof.header["flags"], chain(session, name), stamp_ns) for name in names]
    for row, pose in zip(proof["given_rows"].tolist(), proof["given_poses"], strict=True):
        body, first, last, origin = row
        if not (0 <= body < len(names) and 0 <= first <= last < len(stamp_ns) and origin in GIVEN):
            raise WrongRecord(f"given pose {row} is of no body, frame or origin")
        rows = slice(first, last + 1)
        if (poses.valid[rows, body] & ~flagged[body][rows]).any():
            raise WrongRecord(f"body {names[body]}, frames {first} to {last}: the recording holds another pose")
        poses.valid[rows, body] = origin != 0
        poses.rotation[rows, body], poses.translation[rows, body] = pose[:9].reshape(3, 3), pose[9:]
        told[ORIGINS[origin]] += last + 1 - first
    told[ORIGINS[1]] = int(poses.valid.sum()) - told[ORIGINS[2]] - told[ORIGINS[3]]
    return told


def _check_flags(session: Session, flags: Iterable[Sequence[Any]]) -> None:
    """Refuse a flag that the doctor of recordings does not set."""
    if flags:
        looked = look_through(session.blocks(BLOCK_FRAMES), session.scene.space_radius)
        ends = ((one, *looked.stamp_ns[[one.first, one.last]].tolist()) for one in pose_spans(looked))
        known = {(one.code, looked.names[one.column], start, end) for one, start, end in ends}
        for kind, body, start, end, _ in flags:
            if (kind, body, start, end) not in known:
                raise WrongRecord(f"body {body}: the doctor finds it nowhere {kind} from {start} to {end} ns")


def _flagged(flags: Iterable[Sequence[Any]], names: Sequence[str], stamp_ns: NDArray[np.int64]) -> Flags:
    """The frames (T,) in which a policy touched one of these bodies."""
    marked = np.zeros(len(stamp_ns), dtype=np.bool_)
    for _, body, start, end, _ in flags:
        if body in names:
            marked |= (stamp_ns >= start) & (stamp_ns <= end)
    return marked
