"""Delta debugging: the smallest input about which a detector is still wrong."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from scipy.spatial import cKDTree

from cdcore import Motion, TriangleMesh
from cdcore.bounding.hull import hull_of
from cdcore.errors import CollisionCoreError
from cdcore.numerics import FloatArray, IntArray
from replay.detection.progress import Progress, Silent
from replay.studies.shrink.well_posed import doubts_of, thin_faces
from replay.studies.shrink.wrong_answer import WrongAnswer, reduce_to_pairs

DECIMALS_TRIED: Final = range(13)
"""Decimals that are tried, fewest first; beyond them a number keeps all it has."""

NEAREST_COUNTS: Final = (*range(1, 13), *(round(16 * 2 ** (k / 4)) for k in range(25)))
"""Faces of each body that are tried first: those nearest to the other body; up to 1,024."""


@dataclass(frozen=True)
class Size:
    """Size of a fault: frames, bodies, and faces of the two bodies in question."""

    frames: int
    bodies: int
    faces: tuple[int, int]

    @classmethod
    def of(cls, fault: WrongAnswer) -> Size:
        """Count."""
        first, second = (len(body.mesh.faces) for body in fault.pair)
        return cls(len(fault.motion), len(fault.bodies), (first, second))

    def __str__(self) -> str:
        first, second = self.faces
        return f"{self.frames} frames x {first} x {second} faces of {self.bodies} bodies"


class Shrinking:
    """Reduces a fault; ``fault`` is the smallest so far, ``questions`` how often the detector was asked.

    What is well posed stays so: ``doubts`` are those that the fault has had from the start.
    """

    def __init__(self, fault: WrongAnswer, progress: Progress | None = None) -> None:
        self.fault, self.questions, self.doubts = fault, 0, doubts_of(fault)
        self._progress = progress or Silent()

    def run(self) -> WrongAnswer:
        """Reduce frames, bodies, faces, rotations and decimals until none of these steps changes anything."""
        with self._progress.stage("shrink", None, "questions") as self._advance:
            self._drop_thin_faces()
            content_before: object = None
            while content_before != (content_before := self._fault_content()):
                self._reduce_frames()
                self._reduce_bodies()
                self._keep_nearest_faces()
                for body in np.unique(self.fault.pairs[0]).tolist():
                    self._reduce_faces(body)
                self._remove_rotations()
                self._round_numbers()
        return self.fault

    def _fault_content(self) -> tuple[bytes, ...]:
        motion, meshes = self.fault.motion, [body.mesh for body in self.fault.bodies]
        arrays = motion.times, motion.translations, motion.rotations, *(mesh.triangles for mesh in meshes)
        return tuple(array.tobytes() for array in arrays)

    def _accept_if_wrong(self, make_fault: Callable[..., WrongAnswer | None], *arguments: Any) -> bool:
        """Whether the detector is wrong about what is made, too; then it is the fault from now on."""
        self.questions += 1
        self._advance(1)
        try:
            fault = make_fault(*arguments)
        except CollisionCoreError:
            return False
        if fault is None or not fault.is_reproduced():
            return False
        doubts = doubts_of(fault)
        if doubts - self.doubts:
            return False
        self.fault, self.doubts = fault, doubts
        return True

    def _drop_thin_faces(self) -> None:
        """No face without an area, where the detector is wrong without them too."""
        for number in range(len(self.fault.bodies)):
            is_thin = thin_faces(self.fault.bodies[number].mesh)
            if is_thin.any() and not is_thin.all():
                self._accept_if_wrong(_with_faces, self.fault, {number: np.flatnonzero(~is_thin)})

    def _reduce_frames(self) -> None:
        fault, last_frame = self.fault, len(self.fault.motion) - 1
        minimal_subset(
            np.arange(last_frame),
            lambda rows: self._accept_if_wrong(_fault_at_frames, fault, np.append(rows, last_frame)),
        )

    def _reduce_bodies(self) -> None:
        fault = self.fault
        minimal_subset(
            np.arange(1, len(fault.pairs)),
            lambda rows: self._accept_if_wrong(_fault_of_pairs, fault, np.append(0, rows)),
        )

    def _keep_nearest_faces(self) -> None:
        """The faces of both bodies that lie nearest to the other: they hold most faults."""
        fault = self.fault
        pair_bodies = fault.pairs[0].tolist()
        centres = [fault.corners(end).mean(axis=1) for end in pair_bodies]
        nearest_first = [np.argsort(cKDTree(centres[1 - k]).query(centres[k])[0], kind="stable") for k in range(2)]
        for kept_count in NEAREST_COUNTS:
            kept_rows = {end: rows[:kept_count] for end, rows in zip(pair_bodies, nearest_first, strict=True)}
            if kept_count >= max(map(len, nearest_first)) or self._accept_if_wrong(_with_faces, fault, kept_rows):
                return

    def _reduce_faces(self, body: int) -> None:
        """Fewest faces of one body; a solid that must stay one becomes the hull of fewest corners."""
        mesh = self.fault.bodies[body].mesh
        if not mesh.is_closed or len(mesh.faces) <= 4 or self._can_lose_face(body):
            fault = self.fault
            face_numbers = np.arange(len(fault.bodies[body].mesh.faces))
            minimal_subset(face_numbers, lambda rows: self._accept_if_wrong(_with_faces, fault, {body: rows}))
        self._reduce_to_hull(body)

    def _reduce_to_hull(self, body: int) -> None:
        """The hull of fewest corners, where it has fewer faces.

        A solid that lost a face is still one, with all of its other faces; a tetrahedron has four.
        """
        fault_and_doubts, mesh = (self.fault, self.doubts), self.fault.bodies[body].mesh
        if len(mesh.faces) <= 4:
            return
        corners, fault = mesh.vertices[np.unique(mesh.faces)], self.fault
        if mesh.is_closed or self._accept_if_wrong(_with_hull, fault, body, corners):
            minimal_subset(
                np.arange(len(corners)), lambda rows: self._accept_if_wrong(_with_hull, fault, body, corners[rows])
            )
        if len(self.fault.bodies[body].mesh.faces) >= len(mesh.faces):
            self.fault, self.doubts = fault_and_doubts

    def _can_lose_face(self, body: int) -> bool:
        """Whether any one of a few faces can go."""
        face_numbers = np.arange(len(self.fault.bodies[body].mesh.faces))
        sampled_faces = np.linspace(0, len(face_numbers) - 1, 4).astype(int).tolist()
        return any(
            self._accept_if_wrong(_with_faces, self.fault, {body: np.delete(face_numbers, face)})
            for face in sampled_faces
        )

    def _remove_rotations(self) -> None:
        """No rotation at all, of all bodies or of one."""
        all_bodies = list(range(len(self.fault.bodies)))
        for bodies in (all_bodies, *([k] for k in all_bodies)):
            rotations = self.fault.motion.rotations.copy()
            rotations[:, bodies] = np.eye(3)
            if np.array_equal(rotations, self.fault.motion.rotations) or self._accept_if_wrong(
                _with_poses, self.fault, "rotations", rotations
            ):
                return

    def _round_numbers(self) -> None:
        for name in ("times", "translations", "rotations"):
            self._round_array(getattr(self.fault.motion, name), _with_poses, self.fault, name)
        for body in range(len(self.fault.bodies)):
            self._round_array(self.fault.bodies[body].mesh.vertices, _with_vertices, self.fault, body)

    def _round_array(self, values: FloatArray, make_fault: Callable[..., WrongAnswer], *arguments: Any) -> None:
        """Rounds to the fewest decimals that leave the detector wrong."""
        for decimals in DECIMALS_TRIED:
            rounded_values = np.round(values, decimals) + 0.0
            if np.array_equal(rounded_values, values) or self._accept_if_wrong(make_fault, *arguments, rounded_values):
                return


def minimal_subset(candidates: IntArray, still_stands: Callable[[IntArray], bool]) -> IntArray:
    """Some of the items, in order, that still stand, and of which none can go alone.

    Zeller and Hildebrandt, *Simplifying and isolating failure-inducing input*, IEEE TSE 28 (2002): algorithm ddmin.
    All items are taken to stand, and are not asked about.
    """
    if len(candidates) and still_stands(candidates[:0]):
        return candidates[:0]
    chunk_count = 2
    while len(candidates) >= 2:
        for kept_rows in _candidate_subsets(candidates, min(chunk_count, len(candidates))):
            if still_stands(kept_rows):
                # A part of its own begins anew; what is left without one part goes on as finely.
                chunk_count = 2 if len(kept_rows) <= -(-len(candidates) // chunk_count) else max(chunk_count - 1, 2)
                candidates = kept_rows
                break
        else:
            if chunk_count >= len(candidates):
                break
            chunk_count = min(2 * chunk_count, len(candidates))
    return candidates


def _candidate_subsets(candidates: IntArray, chunk_count: int) -> Iterator[IntArray]:
    chunks = np.array_split(np.arange(len(candidates)), chunk_count)
    yield from (candidates[chunk] for chunk in chunks)
    if chunk_count > 2:
        yield from (np.delete(candidates, chunk) for chunk in chunks)


def _fault_at_frames(fault: WrongAnswer, frames: IntArray) -> WrongAnswer:
    return replace(fault, motion=fault.motion.take(frames))


def _fault_of_pairs(fault: WrongAnswer, pair_columns: IntArray) -> WrongAnswer:
    return reduce_to_pairs(replace(fault, pairs=fault.pairs[pair_columns]))


def _with_faces(fault: WrongAnswer, faces_of_body: dict[int, IntArray]) -> WrongAnswer:
    for body, face_rows in faces_of_body.items():
        mesh = fault.bodies[body].mesh
        corners, faces = np.unique(mesh.faces[np.sort(face_rows)], return_inverse=True)
        fault = _with_mesh(fault, body, TriangleMesh(mesh.vertices[corners], faces.reshape(-1, 3)))
    return fault


def _with_hull(fault: WrongAnswer, body: int, points: FloatArray) -> WrongAnswer | None:
    hull = hull_of(points)
    return None if hull is None else _with_mesh(fault, body, hull)


def _with_vertices(fault: WrongAnswer, body: int, vertices: FloatArray) -> WrongAnswer:
    return _with_mesh(fault, body, TriangleMesh(vertices, fault.bodies[body].mesh.faces))


def _with_mesh(fault: WrongAnswer, body: int, mesh: TriangleMesh) -> WrongAnswer:
    bodies = [*fault.bodies]
    bodies[body] = replace(bodies[body], mesh=mesh)
    return replace(fault, bodies=tuple(bodies))


def _with_poses(fault: WrongAnswer, array_name: str, array_values: FloatArray) -> WrongAnswer:
    motion = fault.motion
    arrays = {field: getattr(motion, field) for field in ("times", "translations", "rotations")} | {
        array_name: array_values
    }
    return replace(fault, motion=Motion(**arrays, valid=motion.valid, linked=motion.linked))
