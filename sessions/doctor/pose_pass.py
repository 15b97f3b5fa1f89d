"""One pass over the frames of a session that marks every odd sample; memory is a block, and eight bytes per sample.

Findings and repairs both use these marks, so that they cannot disagree.
"""

import hashlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sessions.doctor.track_watch import SAMPLE, Mark, TrackWatch, is_marked, with_marks
from sessions.model.constants import SPACE_RADIUS
from sessions.model.session import Frames, Status

NORM_REJECT: Final = 1e-3
"""A quaternion whose norm is further off 1 was not rounded, it is wrong; the collision core rejects it too."""

NORM_NOTE: Final = 1e-6  # Further off 1 than float32 would leave it (1e-7): printed with few decimals

SKEW_NS: Final = 500_000_000
"""Half a second between a sample and its frame is no latency: VIVE-style trackers need 22 ms."""

SAMPLES_PER_BLOCK: Final = 512  # Frames of a block whose poses are kept to judge scale and axes by

MOST_SAMPLES: Final = 131_072  # Of a whole recording; of one that is longer fewer frames of a block are kept
JOINED_FRAMES: Final = 1024  # Frames examined together; smaller blocks are joined first


@dataclass(frozen=True, eq=False)
class PosePass:
    """The results of one pass over T frames of N bodies.

    Parameters
    ----------
    names : N bodies.
    stamp_ns, log_ns : (T,) int64.
    marks : (T, N) uint32, unions of `Mark`.
    steps : (T, N) float32, metres from the sample before; NaN where there is none.
    position (S, N, 3), quaternion (S, N, 4) : poses of some frames spread over the session; NaN where there is none.
    worst_norm : (N,) the norm furthest off 1 among samples marked non-unit.
    digest : SHA-256 over names, stamps and every usable pose; equal for two copies of one recording alone.
    """

    names: tuple[str, ...]
    stamp_ns: NDArray[np.int64]
    log_ns: NDArray[np.int64]
    marks: NDArray[np.uint32]
    steps: NDArray[np.float32]
    position: NDArray[np.float64]
    quaternion: NDArray[np.float64]
    worst_norm: NDArray[np.float64]
    digest: str

    def has(self, mark: Mark, column: int | slice = slice(None)) -> NDArray[np.bool_]:
        """Mask of samples with any of these marks, (T,) of one body, (T, N) of all."""
        return is_marked(self.marks[:, column], mark)

    def usable_rows(self, column: int) -> NDArray[np.int64]:
        """Frames in which a sample of this body claims to be a pose, is finite, and lies where a room may be."""
        return np.flatnonzero(self.has(Mark.PRESENT, column) & ~self.has(Mark.NO_POSE, column))


def run_pose_pass(blocks: Iterable[Frames], space_radius: float = SPACE_RADIUS) -> PosePass:
    """Mark every sample; later blocks may know more bodies than earlier ones; the radius is that of the scene."""
    looking = _RunningPass(space_radius)
    for block in _larger(blocks):
        looking.add(block)
    return looking.result()


def _larger(blocks: Iterable[Frames]) -> Iterator[Frames]:
    """Blocks of the same bodies joined to some thousand frames: a step costs the same for a second as for a minute."""
    pending: list[Frames] = []
    for block in blocks:
        if pending and (block.names != pending[0].names or sum(map(len, pending)) >= JOINED_FRAMES):
            yield Frames.join(pending)
            pending = []
        pending.append(block)
    if pending:
        yield Frames.join(pending)


