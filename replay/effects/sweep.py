"""Contacts between frames: the earliest time of impact in every step, and the steps that stay undecided, by reason."""

from __future__ import annotations

import numpy as np

from cdcore import Verdict
from replay.effects.declaring import pairs
from replay.effects.inputs import EffectInputs, PairContact
from replay.effects.output import EffectEvent, EffectOutput, LaneSpan
from replay.effects.protocol import EffectSpec
from replay.effects.spans import spans_of


def compute(inputs: EffectInputs) -> EffectOutput:
    """Events ``hit`` where a contact begins, with the interval of its time of impact, and ``unresolved``."""
    events: list[EffectEvent] = []
    lanes: dict[str, tuple[LaneSpan, ...]] = {}
    for pair in inputs.pairs:
        told = inputs.contact(pair)
        inputs.count("intervals", len(inputs))
        spans = spans_of(told.touching)
        events += [_hit(inputs, told, first, stop) for first, stop in spans]
        events += _unresolved(inputs, told)
        if spans:
            lanes[f"{pair[0]}-{pair[1]}"] = tuple(_lane(inputs, first, stop) for first, stop in spans)
    return EffectOutput(tuple(sorted(events, key=lambda event: (event.time, event.bodies))), lanes=lanes)


def _hit(inputs: EffectInputs, told: PairContact, first: int, stop: int) -> EffectEvent:
    """The begin of a contact; where the detector gives no interval of it, the step itself bounds the impact."""
    step = (float(inputs.times[max(0, first - 1)]), float(inputs.times[first]))
    low, high = told.detection.toi.get((first, told.column), step)
    inputs.count("hits")
    segments = told.section(first).reshape(-1, 3)
    x, y, z = segments.mean(axis=0).tolist() if len(segments) else (0.0, 0.0, 0.0)
    end = float(inputs.times[stop]) if stop < len(inputs) else None
    values = {"impact_low_s": low, "impact_high_s": high, "intervals": stop - first}
    return EffectEvent(high, "hit", told.pair, end, values, point=(x, y, z) if len(segments) else None)


def _unresolved(inputs: EffectInputs, told: PairContact) -> list[EffectEvent]:
    rows = np.flatnonzero(told.detection.verdict[:, told.column] == Verdict.UNRESOLVED)
    inputs.count("unresolved", len(rows))
    return [
        EffectEvent(
            float(inputs.times[row]), "unresolved", told.pair, None,
            {"reason": told.detection.reasons.get((row, told.column), "no reason given")}, level="warning",
        )
        for row in rows.tolist()
    ]  # fmt: skip


def _lane(inputs: EffectInputs, first: int, stop: int) -> LaneSpan:
    return LaneSpan(float(inputs.times[max(0, first - 1)]), float(inputs.times[min(stop, len(inputs) - 1)]), "hit")


SPEC = EffectSpec(
    kind="sweep",
    about="Bodies that meet between two frames.",
    compute=compute,
    fields={"between": pairs("two selectors: bodies of the first against bodies of the second")},
    detector="continuous",
    sources=("motion between frames: origins linear, rotation at constant angular velocity (stated by the detector)",),
)
