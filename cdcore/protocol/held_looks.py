"""Zero-order hold of a detector with a rate: between samples each pair keeps its last answer.

A look is the first frame at or after a tick ``offset_s + k / rate_hz``, and the first frame of all.
"""

from collections import Counter
from typing import Final

import numpy as np

from cdcore.numerics import BoolArray, ByteArray, FloatArray, IntArray
from cdcore.protocol.live import Live
from cdcore.protocol.motion import Motion, pair_has_pose
from cdcore.protocol.verdict import Verdict

TICK_SLACK: Final = 1e-6
"""A frame up to a microsecond before a tick counts as at it: stamps are whole nanoseconds, and k/rate is rounded."""

BEFORE_FIRST_ANSWER: Final = Verdict.NOT_FOUND
"""Of a pair whose poses are known and that was not sampled yet: the detector reports no contact, and proves nothing."""


def tick_of(times: FloatArray, rate_hz: float, offset_s: float = 0.0) -> FloatArray:
    """Number of the last tick at each time, of any shape."""
    return np.floor((times - offset_s + TICK_SLACK) * rate_hz)


def looks_at(times: FloatArray, frame: int, rate_hz: float | None, offset_s: float = 0.0) -> bool:
    """Whether one frame of a whole motion is looked at."""
    return bool(HeldLooks(0, rate_hz, offset_s).looks(times[max(0, frame - 1) : frame + 1])[-1])


def last_answers(answered: BoolArray) -> IntArray:
    """Number of the last look with an answer after each of L looks, counted from 1, (1 + L, P); 0: none yet.

    ``answered`` (L, P): which looks gave an answer about a pair.
    """
    numbers = np.zeros((1 + len(answered), answered.shape[1]), dtype=np.int64)
    numbers[1:] = np.where(answered, np.arange(1, len(numbers))[:, None], 0)
    return np.maximum.accumulate(numbers, axis=0)


class HeldLooks:
    """Keeps the sampling ticks and the last answer about each pair; handed from block to block.

    ``rate_hz``: looks per second; ``None``: every frame. ``offset_s``: seconds at which the first tick lies.
    """

    def __init__(self, pairs: int, rate_hz: float | None, offset_s: float = 0.0) -> None:
        self._rate_hz, self._offset_s = rate_hz, offset_s
        self._tick = -np.inf
        self._verdict: ByteArray = np.full(pairs, BEFORE_FIRST_ANSWER, dtype=np.uint8)

    def looks(self, times: FloatArray) -> BoolArray:
        """Marks the frames of the next block that are sampled, (T,)."""
        if self._rate_hz is None or not len(times):
            return np.ones(len(times), dtype=np.bool_)
        ticks = tick_of(times, self._rate_hz, self._offset_s)
        looks: BoolArray = np.diff(ticks, prepend=self._tick) > 0
        self._tick = float(ticks[-1])
        return looks

    def hold(
        self, sample_verdict: ByteArray, answered: BoolArray, looks: BoolArray, known: BoolArray
    ) -> tuple[ByteArray, dict[str, int]]:
        """Verdicts of a block (T, P), and counters of looks and of pair-frames that hold an earlier answer.

        ``sample_verdict`` (L, P): verdicts at the looks, ``answered`` (L, P): which of them count; ``looks`` (T,);
        ``known`` (T, P): where both bodies have a pose, elsewhere the verdict is NO_POSE.
        """
        believed = np.concatenate([self._verdict[None], sample_verdict])
        # Most pairs are answered at every look.
        gaps = np.flatnonzero(~answered.all(axis=0))
        believed[:, gaps] = np.take_along_axis(believed[:, gaps], last_answers(answered[:, gaps]), axis=0)
        self._verdict = believed[-1]
        verdict = np.where(known, believed.take(np.cumsum(looks), axis=0), np.uint8(Verdict.NO_POSE))
        held_count = np.count_nonzero(known) - np.count_nonzero(answered)
        return verdict, {"looks": int(looks.sum()), "held": int(held_count)}


class LiveHeld:
    """Looks of a live session at the ticks of a rate only, and its last answers between them.

    ``pairs`` (P, 2) body numbers.
    """

    def __init__(self, live: Live, pairs: IntArray, rate_hz: float, offset_s: float = 0.0) -> None:
        self._live, self._pairs, self._tick = live, pairs, -np.inf
        self._rate_hz, self._offset_s = rate_hz, offset_s
        self._believed: ByteArray = np.full(len(pairs), BEFORE_FIRST_ANSWER, dtype=np.uint8)
        self.seconds: dict[str, float] = {}

    @property
    def work(self) -> Counter[str]:
        """Counters of all samples so far."""
        return self._live.work

    def look(self, now: Motion) -> ByteArray:
        """Verdicts of all pairs (P,) in a motion of one frame; see ``Live.look``."""
        tick = float(tick_of(now.times[0], self._rate_hz, self._offset_s))
        if tick > self._tick:
            sample_verdict, self._tick = self._live.look(now), tick
            self._believed = np.where(sample_verdict != Verdict.NO_POSE, sample_verdict, self._believed)
            self.seconds = self._live.seconds
        else:
            self.seconds = {}
        # The quickest way to ask a small array, and most looks come here and do nothing else.
        if np.count_nonzero(now.valid) == now.valid.size:
            return self._believed
        return np.where(pair_has_pose(now, self._pairs)[0], self._believed, np.uint8(Verdict.NO_POSE))
