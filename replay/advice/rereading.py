"""A recording as an alternative of its import reads it, with as little as possible prepared and built again.

Axes are exchanged by signed permutations. A mesh that such a rotation turns is the mesh as it is, on turned poses; one
that is mirrored is the mirror image of the mesh as it is, on turned poses. So two detectors serve all axes.
"""

from dataclasses import replace
from itertools import permutations, product
from typing import Final

import numpy as np
from scipy.spatial import KDTree

from cdcore import Body, Motion
from cdcore.numerics import FloatArray, IntArray
from replay.advice.sampled_poses import is_plain
from replay.advice.scene_outcome import Outcome, ReplayedBodies
from replay.engine import prepare
from replay.prepare.assemble import body_of
from replay.prepare.assembly import Assembly
from sessions import MeshData, Session
from sessions.model.assumption import Assumption, Subject
from sessions.scene_files.answers import recording_assumptions
from sessions.scene_files.pose_axes import pose_axes_change

SIGNED_PERMUTATIONS: Final = tuple(
    np.diag(signs)[list(order)].astype(np.float64)
    for order in permutations(range(3))
    for signs in product((1, -1), repeat=3)
)
"""Matrices (3, 3) of all changes of axes; the first is the identity."""

MIRROR_MATRIX: Final = np.diag([-1.0, 1.0, 1.0])

SAME_MESH_M: Final = 1e-9
"""Metres up to which two meshes are the same."""

MESH_SUBJECTS: Final = (Subject.MESH_AXES, Subject.MESH_UNIT)


class Rereadings:
    """Outcomes of a recording under alternatives of its import, in chosen frames.

    Parameters
    ----------
    session, whole_assembly : the recording as it is, and the same ready for detection.
    frames : numbers (n,) of the frames to look at.
    """

    def __init__(self, session: Session, whole_assembly: Assembly, frames: IntArray) -> None:
        self._session = session
        self._whole = whole_assembly
        self._frames = frames
        self._motion = whole_assembly.motion.take(frames)
        self._replayed = {(False,) * len(whole_assembly.bodies): ReplayedBodies(whole_assembly)}

    def current(self) -> Outcome:
        """Returns the outcome of the recording as it is."""
        return self._replayed[(False,) * len(self._whole.bodies)].outcome(self._motion)

    def outcome(self, changed_session: Session, row: Assumption) -> Outcome:
        """Returns the outcome of the recording changed by one answer to an assumption of it."""
        meshes = self._meshes(changed_session, row)
        if meshes is None:
            reread_assembly = prepare(changed_session).assembly
            return ReplayedBodies(reread_assembly).outcome(
                reread_assembly.motion.take(self._frames[self._frames < len(reread_assembly.motion)])
            )
        rotations = dict[int, FloatArray]()
        is_mirrored = [False] * len(self._whole.bodies)
        rebuilt_bodies = dict[int, Body]()
        for body_number, body in enumerate(self._whole.bodies):
            mesh_before, mesh_after = self._session.meshes[body.name], meshes[body.name]
            if mesh_after is mesh_before:
                continue
            matrix = change_of_axes(mesh_before, mesh_after)
            if matrix is None:
                rebuilt_bodies[body_number] = body_of(replace(changed_session, meshes=meshes), body.name)
                continue
            is_mirrored[body_number] = bool(np.linalg.det(matrix) < 0.0)
            rotations[body_number] = matrix @ MIRROR_MATRIX if is_mirrored[body_number] else matrix
        motion = self._motion_with_exchanged_axes(rotations)
        if rebuilt_bodies:
            bodies = tuple(
                rebuilt_bodies.get(number, body)
                for number, body in enumerate(self._bodies_with_mirror_images(is_mirrored))
            )
            return ReplayedBodies(replace(self._whole, bodies=bodies)).outcome(motion)
        key = tuple(is_mirrored)
        if key not in self._replayed:
            self._replayed[key] = ReplayedBodies(
                replace(self._whole, bodies=self._bodies_with_mirror_images(is_mirrored))
            )
        return self._replayed[key].outcome(motion)

    def _meshes(self, changed_session: Session, row: Assumption) -> dict[str, MeshData] | None:
        """The meshes that have the contacts of the changed recording on the poses as they are; ``None``: none have."""
        if row.subject in MESH_SUBJECTS:
            return dict(changed_session.meshes)
        if row.subject is not Subject.POSE_AXES or not is_plain(self._session):
            return None
        if _length_unit(changed_session) != _length_unit(self._session):
            return None
        # Poses in other axes move the whole room; seen from the room as it is, the meshes are moved the other way.
        inverse_transform = np.eye(4)
        inverse_transform[:3, :3] = pose_axes_change(self._session, changed_session).T
        return {name: mesh.transformed(inverse_transform) for name, mesh in changed_session.meshes.items()}

    def _motion_with_exchanged_axes(self, rotations: dict[int, FloatArray]) -> Motion:
        """The motion with the axes of some bodies exchanged before their poses."""
        if not any(not np.array_equal(matrix, np.eye(3)) for matrix in rotations.values()):
            return self._motion
        exchanged_rotations = self._motion.rotations.copy()
        for body, matrix in rotations.items():
            exchanged_rotations[:, body] = exchanged_rotations[:, body] @ matrix
        motion = self._motion
        return Motion.of_rigid(motion.times, motion.translations, exchanged_rotations, motion.valid, motion.linked)

    def _bodies_with_mirror_images(self, is_mirrored: list[bool]) -> tuple[Body, ...]:
        """The bodies, some as their mirror images in their plane x = 0."""
        mirror_matrix = np.eye(4)
        mirror_matrix[:3, :3] = MIRROR_MATRIX
        bodies = []
        for body, mirrored in zip(self._whole.bodies, is_mirrored, strict=True):
            if mirrored:
                image = self._session.meshes[body.name].transformed(mirror_matrix)
                bodies.append(body_of(replace(self._session, meshes={body.name: image}), body.name))
            else:
                bodies.append(body)
        return tuple(bodies)


def _length_unit(session: Session) -> str:
    rows = recording_assumptions(session)
    return next((row.value for row in rows if row.subject is Subject.LENGTH_UNIT), "")


def change_of_axes(mesh_before: MeshData, mesh_after: MeshData) -> FloatArray | None:
    """Returns the signed permutation (3, 3) that makes a mesh the other one; ``None``: none does.

    The identity where both are the same solid, in whatever order its faces are: of a body of revolution many are.
    """
    if _is_same_solid(mesh_before, mesh_after):
        return SIGNED_PERMUTATIONS[0]
    for matrix in SIGNED_PERMUTATIONS:
        if np.array_equal(mesh_before.vertices @ matrix.T, mesh_after.vertices):
            return matrix
    return None


def _is_same_solid(mesh_before: MeshData, mesh_after: MeshData) -> bool:
    """Whether two meshes have the same faces, up to a nanometre."""
    if np.abs(mesh_before.bounds - mesh_after.bounds).max() > SAME_MESH_M:
        return False
    distance, vertex = KDTree(mesh_before.vertices).query(mesh_after.vertices)
    if distance.max() > SAME_MESH_M or len(np.unique(vertex)) != len(vertex):
        return False
    faces = [np.sort(rows, axis=1) for rows in (mesh_before.faces, vertex[mesh_after.faces])]
    first, second = (rows[np.lexsort(rows.T)] for rows in faces)
    return bool(np.array_equal(first, second))
