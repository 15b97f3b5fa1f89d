"""Poses in memory: all of a recording up to two hours of twelve bodies, blocks of a longer one.

A recording is decoded once, where its frames fit beside the poses made of them, and in every pass where they do not.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

from replay import words
from replay.errors import AssemblyError
from replay.prepare.assemble import window_ns
from sessions import Frames, Session
from sessions.model.session import FrameSource

MOST_POSES: Final = 8_000_000
"""Frames times bodies of one run: two hours of twelve bodies at 90 Hz are 7,776,000. Their motion takes 96 bytes a
pose, 0.75 GB; `tests/replay/test_memory.py` measures what a run takes in all."""

DECODED_POSES: Final = MOST_POSES // 2
"""Up to here decoded frames are held beside the motion: 65 bytes a pose."""


class _DecodedOnce:
    """The frames of another source; they are held after the first whole pass, up to ``DECODED_POSES`` of them."""

    def __init__(self, source: FrameSource) -> None:
        self._source = source
        self._blocks: list[Frames] | None = None

    @property
    def names(self) -> tuple[str, ...]:
        return self._source.names

    def blocks(self, frames: int) -> Iterator[Frames]:
        if self._blocks is not None:
            for block in self._blocks:
                yield from block.blocks(frames)
            return
        decoded_blocks: list[Frames] | None = []
        pose_count = 0
        for block in self._source.blocks(frames):
            pose_count += len(block) * len(block.names)
            if decoded_blocks is not None:
                decoded_blocks = [*decoded_blocks, block] if pose_count <= DECODED_POSES else None
            yield block
        self._blocks = decoded_blocks


def decoded_once(session: Session) -> Session:
    """The same session, whose file is read once instead of in every pass over its frames, unless it is too long."""
    if isinstance(session.source, Frames) or "frames" in vars(session):
        return session
    return replace(session, source=_DecodedOnce(session.source))


MARGIN_NS: Final = 1_000_000_000
"""Around a part of a recording a second is read too: poses at its ends are filled in as they are in the whole."""


def load_window(session: Session, start: float | None, end: float | None) -> Session:
    """The session, decoded once; of one that is too long to be held only what lies around ``start`` to ``end``.

    ``start`` and ``end`` are seconds after its first frame, ``None`` its ends.

    Raises ``AssemblyError``: the part holds more than ``MOST_POSES``; the sentence says how long a part may be.
    """
    if getattr(session.source, "poses_at_most", MOST_POSES) < MOST_POSES:
        return decoded_once(session)
    stamps, bodies = session.stamps(), max(1, len(session.names))
    if len(stamps) * bodies <= MOST_POSES:
        return decoded_once(session)
    lower, upper = window_ns(int(stamps[0]), int(stamps.max()), start, end)
    stamps_in_window = int(((stamps >= lower) & (stamps <= upper)).sum())
    if stamps_in_window * bodies > MOST_POSES:
        seconds = (min(upper, int(stamps.max())) - max(lower, int(stamps[0]))) / 1e9
        raise AssemblyError(
            f"{stamps_in_window:,} frames of {bodies} bodies ({words.decimal(seconds / 3600, 1)} h) do not fit "
            f"into memory, "
            f"which holds {words.decimal(MOST_POSES / 1e6, 0)} million poses (two hours of twelve bodies); "
            f"replay a part of at most {round(seconds * MOST_POSES / (stamps_in_window * bodies)):,} s with "
            f"--start and --end"
        )
    return decoded_once(session.between(lower - MARGIN_NS, upper + MARGIN_NS))


def load_beginning(session: Session) -> Session:
    """The session, decoded once; of one that is too long to be held its first ``MOST_POSES``."""
    stamps, most_frames = session.stamps(), MOST_POSES // max(1, len(session.names))
    if len(stamps) > most_frames:
        session = session.between(int(stamps[0]), int(stamps[most_frames - 1]))
    return decoded_once(session)
