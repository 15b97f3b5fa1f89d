"""Contact before surfaces meet: which pairs are no farther apart than a distance, by FCL."""

from collections.abc import Sequence

import numpy as np

from cdcore.narrow.fcl_meshes import FclMeshes
from cdcore.narrow.pair_frames import differs_from_before, rows_of_columns
from cdcore.numerics import BoolArray, IntArray
from cdcore.protocol import Body, Motion, ordered_by_name


class ContactOffset:
    """Asks how far the surfaces of ``pairs`` (P, 2) are apart that do not meet; ``reach`` is in metres."""

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, reach: float) -> None:
        self._meshes, self._reach = FclMeshes([body.mesh for body in bodies]), reach
        self._ends = ordered_by_name(bodies, pairs)[0].tolist()

    def near(self, motion: Motion, frames: IntArray, columns: IntArray) -> BoolArray:
        """Which of K pair-frames without contact, sorted by column, are within reach, (K,)."""
        found = np.zeros(len(frames), dtype=np.bool_)
        for column, rows in rows_of_columns(columns):
            at, fresh = frames[rows], np.zeros(len(rows), dtype=np.bool_)
            for body in self._ends[column]:
                fresh |= differs_from_before((motion.rotations[at, body], motion.translations[at, body]))
            answers = [self.apart(motion, frame, column) <= 0.0 for frame in at[fresh].tolist()]
            found[rows] = np.array(answers)[np.cumsum(fresh) - 1]
        return found

    def apart(self, motion: Motion, frame: int, column: int) -> float:
        """Metres by which one pair is farther apart than the reach."""
        a, b = self._ends[column]
        for body in (a, b):
            self._meshes.place_known(body, motion.rotations[frame, body], motion.translations[frame, body])
        return self._meshes.distance(a, b) - self._reach
