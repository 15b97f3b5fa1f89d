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

BRIDGE_NS: Final = 50_000_000
"""A sample speaks for at most 50 ms: five samples of a 90 Hz tracker, and 1-2 cm of an ordinary hand movement."""

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


def is_usable(status: ByteArray) -> BoolArray:
    """Whether each sample is a pose that may be computed with, same shape."""
    return _ORIGIN[status] != PoseOrigin.NONE


def filled(blocks: Iterable[Frames]) -> Iterator[FilledFrames]:
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
        window, first = window.part(kept, len(window)), ready - kept
    if window is not None and len(window):
        yield _fill(window, first, len(window))


def _fill(window: Frames, first: int, stop: int) -> FilledFrames:
    """Fill some frames of a window; the rest of it only serves as their past and future."""
    head = window.part(first, stop)
    origin = _ORIGIN[head.status]
    position, quaternion = head.position.copy(), head.quaternion_xyzw.copy()
    position[origin == PoseOrigin.NONE] = np.nan
    quaternion[origin == PoseOrigin.NONE] = np.nan
    rows, columns = np.nonzero(head.status == Status.ABSENT)
    if len(rows):
        usable, present = is_usable(window.status), window.status != Status.ABSENT
        numbers, last = np.arange(len(window))[:, None], len(window) - 1
        before = np.maximum.accumulate(np.where(present, numbers, -1), axis=0)[first + rows, columns]
        after = np.minimum.accumulate(np.where(present, numbers, last + 1)[::-1], axis=0)[::-1][first + rows, columns]
        since = head.stamp_ns[rows] - window.stamp_ns[before]
        until = window.stamp_ns[np.minimum(after, last)] - head.stamp_ns[rows]
        near_before = (before >= 0) & usable[before, columns] & (since <= BRIDGE_NS)
        near_after = (after <= last) & usable[np.minimum(after, last), columns] & (until <= BRIDGE_NS)
        r, c, b = rows[near_before], columns[near_before], before[near_before]
        position[r, c], quaternion[r, c] = window.position[b, c], window.quaternion_xyzw[b, c]
        origin[r, c] = PoseOrigin.HELD
        between = near_before & near_after
        r, c, b, a = rows[between], columns[between], before[between], after[between]
        share = since[between] / (since[between] + until[between])
        start, end = window.position[b, c], window.position[a, c]
        position[r, c] = start + (end - start) * share[:, None]
        quaternion[r, c] = slerp(window.quaternion_xyzw[b, c], window.quaternion_xyzw[a, c], share)
        origin[r, c] = PoseOrigin.INTERPOLATED
    return FilledFrames(head.stamp_ns, position, quaternion, origin)


NEARLY_EQUAL: Final = 1.0 - 1e-10
"""Above this cosine of half the angle (28 microradians) slerp would divide by a sine that has lost half its digits; the
chord differs from the arc by less than 1e-15 there."""


def slerp(start: FloatArray, end: FloatArray, share: FloatArray) -> FloatArray:
    """Unit quaternions (n, 4) on the shorter arc from ``start`` to ``end`` at ``share`` (n,) of the way.

    Source: K. Shoemake, Animating rotation with quaternion curves, SIGGRAPH 1985.
    """
    a, b = _unit(start), _unit(end)
    cosine = _dot(a, b)
    b = np.where(cosine[:, None] < 0, -b, b)
    cosine = np.abs(cosine)
    near = cosine > NEARLY_EQUAL
    angle = np.arccos(np.where(near, 0.0, cosine))
    sine = np.sin(angle)
    wa = np.where(near, 1.0 - share, np.sin((1.0 - share) * angle) / sine)
    wb = np.where(near, share, np.sin(share * angle) / sine)
    return _unit(wa[:, None] * a + wb[:, None] * b)


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    product = a * b
    return ((product[:, 0] + product[:, 1]) + product[:, 2]) + product[:, 3]


def _unit(q: FloatArray) -> FloatArray:
    return q / np.sqrt(_dot(q, q))[:, None]
