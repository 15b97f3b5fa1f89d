"""Times of settings, frame by frame, in turns with one reference: a slow moment of the machine falls on all.

The reference is asked twice in every pass: the two must come out as a tie, else every interval becomes wider.
"""

from __future__ import annotations

import gc
from collections.abc import Sequence
from dataclasses import dataclass, field
from math import sqrt
from time import perf_counter, process_time
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from cdcore import Motion
from cdcore.numerics import BoolArray, FloatArray
from cdcore.protocol import Live, live_session
from replay.detection.sample_times import sampled_frames

if TYPE_CHECKING:
    from cdcore.kernels.compiling import Compiled

BATCH_FRAMES: Final = 90
"""Frames of each setting in turn: a second at 90 Hz. Over it a machine seldom changes its speed."""

LEAD_FRAMES: Final = 10
"""Asked off the clock where turns do not follow one another: a jump in time is no frame of a live loop."""

MEAN_LEVEL: Final = None
"""Level of a price that is the mean over all frames; any other level is a quantile over samples."""

MOST_COMPILED_PASSES: Final = 3
"""Passes in which kernels were compiled are taken again, so often."""

INTERRUPTION_FACTOR: Final = 3.0
"""A frame that takes so many times its median over passes was interrupted by something else on the machine."""


@dataclass(eq=False)
class Timed:
    """A setting that is timed: its detector, the poses, and pass by pass its seconds (F,) and the reference's."""

    label: str
    detector: Any
    motion: Motion
    own: list[FloatArray] = field(default_factory=list)
    reference: list[FloatArray] = field(default_factory=list)
    rate_hz: float | None = None  # samples a second; ``None``: it runs on every frame

    @property
    def passes(self) -> int:
        """How often it was timed."""
        return len(self.own)

    def ratio(self, quantile: float | None, widened: float = 1.0, samples: BoolArray | None = None) -> FloatArray:
        """The mean or quantile over the reference's in the same passes, and the ends of its interval, widened: (3,).

        A quantile is over the ``samples`` (F,), the frames on which the detector ran. The interval is Student's over
        passes, on logarithms; one pass has none: nan.
        """
        logs = np.log(_of_passes(self.own, quantile, samples) / _of_passes(self.reference, quantile))
        middle, half_width, count = float(logs.mean()), np.nan, len(logs)
        if count > 1:
            from scipy.special import stdtrit

            # Bounded: two passes of a busy machine may be anything apart.
            half_width = min(float(stdtrit(count - 1, 0.975)) * float(logs.std(ddof=1)) / sqrt(count), 300.0)
        return np.exp([middle, middle - half_width, middle + half_width]) * [1.0, 1.0 / widened, widened]


def _of_passes(seconds: Sequence[FloatArray], quantile: float | None, samples: BoolArray | None = None) -> FloatArray:
    """The mean or quantile of every pass, (K,); an interruption of a frame is replaced by its median over passes.

    A mean is over all frames, a quantile over the ``samples``: nan where there is none. Never 0: a clock that did not
    tick says that the frame took less than it can tell.
    """
    passes = np.stack(seconds)
    median_pass = np.median(passes, axis=0)
    calm_passes = np.where(passes > INTERRUPTION_FACTOR * median_pass, median_pass, passes)
    if quantile is None:
        return np.maximum(calm_passes.mean(axis=1), 1e-9)
    sampled_seconds = calm_passes if samples is None else calm_passes[:, samples]
    if not sampled_seconds.shape[1]:
        return np.full(len(calm_passes), np.nan)
    return np.maximum(np.quantile(sampled_seconds, quantile, axis=1), 1e-9)


