"""Clocks that take turns with one reference, so that a slow moment of the machine falls on both.

The reference is asked twice in every pass: the two must come out as a tie, else every interval becomes wider.
"""

from __future__ import annotations

import gc
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import exp, log, sqrt
from time import perf_counter, process_time
from typing import Any, Final, TypeAlias

import numpy as np

from cdcore import Detection, Motion
from cdcore.numerics import FloatArray
from cdcore.protocol import Live, live_session
from replay.errors import TradeoffError

TURN_FRAMES: Final = 90
"""Frames of each setting in turn: a second at 90 Hz. Over it a machine seldom changes its speed."""

LEAD_FRAMES: Final = 10
"""Asked off the clock where turns do not follow one another: a jump in time is no frame of a live loop."""

PRECISE: Final = 1.1
"""An interval of a ratio is narrow enough when its ends are within this factor of it."""


@dataclass(frozen=True)
class Price:
    """A price and its 95 % interval over passes, in the unit of the reference; without passes enough, no interval."""

    value: float
    low: float | None
    high: float | None

    @property
    def precise(self) -> bool:
        """Whether the interval is within 10 %."""
        return self.high is not None and self.high <= PRECISE * self.value


@dataclass(eq=False)
class Passes:
    """One setting, or the reference's twin, and the reference, pass by pass: (K, F) seconds of F asks of each."""

    own: list[FloatArray] = field(default_factory=list)
    reference: list[FloatArray] = field(default_factory=list)

    def __len__(self) -> int:
        return len(self.own)

    def quantile(self, level: float) -> float:
        """Of the asks, each by the median of its passes: an interruption in one pass is not in it."""
        return _typical(np.stack(self.own), level)

    def mean(self) -> float:
        """Seconds of an ask in the mean over all of them, each by the median of its passes."""
        return float(np.mean(np.median(np.stack(self.own), axis=0)))

    def ratio(self, level: float, widened: float = 1.0) -> Price:
        """The quantile over the reference's, in the same passes; the interval is widened by a factor.

        Source: the jackknife over passes with Student's t, on logarithms: R. G. Miller, The jackknife: a review,
        Biometrika 61 (1974). One pass gives no interval.
        """
        own, reference = np.stack(self.own), np.stack(self.reference)
        count, middle = len(own), _log_ratio(own, reference, level)
        if count < 2:
            return Price(exp(middle), None, None)
        from scipy.special import stdtrit

        left = [_log_ratio(np.delete(own, k, 0), np.delete(reference, k, 0), level) for k in range(count)]
        # Bounded: two passes of a busy machine may be anything apart.
        wide = min(float(stdtrit(count - 1, 0.975)) * sqrt((count - 1) * float(np.var(left))), 300.0)
        return Price(exp(middle), exp(middle - wide) / widened, exp(middle + wide) * widened)


def _log_ratio(own: FloatArray, reference: FloatArray, level: float) -> float:
    """Of one ask a pass the mean over passes; of a frame its median: an interruption is in few passes of a frame."""
    if own.shape[1] == 1:
        return float(np.log(own / reference).mean())
    return log(_typical(own, level) / _typical(reference, level))


def _typical(seconds: FloatArray, level: float) -> float:
    """Never 0: a clock that did not tick says that the ask took less than it can tell."""
    return max(float(np.quantile(np.median(seconds, axis=0), level)), 1e-9)


@dataclass(eq=False)
class Timed:
    """A setting that is timed: its detector, the poses, whether faces are asked for, and its passes of both kinds.

    ``digest`` is that of its first answer over the whole motion.
    """

    label: str
    detector: Any
    motion: Motion
    faces: bool = False
    digest: str | None = None
    live: Passes = field(default_factory=Passes)
    whole: Passes = field(default_factory=Passes)

    def detect(self) -> Detection:
        """The answer over the whole motion."""
        detection: Detection = self.detector.detect(self.motion, faces=self.faces)
        return detection


