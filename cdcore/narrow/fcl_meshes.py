"""Triangle meshes in FCL: complete and exact in general position. The only module of the core that imports ``fcl``.

Every mesh is a ``BVHModel``, so that faces keep their numbers and a convex mesh stays a surface. A mesh inside another
does not touch it.

What FCL cannot do: faces that are points or segments (543 of 1,500 pairs missed; 2,090 of 3,357 on a mesh of zero
area), needles, coordinates near 2^400, and ties within rounding in a rotated world (glass resting exactly on a table:
433 missed and 681 invented of 7,018 face pairs). Choose the exact detector where these matter.
"""

from collections.abc import Callable, Sequence
from typing import Any, Final, TypeVar
from weakref import WeakValueDictionary

import fcl
import numpy as np
from numpy.typing import NDArray

from cdcore.errors import InvalidMeshError
from cdcore.mesh import TriangleMesh, once_a_mesh
from cdcore.narrow.pair_frames import Poses
from cdcore.numerics import FloatArray

Answer = TypeVar("Answer")

EVERY_CONTACT: Final = 2**31 - 1
"""FCL stops after ``num_max_contacts``, by default after one."""


class _FacePairs:
    """Stands in for ``fcl.CollisionResult``: keeps two numbers of each contact, not the contact with its arrays."""

    __slots__ = ("contacts", "cost_sources", "first", "is_collision", "second")

    def __init__(self) -> None:
        self.is_collision = False
        self.first: list[int] = []
        self.second: list[int] = []
        self.contacts = self
        self.cost_sources: list[Any] = []

    def append(self, contact: Any) -> None:
        self.first.append(contact.b1)
        self.second.append(contact.b2)


class FclMeshes:
    """Meshes, one a body, that can be placed and asked whether, and in which faces, two of them meet.

    Equal meshes (by content hash) share one tree, also those of other detectors. A ``TriangleMesh`` is never empty and
    its indices exist: FCL would end the process otherwise. InvalidMeshError where FCL could not build the tree.
    """

    def __init__(self, meshes: Sequence[TriangleMesh]) -> None:
        self._trees = [tree_of(mesh) for mesh in meshes]
        self._bodies = [fcl.CollisionObject(tree.model) for tree in self._trees]
        self._first = fcl.CollisionRequest(num_max_contacts=1, enable_contact=False)
        # With enable_contact FCL lists some face pairs twice, and the indices come without it too.
        self._all = fcl.CollisionRequest(num_max_contacts=EVERY_CONTACT, enable_contact=False)

    def set_pose(self, body: int, rotation: FloatArray, translation: FloatArray) -> None:
        """Put a body at a pose of a ``Motion``; to one that is not finite FCL would answer *contact*."""
        self._bodies[body].setRotation(rotation)
        self._bodies[body].setTranslation(translation)

    def touch(self, a: int, b: int) -> bool:
        """Whether the surfaces of two placed bodies meet."""
        return bool(fcl.collide(self._bodies[a], self._bodies[b], self._first, _FacePairs()))

    def faces(self, a: int, b: int) -> NDArray[np.int32]:
        """The face pairs of two placed bodies that meet, (k, 2), unique and sorted."""
        result = _FacePairs()
        if not fcl.collide(self._bodies[a], self._bodies[b], self._all, result):
            return np.zeros((0, 2), dtype=np.int32)
        keys = np.unique(np.array(result.first, dtype=np.int64) << 32 | np.array(result.second, dtype=np.int64))
        return np.stack([keys >> 32, keys & 0xFFFFFFFF], axis=1).astype(np.int32)

    def gap(self, a: int, b: int) -> tuple[float, FloatArray]:
        """Metres between the surfaces of two placed bodies that do not meet, and the nearest points (2, 3) of both."""
        result = fcl.DistanceResult()
        metres = fcl.distance(self._bodies[a], self._bodies[b], fcl.DistanceRequest(True), result)
        return float(metres), np.array(result.nearest_points)

    def at_poses(
        self, ask: Callable[[int, int], Answer], a: int, b: int, poses_a: Poses, poses_b: Poses
    ) -> list[Answer]:
        """Answers of ``touch`` or ``faces`` for two bodies at each of K pairs of poses of a ``Motion``."""
        first, second = self._bodies[a], self._bodies[b]
        matrix_a, move_a = first.setRotation, first.setTranslation
        matrix_b, move_b = second.setRotation, second.setTranslation
        answers = []
        for rotation_a, translation_a, rotation_b, translation_b in zip(*poses_a, *poses_b, strict=True):
            matrix_a(rotation_a)
            move_a(translation_a)
            matrix_b(rotation_b)
            move_b(translation_b)
            answers.append(ask(a, b))
        return answers


class FclTree:
    """The tree of one mesh; ``fcl`` allows no weak reference to its own."""

    def __init__(self, mesh: TriangleMesh) -> None:
        self.model = fcl.BVHModel()
        # python-fcl names the arguments in this order; FCL allocates by them and grows where they are too small.
        self.model.beginModel(num_tris_=len(mesh.faces), num_vertices_=len(mesh.vertices))
        self.model.addSubModel(mesh.vertices, mesh.faces.tolist())
        if self.model.endModel() != 0:
            raise InvalidMeshError(f"FCL cannot build a tree of {mesh!r}; repair the mesh or use another detector")


TREES: Final[WeakValueDictionary[str, FclTree]] = WeakValueDictionary()
"""By content hash, as long as a mesh lives: a run asks the same meshes in several detectors, one after the other, and
in its audit. Building a tree of 5,000 faces takes 16 ms."""


@once_a_mesh
def tree_of(mesh: TriangleMesh) -> FclTree:
    """The tree of a mesh, built where nobody holds it yet."""
    tree = TREES.get(mesh.content_hash)
    if tree is None:
        tree = TREES[mesh.content_hash] = FclTree(mesh)
    return tree