class _RunningPass:
    def __init__(self, space_radius: float) -> None:
        self.space_radius = space_radius
        self.names: tuple[str, ...] = ()
        self.count, self.least_step = 0, 0.0
        self.stamps: list[NDArray[np.int64]] = []
        self.logs: list[NDArray[np.int64]] = []
        # Rows and columns grow while blocks come; the watches write into rows of earlier blocks.
        self.marks, self.steps = np.zeros((0, 0), dtype=np.uint32), np.zeros((0, 0), dtype=np.float32)
        self.worst = np.zeros(0)
        self.poses, self.thinned = [np.zeros((0, 0, 7))], 1
        self.watches: list[TrackWatch] = []
        self.hashes: list[Any] = []

    def add(self, frames: Frames) -> None:
        """Take one block in."""
        if not self.least_step:
            step = np.diff(frames.stamp_ns)
            self.least_step = float(np.median(step[step > 0])) / 1e9 if (step > 0).any() else 0.0
        first, self.count = self.count, self.count + len(frames)
        self.names = frames.names
        self._grow()
        self.stamps.append(frames.stamp_ns)
        self.logs.append(frames.log_ns)
        self.poses.append(sampled_poses(frames)[:: self.thinned])
        if sum(map(len, self.poses)) > MOST_SAMPLES:
            self.poses, self.thinned = [block[::2] for block in self.poses], 2 * self.thinned
        with np.errstate(over="ignore", invalid="ignore"):
            self.marks[first : self.count] |= self._marks_of_single_samples(frames)
            for column, watch in enumerate(self.watches):
                track = self._track(frames, first, column)
                # Row by row and body by body, so that it does not depend on blocks.
                poses = np.column_stack([track["row"], track["position"], track["quaternion"]])
                self.hashes[column].update(poses.tobytes())
                watch.add(track, self.marks[:, column], self.steps[:, column])

    def _grow(self) -> None:
        wider = len(self.names) - len(self.watches)
        # By a quarter: copying stays linear in the number of frames, and hours of them fit into 2 GiB.
        taller = max(self.count, len(self.marks) * 5 // 4) - len(self.marks) if self.count > len(self.marks) else 0
        self.watches += [TrackWatch(self.least_step) for _ in range(wider)]
        self.hashes += [hashlib.sha256() for _ in range(wider)]
        self.worst = np.pad(self.worst, (0, wider), constant_values=1.0)
        if wider or taller:
            self.marks = np.pad(self.marks, ((0, taller), (0, wider)))
            self.steps = np.pad(self.steps, ((0, taller), (0, wider)), constant_values=np.nan)

    def _marks_of_single_samples(self, frames: Frames) -> NDArray[np.uint32]:
        """Marks of samples that need no neighbour."""
        present, lost = frames.status != Status.ABSENT, frames.status == Status.LOST
        claims = present & ~lost
        q = frames.quaternion_xyzw
        norm = np.sqrt((q * q).sum(axis=-1))
        finite = np.isfinite(frames.position).all(axis=-1) & np.isfinite(q).all(axis=-1)
        away = claims & finite & (np.abs(frames.position).max(axis=-1) > self.space_radius)
        off = np.abs(norm - 1.0)
        zero = claims & finite & (norm == 0)
        rejected = claims & finite & ~zero & ~(off <= NORM_REJECT)
        rounded = claims & finite & (off > NORM_NOTE) & (off <= NORM_REJECT)
        still = (frames.position == 0).all(axis=-1) & (q[..., :3] == 0).all(axis=-1) & (np.abs(q[..., 3]) == 1)
        skewed = present & (np.abs(frames.sample_ns - frames.stamp_ns[:, None]) > SKEW_NS)
        norms = np.vstack([self.worst, np.where(rejected, norm, 1.0)])
        self.worst = norms[np.abs(norms - 1.0).argmax(axis=0), np.arange(len(self.worst))]
        return with_marks(
            {
                Mark.PRESENT: present,
                Mark.LOST: lost,
                Mark.NOT_FINITE: claims & ~finite,
                Mark.ZERO_QUATERNION: zero,
                Mark.NON_UNIT: rejected,
                Mark.OFF_UNIT: rounded,
                Mark.IDENTITY: claims & still,
                Mark.SAMPLE_SKEWED: skewed,
                Mark.OUT_OF_SPACE: away,
            }
        )

    def _track(self, frames: Frames, first: int, column: int) -> NDArray[np.void]:
        marks = self.marks[first : self.count, column]
        rows = np.flatnonzero(is_marked(marks, Mark.PRESENT) & ~is_marked(marks, Mark.NO_POSE))
        track = np.empty(len(rows), SAMPLE)
        track["row"] = rows + first
        track["time"] = (frames.stamp_ns[rows] - self.stamps[0][0]) / 1e9
        track["position"] = frames.position[rows, column]
        track["quaternion"] = frames.quaternion_xyzw[rows, column]
        return track

    def result(self) -> PosePass:
        """Everything seen."""
        with np.errstate(over="ignore", invalid="ignore"):
            for column, watch in enumerate(self.watches):
                watch.add(np.zeros(0, SAMPLE), self.marks[:, column], self.steps[:, column], last=True)
        width, none = len(self.names), np.zeros(0, dtype=np.int64)
        poses = [
            np.pad(block, ((0, 0), (0, width - block.shape[1]), (0, 0)), constant_values=np.nan) for block in self.poses
        ]
        position, quaternion = np.split(np.concatenate(poses), [3], axis=2)
        stamps = np.concatenate([none, *self.stamps])
        poses_of = [repr(self.names).encode(), stamps.tobytes(), *(digest.digest() for digest in self.hashes)]
        return PosePass(
            self.names,
            stamps,
            np.concatenate([none, *self.logs]),
            self.marks[: self.count],
            self.steps[: self.count],
            position,
            quaternion,
            self.worst,
            hashlib.sha256(b"".join(poses_of)).hexdigest(),
        )


def sampled_poses(frames: Frames) -> NDArray[np.float64]:
    """Position and quaternion of at most `SAMPLES_PER_BLOCK` frames, evenly spread, (S, N, 7); NaN where lost."""
    rows = slice(0, len(frames), max(1, -(-len(frames) // SAMPLES_PER_BLOCK)))
    poses = np.concatenate([frames.position[rows], frames.quaternion_xyzw[rows]], axis=2)
    poses[frames.status[rows] == Status.LOST] = np.nan
    return poses