class Clock:
    """Runs passes of some settings beside the reference and its twin, and makes prices of them.

    ``kind`` names the passes, ``live`` or ``whole``; ``passer`` asks each of some settings once over the session, in
    an order that its number shuffles: the seconds of each ask, an array a setting; ``level``: the quantile of the asks
    that is the price.
    """

    def __init__(self, kind: str, passer: Passer, level: float, reference: Timed, twin: Timed) -> None:
        self._kind, self._passer, self.level, self._pair = kind, passer, level, (reference, twin)
        self.twin = self.of(twin)
        self.seconds = self.at_work = 0.0

    def of(self, one: Timed) -> Passes:
        """The passes of this kind."""
        passes: Passes = getattr(one, self._kind)
        return passes

    def time(self, asked: Sequence[Timed]) -> None:
        """One pass over all of these, beside the reference and its twin, which may be one of them."""
        asked = [one for one in asked if one not in self._pair]
        began, at_work = perf_counter(), process_time()
        reference, *found = self._passer([*self._pair, *asked], len(self.twin))
        self.seconds += perf_counter() - began
        self.at_work += process_time() - at_work
        for one, own in zip((self._pair[1], *asked), found, strict=True):
            self.of(one).own.append(own)
            self.of(one).reference.append(reference)

    @property
    def again(self) -> Price:
        """The reference's twin over the reference: what the clock says of one setting timed twice."""
        return self.twin.ratio(self.level)

    @property
    def widened(self) -> float:
        """The factor by which intervals are widened: 1 where the same setting twice comes out as a tie."""
        again = self.again
        if again.low is None or again.high is None or again.low <= 1.0 <= again.high:
            return 1.0
        return max(again.value, 1.0 / again.value)

    def price(self, one: Timed) -> Price:
        """Seconds of a setting: the ratio of its passes times what the reference takes in all passes."""
        unit = _typical(np.stack(self.twin.reference), self.level)
        found = self.of(one).ratio(self.level, self.widened)
        low, high = (None if end is None else end * unit for end in (found.low, found.high))
        return Price(found.value * unit, low, high)

    def as_json(self) -> dict[str, Any]:
        """The self-check: how often the same setting was timed twice, and what came out."""
        again = self.again
        return {
            "passes": len(self.twin), "ratio": again.value, "low": again.low, "high": again.high,
            "tie": self.widened == 1.0, "widened": self.widened,
        }  # fmt: skip


Passer: TypeAlias = Callable[[Sequence[Timed], int], list[FloatArray]]


class LiveFrames:
    """The frames of a motion that are asked live: all, or turns spread evenly over it where there are too many."""

    def __init__(self, motion: Motion, most: int) -> None:
        starts = np.arange(0, len(motion), TURN_FRAMES)
        turns = max(1, min(len(starts), most // TURN_FRAMES))
        self.turns: list[tuple[list[Motion], list[Motion]]] = []
        last = 0
        for start in starts[np.linspace(0, len(starts) - 1, turns).round().astype(np.int64)].tolist():
            stop = min(start + TURN_FRAMES, len(motion))
            lead = [] if start == last else _singly(motion, max(last, start - LEAD_FRAMES), start)
            self.turns.append((lead, _singly(motion, start, stop)))
            last = stop
        self.count = sum(len(timed) for _, timed in self.turns)

    def live_pass(self, asked: Sequence[Timed], number: int = 0) -> list[FloatArray]:
        """Seconds of every timed frame, (count,) a setting; each begins a session of its own."""
        # Whoever follows its twin finds the caches warm: in a fixed order, one setting timed twice differed by 1.4.
        shuffled = np.random.default_rng(number)
        sessions: list[Live] = [live_session(one.detector) for one in asked]
        seconds, at = np.zeros((len(sessions), self.count)), 0
        collecting = gc.isenabled()
        gc.disable()
        try:
            for lead, timed in self.turns:
                for k in shuffled.permutation(len(sessions)).tolist():
                    _ask(sessions[k], lead, timed, seconds[k, at:])
                at += len(timed)
        finally:
            if collecting:
                gc.enable()
        return list(seconds)


def _singly(motion: Motion, start: int, stop: int) -> list[Motion]:
    return [motion.frames(k, k + 1) for k in range(start, stop)]


def _ask(session: Live, lead: Sequence[Motion], timed: Sequence[Motion], seconds: FloatArray) -> None:
    for now in lead:
        session.look(now)
    for k, now in enumerate(timed):
        began = perf_counter()
        session.look(now)
        seconds[k] = perf_counter() - began


def whole_pass(asked: Sequence[Timed], number: int = 0) -> list[FloatArray]:
    """Seconds of each whole answer, (1,) a setting.

    Raises ``TradeoffError``: a setting answers otherwise than before.
    """
    seconds = np.zeros((len(asked), 1))
    for k in np.random.default_rng(number).permutation(len(asked)).tolist():
        one, began = asked[k], perf_counter()
        detection = one.detect()
        seconds[k] = perf_counter() - began
        if detection.digest != one.digest:
            raise TradeoffError(f"{one.label} gave other verdicts the second time; its recall means nothing")
    return list(seconds)
