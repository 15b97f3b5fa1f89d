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

from replay.advice.mesh_interior import MeshInterior
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


class PairState(IntEnum):
    """State of a pair in a frame."""

    UNKNOWN = 0
    SEPARATED = 1
    """No contact is reported; within a part with an opening it stays undecided whether there is one."""
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
        self._interiors = MeshInterior(first), MeshInterior(second)
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
        path_lengths = self._path_lengths(rotations, translations)
        pose_row = 0
        while pose_row < len(rotations):
            gap = self._gap(rotations[pose_row], translations[pose_row], budget)
            if gap <= CLEAR_GAP_M:
                states[pose_row] = PairState.UNKNOWN if gap > 0.0 else PairState.CONTACT
                pose_row += 1
                continue
            free_path = gap - CLEAR_GAP_M
            is_as_before = pose_row > 0 and path_lengths[pose_row] - path_lengths[pose_row - 1] < free_path
            if is_as_before and states[pose_row - 1] != PairState.UNKNOWN:
                state = int(states[pose_row - 1])
            else:
                state = self._state_with_gap(rotations[pose_row], translations[pose_row])
            end_row = bisect_left(path_lengths, path_lengths[pose_row] + free_path, pose_row + 1)
            states[pose_row:end_row] = state
            pose_row = end_row
        return states

    def _path_lengths(self, rotations: Array, translations: Array) -> list[float]:
        """Metres that no point of the second body has exceeded on its way to each pose since the first, k of them."""
        translation_steps = np.diff(translations, axis=0)
        rotation_change = np.diff(rotations, axis=0).reshape(-1, 9)
        step_bounds = np.sqrt((translation_steps * translation_steps).sum(axis=1)) + self._reach * np.sqrt(
            (rotation_change * rotation_change).sum(axis=1)
        )
        path_lengths: list[float] = np.concatenate([[0.0], np.cumsum(step_bounds)]).tolist()
        return path_lengths

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
        first, second = self._interiors
        (first_points, first_starts), (second_points, second_starts) = (
            first.component_points(),
            second.component_points(),
        )
        inside_answers = (
            first.holds(second_points @ rotation.T + translation, second_starts),
            second.holds((first_points - translation) @ rotation, first_starts),
        )
        if True in inside_answers:
            return PairState.CONTACT
        return PairState.UNKNOWN if None in inside_answers else PairState.SEPARATED


def can_be_tested(mesh: MeshData) -> bool:
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
