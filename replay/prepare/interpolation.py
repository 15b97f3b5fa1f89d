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

    def part(self, start: int, stop: int) -> "FilledFrames":
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
        ready = int(np.searchsorted(window.stamp_ns, window.stamp_ns[-1] - BRIDGE_NS, side="right"))
        if ready > first:
            yield _fill(window, first, ready)
        kept = int(np.searchsorted(window.stamp_ns, window.stamp_ns[ready] - BRIDGE_NS))
        window, first = window.segment(kept, len(window)), ready - kept
    if window is not None and len(window):
        yield _fill(window, first, len(window))


def _fill(window: Frames, first: int, stop: int) -> FilledFrames:
    """Fill some frames of a window; the rest of it only serves as their past and future."""
    head = window.segment(first, stop)
    origin = _ORIGIN[head.status]
    position, quaternion = head.position.copy(), head.quaternion_xyzw.copy()
    position[origin == PoseOrigin.NONE] = np.nan
    quaternion[origin == PoseOrigin.NONE] = np.nan
    rows, columns = np.nonzero(head.status == Status.ABSENT)
    if len(rows):
        usable, last = _ORIGIN[window.status] != PoseOrigin.NONE, len(window) - 1
        before, after = (some[first + rows, columns] for some in neighbours(window.status != Status.ABSENT))
        since = head.stamp_ns[rows] - window.stamp_ns[before]
        until = window.stamp_ns[np.minimum(after, last)] - head.stamp_ns[rows]
        near_before = (before >= 0) & usable[before, columns] & (since <= BRIDGE_NS)
        near_after = (after <= last) & usable[np.minimum(after, last), columns] & (until <= BRIDGE_NS)
        r, c, b = rows[near_before], columns[near_before], before[near_before]
        position[r, c], quaternion[r, c] = window.position[b, c], window.quaternion_xyzw[b, c]
        origin[r, c] = PoseOrigin.HELD
        between = near_before & near_after
        r, c, b, a = rows[between], columns[between], before[between], after[between]
        fraction = since[between] / (since[between] + until[between])
        start, end = (np.hstack([window.position[k, c], window.quaternion_xyzw[k, c]]) for k in (b, a))
        position[r, c], quaternion[r, c] = np.split(interpolate_poses(start, end, fraction), [3], axis=1)
        origin[r, c] = PoseOrigin.INTERPOLATED
    return FilledFrames(head.stamp_ns, position, quaternion, origin)


def neighbours(present: BoolArray) -> tuple[IntArray, IntArray]:
    """Indices of the last present row up to each row (T, ...), -1: none, and of the first from it on, T: none."""
    count = len(present)
    numbers = np.arange(count).reshape(-1, *[1] * (present.ndim - 1))
    before = np.maximum.accumulate(np.where(present, numbers, -1), axis=0)
    return before, np.minimum.accumulate(np.where(present, numbers, count)[::-1], axis=0)[::-1]


def interpolate_poses(start: FloatArray, end: FloatArray, fraction: FloatArray) -> FloatArray:
    """Poses (n, 7), position and quaternion, at ``fraction`` (n,) between two: straight, and by slerp."""
    translation = start[:, :3] + (end[:, :3] - start[:, :3]) * fraction[:, None]
    first, last = (pose[:, 3:] / np.linalg.norm(pose[:, 3:], axis=1, keepdims=True) for pose in (start, end))
    return np.hstack([translation, slerp(first, last, fraction)])