class Clock:
    """Passes of some settings beside the reference and its twin, and the prices that come out.

    ``compiled`` tells how long kernels compiled: no compilation lies inside a measured frame, since a pass in which one
    was compiled is thrown away and taken again.
    """

    def __init__(self, frames: LiveFrames, reference: Timed, twin: Timed, compiled: Compiled | None = None) -> None:
        self.frames, self._reference, self.twin, self._compiled = frames, reference, twin, compiled
        self.seconds = self.at_work = 0.0

    def time(self, settings: Sequence[Timed]) -> None:
        """One pass over all of these."""
        timed_settings = [
            self._reference,
            self.twin,
            *(candidate for candidate in settings if candidate is not self.twin),
        ]
        for _ in range(MOST_COMPILED_PASSES):
            compile_seconds = 0.0 if self._compiled is None else self._compiled.seconds
            clock_start, processor_start = perf_counter(), process_time()
            reference, *passes = self.frames.live_pass(timed_settings, self.twin.passes)
            clock_seconds, processor_seconds = perf_counter() - clock_start, process_time() - processor_start
            if self._compiled is None or self._compiled.seconds == compile_seconds:
                break
        self.seconds += clock_seconds
        self.at_work += processor_seconds
        for setting, seconds_of_pass in zip(timed_settings[1:], passes, strict=True):
            setting.own.append(seconds_of_pass)
            setting.reference.append(reference)

    @property
    def widened(self) -> float:
        """The factor by which intervals are widened: 1 where the same setting twice comes out as a tie."""
        ratio, lower, upper = self.twin.ratio(MEAN_LEVEL).tolist()
        return max(ratio, 1.0 / ratio) if lower > 1.0 or upper < 1.0 else 1.0

    def price(self, setting: Timed, level: float | None) -> FloatArray:
        """Seconds of a setting and the ends of their interval (3,): its ratio times the reference's in all passes."""
        reference = _of_passes(self.twin.reference, level)
        samples = None if level is None else self.frames.samples(setting.rate_hz)
        return setting.ratio(level, self.widened, samples) * np.exp(np.log(reference).mean())

    def as_json(self) -> dict[str, Any]:
        """The self-check: how often the reference was timed twice, and what came out."""
        ratio, lower, upper = known(self.twin.ratio(MEAN_LEVEL))
        return {
            "passes": self.twin.passes,
            "ratio": ratio,
            "low": lower,
            "high": upper,
            "tie": self.widened == 1.0,
            "widened": self.widened,
        }


def known(values: FloatArray) -> list[float | None]:
    """The same as JSON has them: null for nan."""
    return [None if np.isnan(value) else value for value in values.tolist()]


class LiveFrames:
    """The frames of a motion that are asked live: all, or turns spread evenly over it where there are too many."""

    def __init__(self, motion: Motion, most: int) -> None:
        starts = np.arange(0, len(motion), BATCH_FRAMES)
        rounds = max(1, min(len(starts), most // BATCH_FRAMES))
        self.turns: list[tuple[list[Motion], list[Motion]]] = []
        self.count = 0
        """How many frames are timed in a pass."""
        last = 0
        for start in starts[np.linspace(0, len(starts) - 1, rounds).round().astype(np.int64)].tolist():
            stop = min(start + BATCH_FRAMES, len(motion))
            lead = [] if start == last else _singly(motion, max(last, start - LEAD_FRAMES), start)
            self.turns.append((lead, _singly(motion, start, stop)))
            self.count += stop - start
            last = stop

    def samples(self, rate_hz: float | None) -> BoolArray:
        """Mask of timed frames that a detector of this rate runs on, (count,): at its ticks, or all without a rate."""
        masks = []
        for lead, timed in self.turns:
            times = np.array([frame.times[0] for frame in (*lead, *timed)])
            masks.append(sampled_frames(times, rate_hz)[len(lead) :])
        return np.concatenate(masks)

    def live_pass(self, timed_settings: Sequence[Timed], number: int = 0) -> list[FloatArray]:
        """Seconds of every timed frame, (count,) a setting; each begins a session of its own.

        A detector that is not asked frame by frame answers the whole motion at once: each frame takes the mean.
        """
        # Whoever follows its twin finds the caches warm: in a fixed order, one setting timed twice differed by 1.4.
        shuffled = np.random.default_rng(number)
        seconds = np.zeros((len(timed_settings), self.count))
        live: dict[int, Live] = {}
        for k, setting in enumerate(timed_settings):
            if setting.detector.online:
                live[k] = live_session(setting.detector)
            else:
                began = perf_counter()
                setting.detector.detect(setting.motion)
                seconds[k] = (perf_counter() - began) / max(1, len(setting.motion))
        collecting, position = gc.isenabled(), 0
        gc.disable()
        try:
            for lead, timed in self.turns:
                for k in shuffled.permutation([*live]).tolist():
                    _ask(live[k], lead, timed, seconds[k, position:])
                position += len(timed)
        finally:
            if collecting:
                gc.enable()
        return list(seconds)


def _singly(motion: Motion, start: int, stop: int) -> list[Motion]:
    return [motion.frames(k, k + 1) for k in range(start, stop)]


def _ask(session: Live, lead: Sequence[Motion], timed: Sequence[Motion], seconds: FloatArray) -> None:
    for frame in lead:
        session.look(frame)
    for k, frame in enumerate(timed):
        began = perf_counter()
        session.look(frame)
        seconds[k] = perf_counter() - began
