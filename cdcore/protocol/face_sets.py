"""Face pairs of many frames in three arrays: nothing is stored per frame that the frame before already holds."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cdcore.numerics import Int32Array, IntArray, readonly

NO_FACES: Int32Array = readonly(np.zeros((0, 2), dtype=np.int32))


@dataclass(frozen=True, eq=False)
class FaceSets:
    """Faces that meet, for every frame and pair in contact.

    Entry k says that in frame ``frame[k]`` pair ``pair[k]`` (a column of the detection) meets in
    ``faces[start[k]:stop[k]]``; entries are sorted by frame, then pair. Equal sets of neighbouring frames may share
    rows of ``faces`` (run-length storage), which is what keeps hours of resting contact small.

    Parameters
    ----------
    frame, pair, start, stop : (K,) int64.
    faces : (M, 2) int32, (face of the pair's first body, face of its second), each set unique and sorted.
    """

    frame: IntArray
    pair: IntArray
    start: IntArray
    stop: IntArray
    faces: Int32Array

    def __post_init__(self) -> None:
        for array in (self.frame, self.pair, self.start, self.stop, self.faces):
            readonly(array)

    @classmethod
    def from_shared(
        cls,
        frame: NDArray[np.integer],
        pair: NDArray[np.integer],
        which: NDArray[np.integer],
        sets: Sequence[NDArray[np.integer]],
    ) -> FaceSets:
        """Build from distinct sets and, for each entry, which of them it is; entries without a face are left out.

        Entries may come in any order; each set is sorted and unique.
        """
        sizes = np.array([len(rows_of_set) for rows_of_set in sets], dtype=np.int64)
        stop = np.cumsum(sizes)
        keep = np.flatnonzero(sizes[which])
        order = keep[np.lexsort((pair[keep], frame[keep]))]
        rows = [np.asarray(rows_of_set, dtype=np.int32).reshape(-1, 2) for rows_of_set in sets]
        faces = np.concatenate([NO_FACES, *rows])
        number = which[order].astype(np.int64)
        start = (stop - sizes)[number]
        return cls(frame[order].astype(np.int64), pair[order].astype(np.int64), start, stop[number], faces)

    def at(self, frame: int, pair: int) -> IntArray:
        """The face pairs of one frame and pair, (k, 2) int64; k = 0 where there is no contact."""
        lower, upper = np.searchsorted(self.frame, [frame, frame + 1])
        entry = lower + int(np.searchsorted(self.pair[lower:upper], pair))
        if entry >= upper or self.pair[entry] != pair:
            return np.zeros((0, 2), dtype=np.int64)
        return self.faces[self.start[entry] : self.stop[entry]].astype(np.int64)

    def counts(self, frames: int, pairs: int) -> IntArray:
        """Number of face pairs for every frame and pair, (T, P)."""
        counts = np.zeros((frames, pairs), dtype=np.int64)
        counts[self.frame, self.pair] = self.stop - self.start
        return counts

    def take(self, frames: IntArray) -> FaceSets:
        """Those of some frames (n,), increasing, numbered from 0; the rows of ``faces`` are shared."""
        lower, upper = (np.searchsorted(self.frame, frames, side) for side in ("left", "right"))
        sizes = upper - lower
        kept = np.arange(sizes.sum()) + np.repeat(lower - (np.cumsum(sizes) - sizes), sizes)
        numbers = np.repeat(np.arange(len(frames)), sizes)
        return FaceSets(numbers, self.pair[kept], self.start[kept], self.stop[kept], self.faces)

    @classmethod
    def join(cls, numbered_blocks: Iterable[tuple[int, FaceSets]]) -> FaceSets:
        """Put blocks after each other; each comes with the number of its first frame."""
        blocks = list(numbered_blocks)
        rows = np.cumsum([0] + [len(sets.faces) for _, sets in blocks])
        return cls(
            np.concatenate([sets.frame + first for first, sets in blocks]),
            np.concatenate([sets.pair for _, sets in blocks]),
            np.concatenate([sets.start + row for (_, sets), row in zip(blocks, rows, strict=False)]),
            np.concatenate([sets.stop + row for (_, sets), row in zip(blocks, rows, strict=False)]),
            np.concatenate([sets.faces for _, sets in blocks]),
        )
