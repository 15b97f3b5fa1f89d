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
    def empty(cls, frames: int, bodies: int) -> "Placed":
        """Room for so many poses."""
        shape = frames, bodies
        return cls(np.empty((*shape, 3)), np.empty((*shape, 3, 3)), np.empty(shape, dtype=np.uint8))


@dataclass(frozen=True, eq=False)
class _World:
    """One body's frame in the world over T frames; a body at rest in the world has one row."""

    translation: FloatArray
    rotation: FloatArray
    origin: ByteArray

    def then(self, child: "_World") -> "_World":
        """A pose given in this frame, in the world.

        A child has a pose only where its parent has one; its origin is its own, or its parent's where it is fixed.
        """
        of_child, of_parent = np.broadcast_arrays(child.origin, self.origin)
        origin = np.where(of_child == PoseOrigin.FIXED, of_parent, of_child)
        origin = np.where(of_parent == PoseOrigin.NONE, PoseOrigin.NONE, origin).astype(np.uint8)
        # ``R t`` and ``A B`` are summed in a fixed order, so that every machine and block size gets the same bits.
        x, y, z = (self.rotation[..., :, k] * child.translation[..., k, None] for k in range(3))
        moved = (x + y) + z + self.translation
        x, y, z = (self.rotation[..., :, k, None] * child.rotation[..., None, k, :] for k in range(3))
        return _World(moved, (x + y) + z, origin)


class Kinematics:
    """Poses of the meshes of the chosen bodies, frame block by frame block.

    ``tracked`` names the columns of the filled frames; each of ``bodies`` is tracked or fixed. Raises
    ``AssemblyError``: a parent that is neither tracked nor fixed, or a circle of parents.
    """

    def __init__(self, scene: Scene, tracked: Sequence[str], bodies: Sequence[str]) -> None:
        self._scene = scene
        self._column = {name: number for number, name in enumerate(tracked)}
        self._bodies = tuple(bodies)
        for name in bodies:
            self._check_chain(name)

    def place(self, frames: FilledFrames, placed: Placed) -> None:
        """Write the world poses of the chosen bodies into ``placed``, as many frames of them."""
        known: dict[str, _World] = {}
        translation, rotation, origin = placed
        for column, name in enumerate(self._bodies):
            world, offset = self._tracker(name, frames, known), self._declared_body(name).offset
            if offset != Pose():
                world = world.then(_at_rest(offset))
            translation[:, column], rotation[:, column] = world.translation, world.rotation
            origin[:, column] = world.origin
        none = origin == PoseOrigin.NONE
        translation[none], rotation[none] = 0.0, np.eye(3)

    def _declared_body(self, name: str) -> SceneBody:
        return self._scene.body(name) or SceneBody(name)

    def _tracker(self, name: str, frames: FilledFrames, known: dict[str, _World]) -> _World:
        """The frame of a tracker, joint or fixed body in the world; ``known`` are those computed before."""
        if name not in known:
            declared = self._declared_body(name)
            if name in self._column:
                column = self._column[name]
                rotation = rotation_from_quaternion(frames.quaternion_xyzw[:, column])
                in_parent = _World(frames.position[:, column], rotation, frames.origin[:, column])
            else:
                in_parent = _at_rest(declared.fixed or Pose())
            known[name] = (
                self._tracker(declared.parent, frames, known).then(in_parent) if declared.parent else in_parent
            )
        return known[name]

    def _check_chain(self, name: str) -> None:
        chain = chain_of(name, self._scene)
        for child, body in pairwise([name, *chain]):
            if body not in self._column and self._declared_body(body).fixed is None:
                raise AssemblyError(
                    f"body {body!r}, parent of {child!r}, has neither a track nor a fixed pose; "
                    "record it, give it `fixed`, or take `parent` away"
                )
        again = self._declared_body(chain[-1]).parent
        if again:
            circle = " -> ".join([*chain, again])
            raise AssemblyError(f"the parents of body {name!r} run in a circle: {circle}; break it")


def _at_rest(pose: Pose) -> _World:
    rotation = rotation_from_quaternion(np.array([pose.quaternion_xyzw], dtype=np.float64))
    return _World(np.array([pose.position], dtype=np.float64), rotation, np.array([PoseOrigin.FIXED], dtype=np.uint8))
