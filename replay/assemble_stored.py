"""A session of hours, ready for detection with its poses on disk: only stamps and flags grow in memory."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

import numpy as np

from cdcore import Motion
from replay.assemble import Layout, assemble, assemble_blocks
from replay.assembly import Assembly
from replay.stored_motion import StoredMotion
from sessions import Session

HELD_FRAMES: Final = 324_000
"""Up to here (an hour at 90 Hz) poses are held in memory: 31 MB per body. Beyond it they lie in a temporary file."""

BLOCK_FRAMES: Final = 16384


def assemble_bounded(session: Session, layout: Layout, *, start: float | None, end: float | None) -> Assembly:
    """The assembly of a session of any length; its motion is a ``StoredMotion`` when it is longer than an hour."""
    if len(layout.survey.stamp_ns) <= HELD_FRAMES:
        return assemble(session, start=start, end=end, layout=layout)
    seen: list[Assembly] = []

    def motions() -> Iterator[Motion]:
        for block in assemble_blocks(session, BLOCK_FRAMES, start=start, end=end, layout=layout):
            yield block.motion
            # Taken, not sliced: a slice of no frames would still hold the poses of its block.
            seen.append(replace(block, motion=block.motion.take(np.zeros(0, dtype=np.int64))))

    motion = StoredMotion(motions())
    return replace(
        seen[0],
        motion=motion,
        stamp_ns=np.concatenate([block.stamp_ns for block in seen]),
        origin=np.concatenate([block.origin for block in seen]),
    )
