"""Kinematics: from poses of trackers and joints to those of meshes, by parents, offsets and fixed bodies of a scene.

``world(body mesh) = world(parent) . recorded pose . offset``; a child has a pose only where its parent has one. A
parent is met in its tracker's frame, before its own offset. Bodies without parent and offset keep the bits of their
recorded pose.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from cdcore.numerics import ByteArray, FloatArray
from cdcore.poses import rotation_from_quaternion
from replay.errors import AssemblyError
from replay.prepare.assembly import PoseOrigin
from replay.prepare.flags import chain_of
from replay.prepare.interpolation import FilledFrames
from sessions.model.scene import Pose, Scene, SceneBody


class Placed(NamedTuple):
    """World poses of the meshes of N bodies in T frames."""

    translation: FloatArray  # (T, N, 3), zeros where there is no pose
    rotation: FloatArray  # (T, N, 3, 3), identity where there is no pose
    origin: ByteArray  # (T, N) uint8, values of ``PoseOrigin``

    @classmethod
    def empty(cls, frame_count: int, bodies: int) -> "Placed":
        """Room for so many poses."""
        shape = frame_count, bodies
        return cls(np.empty((*shape, 3)), np.empty((*shape, 3, 3)), np.empty(shape, dtype=np.uint8))


@dataclass(frozen=True, eq=False)
class _World:
    """One body's frame in the world over T frames; a body at rest in the world has one row."""

    translation: FloatArray
    rotation: FloatArray
    origin: ByteArray

    def compose(self, child: "_World") -> "_World":
        """A pose given in this frame, in the world.

        A child has a pose only where its parent has one; its origin is its own, or its parent's where it is fixed.
        """
        of_child, of_parent = np.broadcast_arrays(child.origin, self.origin)
        origin = np.where(of_child == PoseOrigin.FIXED, of_parent, of_child)
        origin = np.where(of_parent == PoseOrigin.NONE, PoseOrigin.NONE, origin).astype(np.uint8)
        # ``R t`` and ``A B`` are summed in a fixed order, so that every machine and block size gets the same bits.
        x, y, z = (self.rotation[..., :, k] * child.translation[..., k, None] for k in range(3))
        translated = (x + y) + z + self.translation
        x, y, z = (self.rotation[..., :, k, None] * child.rotation[..., None, k, :] for k in range(3))
        return _World(translated, (x + y) + z, origin)


class Kinematics:
    """Poses of the meshes of the chosen bodies, frame block by frame block.

    ``tracked_names`` names the columns of the filled frames; each of ``bodies`` is tracked or fixed. Raises
    ``AssemblyError``: a parent that is neither tracked nor fixed, or a circle of parents.
    """

    def __init__(self, scene: Scene, tracked_names: Sequence[str], bodies: Sequence[str]) -> None:
        self._scene = scene
        self._column = {name: number for number, name in enumerate(tracked_names)}
        self._bodies = tuple(bodies)
        for name in bodies:
            self._check_chain(name)

    def place(self, frames: FilledFrames, placed: Placed) -> None:
        """Write the world poses of the chosen bodies into ``placed``, as many frames of them."""
        tracker_frames: dict[str, _World] = {}
        translation, rotation, origin = placed
        for column, name in enumerate(self._bodies):
            world_pose, offset = self._tracker_frame(name, frames, tracker_frames), self._declared_body(name).offset
            if offset != Pose():
                world_pose = world_pose.compose(_at_rest(offset))
            translation[:, column], rotation[:, column] = world_pose.translation, world_pose.rotation
            origin[:, column] = world_pose.origin
        has_no_pose = origin == PoseOrigin.NONE
        translation[has_no_pose], rotation[has_no_pose] = 0.0, np.eye(3)

    def _declared_body(self, name: str) -> SceneBody:
        return self._scene.body(name) or SceneBody(name)

    def _tracker_frame(self, name: str, frames: FilledFrames, tracker_frames: dict[str, _World]) -> _World:
        """The frame of a tracker, joint or fixed body in the world; ``tracker_frames`` are those computed before."""
        if name not in tracker_frames:
            declared_body = self._declared_body(name)
            if name in self._column:
                column = self._column[name]
                rotation = rotation_from_quaternion(frames.quaternion_xyzw[:, column])
                in_parent = _World(frames.position[:, column], rotation, frames.origin[:, column])
            else:
                in_parent = _at_rest(declared_body.fixed or Pose())
            tracker_frames[name] = (
                self._tracker_frame(declared_body.parent, frames, tracker_frames).compose(in_parent)
                if declared_body.parent
                else in_parent
            )
        return tracker_frames[name]

    def _check_chain(self, name: str) -> None:
        names_in_chain = chain_of(name, self._scene)
        for child, body in pairwise([name, *names_in_chain]):
            if body not in self._column and self._declared_body(body).fixed is None:
                raise AssemblyError(
                    f"body {body!r}, parent of {child!r}, has neither a track nor a fixed pose; "
                    "record it, give it `fixed`, or take `parent` away"
                )
        repeated_name = self._declared_body(names_in_chain[-1]).parent
        if repeated_name:
            circle_text = " -> ".join([*names_in_chain, repeated_name])
            raise AssemblyError(f"the parents of body {name!r} run in a circle: {circle_text}; break it")


def _at_rest(pose: Pose) -> _World:
    rotation = rotation_from_quaternion(np.array([pose.quaternion_xyzw], dtype=np.float64))
    return _World(np.array([pose.position], dtype=np.float64), rotation, np.array([PoseOrigin.FIXED], dtype=np.uint8))
