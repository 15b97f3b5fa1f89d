"""Heat of a flame: what stands over it nears the temperature at which it loses what it gets, and cools when away."""

from __future__ import annotations

from typing import Any

import numpy as np

from replay.effects.declaring import Declaration
from replay.effects.inputs import EffectInputs
from replay.effects.models.warming import warmed
from replay.effects.output import EffectEvent, EffectOutput, FloatArray, Series
from replay.effects.spans import BoolArray, Span, steadied
from replay.errors import EffectError
from sessions.scene_files.toml_table import is_number

FRAMES = 2
"""Frames in a row that begin or end being over the flame: one alone is noise."""


def heated(inputs: EffectInputs, declared: Declaration) -> EffectOutput:
    """Events ``heated`` and ``boil``, the temperature from the first heat on."""
    name, lamp = declared.body("heats"), declared.body("source")
    over = _over(inputs, declared)
    spans = steadied(over, np.ones(len(inputs), dtype=np.bool_), FRAMES, FRAMES)
    inputs.count("frames over a flame", int(over.sum()))
    ran = np.zeros(len(inputs), dtype=np.bool_)
    ambient = declared.number("ambient_c")
    times = inputs.times
    if not spans:
        ends = times[[0, -1]] if len(times) else times
        return EffectOutput(series={f"{name}/temperature": Series(ends, np.full(len(ends), ambient), "degC")}, ran=ran)
    first = spans[0][0]
    ran[first:] = True
    power = np.zeros(len(inputs))
    for begin, stop in spans:
        power[begin:stop] = declared.number("power_w")
    celsius = warmed(
        times[first:], power[first:], capacity=_capacity(inputs, name), loss=declared.number("loss_w_per_k"),
        ambient=ambient,
    )  # fmt: skip
    whole = np.concatenate([np.full(first, ambient), celsius])
    shown = np.arange(len(times)) >= max(0, first - 1)
    shown[0] = True
    events = [_event(inputs, name, lamp, span, whole) for span in spans]
    events += boiling(declared, name, times, whole)
    lane = tuple(inputs.shown(spans, "over the flame"))
    series = {f"{name}/temperature": Series(times[shown], whole[shown], "degC")}
    return EffectOutput(tuple(events), series, {name: lane}, ran)


def boiling(declared: Declaration, name: str, times: FloatArray, celsius: FloatArray) -> list[EffectEvent]:
    """An event when a temperature first reaches the declared boiling point."""
    if declared.values["boils_c"] is None:
        return []
    rows = np.flatnonzero(celsius >= declared.number("boils_c"))
    if not len(rows):
        return []
    words = f"{name} reaches {declared.number('boils_c'):g} degC and would boil"
    return [EffectEvent(float(times[rows[0]]), "boil", (name,), None, {}, words, "warning")]


def _over(inputs: EffectInputs, declared: Declaration) -> BoolArray:
    """(T,) whether the body's origin is above the flame's foot and near its axis; where not seen, as last seen."""
    lamp, dish = (inputs.poses(declared.body(key)).held() for key in ("source", "heats"))
    local = lamp.local(dish.translation) - np.array(declared.vector("base"))
    near = np.hypot(local[:, 0], local[:, 2]) < declared.number("within")
    return np.asarray(near & (local[:, 1] > 0.0) & lamp.valid & dish.valid)


def _capacity(inputs: EffectInputs, name: str) -> float:
    properties = inputs.body(name).extra.get("properties") or {}
    value: Any = properties.get("heat_capacity_j_per_k")
    if not is_number(value) or not value > 0.0:
        raise EffectError(f"scene: body {name!r} has heat_capacity_j_per_k = {value!r}; give its m c in J/K")
    return float(value)


def _event(inputs: EffectInputs, name: str, lamp: str, span: Span, celsius: FloatArray) -> EffectEvent:
    start, end = inputs.ends(span)
    reached = float(celsius[min(span[1], len(celsius) - 1)])
    words = f"{lamp} heats {name} to {reached:.0f} degC in {end - start:.1f} s"
    values = {"to_c": reached, "seconds": end - start}
    return EffectEvent(start, "heated", (name, lamp), inputs.end(span[1]), values, words)
