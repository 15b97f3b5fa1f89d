"""A hand on a hot part for too long is a burn; the threshold is the author's, from ISO 13732-1."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from replay import words
from replay.effects.contact import EffectContact, touches_of
from replay.effects.declaring import Declaration
from replay.effects.inputs import EffectInputs
from replay.effects.output import EffectEvent, EffectOutput, Findings, FloatArray, Series
from replay.effects.protocol import spec_of
from sessions.model.scene import Scene


def compute(inputs: EffectInputs) -> EffectOutput:
    """Events ``exposed`` and, above the threshold for long enough, ``burn``; what was felt, as a series."""
    findings = Findings(len(inputs))
    for declared in inputs.declared:
        for pair in declared["between"]:
            for touch in touches_of(inputs, pair):
                span = (touch.first, touch.stop)
                findings.ran[slice(*span)] = True
                felt_c = surface_temperature(inputs, declared, pair[1], touch)
                events = _exposure_events(inputs, declared, pair, touch, felt_c)
                findings.events += events
                findings.add_lane(f"{pair[0]}-{pair[1]}", *inputs.lane_spans([span], events[-1].name))
                findings.series[f"{pair[1]}/touched at {touch.first}"] = Series(
                    inputs.times[slice(*span)], felt_c, "degC"
                )
    return findings.output()


def surface_temperature(
    inputs: EffectInputs, declared: Declaration, hot_body_name: str, touch: EffectContact
) -> FloatArray:
    """Temperature (n,) of the part during a contact: declared, else what ``heat`` says, at first that of the room."""
    times = inputs.times[touch.first : touch.stop]
    if declared["surface_c"] is not None:
        return np.full(len(times), declared["surface_c"])
    heat = inputs.output("heat").series.get(f"{hot_body_name}/temperature")
    if heat is None:
        return np.full(len(times), inputs.tables["heat"][0]["ambient_c"])
    return np.interp(times, heat.times, heat.values)


def _exposure_events(
    inputs: EffectInputs, declared: Declaration, pair: tuple[str, str], touch: EffectContact, felt_c: FloatArray
) -> list[EffectEvent]:
    start, end = inputs.span_times((touch.first, touch.stop))
    times = inputs.times[touch.first : touch.stop]
    is_hot = felt_c > declared["threshold_c"]
    frame_durations = np.diff(np.append(times, end))
    seconds_above = float(frame_durations[is_hot].sum())
    highest_celsius = float(felt_c.max())
    event_values = {"seconds": end - start, "seconds_above": seconds_above, "surface_c": highest_celsius}
    message = (
        f"{pair[0]} is on {pair[1]} at {words.decimal(highest_celsius, 0)} degC for {words.decimal(end - start, 2)} s"
    )
    end_time = inputs.end(touch.stop)
    exposed_event = EffectEvent(
        start, "exposed", pair, end_time, event_values, message, "warning" if seconds_above else "info", touch.point
    )
    burn_event = replace(exposed_event, name="burn", message=f"burn: {message}", level="error")
    return [exposed_event] if seconds_above < declared["seconds"] else [exposed_event, burn_event]


def _check_all(tables: Mapping[str, tuple[Declaration, ...]], _scene: Scene, _file: str) -> None:
    heats = tables.get("heat", ())
    heated_bodies = {table["heats"] for table in heats}
    if any(table["of"] != "flame" for table in heats):
        from replay.effects.vessels import vessel_names  # a flame alone loads no vessel

        heated_bodies |= set(vessel_names(tables))
    for declared in tables["burn-exposure"]:
        for _, hot_body_name in declared["between"] if declared["surface_c"] is None else ():
            if hot_body_name not in heated_bodies:
                raise declared.fail(f"nothing says how hot {hot_body_name!r} is; give surface_c or an effect heat")


SPEC = spec_of("burn-exposure", compute, check_all=_check_all)
