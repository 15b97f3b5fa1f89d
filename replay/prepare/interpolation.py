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
    waiting: Frames | None = None
    anchor: _Anchor | None = None
    for block in blocks:
        window = block if waiting is None else Frames.join([waiting, block])
        if not len(window):
            continue
        anchor = anchor or _Anchor.none(len(window.names))
        ready = int(np.searchsorted(window.stamp_ns, window.stamp_ns[-1] - BRIDGE_NS, side="right"))
        if ready:
            yield _fill(window, ready, anchor)
            anchor = anchor.after(window.part(0, ready))
        waiting = window.part(ready, len(window))
    if waiting is not None and len(waiting):
        yield _fill(waiting, len(waiting), anchor or _Anchor.none(len(waiting.names)))


@dataclass(frozen=True, eq=False)
class _Anchor:
    """The last sample of each body before a window: one row of the same columns."""

    stamp_ns: IntArray
    position: FloatArray
    quaternion: FloatArray
    usable: BoolArray

    @classmethod
    def none(cls, bodies: int) -> "_Anchor":
        """No body has been seen."""
        return cls(
            np.zeros(bodies, dtype=np.int64), np.zeros((bodies, 3)), np.zeros((bodies, 4)), np.zeros(bodies, np.bool_)
        )

    def after(self, frames: Frames) -> "_Anchor":
        """The last sample of each body after these frames too."""
        table = _Samples.of(frames, self)
        last = table.before[-1], np.arange(len(frames.names))
        return _Anchor(table.stamp_ns[last], table.position[last], table.quaternion[last], table.usable[last])


@dataclass(frozen=True, eq=False)
class _Samples:
    """The samples of a window below one row for the anchor, and for each frame which row comes before and after.

    ``before`` and ``after`` are (n, N) row numbers; ``after`` is -1 where no sample follows.
    """

    stamp_ns: IntArray
    position: FloatArray
    quaternion: FloatArray
    usable: BoolArray
    before: IntArray
    after: IntArray

    @classmethod
    def of(cls, window: Frames, anchor: _Anchor) -> "_Samples":
        """Look up the neighbours of every frame."""
        present = window.status != Status.ABSENT
        rows = np.arange(1, len(window) + 1)[:, None]
        before = np.maximum.accumulate(np.where(present, rows, 0), axis=0)
        end = len(window) + 1
        after = np.minimum.accumulate(np.where(present, rows, end)[::-1], axis=0)[::-1]
        stamps = np.broadcast_to(window.stamp_ns[:, None], present.shape)
        return cls(
            np.concatenate([anchor.stamp_ns[None], stamps]), np.concatenate([anchor.position[None], window.position]),
            np.concatenate([anchor.quaternion[None], window.quaternion_xyzw]),
            np.concatenate([anchor.usable[None], is_usable(window.status)]), before, np.where(after == end, -1, after),
        )  # fmt: skip


def _fill(window: Frames, count: int, anchor: _Anchor) -> FilledFrames:
    """Fill the first frames of a window; the rest of it only serves as their future."""
    head = window.part(0, count)
    origin = _ORIGIN[head.status]
    position, quaternion = head.position.copy(), head.quaternion_xyzw.copy()
    position[origin == PoseOrigin.NONE] = np.nan
    quaternion[origin == PoseOrigin.NONE] = np.nan
    absent = head.status == Status.ABSENT
    if absent.any():
        _fill_absent(_Samples.of(window, anchor), head.stamp_ns, absent, position, quaternion, origin)
    return FilledFrames(head.stamp_ns, position, quaternion, origin)


def _fill_absent(
    samples: _Samples, stamp_ns: IntArray, absent: BoolArray, position: FloatArray,
    quaternion: FloatArray, origin: ByteArray,
) -> None:  # fmt: skip
    rows, columns = np.nonzero(absent)
    now = stamp_ns[rows]
    before, after = samples.before[rows, columns], samples.after[rows, columns]
    since, until = now - samples.stamp_ns[before, columns], samples.stamp_ns[after, columns] - now
    near_before = samples.usable[before, columns] & (since <= BRIDGE_NS)
    near_after = (after >= 0) & samples.usable[after, columns] & (until <= BRIDGE_NS)
    held = near_before & ~near_after
    r, c, b = rows[held], columns[held], before[held]
    position[r, c], quaternion[r, c] = samples.position[b, c], samples.quaternion[b, c]
    origin[r, c] = PoseOrigin.HELD
    between = near_before & near_after
    r, c, b, a = rows[between], columns[between], before[between], after[between]
    share = since[between] / (since[between] + until[between])
    start, end = samples.position[b, c], samples.position[a, c]
    position[r, c] = start + (end - start) * share[:, None]
    quaternion[r, c] = slerp(samples.quaternion[b, c], samples.quaternion[a, c], share)
    origin[r, c] = PoseOrigin.INTERPOLATED


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
