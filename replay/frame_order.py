"""Of the frames of a file, those whose stamps increase; the others are counted, never lost in silence."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from sessions import Frames


@dataclass(frozen=True, eq=False)
class OrderedFrames:
    """What is left of one block.

    Parameters
    ----------
    frames : frames whose stamp lies after every stamp before, over all blocks.
    numbers : their numbers in the file, from 0.
    repeated : frames left out because their stamp is the latest one again.
    backwards : frames left out because their stamp lies before the latest one.
    """

    frames: Frames
    numbers: NDArray[np.int64]
    repeated: int
    backwards: int


def in_order(blocks: Iterable[Frames]) -> Iterator[OrderedFrames]:
    """Go through blocks in file order and keep the frames that move the clock on."""
    latest, first = np.iinfo(np.int64).min, 0
    for block in blocks:
        peak = np.maximum.accumulate(np.concatenate([[latest], block.stamp_ns]))
        keep = block.stamp_ns > peak[:-1]
        same = int((block.stamp_ns == peak[:-1]).sum())
        frames = block if keep.all() else _rows(block, keep)
        yield OrderedFrames(frames, np.flatnonzero(keep) + first, same, len(block) - len(frames) - same)
        latest, first = int(peak[-1]), first + len(block)


def _rows(frames: Frames, keep: NDArray[np.bool_]) -> Frames:
    return Frames(frames.names, *(getattr(frames, item.name)[keep] for item in fields(Frames)[1:]))
