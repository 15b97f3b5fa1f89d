"""``replay.tradeoffs.sweep.tradeoff``: a session in, a table of what every setting misses and takes out.

Verdicts, and so recalls, are the same in every run; only times differ, and those are ratios of one machine.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from cdcore import Detection, Detector, Motion
from replay.base.machine import machine, versions
from replay.base.wilson import OVER_CONTACTS
from replay.comparison.tolerance import TAU
from replay.detection.detector_spec import SpecLike, parse_detector
from replay.detection.run_detector import make_detector, warm_frames
from replay.errors import TradeoffError
from replay.pipeline.engine import TRUSTED
from replay.pipeline.run_result import Tradeoff
from replay.prepare.assemble import Pairs, assemble
from replay.prepare.assemble_stored import decoded_once
from replay.prepare.assembly import Assembly
from replay.prepare.policy import Policy, PolicyLike, parse_policy
from replay.prepare.repair import repair_session
from replay.tradeoffs.decimation import decimated
from replay.tradeoffs.pareto import advice_of, front_of
from replay.tradeoffs.scoring import Scoring
from replay.tradeoffs.settings import Setting, settings_list
from replay.tradeoffs.timing import Pass, figures, timed
from sessions import Session

if TYPE_CHECKING:
    from cdcore.kernels.compiling import Compiled

TIME_LIMIT: Final = 150.0
"""Seconds a tradeoff takes at most when nothing is said: the list but its tail fits for a minute of a bench."""

REPEATS: Final = 3
"""Passes over the session, each over all settings in turn, so that a slow minute of the machine falls on all."""

QUICK_SECONDS: Final = 0.3
"""A pass quicker than this is repeated at once until this has passed, at most ``QUICK_PASSES`` times."""

QUICK_PASSES: Final = 20
"""The noise of a busy machine is as large as a quick pass; the quickest of many is steady where one of two is not."""

ONCE_SECONDS: Final = 2.0
"""What takes longer than this is not repeated: noise of the clock is no longer what matters."""

Watch = Callable[[int, int, str, Sequence[dict[str, Any]]], None]
"""Called with steps done, steps in all, what is next, and the rows so far."""


@dataclass(eq=False)
class _Trial:
    """A setting that has run at least once."""

    setting: Setting
    detector: Detector
    motion: Motion
    detection: Detection
    row: dict[str, Any]
    passes: list[Pass]


def tradeoff(
    session: Session, *, settings: Sequence[Setting] | None = None, oracle: SpecLike | None = None,
    pairs: Pairs | None = None, start: float | None = None, end: float | None = None, seed: int = 0, tau: float = TAU,
    policy: PolicyLike | Policy | None = None, repeats: int = REPEATS,
    time_limit: float | None = TIME_LIMIT, watch: Watch | None = None,
) -> Tradeoff:  # fmt: skip
    """Run every setting over a session, beside the oracle.

    Parameters
    ----------
    settings : what to try; ``None``: the fixed list.
    oracle, policy : as ``replay.run``.
    tau : metres; a disagreement about less is *within tolerance* and counts neither way.
    repeats : timed passes of each setting that takes under ``ONCE_SECONDS``.
    time_limit : seconds; a setting that cannot end within them is not begun and is in ``cut``; ``None``: no limit.
        Compiling, once per machine, does not count.
    watch : called after every step.

    Raises ``TradeoffError``: the oracle finds no contact, so nothing can be missed; and as ``replay.run``.
    """
    from cdcore.kernels.compiling import compiling_reported  # loads the compiler: not for those who only write tables

    rules = parse_policy(policy)
    wanted = tuple(settings if settings is not None else settings_list())
    steps = sum(1 if one.tail else max(1, repeats) for one in wanted)
    trials: list[_Trial] = []
    with compiling_reported(lambda *_: None) as compiled:
        watched = _Watched(watch, steps, time_limit, compiled)
        session = repair_session(decoded_once(session), rules).session
        assembly = assemble(session, pairs=pairs, start=start, end=end)
        scoring = Scoring(assembly, parse_detector(oracle or TRUSTED), seed, tau)
        for setting in (one for one in wanted if not one.tail):
            _try(setting, assembly, scoring, seed, trials, watched)
        for _ in range(1, repeats):
            for trial in trials:
                watched.next(trial.setting.label, trials)
                if trial.passes[0].seconds <= ONCE_SECONDS and watched.left() > trial.passes[0].seconds:
                    _again(trial)
        for setting in (one for one in wanted if one.tail):
            _try(setting, assembly, scoring, seed, trials, watched)
        watched.next("", trials)
    done = {trial.setting.label for trial in trials}
    cut = tuple(setting.label for setting in wanted if setting.label not in done)
    return _whole(session, assembly, scoring, trials, cut, seed)


class _Watched:
    """Reports how far the work is, and knows how much time is left."""

    def __init__(self, watch: Watch | None, total: int, limit: float | None, compiled: Compiled) -> None:
        self._watch, self._total, self._limit, self._compiled = watch, total, limit, compiled
        self._began, self._done = perf_counter(), 0

    def left(self) -> float:
        """Seconds; those spent on compiling are given back."""
        if self._limit is None:
            return float("inf")
        return self._limit + self._compiled.seconds - (perf_counter() - self._began)

    def next(self, label: str, trials: Sequence[_Trial]) -> None:
        """Report what comes next; an empty label says that all is done."""
        if self._watch is not None:
            self._watch(self._done if label else self._total, self._total, label, [one.row for one in trials])
        self._done += 1


def _try(
    setting: Setting, assembly: Assembly, scoring: Scoring, seed: int, trials: list[_Trial], watched: _Watched
) -> None:
    """Run a setting for the first time, if it can end in time; the very first one always runs."""
    watched.next(setting.label, trials)
    left = watched.left() if trials else float("inf")
    if left > 0:
        trial = _first(setting, assembly, scoring, seed, left)
        trials += [] if trial is None else [trial]


def _first(setting: Setting, assembly: Assembly, scoring: Scoring, seed: int, left: float) -> _Trial | None:
    """Build, warm up, detect, compare; ``None`` where the warm-up predicts more than the seconds ``left``."""
    seen = decimated(assembly, setting.cell) if setting.cell else assembly
    clock = perf_counter()
    detector = make_detector(setting.spec, seen, seed)
    prepared = perf_counter() - clock
    sample = seen.motion.take(warm_frames(len(seen.motion)))
    # The first call may have compiled; only the second predicts the time.
    least = left * len(sample) / len(seen.motion)
    if all(timed(detector, sample, faces=setting.faces)[1].seconds > least for _ in range(2)):
        return None
    detection, first = timed(detector, seen.motion, faces=setting.faces)
    row: dict[str, Any] = {
        "label": setting.label, "line": setting.line, "detector": setting.detector, "axis": setting.axis,
        "value": setting.value, "settings": str(setting.spec).partition("=")[2], "cell_mm": setting.cell * 1e3,
        "faces_listed": setting.faces, "mesh_faces": sum(len(body.mesh.faces) for body in seen.bodies),
        "online": detector.online, "covers": detection.covers, "oracle": setting.detector == scoring.spec.name,
        "prepare_seconds": prepared, "digest": detection.digest,
        "work": {name: int(np.sum(value)) for name, value in detection.work.items()},
        **scoring.figures(detection, same_faces=not setting.cell),
    }  # fmt: skip
    trial = _Trial(setting, detector, seen.motion, detection, row, [first])
    _tell_time(trial)
    return trial


def _again(trial: _Trial) -> None:
    """One more pass, of quick settings several; each must give the same verdicts."""
    spent = 0.0
    while not spent or spent + trial.passes[-1].seconds < QUICK_SECONDS:
        detection, again = timed(trial.detector, trial.motion, faces=trial.setting.faces)
        if detection.digest != trial.row["digest"]:
            raise TradeoffError(f"{trial.setting.label} gave other verdicts the second time; its recall means nothing")
        trial.passes.append(again)
        spent += max(again.seconds, QUICK_SECONDS / QUICK_PASSES)
    _tell_time(trial)


def _tell_time(trial: _Trial) -> None:
    taken, frames = figures(trial.passes), max(1, len(trial.motion))
    minutes = float(trial.motion.times[-1] - trial.motion.times[0]) / 60 or 1.0
    trial.row.update(taken)
    trial.row["seconds_per_minute"] = taken["seconds"] / minutes
    for key, name in (("seconds", "ms_per_frame"), ("seconds_median", "ms_median"), ("seconds_high", "ms_high")):
        trial.row[name] = taken[key] / frames * 1e3


def _whole(
    session: Session, assembly: Assembly, scoring: Scoring, trials: Sequence[_Trial], cut: tuple[str, ...], seed: int
) -> Tradeoff:
    rows, passes = [one.row for one in trials], [one for trial in trials for one in trial.passes]
    front, online = front_of(rows), front_of(rows, time="p99_ms", online=True)
    for row in rows:
        row["front"], row["front_online"] = row["label"] in front, row["label"] in online
    times = assembly.motion.times
    about = {
        "session": session.scene.name or Path(session.origin).name,
        "frames": len(times), "bodies": len(assembly.bodies), "seconds": float(times[-1] - times[0]),
        "pairs": len(assembly.pairs), "oracle": scoring.spec.name, "contacts": len(scoring.contacts), "seed": seed,
        "machine": machine(), "versions": versions(), "intervals": OVER_CONTACTS,
        "processor_share": sum(one.processor for one in passes) / sum(one.seconds for one in passes),
    }  # fmt: skip
    return Tradeoff(tuple(rows), tuple(front), tuple(online), tuple(advice_of(rows)), cut, about)
