"""``replay.advice.sweep.tradeoff``: a session in, a table of what every setting gets wrong and takes out.

Verdicts, and so counts, are the same in every run; only times differ, and those are ratios of one machine.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from time import perf_counter
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from replay.advice.pareto import advice_of, contenders_of, front_of, sorted_rows
from replay.advice.scoring import Scoring
from replay.advice.settings import Setting, next_to_front, settings_list, settings_of
from replay.advice.timing import MEAN_LEVEL, Clock, LiveFrames, Timed, known
from replay.cutting.compound import seconds_to_cut
from replay.detection.detector_spec import TRUSTED_DETECTOR, parse_detector
from replay.detection.run_detector import make_detector, warm_frames
from replay.detection.sample_times import P99
from replay.document.machine import machine, versions
from replay.document.run_result import Tradeoff
from replay.document.summary import session_name
from replay.engine import prepare
from replay.errors import TradeoffError
from replay.prepare.assembly import Assembly
from replay.prepare.frame_times import frame_rate
from replay.settings import RunSettings
from sessions import Session

if TYPE_CHECKING:
    from cdcore.kernels.compiling import Compiled

TIME_LIMIT_S: Final = 150.0
"""Seconds a tradeoff takes at most when nothing is said."""

PASSES_PER_SETTING: Final = 3
"""Of every setting that is tried: a price from one pass is none."""

FRONT_PASSES: Final = 7
"""Of the settings on the front, as far as the time goes."""

FIRST_ROUND, LATER_ROUNDS = 18, 6
"""Settings that are timed in turns with each other: one of each family, then those around the front."""

BEGIN, TIME, REFINE = 0.35, 0.7, 0.8
"""Of the time limit: when the first round has begun its settings, when it has timed them, and when the last round
begins; what is left is for the front."""

MOST_FRAMES, FEWEST_FRAMES = 5_400, 900
"""Frames timed in one pass: a minute at 90 Hz, and with less time ten seconds spread over the session."""

PASS_OVERHEAD_FACTOR: Final = 1.5
"""Seconds of a pass over those on its clocks, and what the turns of others cost its caches."""

Watch = Callable[[int, int], None]
"""Called with settings begun, and settings in all."""


class _Trial(Timed):
    """A setting that was begun: ``frame`` seconds of a frame, ``answer`` seconds of a whole answer, as foretold."""

    def __init__(self, setting: Setting, assembly: Assembly, seed: int) -> None:
        self.setting = setting
        began = perf_counter()
        detector = make_detector(setting.spec, assembly, seed)
        self.prepared = perf_counter() - began
        super().__init__(setting.label, detector, assembly.motion, rate_hz=setting.rate_hz)
        self.row: dict[str, Any] = {}
        sample = self.motion.take(warm_frames(len(self.motion)))
        timed_alone = Timed(self.label, detector, sample)
        for _ in range(2):  # the first one compiles
            began = perf_counter()
            detector.detect(sample)
            self.answer = (perf_counter() - began) * len(self.motion) / max(1, len(sample))
            self.frame = float(LiveFrames(sample, len(sample)).live_pass([timed_alone])[0].mean())


RUN_OPTIONS: Final = ("detectors", "oracle", "pairs", "start", "end", "seed", "tau", "policy")
"""Fields of ``RunSettings`` that a tradeoff takes."""


def tradeoff(
    session: Session,
    *,
    time_limit: float | None = TIME_LIMIT_S,
    watch: Watch = lambda *_: None,
    **options: Any,
) -> Tradeoff:
    """Run many settings over a session, beside the oracle, and time them frame by frame.

    Parameters
    ----------
    time_limit : seconds; a setting that cannot end within them is not begun and is in ``cut``; ``None``: no limit.
        Compiling, once per machine, does not count.
    watch : called after every step.
    options : as ``replay.run``: ``oracle``, ``pairs``, ``start``, ``end``, ``seed``, ``tau``, ``policy``; ``detectors``
        are tried in place of the list of ``replay.advice.settings``.

    Raises ``TradeoffError``: the oracle finds no contact, so nothing can be missed; and as ``replay.run``.
    """
    from cdcore.kernels.compiling import compiling_reported  # loads the compiler: not for those who only write tables

    unknown = ", ".join(sorted(options.keys() - {*RUN_OPTIONS}))
    if unknown:
        raise TypeError(f"tradeoff takes no {unknown}; it takes time_limit, watch, {', '.join(RUN_OPTIONS)}")
    run = RunSettings(**options)
    with compiling_reported(lambda *_: None) as compiled:
        deadline = _Deadline(time_limit, compiled)
        prepared = prepare(session, pairs=run.pairs, start=run.start, end=run.end, policy=run.policy)
        motion, session = prepared.assembly.motion, prepared.repaired.session
        assembly = replace(prepared.assembly, motion=motion.frames(0, len(motion)))
        if run.detectors is not None:
            settings = settings_of(run.detectors)
        else:
            settings = settings_list(frames_hz=frame_rate(motion.times), has_shipped_colliders=bool(session.colliders))
        scoring = Scoring(assembly, parse_detector(run.oracle or TRUSTED_DETECTOR), run.seed, run.tau, session)
        if not scoring.contacts:
            oracle = scoring.spec.name
            raise TradeoffError(f"{oracle} finds no contact in this session: nothing can be missed; take another")
        sweep = _Sweep(assembly, scoring, run.seed, deadline, settings)
        sweep.run(watch)
    return sweep.whole(session)


class _Deadline:
    """Knows how much time is left; seconds spent on compiling are given back."""

    def __init__(self, limit: float | None, compiled: Compiled) -> None:
        self.limit, self.compiled, self._began = limit, compiled, perf_counter()

    def left(self, fraction: float = 1.0) -> float:
        """Seconds until this share of the limit is used up."""
        if self.limit is None:
            return float("inf")
        return fraction * self.limit + self.compiled.seconds - (perf_counter() - self._began)


class _Sweep:
    """The trials of one tradeoff: round by round begun, counted and timed in turns."""

    def __init__(
        self, assembly: Assembly, scoring: Scoring, seed: int, deadline: _Deadline, settings: Sequence[Setting]
    ) -> None:
        self._assembly, self._scoring, self._seed, self._deadline = assembly, scoring, seed, deadline
        self._settings, self._left = settings, [*settings]
        self._pair = [_Trial(Setting(TRUSTED_DETECTOR, TRUSTED_DETECTOR), assembly, seed) for _ in range(2)]
        self._clock: Clock | None = None
        self._trials: list[_Trial] = []

    def run(self, watch: Watch) -> None:
        """Rounds until everything was tried or the time is up; what is left of it goes to the front."""
        size, fraction = FIRST_ROUND, BEGIN
        while batch := self._next_trials(size, fraction, watch):
            self._time_batch(batch)
            size, fraction = LATER_ROUNDS, REFINE
        for _ in range(FRONT_PASSES - PASSES_PER_SETTING):
            near_front = {*front_of(self._rows()), *contenders_of(self._rows())}
            front = [trial for trial in self._trials if trial.label in near_front]
            if self._pass_seconds(front) < self._deadline.left():
                watch(len(self._trials), len(self._settings))
                self._pass(front)
        watch(len(self._settings), len(self._settings))

    def _rows(self) -> list[dict[str, Any]]:
        """Those that have a price by now."""
        return [trial.row for trial in self._trials if trial.passes]

    def _next_trials(self, size: int, fraction: float, watch: Watch) -> list[_Trial]:
        """The next settings, made and counted, as many as can be timed too within the limit."""
        batch: list[_Trial] = []
        for setting in next_to_front(self._left, self._settings, front_of(self._rows())):
            # The first setting is tried whatever it takes: a table without rows says nothing.
            if len(batch) == size or (self._trials and self._deadline.left(fraction) <= 0):
                break
            watch(len(self._trials), len(self._settings))
            self._left.remove(setting)
            trial = self._count_faults(setting, batch)
            if trial is not None:
                self._trials.append(trial)
                batch.append(trial)
        return batch

    def _count_faults(self, setting: Setting, batch: Sequence[_Trial]) -> _Trial | None:
        """Make a setting, warm it up, let it answer and count; ``None``: it cannot be timed too within the limit."""
        left = self._deadline.left() if self._trials else float("inf")
        detector_settings = setting.settings
        if detector_settings.get("shape") == "compound" and left <= seconds_to_cut(
            self._assembly.bodies, self._assembly.pairs, detector_settings
        ):
            return None
        twin = self._pair[1]
        trial = twin if setting == twin.setting else _Trial(setting, self._assembly, self._seed)
        if trial.answer + self._pass_seconds([*batch, trial]) * PASSES_PER_SETTING > left:
            return None
        detection = trial.detector.detect(trial.motion)
        trial.row = {
            "label": setting.label,
            "settings": setting.detector_text,
            "detector": setting.detector,
            "line": setting.line,
            "value": setting.value,
            "rate_hz": setting.rate_hz,
            "complete": setting.complete,
            "oracle": setting.detector == self._scoring.spec.name,
            "prepare_seconds": trial.prepared,
            "digest": detection.digest,
            "work": {name: int(np.sum(value)) for name, value in detection.work.items()},
            **self._scoring.figures(detection, setting),
        }
        return trial

    def _pass_seconds(self, trials: Sequence[_Trial]) -> float:
        """Seconds of a pass over these, with the reference and its twin."""
        count = FEWEST_FRAMES if self._clock is None else self._clock.frames.count
        return PASS_OVERHEAD_FACTOR * count * sum(trial.frame for trial in {*self._pair, *trials})

    def _time_batch(self, batch: Sequence[_Trial]) -> None:
        """Passes over a round; the first round settles how many frames a pass has."""
        if self._clock is None:
            frame = self._pass_seconds(batch) / FEWEST_FRAMES
            most_frames = self._deadline.left(TIME) / (PASSES_PER_SETTING * frame)
            frames = LiveFrames(self._assembly.motion, int(max(FEWEST_FRAMES, min(MOST_FRAMES, most_frames))))
            self._clock = Clock(frames, self._pair[0], self._pair[1], self._deadline.compiled)
        for _ in range(PASSES_PER_SETTING):
            self._pass(batch)

    def _pass(self, trials: Sequence[_Trial]) -> None:
        assert self._clock is not None
        self._clock.time(trials)
        for trial in self._trials:
            if trial.passes:
                self._tell_time(trial, self._clock)

    def _tell_time(self, trial: _Trial, clock: Clock) -> None:
        """Prices of the passes so far, into the row."""
        row = trial.row
        for name, level in (("mean", MEAN_LEVEL), ("p99", P99)):
            seconds = clock.price(trial, level)
            if level is not MEAN_LEVEL and not trial.detector.online:
                seconds *= np.nan
            row |= zip((f"{name}_ms", f"{name}_low", f"{name}_high"), known(1e3 * seconds), strict=True)
        row |= {"passes": trial.passes, "frames": clock.frames.count}

    def whole(self, session: Session) -> Tradeoff:
        """Everything that was found."""
        assert self._clock is not None
        rows, scoring, times = self._rows(), self._scoring, self._assembly.motion.times
        front = front_of(rows)
        for row in rows:
            row["front"] = row["label"] in front
        at_work = self._clock.at_work / self._clock.seconds
        about = {
            "session": session_name(session, "in memory"),
            "frames": len(times),
            "bodies": len(self._assembly.bodies),
            "seconds": float(times[-1] - times[0]),
            "pairs": len(self._assembly.pairs),
            "oracle": scoring.spec.name,
            "contacts": len(scoring.contacts),
            "seed": self._seed,
            "machine": machine(),
            "versions": versions(),
            "reference": TRUSTED_DETECTOR,
            "live_frames": self._clock.frames.count,
            "time_limit": self._deadline.limit,
            "clock": self._clock.as_json(),
            "processor_share": at_work,
        }
        tried_labels = {row["label"] for row in rows}
        cut = tuple(setting.label for setting in self._settings if setting.label not in tried_labels)
        advice = tuple(advice_of(rows, processor_fraction=at_work))
        return Tradeoff(tuple(sorted_rows(rows)), tuple(front), advice, cut, about)
