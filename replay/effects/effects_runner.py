"""Runs the effects of a plan over one assembly, in order; each is timed and gets only what its spec names."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any, Final

import numpy as np

from cdcore import Detection
from cdcore.errors import CollisionCoreError
from replay.effects.effect_plan import Plan, Step
from replay.effects.inputs import EffectInputs
from replay.effects.output import EffectEvent, EffectOutput, Series
from replay.effects.protocol import EffectSpec
from replay.effects.spans import spans_of
from replay.errors import EffectError, ReplayError
from replay.prepare.assembly import Assembly
from sessions import Session
from sessions.errors import SessionError

SKIPPED_LANE = "skipped"
"""Name of the lane that shows when an effect did not run."""


@dataclass(frozen=True, eq=False)
class EffectRun:
    """Outcome and cost of one effect."""

    spec: EffectSpec
    because: Sequence[str]  # why it was in the plan
    output: EffectOutput  # events, series, lanes, liquids
    seconds: float
    counters: Mapping[str, int]  # its work
    # frames, frames_run: frames of the run, and those in which its trigger was on
    frames: int
    frames_run: int

    @property
    def events(self) -> tuple[EffectEvent, ...]:
        """In order of time."""
        return self.output.events

    @property
    def series(self) -> Mapping[str, Series]:
        """Name -> quantity over time."""
        return self.output.series


def run_effects(
    planned: Plan, session: Session, assembly: Assembly, detections: Mapping[str, Detection]
) -> dict[str, EffectRun]:
    """Run every effect of a plan; kind -> outcome, in running order.

    ``detections``: name of a detector that a spec names -> the answer its effect reads.
    Raises EffectError: the recording does not hold what a declared effect needs.
    """
    effect_runs: dict[str, EffectRun] = {}
    tables_of_kind = {kind: step.declared for kind, step in planned.steps.items()}
    shared_objects: dict[str, Any] = {}
    for kind, step in planned.steps.items():
        output_of_kind = {name: effect_runs[name].output for name in step.inputs}
        pairs = tuple(pair for pair in step.pairs if frozenset(assembly.names).issuperset(pair))
        effect_runs[kind] = _run_effect(
            step,
            EffectInputs(
                kind,
                step.declared,
                pairs,
                session,
                assembly,
                frozenset(planned.bodies),
                step.spec.reads,
                detections.get(step.spec.detector),
                output_of_kind,
                Counter(),
                tables_of_kind,
                shared_objects,
            ),
        )
    return effect_runs


def _run_effect(step: Step, inputs: EffectInputs) -> EffectRun:
    spec = step.spec
    start = perf_counter()
    try:
        output = spec.compute(inputs)
    except (ReplayError, CollisionCoreError, SessionError, MemoryError):
        raise
    except Exception as error:  # an effect of another package may fail with anything
        effect_location = f"effect {spec.kind!r} ({getattr(spec.compute, '__module__', 'of another package')})"
        raise EffectError(
            f"{effect_location} failed: {type(error).__name__}: {error}; report it to its package"
        ) from error
    seconds = perf_counter() - start
    frames = len(inputs)
    has_run = np.ones(frames, dtype=np.bool_) if output.ran is None else output.ran
    if has_run.shape != (frames,):
        raise EffectError(f"effect {spec.kind!r} says it ran in {has_run.shape} of {frames} frames; repair it")
    run = int(has_run.sum())
    if run < frames:
        skipped_spans = tuple(inputs.lane_spans(spans_of(~has_run), SKIPPED_LANE))
        output = replace(output, lanes={**output.lanes, SKIPPED_LANE: skipped_spans})
    return EffectRun(spec, step.because, output, seconds, dict(inputs.counters), frames, run)


SCALARS: Final = "scalars"
CURVES: Final = "curves"

RECORDED_SPEC = EffectSpec(SCALARS, "Numbers that were recorded beside the poses.", lambda _: EffectOutput())


def recorded_scalars(session: Session, assembly: Assembly) -> dict[str, EffectRun]:
    """Kind -> the numbers between the first and the last frame of the assembly; empty where there are none."""
    start, count = perf_counter(), len(assembly.motion)
    series = {}
    for name, track in session.scalars.items():
        times = (track.times_ns - assembly.first_ns) / 1e9
        first, last = assembly.motion.times[[0, -1]]
        rows_in_window = np.flatnonzero((times >= first) & (times <= last))
        if len(rows_in_window):
            series[name] = Series(times[rows_in_window], track.values[rows_in_window], track.unit)
    if not series:
        return {}
    output, seconds = EffectOutput(series=series), perf_counter() - start
    return {
        SCALARS: EffectRun(RECORDED_SPEC, ("it was recorded",), output, seconds, {CURVES: len(series)}, count, count)
    }
