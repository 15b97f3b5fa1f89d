"""One pass over the frames of a session that marks every odd sample; memory is a block, and six bytes per sample.

The findings and what a run does about them both rest on these marks, so that they cannot disagree.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sessions.doctor.track_watch import Mark, Samples, TrackWatch
from sessions.frames import Frames, Status

NORM_REJECT: Final = 1e-3
"""A quaternion whose norm is further off 1 was not rounded, it is wrong; the collision core rejects it too."""

NORM_NOTE: Final = 1e-6
"""Further off 1 than float32 would leave it (1e-7): printed with few decimals."""

SKEW_NS: Final = 500_000_000
"""Half a second between a sample and its frame is no latency: VIVE-style trackers need 22 ms."""

LOOKS_PER_BLOCK: Final = 512
"""Frames of a block whose poses are kept to judge scale and axes by."""

JOINED_FRAMES: Final = 1024
"""Frames looked at together, whatever pieces they come in."""

MOST_DECIMALS: Final = 7
"""Numbers printed with more decimals than float32 holds are not called rounded."""


@dataclass(frozen=True, eq=False)
class Looked:
    """What one pass over T frames of N bodies leaves.

    Parameters
    ----------
    names : N bodies.
    stamp_ns, log_ns : (T,) int64.
    marks : (T, N) uint16, unions of `Mark`.
    steps : (T, N) float32, metres from the sample before; NaN where there is none.
    position (S, N, 3), quaternion (S, N, 4) : poses of some frames spread over the session; NaN where there is none.
    worst_norm : (N,) the norm furthest off 1 among samples marked non-unit or off unit.
    """

    names: tuple[str, ...]
    stamp_ns: NDArray[np.int64]
    log_ns: NDArray[np.int64]
    marks: NDArray[np.uint16]
    steps: NDArray[np.float32]
    position: NDArray[np.float64]
    quaternion: NDArray[np.float64]
    worst_norm: NDArray[np.float64]

    def has(self, mark: Mark) -> NDArray[np.bool_]:
        """(T, N) where any of these marks is set."""
        found: NDArray[np.bool_] = (self.marks & np.uint16(mark)) != 0
        return found

    @property
    def usable(self) -> NDArray[np.bool_]:
        """(T, N) samples that claim to be poses and are finite."""
        return self.has(Mark.PRESENT) & ~self.has(Mark.LOST | Mark.NOT_FINITE)


def look_through(blocks: Iterable[Frames]) -> Looked:
    """Mark every sample; later blocks may know more bodies than earlier ones."""
    looking = _Looking()
    waiting: Frames | None = None
    for block in _larger(blocks):
        if waiting is not None:
            looking.add(waiting, last=False)
        waiting = block
    if waiting is not None:
        looking.add(waiting, last=True)
    return looking.result()


def _larger(blocks: Iterable[Frames]) -> Iterator[Frames]:
    """Blocks of the same bodies joined to some thousand frames: a step costs the same for a second as for a minute."""
    held: list[Frames] = []
    for block in blocks:
        if held and (block.names != held[0].names or sum(map(len, held)) >= JOINED_FRAMES):
            yield Frames.join(held)
            held = []
        held.append(block)
    if held:
        yield Frames.join(held)


@dataclass
class _Looking:
    names: tuple[str, ...] = ()
    stamps: list[NDArray[np.int64]] = field(default_factory=list)
    logs: list[NDArray[np.int64]] = field(default_factory=list)
    marks: NDArray[np.uint16] = field(default_factory=lambda: np.zeros((0, 0), dtype=np.uint16))
    steps: NDArray[np.float32] = field(default_factory=lambda: np.zeros((0, 0), dtype=np.float32))
    poses: list[NDArray[np.float64]] = field(default_factory=list)
    watches: list[TrackWatch] = field(default_factory=list)
    worst: list[float] = field(default_factory=list)
    least_step: float = 0.0
    count: int = 0

    def add(self, frames: Frames, *, last: bool) -> None:
        """Take one block in."""
        if not self.least_step:
            step = np.diff(frames.stamp_ns)
            self.least_step = float(np.median(step[step > 0])) / 1e9 if (step > 0).any() else 0.0
        first, self.count = self.count, self.count + len(frames)
        self.names = frames.names
        self._grow()
        self.stamps.append(frames.stamp_ns)
        self.logs.append(frames.log_ns)
        some = frames_apart(frames)
        self.poses.append(np.concatenate([some.position, some.quaternion_xyzw], axis=2))
        with np.errstate(over="ignore", invalid="ignore"):
            self.marks[first : self.count] |= self._alone(frames)
            for column, watch in enumerate(self.watches):
                watch.add(self._track(frames, first, column), self.marks[:, column], self.steps[:, column], last=last)

    def _grow(self) -> None:
        width = len(self.names)
        for _ in range(width - len(self.watches)):
            self.watches.append(TrackWatch(self.least_step))
            self.worst.append(1.0)
        if self.count > len(self.marks) or width > self.marks.shape[1]:
            rows = max(self.count, 2 * len(self.marks)) if self.count > len(self.marks) else len(self.marks)
            marks, steps = np.zeros((rows, width), np.uint16), np.full((rows, width), np.nan, np.float32)
            old = (slice(0, self.marks.shape[0]), slice(0, self.marks.shape[1]))
            marks[old], steps[old] = self.marks, self.steps
            self.marks, self.steps = marks, steps

    def _alone(self, frames: Frames) -> NDArray[np.uint16]:
        """Marks of samples that need no neighbour."""
        present, lost = frames.status != Status.ABSENT, frames.status == Status.LOST
        claims = present & ~lost
        q = frames.quaternion_xyzw
        norm = np.sqrt((q * q).sum(axis=-1))
        finite = np.isfinite(frames.position).all(axis=-1) & np.isfinite(q).all(axis=-1)
        off = np.abs(norm - 1.0)
        zero = claims & finite & (norm == 0)
        rejected = claims & finite & ~zero & ~(off <= NORM_REJECT)
        rounded = claims & finite & (off > NORM_NOTE) & (off <= NORM_REJECT)
        still = (frames.position == 0).all(axis=-1) & (q[..., :3] == 0).all(axis=-1) & (np.abs(q[..., 3]) == 1)
        skewed = present & (np.abs(frames.sample_ns - frames.stamp_ns[:, None]) > SKEW_NS)
        for column in np.flatnonzero((rejected | rounded).any(axis=0)).tolist():
            mine = norm[(rejected | rounded)[:, column], column]
            furthest = float(mine[np.abs(mine - 1.0).argmax()])
            if abs(furthest - 1.0) > abs(self.worst[column] - 1.0):
                self.worst[column] = furthest
        marks = np.zeros(present.shape, dtype=np.uint16)
        for mark, where in (
            (Mark.PRESENT, present), (Mark.LOST, lost), (Mark.NOT_FINITE, claims & ~finite),
            (Mark.ZERO_QUATERNION, zero), (Mark.NON_UNIT, rejected), (Mark.OFF_UNIT, rounded),
            (Mark.IDENTITY, claims & still), (Mark.SAMPLE_SKEWED, skewed),
        ):  # fmt: skip
            marks[where] |= np.uint16(mark)
        return marks

    def _track(self, frames: Frames, first: int, column: int) -> Samples:
        marks = self.marks[first : self.count, column]
        rows = np.flatnonzero(marks & np.uint16(Mark.PRESENT) & ~_missing(marks))
        return Samples(
            rows + first,
            (frames.stamp_ns[rows] - self.stamps[0][0]) / 1e9,
            frames.sample_ns[rows, column],
            frames.position[rows, column],
            frames.quaternion_xyzw[rows, column],
        )

    def result(self) -> Looked:
        """Everything seen."""
        width = len(self.names)
        wide = np.full((sum(map(len, self.poses)), width, 7), np.nan)
        at = 0
        for part in self.poses:
            wide[at : at + len(part), : part.shape[1]] = part
            at += len(part)
        none = [np.zeros(0, dtype=np.int64)]
        return Looked(
            self.names, np.concatenate(self.stamps or none), np.concatenate(self.logs or none),
            self.marks[: self.count], self.steps[: self.count], wide[..., :3], wide[..., 3:], np.array(self.worst),
        )  # fmt: skip


def _missing(marks: NDArray[np.uint16]) -> NDArray[np.uint16]:
    """PRESENT where a sample is no pose, so that it is taken away."""
    gone = (marks & np.uint16(Mark.LOST | Mark.NOT_FINITE)) != 0
    return np.where(gone, np.uint16(Mark.PRESENT), np.uint16(0)).astype(np.uint16)


def frames_apart(frames: Frames) -> Frames:
    """At most `LOOKS_PER_BLOCK` frames, evenly spread; positions flagged as lost are NaN."""
    stride = max(1, -(-len(frames) // LOOKS_PER_BLOCK))
    rows = slice(0, len(frames), stride)
    lost = frames.status[rows] == Status.LOST
    position, quaternion = frames.position[rows].copy(), frames.quaternion_xyzw[rows].copy()
    position[lost], quaternion[lost] = np.nan, np.nan
    return Frames(
        frames.names, frames.stamp_ns[rows], frames.log_ns[rows], frames.sample_ns[rows], position, quaternion,
        frames.status[rows],
    )  # fmt: skip
