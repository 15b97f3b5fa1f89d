"""Keeps the poses of sessions of hours on disk; decodes a shorter session once and holds it in memory."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from cdcore import Motion
from replay.base.constants import BLOCK_FRAMES, HELD_FRAMES
from replay.prepare.assemble import AssemblyLayout, assemble, assemble_blocks, window_frames
from replay.prepare.assembly import Assembly
from replay.prepare.stored_motion import StoredMotion
from sessions import Frames, Session
from sessions.model.session import FrameSource


class _DecodedOnce:
    """The frames of another source; they are held after the first whole pass, up to ``HELD_FRAMES`` of them."""

    def __init__(self, source: FrameSource) -> None:
        self._source = source
        self._held: list[Frames] | None = None

    @property
    def names(self) -> tuple[str, ...]:
        return self._source.names

    def blocks(self, frames: int) -> Iterator[Frames]:
        if self._held is not None:
            for block in self._held:
                yield from block.blocks(frames)
            return
        kept: list[Frames] | None = []
        count = 0
        for block in self._source.blocks(frames):
            count += len(block)
            if kept is not None:
                kept = [*kept, block] if count <= HELD_FRAMES else None
            yield block
        self._held = kept


def decoded_once(session: Session) -> Session:
    """The same session, whose file is read once instead of in every pass over its frames, unless it is too long."""
    if isinstance(session.source, Frames) or "frames" in vars(session):
        return session
    return replace(session, source=_DecodedOnce(session.source))


def assemble_bounded(session: Session, layout: AssemblyLayout, *, start: float | None, end: float | None) -> Assembly:
    """The assembly of a window of any length; its motion is a ``StoredMotion`` when that is longer than an hour."""
    if window_frames(layout.scan, start, end) <= HELD_FRAMES:
        return assemble(session, start=start, end=end, layout=layout)
    seen: list[Assembly] = []

    def motions() -> Iterator[Motion]:
        for block in assemble_blocks(session, BLOCK_FRAMES, start=start, end=end, layout=layout):
            yield block.motion
            # Taken, not sliced: a slice of no frames would still hold the poses of its block.
            seen.append(replace(block, motion=block.motion.take(np.zeros(0, dtype=np.int64))))

    motion = StoredMotion(motions())
    stamps, origin = (np.concatenate([getattr(block, name) for block in seen]) for name in ("stamp_ns", "origin"))
    return replace(seen[0], motion=motion, stamp_ns=stamps, origin=origin)
