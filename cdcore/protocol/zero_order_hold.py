"""Zero-order hold of a detector with a rate: between samples each pair keeps its last answer.

A sample is the first frame at or after a tick ``offset_s + k / rate_hz``, and the first frame of all.
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

BEFORE_BLOCK: Final = -1
"""In place of the index of a sample: the answer is that of an earlier block."""


def tick_of(times: FloatArray, rate_hz: float, offset_s: float = 0.0) -> FloatArray:
    """Number of the last tick at each time, of any shape."""
    return np.floor((times - offset_s + TICK_SLACK) * rate_hz)


def is_sampled(times: FloatArray, frame: int, rate_hz: float | None, offset_s: float = 0.0) -> bool:
    """Whether one frame of a whole motion is a sample."""
    return bool(ZeroOrderHold(0, rate_hz, offset_s).sampled(times[max(0, frame - 1) : frame + 1])[-1])


def answering_samples(answered: BoolArray, sampled: BoolArray) -> IntArray:
    """Index of the sample whose answer about a pair counts in a frame, (T, P); or ``BEFORE_BLOCK``.

    ``answered`` (L, P): which samples gave an answer about a pair; ``sampled`` (T,): the frames that are samples.
    """
    last = np.maximum.accumulate(np.where(answered, np.arange(len(answered))[:, None], BEFORE_BLOCK), axis=0)
    answering = np.full((len(sampled), answered.shape[1]), BEFORE_BLOCK, dtype=np.int64)
    count = np.cumsum(sampled)
    answering[count > 0] = last[count[count > 0] - 1]
    return answering


class ZeroOrderHold:
    """Keeps the sampling ticks and the last answer about each pair; handed from block to block.

    ``rate_hz``: samples per second; ``None``: every frame. ``offset_s``: seconds at which the first tick lies.
    """

    def __init__(self, pairs: int, rate_hz: float | None, offset_s: float = 0.0) -> None:
        self._rate_hz, self._offset_s = rate_hz, offset_s
        self._tick = -np.inf
        self._verdict: ByteArray = np.full(pairs, BEFORE_FIRST_ANSWER, dtype=np.uint8)

    def sampled(self, times: FloatArray) -> BoolArray:
        """Marks the frames of the next block that are samples, (T,)."""
        if self._rate_hz is None or not len(times):
            return np.ones(len(times), dtype=np.bool_)
        ticks = tick_of(times, self._rate_hz, self._offset_s)
        sampled: BoolArray = np.diff(ticks, prepend=self._tick) > 0
        self._tick = float(ticks[-1])
        return sampled

    def hold(
        self, sample_verdict: ByteArray, answered: BoolArray, sampled: BoolArray, known: BoolArray
    ) -> tuple[ByteArray, dict[str, int]]:
        """Verdicts of a block (T, P), and counters of samples and of pair-frames that keep an earlier answer.

        ``sample_verdict`` (L, P): verdicts at the samples, ``answered`` (L, P): which of them count; ``sampled`` (T,);
        ``known`` (T, P): where both bodies have a pose, elsewhere the verdict is NO_POSE.
        """
        # Row 0: the answers of earlier blocks.
        answers = np.concatenate([self._verdict[None], sample_verdict])
        # Most pairs are answered at every sample.
        for column in np.flatnonzero(~answered.all(axis=0)).tolist():
            counts = np.concatenate([[True], answered[:, column]])
            answers[:, column] = answers[counts, column][np.cumsum(counts) - 1]
        self._verdict = answers[-1]
        verdict = np.where(known, answers.take(np.cumsum(sampled), axis=0), np.uint8(Verdict.NO_POSE))
        kept = np.count_nonzero(known) - np.count_nonzero(answered)
        return verdict, {"looks": int(sampled.sum()), "held": int(kept)}


class LiveAtRate:
    """Samples of a live session at the ticks of a rate only, and its last answers between them.

    ``pairs`` (P, 2) body numbers.
    """

    def __init__(self, live: Live, pairs: IntArray, rate_hz: float, offset_s: float = 0.0) -> None:
        self._live, self._pairs, self._tick = live, pairs, -np.inf
        self._rate_hz, self._offset_s = rate_hz, offset_s
        self._verdict: ByteArray = np.full(len(pairs), BEFORE_FIRST_ANSWER, dtype=np.uint8)
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
            self._verdict = np.where(sample_verdict != Verdict.NO_POSE, sample_verdict, self._verdict)
            self.seconds = self._live.seconds
        else:
            self.seconds = {}
        # The quickest way to ask a small array, and most calls come here and do nothing else.
        if np.count_nonzero(now.valid) == now.valid.size:
            return self._verdict
        return np.where(pair_has_pose(now, self._pairs)[0], self._verdict, np.uint8(Verdict.NO_POSE))
