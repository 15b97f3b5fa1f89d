"""Whether two bodies are in contact in each of many frames, by FCL: no kernel has to be loaded.

Where a pair is apart, frames are left out in which its gap cannot have closed: no point of a body travels farther than
its turns and its steps allow. So most of a recording is answered by few distances.
"""

from bisect import bisect_left
from enum import IntEnum
from functools import cached_property
from typing import Final

import fcl
import numpy as np
from numpy.typing import NDArray

from sessions import MeshData

Array = NDArray[np.float64]

CLEAR_GAP_M: Final = 1e-5
"""A smaller gap is no evidence: FCL rounds, and bodies that rest touch."""

BUDGET_US: Final = 400_000.0
"""Microseconds that FCL may take for a question, as estimated; where it would take more, a replay is quicker."""

COLLISION_US: Final = 10.0
"""Microseconds of a collision, of meshes of any size."""

DISTANCE_US, DISTANCE_US_OF_A_FACE = 30.0, 0.02
"""Microseconds of a distance, and what each face of both meshes adds; measured with spheres of 20 to 20,480 faces."""

RAY_COUNT: Final = 40
"""Directions in which a point looks for a way out of a closed mesh."""

RAYS_OF_THE_INSIDE: Final = 5
"""Of the first so many all must leave the mesh an odd number of times for a point that is inside."""


class PairState(IntEnum):
    """State of a pair in a frame."""

    UNKNOWN = 0
    APART = 1
    CONTACT = 2


class QueryLimitError(Exception):
    """More queries would take longer than a replay."""


class QueryBudget:
    """Time that FCL may still take for a question, as estimated: the same on every machine."""

    def __init__(self, microseconds: float = BUDGET_US) -> None:
        self._microseconds = microseconds

    def spend(self, microseconds: float) -> None:
        """Counts the time of a query; raises ``QueryLimitError`` beyond the budget."""
        self._microseconds -= microseconds
        if self._microseconds < 0.0:
            raise QueryLimitError


class PairStates:
    """Two meshes whose state is looked up in many frames."""

    def __init__(self, first: MeshData, second: MeshData) -> None:
        self._meshes = first, second
        self._interiors = Interior(first), Interior(second)
        self._distance_us = DISTANCE_US + DISTANCE_US_OF_A_FACE * (len(first.faces) + len(second.faces))
        self._reach = float(np.linalg.norm(second.vertices, axis=1).max())

    @cached_property
    def _objects(self) -> tuple[fcl.CollisionObject, fcl.CollisionObject]:
        first, second = self._meshes
        return fcl.CollisionObject(_tree(first)), fcl.CollisionObject(_tree(second))

    def states(self, rotations: Array, translations: Array, budget: QueryBudget) -> NDArray[np.int8]:
        """Returns the ``PairState`` (k,) for poses (k, 3, 3), (k, 3) of the second body in the axes of the first.

        Raises ``QueryLimitError``.
        """
        states = np.full(len(rotations), PairState.UNKNOWN, dtype=np.int8)
        travelled = self._travelled(rotations, translations)
        row = 0
        while row < len(rotations):
            gap = self._gap(rotations[row], translations[row], budget)
            if gap <= CLEAR_GAP_M:
                states[row] = PairState.UNKNOWN if gap > 0.0 else PairState.CONTACT
                row += 1
                continue
            room = gap - CLEAR_GAP_M
            is_as_before = row > 0 and travelled[row] - travelled[row - 1] < room
            if is_as_before and states[row - 1] != PairState.UNKNOWN:
                state = int(states[row - 1])
            else:
                state = self._state_with_gap(rotations[row], translations[row])
            end = bisect_left(travelled, travelled[row] + room, row + 1)
            states[row:end] = state
            row = end
        return states

    def _travelled(self, rotations: Array, translations: Array) -> list[float]:
        """Metres that no point of the second body has exceeded on its way to each pose since the first, k of them."""
        step = np.diff(translations, axis=0)
        turn = np.diff(rotations, axis=0).reshape(-1, 9)
        metres = np.sqrt((step * step).sum(axis=1)) + self._reach * np.sqrt((turn * turn).sum(axis=1))
        travelled: list[float] = np.concatenate([[0.0], np.cumsum(metres)]).tolist()
        return travelled

    def _gap(self, rotation: Array, translation: Array, budget: QueryBudget) -> float:
        """Metres between the surfaces; 0 where they meet."""
        self._objects[1].setRotation(rotation)
        self._objects[1].setTranslation(translation)
        budget.spend(COLLISION_US)
        if fcl.collide(*self._objects, fcl.CollisionRequest(), fcl.CollisionResult()):
            return 0.0
        budget.spend(self._distance_us)
        # Of surfaces that nearly touch FCL may find no distance; they are no evidence.
        return max(fcl.distance(*self._objects, fcl.DistanceRequest(), fcl.DistanceResult()), 0.1 * CLEAR_GAP_M)

    def _state_with_gap(self, rotation: Array, translation: Array) -> PairState:
        """The state of two bodies whose surfaces do not meet: one may be inside the other."""
        first, second = self._meshes
        inside = (
            self._interiors[0].holds(second.vertices @ rotation.T + translation),
            self._interiors[1].holds((first.vertices - translation) @ rotation),
        )
        if True in inside:
            return PairState.CONTACT
        return PairState.UNKNOWN if None in inside else PairState.APART


