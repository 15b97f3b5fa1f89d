"""Every frame of a body gets its recorded pose, a pose computed from near neighbours, or none; blocks change nothing.

Rules, per body and frame:

- A sample recorded in the frame is used as it is and stands at the frame's stamp.
- Without one, and with usable samples at most 50 ms before **and** after: position linear, rotation slerp between them.
- Else, with a usable sample at most 50 ms before: that one, held.
- Else there is no pose.
- A sample flagged as lost gives no pose. No pose is held or interpolated across it, however short the loss, because a
  tracker that comes back usually comes back some millimetres elsewhere.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from cdcore.numerics import BoolArray, ByteArray, FloatArray, IntArray
from replay.prepare.assembly import PoseOrigin
from sessions import Frames, Status
from sessions.geometry.rotations import slerp
from sessions.model.constants import BRIDGE_NS

_ORIGIN: Final = np.array(
    [PoseOrigin.NONE, PoseOrigin.RECORDED, PoseOrigin.NONE, PoseOrigin.HELD, PoseOrigin.INTERPOLATED], dtype=np.uint8
)
"""Origin of a recorded sample by its ``Status``."""


@dataclass(frozen=True, eq=False)
class FilledFrames:
    """Poses of N tracked bodies in T frames.

    Parameters
    ----------
    stamp_ns : (T,) int64, increasing.
    position : (T, N, 3), NaN where there is no pose.
    quaternion_xyzw : (T, N, 4), as recorded or interpolated; NaN where there is no pose.
    origin : (T, N) uint8, values of ``PoseOrigin``.
    """

    stamp_ns: IntArray
    position: FloatArray
    quaternion_xyzw: FloatArray
    origin: ByteArray

    def __len__(self) -> int:
        return len(self.stamp_ns)

    def segment(self, start: int, stop: int) -> "FilledFrames":
        """Frames ``start <= t < stop`` as views."""
        return FilledFrames(*(column[start:stop] for column in vars(self).values()))


def fill_frames(blocks: Iterable[Frames]) -> Iterator[FilledFrames]:
    """Fill frames whose stamps increase, block by block; a frame leaves once nothing to come can change it.

    The joined result does not depend on how the frames were cut into blocks, to the last bit.
    """
    window: Frames | None = None
    first = 0  # Rows of the window before this one have left; they are kept while they can still speak for others
    for block in blocks:
        window = block if window is None else Frames.join([window, block])
        if not len(window):
            continue
        ready_row = int(np.searchsorted(window.stamp_ns, window.stamp_ns[-1] - BRIDGE_NS, side="right"))
        if ready_row > first:
            yield _filled_segment(window, first, ready_row)
        kept_row = int(np.searchsorted(window.stamp_ns, window.stamp_ns[ready_row] - BRIDGE_NS))
        window, first = window.segment(kept_row, len(window)), ready_row - kept_row
    if window is not None and len(window):
        yield _filled_segment(window, first, len(window))


def _filled_segment(window: Frames, first: int, stop: int) -> FilledFrames:
    """Fill some frames of a window; the rest of it only serves as their past and future."""
    segment_frames = window.segment(first, stop)
    origin = _ORIGIN[segment_frames.status]
    position, quaternion = segment_frames.position.copy(), segment_frames.quaternion_xyzw.copy()
    position[origin == PoseOrigin.NONE] = np.nan
    quaternion[origin == PoseOrigin.NONE] = np.nan
    absent_rows, absent_columns = np.nonzero(segment_frames.status == Status.ABSENT)
    if len(absent_rows):
        is_usable, last_row = _ORIGIN[window.status] != PoseOrigin.NONE, len(window) - 1
        present_before, present_after = (
            neighbour_rows[first + absent_rows, absent_columns]
            for neighbour_rows in present_neighbours(window.status != Status.ABSENT)
        )
        since_before = segment_frames.stamp_ns[absent_rows] - window.stamp_ns[present_before]
        until_after = window.stamp_ns[np.minimum(present_after, last_row)] - segment_frames.stamp_ns[absent_rows]
        near_before = (present_before >= 0) & is_usable[present_before, absent_columns] & (since_before <= BRIDGE_NS)
        near_after = (
            (present_after <= last_row)
            & is_usable[np.minimum(present_after, last_row), absent_columns]
            & (until_after <= BRIDGE_NS)
        )
        r, c, b = absent_rows[near_before], absent_columns[near_before], present_before[near_before]
        position[r, c], quaternion[r, c] = window.position[b, c], window.quaternion_xyzw[b, c]
        origin[r, c] = PoseOrigin.HELD
        is_between = near_before & near_after
        r, c, b, a = (
            absent_rows[is_between],
            absent_columns[is_between],
            present_before[is_between],
            present_after[is_between],
        )
        fraction = since_before[is_between] / (since_before[is_between] + until_after[is_between])
        start, end = (np.hstack([window.position[k, c], window.quaternion_xyzw[k, c]]) for k in (b, a))
        position[r, c], quaternion[r, c] = np.split(interpolate_poses(start, end, fraction), [3], axis=1)
        origin[r, c] = PoseOrigin.INTERPOLATED
    return FilledFrames(segment_frames.stamp_ns, position, quaternion, origin)


def present_neighbours(present: BoolArray) -> tuple[IntArray, IntArray]:
    """Indices of the last present row up to each row (T, ...), -1: none, and of the first from it on, T: none."""
    row_count = len(present)
    row_numbers = np.arange(row_count).reshape(-1, *[1] * (present.ndim - 1))
    last_present = np.maximum.accumulate(np.where(present, row_numbers, -1), axis=0)
    return last_present, np.minimum.accumulate(np.where(present, row_numbers, row_count)[::-1], axis=0)[::-1]


def interpolate_poses(start_poses: FloatArray, end_poses: FloatArray, fraction: FloatArray) -> FloatArray:
    """Poses (n, 7), position and quaternion, at ``fraction`` (n,) between two: straight, and by slerp."""
    translation = start_poses[:, :3] + (end_poses[:, :3] - start_poses[:, :3]) * fraction[:, None]
    start_quaternions, end_quaternions = (
        pose[:, 3:] / np.linalg.norm(pose[:, 3:], axis=1, keepdims=True) for pose in (start_poses, end_poses)
    )
    return np.hstack([translation, slerp(start_quaternions, end_quaternions, fraction)])
