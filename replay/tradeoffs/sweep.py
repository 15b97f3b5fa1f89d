"""``replay.tradeoffs.sweep.tradeoff``: a session in, a table of what every setting misses and takes out.

Verdicts, and so recalls, are the same in every run; only times differ, and those are ratios of one machine.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import cycle
from time import perf_counter
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from replay.base.constants import BUDGET_MS
from replay.base.machine import machine, versions
from replay.base.wilson import OVER_CONTACTS
from replay.comparison.tolerance import TAU
from replay.detection.detector_spec import TRUSTED, SpecLike, SpecsLike, parse_detector
from replay.detection.run_detector import make_detector, warm_frames
from replay.pipeline.engine import prepared
from replay.pipeline.run_result import Tradeoff
from replay.pipeline.summary import session_name
from replay.prepare.assemble import Pairs
from replay.prepare.assembly import Assembly
from replay.prepare.convex_pieces import seconds_to_cut
from replay.prepare.policy import Policy, PolicyLike
from replay.tradeoffs.decimation import decimated
from replay.tradeoffs.pareto import LIVE, WHOLE, Columns, advice_of, answer_of, front_of
from replay.tradeoffs.scoring import Scoring
from replay.tradeoffs.settings import AS_IT_COMES, Setting, settings_list, settings_of
from replay.tradeoffs.timing import Clock, LiveFrames, Price, Timed, whole_pass
from sessions import Session

if TYPE_CHECKING:
    from cdcore.kernels.compiling import Compiled

TIME_LIMIT: Final = 150.0
"""Seconds a tradeoff takes at most when nothing is said."""

REPEATS: Final = 3
"""Passes of what advice names only where it is surely quicker, as far as the time goes."""

LEAST_PASSES, MOST_PASSES = 7, 21
"""Of what advice may name: the least, and where it ends though the interval is still wide."""

SLOWER: Final = 3.0
"""A complete setting so many times slower than the quickest of them is not named: it is timed with the others."""

MOST_FRAMES: Final = 5_400
"""Frames asked live in one pass: a minute at 90 Hz."""

SHARE: Final = 0.6
"""Of the time limit that what advice may name gets; the others get what is left."""

OVERHEAD: Final = 1.5
"""Seconds of a live pass over those on its clocks, and what the turns of others cost its caches."""

Watch = Callable[[int, int, str, Sequence[dict[str, Any]]], None]
"""Called with steps done, steps in all, what is next, and the rows so far."""


class _Trial(Timed):
    """A setting that has run at least once; ``frame`` and ``seconds``: what a look and a whole answer are to take."""

    def __init__(self, setting: Setting, assembly: Assembly, seed: int) -> None:
        self.setting = setting
        self.assembly = decimated(assembly, setting.cell) if setting.cell else assembly
        began = perf_counter()
        detector = make_detector(setting.spec, self.assembly, seed)
        self.prepared = perf_counter() - began
        super().__init__(setting.label, detector, self.assembly.motion, setting.faces)
        self.row: dict[str, Any] = {}
        self.frame, self.seconds = self._warmed()

    def _warmed(self) -> tuple[float, float]:
        """Seconds that a live look and a whole answer will take: the second of two, for the first compiles."""
        motion = self.motion
        sample = motion.take(warm_frames(len(motion)))
        asked = Timed(
            self.label, self.detector, sample, self.faces, self.detector.detect(sample, faces=self.faces).digest
        )
        whole = whole_pass([asked])[0][0] * len(motion) / max(1, len(sample))
        if not self.detector.online or self.faces:
            return float("inf"), whole
        frames = LiveFrames(sample, len(sample))
        return min(frames.live_pass([asked])[0].mean() for _ in range(2)), whole


def tradeoff(
    session: Session, *, settings: Sequence[Setting] | None = None, detectors: SpecsLike | None = None,
    oracle: SpecLike | None = None, pairs: Pairs | None = None, start: float | None = None, end: float | None = None,
    seed: int = 0, tau: float = TAU, policy: PolicyLike | Policy | None = None, repeats: int = REPEATS,
    time_limit: float | None = TIME_LIMIT, watch: Watch | None = None,
) -> Tradeoff:  # fmt: skip
    """Run every setting over a session, beside the oracle, and time it live and offline.

    Parameters
    ----------
    settings : what to try; ``None``: ``detectors``, and without those the fixed list.
    detectors, oracle, policy : as ``replay.run``.
    tau : metres; a disagreement about less is *within tolerance* and counts neither way.
    repeats : timed passes of what advice names only where it is surely quicker; of the rest at least seven.
    time_limit : seconds; a setting that cannot end within them is not begun and is in ``cut``; ``None``: no limit.
        Compiling, once per machine, does not count.
    watch : called after every step.

    Raises ``TradeoffError``: the oracle finds no contact, so nothing can be missed; and as ``replay.run``.
    """
    from cdcore.kernels.compiling import compiling_reported  # loads the compiler: not for those who only write tables

    listed = settings_list(shipped=bool(session.colliders)) if detectors is None else settings_of(detectors)
    wanted = tuple(listed if settings is None else settings)
    with compiling_reported(lambda *_: None) as compiled:
        watched = _Watched(watch, len(wanted) + LEAST_PASSES, time_limit, compiled)
        ready = prepared(session, pairs=pairs, start=start, end=end, policy=policy)
        motion = ready.assembly.motion
        assembly = replace(ready.assembly, motion=motion.frames(0, len(motion)))
        session = ready.treatment.session
        scoring = Scoring(assembly, parse_detector(oracle or TRUSTED), seed, tau, session)
        sweep = _Sweep(assembly, scoring, seed, watched)
        sweep.begin([one for one in wanted if one.complete])
        sweep.settle()
        sweep.others(wanted, repeats)
        watched.next("", sweep.rows())
    return sweep.whole(session, wanted)


class _Watched:
    """Reports how far the work is, and knows how much time is left."""

    def __init__(self, watch: Watch | None, total: int, limit: float | None, compiled: Compiled) -> None:
        self._watch, self._total, self.limit, self._compiled = watch, total, limit, compiled
        self._began, self._done = perf_counter(), 0

    def left(self, share: float = 1.0) -> float:
        """Seconds until this share of the limit is used up; those spent on compiling are given back."""
        if self.limit is None:
            return float("inf")
        return share * self.limit + self._compiled.seconds - (perf_counter() - self._began)

    def next(self, label: str, rows: Sequence[dict[str, Any]]) -> None:
        """Report what comes next; an empty label says that all is done."""
        if self._watch is not None:
            self._watch(min(self._done, self._total) if label else self._total, self._total, label, rows)
        self._done += 1


class _Sweep:
    """The trials of one tradeoff, and the two clocks: frame by frame, and over the whole session at once."""

    def __init__(self, assembly: Assembly, scoring: Scoring, seed: int, watched: _Watched) -> None:
        self._assembly, self._scoring, self._seed, self._watched = assembly, scoring, seed, watched
        self._trials: list[_Trial] = []
        self._pair = [_Trial(Setting(TRUSTED, AS_IT_COMES, ""), assembly, seed) for _ in range(2)]
        for one in self._pair:
            one.digest = one.detect().digest
        self._whole = Clock("whole", whole_pass, 0.5, *self._pair)

    def rows(self) -> list[dict[str, Any]]:
        """Those that have a price by now."""
        return [one.row for one in self._trials if one.row.get("ms_per_frame")]

    def begin(self, settings: Sequence[Setting]) -> None:
        """Make and score those that advice may name; then settle how many frames they can be asked live."""
        for setting in settings:
            self._try(setting, SHARE / 2)
        cost = sum(one.frame for one in {*self._pair, *self._named("frame")})
        most = self._watched.left(SHARE) / (LEAST_PASSES * OVERHEAD * cost)
        self._frames = LiveFrames(self._assembly.motion, int(min(MOST_FRAMES, most)))
        self._live = Clock("live", self._frames.live_pass, 0.99, *self._pair)

    def settle(self) -> None:
        """Time what advice may name in passes over all of it, until intervals are narrow or its time is up."""
        for number in range(MOST_PASSES):
            self._watched.next(f"pass {number + 1}", self.rows())
            for clock, named in ((self._live, self._named("frame")), (self._whole, self._named("seconds"))):
                # Live passes ask as many frames as there is time for; a whole one takes what it takes.
                late = number > 0 and clock is self._whole and self._watched.left() < 0
                if not late and (number < LEAST_PASSES or not all(clock.price(one).precise for one in named)):
                    clock.time(named)
            if number == 0:
                self._tell_times()
            if number + 1 >= LEAST_PASSES and self._watched.left(SHARE) < 0:
                break
        self._tell_times()

    def _tell_times(self) -> None:
        for one in self._trials:
            if one.live or one.whole:
                self._tell_time(one)

    def others(self, settings: Sequence[Setting], repeats: int) -> None:
        """One pass of everything that was not tried yet, in its order, then more in turns while there is time."""
        tried = {one.label for one in self._trials}
        for setting in settings:
            if setting.label not in tried and (one := self._try(setting, 1.0)) is not None:
                self._once(one)
        left = [one for one in self._trials if min(len(one.live), len(one.whole)) < LEAST_PASSES]
        for number, one in zip(range(repeats * len(left)), cycle(left), strict=False):
            self._watched.next(one.label, self.rows())
            if number >= len(left) or not one.row.get("ms_per_frame"):
                self._once(one, repeats)

    def _once(self, one: _Trial, most: int = 1) -> None:
        """One pass of each kind that it has fewer of than ``most``, where there is time."""
        for clock, cost in ((self._whole, one.seconds), (self._live, OVERHEAD * one.frame * self._frames.count)):
            alone = one is self._trials[0] and not one.whole
            if len(clock.of(one)) < most and (alone or cost < self._watched.left()):
                clock.time([one])
        self._tell_time(one)

    def _named(self, cost: str, *more: _Trial) -> list[_Trial]:
        """Complete trials that are not far slower than the quickest of them."""
        complete = [one for one in (*self._trials, *more) if one.setting.complete]
        least = min((getattr(one, cost) for one in complete), default=0.0)
        return [one for one in complete if getattr(one, cost) <= SLOWER * least < float("inf")]

    def _try(self, setting: Setting, share: float) -> _Trial | None:
        """Make a setting, warm it up, let it answer and count, if that ends within a share of the limit; or first."""
        self._watched.next(setting.label, self.rows())
        left = self._watched.left(share) if self._trials else float("inf")
        turned = setting.settings
        cutting = turned.get("shape") == "compound" and seconds_to_cut(
            (body.mesh for body in self._assembly.bodies), turned.get("pieces", 16)
        )
        if left <= cutting:
            return None
        if setting.spec == self._pair[1].setting.spec:
            one = self._pair[1]
        else:
            one = _Trial(setting, self._assembly, self._seed)
        named = share == 1.0 or not self._trials or any(one in self._named(cost, one) for cost in ("frame", "seconds"))
        if one.seconds > left or not named:
            return None
        began = perf_counter()
        detection = one.detect()
        one.seconds, one.digest = perf_counter() - began, detection.digest
        one.row = {
            "label": setting.label, "line": setting.line, "detector": setting.detector, "axis": setting.axis,
            "value": setting.value, "settings": str(setting.spec).partition("=")[2], "cell_mm": setting.cell * 1e3,
            "faces_listed": setting.faces, "mesh_faces": sum(len(body.mesh.faces) for body in one.assembly.bodies),
            "complete": setting.complete, "simplicity": setting.simplicity,
            "containment": bool(getattr(one.detector.settings, "containment", False)),
            "covers": detection.covers, "oracle": setting.detector == self._scoring.spec.name,
            "prepare_seconds": one.prepared, "digest": detection.digest,
            "work": {name: int(np.sum(value)) for name, value in detection.work.items()},
            **self._scoring.figures(detection, spec=setting.spec, other=one.assembly if setting.cell else None),
        }  # fmt: skip
        self._trials.append(one)
        return one

    def _tell_time(self, one: _Trial) -> None:
        """Prices of the passes so far, into the row."""
        frames, minutes = max(1, len(one.motion)), float(np.ptp(one.motion.times)) / 60 or 1.0
        row, live = one.row, len(one.live)
        row |= {"passes": len(one.whole), "online": live > 0, "live_passes": live, "live_frames": self._frames.count}
        if len(one.whole):
            price = self._whole.price(one)
            row |= _columns(WHOLE, price, 1e3 / frames)
            row |= {"seconds": price.value, "seconds_per_minute": price.value / minutes}
            row["slowest_seconds"] = float(np.max(one.whole.own))
        if not live:
            row |= dict.fromkeys(("mean_ms", "p50_ms", "p95_ms", *LIVE, "over_share"))
            return
        price = self._live.price(one)
        row |= _columns(LIVE, price, 1e3)
        own = 1e3 * price.value / one.live.quantile(self._live.level)
        row |= {
            "mean_ms": own * one.live.mean(),
            "p50_ms": own * one.live.quantile(0.5),
            "p95_ms": own * one.live.quantile(0.95),
        }
        row["over_share"] = float((np.array(one.live.own) * 1e3 > BUDGET_MS).mean())

    def whole(self, session: Session, wanted: Sequence[Setting]) -> Tradeoff:
        """Everything that was found."""
        priced = {row["label"]: row for row in self.rows()}
        rows = tuple(priced[one.label] for one in wanted if one.label in priced)
        scoring, times = self._scoring, self._assembly.motion.times
        front, online = front_of(rows, WHOLE), front_of(rows, LIVE)
        for row in rows:
            row["front"], row["front_online"] = row["label"] in front, row["label"] in online
        clocks = (self._live, self._whole)
        about = {
            "session": session_name(session, "in memory"),
            "frames": len(times), "bodies": len(self._assembly.bodies),
            "seconds": float(times[-1] - times[0]), "pairs": len(self._assembly.pairs), "oracle": scoring.spec.name,
            "contacts": len(scoring.contacts), "seed": self._seed, "machine": machine(), "versions": versions(),
            "intervals": OVER_CONTACTS, "reference": TRUSTED, "live_frames": self._frames.count,
            "clock": {"live": self._live.as_json(), "offline": self._whole.as_json()},
            "processor_share": sum(one.at_work for one in clocks) / sum(one.seconds for one in clocks),
        }  # fmt: skip
        cut = tuple(setting.label for setting in wanted if setting.label not in priced)
        return Tradeoff(rows, tuple(front), tuple(online), tuple(advice_of(rows)), cut, about, answer_of(rows))


def _columns(names: Columns, price: Price, scale: float) -> dict[str, float | None]:
    ends = (price.value, price.low, price.high)
    return {name: None if end is None else scale * end for name, end in zip(names, ends, strict=True)}