class Interior:
    """The inside of a mesh, for bodies that its surface does not meet."""

    def __init__(self, mesh: MeshData) -> None:
        self._mesh = mesh
        self._directions = sphere_directions(RAY_COUNT)
        self._normals = dict[int, Array]()
        """Number of a direction -> its normal on the second edge of each face, (n, 3)."""

    def holds(self, points: Array) -> bool | None:
        """Returns whether a body of these points (n, 3) is inside; ``None``: the mesh is open, or rays disagree."""
        lower, upper = self._mesh.bounds
        if (points.min(axis=0) < lower).any() or (points.max(axis=0) > upper).any():
            return False
        if not self._is_closed:
            return None
        is_inside = True
        for number in range(RAY_COUNT):
            crossings = self._crossings(points[0], number)
            # A ray that meets nothing proves the outside, of crossing and nested parts too.
            if crossings == 0:
                return False
            is_inside &= crossings % 2 == 1
            if is_inside and number + 1 == RAYS_OF_THE_INSIDE:
                return True
        return None

    @cached_property
    def _is_closed(self) -> bool:
        faces = self._mesh.faces
        edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
        ordered = edges[np.lexsort(edges.T)]
        # Every edge twice, and no edge four times.
        if len(ordered) % 2:
            return False
        is_paired = (ordered[0::2] == ordered[1::2]).all()
        return bool(is_paired and (ordered[1:-1:2] != ordered[2::2]).any(axis=1).all())

    @cached_property
    def _edges(self) -> tuple[Array, Array, Array]:
        """The first corner of each face and its two edges from there, (n, 3) each."""
        corners = self._mesh.vertices[self._mesh.faces]
        return corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]

    def _crossings(self, point: Array, ray: int) -> int:
        """Faces that a ray from a point meets.

        Source: Moeller and Trumbore, "Fast, minimum storage ray/triangle intersection", 1997.
        """
        if ray not in self._normals:
            self._normals[ray] = np.cross(self._directions[ray], self._edges[2])
        base, along, across = self._edges
        normal, offset = self._normals[ray], point - base
        second_normal = np.cross(offset, along)
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = 1.0 / (along * normal).sum(axis=1)
            u = (offset * normal).sum(axis=1) * inverse
            v = (second_normal @ self._directions[ray]) * inverse
            distance = (across * second_normal).sum(axis=1) * inverse
            return int(((u >= 0) & (v >= 0) & (u + v <= 1) & (distance > 0)).sum())


def sphere_directions(count: int) -> Array:
    """Returns unit vectors (count, 3) evenly about a sphere, along a spiral that turns by the golden angle."""
    height = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    angle = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(count)
    radius = np.sqrt(1.0 - height * height)
    return np.stack([radius * np.cos(angle), height, radius * np.sin(angle)], axis=1)


def can_be_asked(mesh: MeshData) -> bool:
    """Returns whether FCL can be trusted with a mesh.

    It misses faces that are points or segments. They are left out where faces with area have their corners.
    """
    has_area = _has_area(mesh)
    return bool(has_area.any() and np.isin(mesh.faces[~has_area], mesh.faces[has_area]).all())


def _has_area(mesh: MeshData) -> NDArray[np.bool_]:
    """Whether each face is neither a point nor a segment, (f,)."""
    corners = mesh.triangles
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    has_area: NDArray[np.bool_] = (normals != 0.0).any(axis=1)
    return has_area


def _tree(mesh: MeshData) -> fcl.BVHModel:
    faces = mesh.faces[_has_area(mesh)]
    tree = fcl.BVHModel()
    tree.beginModel(num_tris_=len(faces), num_vertices_=len(mesh.vertices))
    tree.addSubModel(mesh.vertices, faces.tolist())
    tree.endModel()
    return tree
