"""Keeps the poses of sessions of hours on disk; decodes a shorter session once and holds it in memory.

Of a motion on disk any frames are read when asked for, and memory holds only those. Everything that takes blocks,
single frames or a selection of frames works on it as on any motion; what asks for all poses gets them, at that price.
A file mapped into memory would be shorter, but the pages that were read count as held: gigabytes (2026-11).
"""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from tempfile import TemporaryFile
from types import EllipsisType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from cdcore import Motion
from replay.base.constants import BLOCK_FRAMES, HELD_FRAMES
from replay.prepare.assemble import AssemblyLayout, assemble, assemble_blocks, window_frames
from replay.prepare.assembly import Assembly
from sessions import Frames, Session
from sessions.model.session import FrameSource

ROWS_AT_ONCE: Final = BLOCK_FRAMES
"""Rows read together when a long selection is cut down to a few columns: 1 MB per body."""


class StoredRows:
    """A float64 array on disk that grows by rows of one shape; the file is deleted with the object.

    Every key of numpy gives the copy that numpy would give; a key that names rows reads only those.
    """

    dtype = np.dtype(np.float64)

    def __init__(self, row_shape: tuple[int, ...]) -> None:
        self._row_shape = row_shape
        self._row_size = int(np.prod(row_shape))
        self._file = TemporaryFile(prefix="replay-poses-")  # noqa: SIM115  (it lives as long as the array)
        self._count = 0

    @property
    def shape(self) -> tuple[int, ...]:
        """Rows, then the shape of a row."""
        return (self._count, *self._row_shape)

    @property
    def ndim(self) -> int:
        """Number of axes."""
        return 1 + len(self._row_shape)

    def __len__(self) -> int:
        return self._count

    def append(self, rows: NDArray[np.float64]) -> None:
        """Add rows (n, ...) at the end."""
        self._file.seek(0, 2)
        self._file.write(np.ascontiguousarray(rows, dtype=np.float64).data)
        self._count += len(rows)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        if copy is False:
            raise ValueError("an array on disk cannot be had without reading it; ask for a copy")
        return self._run(0, self._count).astype(dtype or self.dtype, copy=False)

    def __getitem__(self, key: Any) -> Any:
        first, rest = (key[0], key[1:]) if isinstance(key, tuple) else (key, ())
        if isinstance(first, int | np.integer):
            return self._rows(np.array([range(self._count)[first]]))[0][rest or ...]
        if isinstance(first, EllipsisType) or (np.ndim(first) > 1 and np.asarray(first).dtype == np.bool_):
            return np.asarray(self)[key]
        rows = np.arange(self._count)[first]
        if rows.ndim > 1 or (
            not isinstance(first, slice) and any(isinstance(part, list | np.ndarray) for part in rest)
        ):
            # Row numbers of any shape, paired with other numbers or not: numpy answers on the rows that are named.
            named, place = np.unique(rows, return_inverse=True)
            return self._rows(named)[(place.reshape(rows.shape), *rest)]
        # Never more than ROWS_AT_ONCE whole rows in memory beside what is asked for.
        cuts = range(ROWS_AT_ONCE, len(rows), ROWS_AT_ONCE) if rest else ()
        parts = [self._rows(part)[(slice(None), *rest)].copy() for part in np.split(rows, cuts)]
        return np.concatenate(parts) if len(parts) > 1 else parts[0]

    def _rows(self, rows: NDArray[np.int64]) -> NDArray[np.float64]:
        """Whole rows of these numbers."""
        out = np.empty((len(rows), *self._row_shape))
        begins = np.flatnonzero(np.diff(rows, prepend=-2) != 1).tolist()
        for begin, stop in zip(begins, [*begins[1:], len(rows)], strict=False):
            out[begin:stop] = self._run(int(rows[begin]), int(rows[begin]) + stop - begin)
        return out

    def _run(self, start: int, stop: int) -> NDArray[np.float64]:
        """Consecutive rows."""
        out = np.empty((stop - start, *self._row_shape))
        self._file.seek(start * self._row_size * 8)
        if out.size:
            self._file.readinto(out.reshape(-1).view(np.uint8).data)
        return out


class StoredMotion(Motion):
    """Consecutive motions of the same bodies, joined on disk; times and flags stay in memory.

    The poses are not checked again, and ``linked`` of a block's first frame is kept.
    """

    def __init__(self, blocks: Iterable[Motion]) -> None:
        times, valid, linked, renormalised, worst = [], [], [], 0, 0.0
        translations: StoredRows | None = None
        rotations: StoredRows | None = None
        for block in blocks:
            if translations is None or rotations is None:
                translations, rotations = StoredRows((block.body_count, 3)), StoredRows((block.body_count, 3, 3))
            translations.append(block.translations)
            rotations.append(block.rotations)
            times.append(block.times)
            valid.append(block.valid)
            linked.append(block.linked)
            renormalised += block.renormalised
            worst = max(worst, block.worst_orthonormality)
        if translations is None:
            raise ValueError("there is no block to store; give at least one motion")
        self._set(
            np.concatenate(times), translations, rotations, np.concatenate(valid), np.concatenate(linked),
            renormalised, worst, np.zeros(translations.shape[1], dtype=np.bool_), None,
        )  # fmt: skip


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
