"""From what trackers and joints report to where meshes are: parents, offsets and fixed bodies of a scene.

``world(body mesh) = world(parent) . recorded pose . offset``; a child has a pose only where its parent has one. A
parent is met in its tracker's frame, before its own offset. Bodies without parent and offset keep the bits of their
recorded pose.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cdcore.transforms.rigid import rotation_from_quaternion
from replay.assembly import PoseOrigin
from replay.errors import AssemblyError
from replay.pose_filling import FilledFrames
from sessions.scene import Pose, Scene

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PlacedFrames:
    """World poses of the meshes of N bodies in T frames.

    Parameters
    ----------
    stamp_ns : (T,) int64.
    translation : (T, N, 3), zeros where there is no pose.
    rotation : (T, N, 3, 3), identity where there is no pose.
    origin : (T, N) uint8, values of ``PoseOrigin``.
    """

    stamp_ns: NDArray[np.int64]
    translation: FloatArray
    rotation: FloatArray
    origin: NDArray[np.uint8]

    def __len__(self) -> int:
        return len(self.stamp_ns)

    def part(self, start: int, stop: int) -> PlacedFrames:
        """Frames ``start <= t < stop`` as views."""
        rows = slice(start, stop)
        return PlacedFrames(self.stamp_ns[rows], self.translation[rows], self.rotation[rows], self.origin[rows])

    @classmethod
    def join(cls, parts: Sequence[PlacedFrames]) -> PlacedFrames:
        """Blocks after each other."""
        if len(parts) == 1:
            return parts[0]
        return cls(
            np.concatenate([part.stamp_ns for part in parts]),
            np.concatenate([part.translation for part in parts]),
            np.concatenate([part.rotation for part in parts]),
            np.concatenate([part.origin for part in parts]),
        )


@dataclass(frozen=True, eq=False)
class _World:
    """One body's frame in the world over T frames; a body at rest in the world has one row."""

    translation: FloatArray
    rotation: FloatArray
    origin: NDArray[np.uint8]

    def then(self, translation: FloatArray, rotation: FloatArray) -> _World:
        """This frame followed by a pose given in it."""
        moved = _turned(self.rotation, translation) + self.translation
        return _World(moved, _product(self.rotation, rotation), self.origin)


class Placing:
    """Where the meshes of the chosen bodies are, frame block by frame block.

    Parameters
    ----------
    scene : parents, offsets, fixed poses.
    tracked : names of the recorded bodies, one per column of the filled frames.
    bodies : names of the bodies wanted, in order; each tracked or fixed.

    Raises
    ------
    AssemblyError
        A parent that is neither tracked nor fixed, or a circle of parents.
    """

    def __init__(self, scene: Scene, tracked: Sequence[str], bodies: Sequence[str]) -> None:
        self._scene = scene
        self._column = {name: number for number, name in enumerate(tracked)}
        self._bodies = tuple(bodies)
        for name in bodies:
            self._check_chain(name)

    def place(self, frames: FilledFrames) -> PlacedFrames:
        """World poses of the chosen bodies."""
        known: dict[str, _World] = {}
        count, width = len(frames), len(self._bodies)
        translation, rotation = np.zeros((count, width, 3)), np.zeros((count, width, 3, 3))
        origin = np.zeros((count, width), dtype=np.uint8)
        for column, name in enumerate(self._bodies):
            world = self._mesh_frame(name, frames, known)
            translation[:, column], rotation[:, column] = world.translation, world.rotation
            origin[:, column] = world.origin
        none = origin == PoseOrigin.NONE
        translation[none], rotation[none] = 0.0, np.eye(3)
        return PlacedFrames(frames.stamp_ns, translation, rotation, origin)

    def _mesh_frame(self, name: str, frames: FilledFrames, known: dict[str, _World]) -> _World:
        world = self._body_frame(name, frames, known)
        declared = self._scene.body(name)
        if declared is None or declared.offset == Pose():
            return world
        return world.then(*_matrix(declared.offset))

    def _body_frame(self, name: str, frames: FilledFrames, known: dict[str, _World]) -> _World:
        if name not in known:
            own = self._own_pose(name, frames)
            declared = self._scene.body(name)
            if declared is not None and declared.parent:
                parent = self._body_frame(declared.parent, frames, known)
                own = _World(
                    *_shared(parent.then(own.translation, own.rotation), own.origin, parent.origin)
                )  # fmt: skip
            known[name] = own
        return known[name]

    def _own_pose(self, name: str, frames: FilledFrames) -> _World:
        """The pose as recorded or declared, relative to the parent or the world."""
        if name in self._column:
            column = self._column[name]
            rotation = rotation_from_quaternion(frames.quaternion_xyzw[:, column])
            return _World(frames.position[:, column], rotation, frames.origin[:, column])
        declared = self._scene.body(name)
        assert declared is not None and declared.fixed is not None
        translation, rotation = _matrix(declared.fixed)
        return _World(translation, rotation, np.array([PoseOrigin.FIXED], dtype=np.uint8))

    def _check_chain(self, name: str) -> None:
        chain = [name]
        while True:
            declared = self._scene.body(chain[-1])
            if chain[-1] not in self._column and (declared is None or declared.fixed is None):
                raise AssemblyError(
                    f"body {chain[-1]!r}, parent of {chain[-2]!r}, has neither a track nor a fixed pose; "
                    "record it, give it `fixed`, or take `parent` away"
                )
            if declared is None or not declared.parent:
                return
            if declared.parent in chain:
                circle = " -> ".join([*chain, declared.parent])
                raise AssemblyError(f"the parents of body {name!r} run in a circle: {circle}; break it")
            chain.append(declared.parent)


def _shared(
    world: _World, own: NDArray[np.uint8], parent: NDArray[np.uint8]
) -> tuple[FloatArray, FloatArray, NDArray[np.uint8]]:
    """A child is there only where its parent is; then as good as its own pose, or as the parent it is fixed to."""
    own, parent = np.broadcast_arrays(own, parent)
    origin = np.where(own == PoseOrigin.FIXED, parent, own)
    return (
        world.translation,
        world.rotation,
        np.where(parent == PoseOrigin.NONE, PoseOrigin.NONE, origin).astype(np.uint8),
    )


def _matrix(pose: Pose) -> tuple[FloatArray, FloatArray]:
    quaternion = np.array([pose.quaternion_xyzw], dtype=np.float64)
    return np.array([pose.position], dtype=np.float64), rotation_from_quaternion(quaternion)


def _turned(rotation: FloatArray, vector: FloatArray) -> FloatArray:
    """``R v`` row by row, summed in a fixed order so that every machine and block size gets the same bits."""
    x, y, z = (rotation[..., :, k] * vector[..., k, None] for k in range(3))
    turned: FloatArray = (x + y) + z
    return turned


def _product(a: FloatArray, b: FloatArray) -> FloatArray:
    """``A B`` matrix by matrix, summed in a fixed order."""
    x, y, z = (a[..., :, k, None] * b[..., None, k, :] for k in range(3))
    product: FloatArray = (x + y) + z
    return product
