"""The mesh stage: which of many pair-frames meet, and in which faces; a pose that repeats is not tested again."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cdcore.narrow.fcl_meshes import FclMeshes
from cdcore.narrow.pair_frames import Poses, ask_changed_poses, swapped_faces
from cdcore.numerics import BoolArray, FloatArray, IntArray
from cdcore.protocol import Body, FaceSets, Motion, Verdict, ordered_by_name


@dataclass(frozen=True, eq=False)
class MeshAnswer:
    """Contact of K pair-frames (K,), their faces if requested, mesh queries done and answers reused."""

    hits: BoolArray
    queries: int
    reused: int
    which: IntArray
    """(K,) row of ``sets``, the distinct face sets (k, 2), which are none where faces were not asked for."""
    sets: list[NDArray[np.int32]]

    def face_sets(self, frames: IntArray, columns: IntArray) -> FaceSets:
        """The faces as a detection keeps them."""
        return FaceSets.from_shared(frames, columns, self.which, self.sets)


class MeshStage:
    """Decides contact on triangles, pair after pair so that two trees stay in the cache.

    Each of the ``pairs`` (P, 2) is tested in the order of its names; its order here does not matter.
    """

    def __init__(self, bodies: Sequence[Body], pairs: IntArray) -> None:
        self._meshes = FclMeshes([body.mesh for body in bodies])
        self._pairs, self._swapped = ordered_by_name(bodies, pairs)
        self._ends = self._pairs.tolist()

    def decide(self, motion: Motion, frames: IntArray, columns: IntArray, *, faces: bool = False) -> MeshAnswer:
        """Answer for K pair-frames at which both bodies have a pose, sorted by column, then frame."""

        def ask(column: int, pose_a: Poses, pose_b: Poses) -> list[Any]:
            a, b = self._ends[column]
            if not faces:
                return self._meshes.at_poses(self._meshes.touch, a, b, pose_a, pose_b)
            face_pairs = self._meshes.at_poses(self._meshes.faces, a, b, pose_a, pose_b)
            return [swapped_faces(pairs) for pairs in face_pairs] if self._swapped[column] else face_pairs

        answers, which = ask_changed_poses(motion, self._pairs, frames, columns, ask)
        hits = np.array([len(pairs) > 0 for pairs in answers] if faces else answers, dtype=np.bool_)[which]
        return MeshAnswer(hits, len(answers), len(frames) - len(answers), which, answers if faces else [])

    def gap(self, motion: Motion, frame: int, column: int) -> tuple[float, FloatArray]:
        """Metres between the surfaces of a pair that does not meet, and the nearest points (2, 3), world metres."""
        return self._meshes.gap(*self._place_solids(motion, frame, column))

    def _place_solids(self, motion: Motion, frame: int, column: int) -> tuple[int, int]:
        a, b = self._ends[column]
        for body in (a, b):
            self._meshes.set_pose(body, motion.rotations[frame, body], motion.translations[frame, body])
        return a, b

    def decide_now(self, now: Motion, column: int, _margin: float) -> tuple[int, bool]:
        """CONTACT or CLEAR for one pair in a motion of one frame, and False: how far it is apart is not asked."""
        return (CONTACT if self._meshes.touch(*self._place_solids(now, 0, column)) else CLEAR), False


CONTACT, CLEAR = int(Verdict.CONTACT), int(Verdict.CLEAR)
