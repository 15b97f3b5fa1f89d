"""What every detector demands of a motion: poses of its bodies, and blocks in order of time."""

from collections.abc import Iterable, Iterator, Sequence
from typing import Final

import numpy as np

from cdcore.errors import InvalidPoseError
from cdcore.numerics import BoolArray, ByteArray, FloatArray, IntArray
from cdcore.protocol.body import Body
from cdcore.protocol.motion import Motion
from cdcore.protocol.verdict import Verdict, is_one_of


def require_bodies(motion: Motion, bodies: Sequence[Body]) -> None:
    """Refuse what is no motion, or one of another number of bodies than the detector has, with an InvalidPoseError."""
    if not isinstance(motion, Motion):
        raise InvalidPoseError(
            f"a detector is asked about a Motion, not {type(motion).__name__}; make one: "
            "cdcore.Motion(times, translations, rotations)"
        )
    if motion.body_count != len(bodies):
        names = ", ".join(body.name for body in bodies)
        raise InvalidPoseError(
            f"the motion has poses of {motion.body_count} bodies, the detector has {len(bodies)}; "
            f"give one column for each of: {names}"
        )


def blocks_in_order(motions: Iterable[Motion]) -> Iterator[Motion]:
    """The blocks of a stream; InvalidPoseError where one starts before the end of the block before it."""
    last: float | None = None
    for number, motion in enumerate(motions):
        if len(motion):
            first = float(motion.times[0])
            if last is not None and not first > last:
                raise InvalidPoseError(
                    f"block {number} starts at {first!r} s, not after {last!r} s where the block before ends; "
                    "stream the blocks in order of time"
                )
            last = float(motion.times[-1])
        yield motion


def pair_has_pose(motion: Motion, pairs: IntArray) -> BoolArray:
    """Whether both bodies of a pair have a pose, (T, P)."""
    return motion.valid[:, pairs[:, 0]] & motion.valid[:, pairs[:, 1]]


def contact_or_clear(hits: BoolArray, motion: Motion, pairs: IntArray) -> ByteArray:
    """Verdicts (T, P): CONTACT where a pair was hit, NO_POSE where a body has no pose, else CLEAR."""
    verdict: ByteArray = hits * np.uint8(Verdict.CONTACT)
    if not motion.valid.all():
        verdict[~pair_has_pose(motion, pairs)] = Verdict.NO_POSE
    return verdict


def ordered_by_name(bodies: Sequence[Body], pairs: IntArray) -> tuple[IntArray, BoolArray]:
    """Each pair with the body first whose name sorts first, (P, 2), and which rows that turned round, (P,).

    Asked in this order, an engine whose answer depends on the order of its operands gives one answer for a pair,
    however the pair was written down.
    """
    rank = np.empty(len(bodies), dtype=np.int64)
    rank[sorted(range(len(bodies)), key=lambda k: bodies[k].name)] = np.arange(len(bodies))
    turned = rank[pairs[:, 0]] > rank[pairs[:, 1]]
    ordered = pairs.copy()
    ordered[turned] = pairs[turned][:, ::-1]
    return ordered, turned


class HeldVerdicts:
    """What is believed of each pair between looks (zero-order hold), handed from block to block.

    ``tick``: number of the last tick that had a look, for ``looks_of``.
    """

    def __init__(self, pairs: int) -> None:
        self.tick = -np.inf
        self._verdict: ByteArray = np.full(pairs, Verdict.NO_POSE, dtype=np.uint8)

    def hold(self, seen: ByteArray, looks: BoolArray, known: BoolArray) -> tuple[ByteArray, dict[str, int]]:
        """Verdicts of a block (T, P), and how many were looked at and held; a look without a pose changes nothing.

        ``seen`` (looks, P), verdicts at the frames with a look; ``looks`` (T,); ``known`` (T, P): has a pose.
        """
        believed = np.concatenate([self._verdict[None], seen])
        for column in np.flatnonzero(is_one_of(seen, (Verdict.NO_POSE,)).any(axis=0)):
            row = believed[:, column]
            last = np.where(row != Verdict.NO_POSE, np.arange(len(row)), 0)
            believed[:, column] = row[np.maximum.accumulate(last)]
        self._verdict = believed[-1]
        verdict = np.where(known, believed.take(np.cumsum(looks), axis=0), np.uint8(Verdict.NO_POSE))
        held = np.count_nonzero(known) - np.count_nonzero(known[looks])
        return verdict, {"looks": int(looks.sum()), "held": int(held)}


TICK_SLACK: Final = 1e-6
"""A frame up to a microsecond before a tick counts as at it: stamps are whole nanoseconds, and k/rate is rounded."""


def looks_of(times: FloatArray, rate_hz: float | None, before: float = -np.inf) -> tuple[BoolArray, float]:
    """Which frames are tested, (T,), and the number of the last tick, which is ``before`` of the next block.

    ``times`` (T,) are seconds, increasing; ``rate_hz``: ticks per second, ``None``: every frame is tested; ``before``:
    number of the last tick that had a look, minus infinity: none, so that the first frame has one.
    """
    if rate_hz is None or not len(times):
        return np.ones(len(times), dtype=np.bool_), before
    ticks = tick_of(times, rate_hz)
    return np.diff(ticks, prepend=before) > 0, float(ticks[-1])


def tick_of(times: FloatArray, rate_hz: float) -> FloatArray:
    """Number of the last tick at each time, of any shape."""
    return np.floor((times + TICK_SLACK) * rate_hz)


def looks_at(times: FloatArray, frame: int, rate_hz: float | None) -> bool:
    """Whether one frame of a whole motion is tested."""
    first = max(0, frame - 1)
    looks, _ = looks_of(times[first : frame + 1], rate_hz)
    return frame == 0 or bool(looks[-1])
