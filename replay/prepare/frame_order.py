"""The frames of a file whose stamps increase; the others are left out and counted."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from sessions import Frames


@dataclass(frozen=True, eq=False)
class OrderedFrames:
    """The frames of one block that are used.

    Parameters
    ----------
    frames : frames whose stamp lies after every stamp before, over all blocks.
    numbers : their numbers in the file, from 0.
    repeated, backwards : how many were left out because their stamp equals the latest one, or lies before it.
    """

    frames: Frames
    numbers: NDArray[np.int64]
    repeated: int
    backwards: int


def in_order(blocks: Iterable[Frames]) -> Iterator[OrderedFrames]:
    """Go through blocks in file order and keep the frames whose stamp increases."""
    latest, first = np.iinfo(np.int64).min, 0
    for block in blocks:
        peak = np.maximum.accumulate(np.concatenate([[latest], block.stamp_ns]))
        keep = block.stamp_ns > peak[:-1]
        same = int((block.stamp_ns == peak[:-1]).sum())
        columns = (getattr(block, item.name)[keep] for item in fields(Frames)[1:])
        frames = block if keep.all() else Frames(block.names, *columns)
        yield OrderedFrames(frames, np.flatnonzero(keep) + first, same, len(block) - len(frames) - same)
        latest, first = int(peak[-1]), first + len(block)
