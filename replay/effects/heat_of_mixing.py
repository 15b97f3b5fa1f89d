"""The heat of liquids that come together, from the ledger: of dilution and reaction; the wrong order is named."""

import numpy as np

from replay.effects.declaring import Declaration
from replay.effects.heat import boils, note_temperature
from replay.effects.inputs import EffectInputs
from replay.effects.matter import Matter, matter_of
from replay.effects.models.ledger import BROUGHT, HEAT
from replay.effects.models.outflow import flows
from replay.effects.movement import movement_of
from replay.effects.output import EffectEvent, Findings, FloatArray, LaneSpan, Series, vector_of

LEAST_ML = 0.05
"""What is less in one go, about a drop, is no mistake of order; chosen by us."""

BOILING = 1e-9
"""Kelvin below the boiling point that are none."""

LEAST_KELVIN = 0.05
"""A vessel whose temperature changes by less tells no result; a school's thermometer shows 0.1."""


def mixed(inputs: EffectInputs, declared: Declaration, found: Findings) -> None:
    """Find events ``warmest``, ``coldest``, ``wrong-order`` and ``boil``, and the temperature of every vessel."""
    matter = matter_of(inputs)
    for event in _wrong_orders(inputs, declared, matter) if declared["solute"] else ():
        found.events.append(event)
        found.lane(event.bodies[-1], LaneSpan(event.time, event.end or event.time, "water into acid"))
    for name, history in matter.histories.items():
        changed = np.flatnonzero(np.diff(history.volume_ml, prepend=history.volume_ml[0]))
        if not len(changed) and not matter.amount(name, HEAT).any():
            continue
        first = int(history.frames[changed[0]]) if len(changed) else 0
        found.ran[first:] = True
        times = inputs.times[[0, *range(max(1, first - 1), len(inputs))]]
        celsius = declared["ambient_c"] + matter.kelvin(name, times)
        # What boils is told so, whatever its heat over its capacity is rounded to.
        celsius[celsius > boils(declared) - BOILING] = boils(declared)
        note_temperature(declared, found, name, Series(times, celsius, "degC"))
        found.events += _extremes(name, times, celsius)


def _extremes(name: str, times: FloatArray, celsius: FloatArray) -> list[EffectEvent]:
    """The warmest and the coldest that a vessel gets after its start: what calorimetry reads."""
    events = []
    for word, row, sign in (("warmest", int(np.argmax(celsius)), 1.0), ("coldest", int(np.argmin(celsius)), -1.0)):
        change = float(celsius[row] - celsius[0])
        if sign * change > LEAST_KELVIN:
            verb = "warms" if sign > 0.0 else "cools"
            words = f"{name} {verb} from {celsius[0]:.2f} to {celsius[row]:.2f} degC"
            values = {"from_c": float(celsius[0]), "to_c": float(celsius[row]), "change_k": change}
            events.append(EffectEvent(float(times[row]), word, (name,), None, values, words))
    return events


def _wrong_orders(inputs: EffectInputs, declared: Declaration, matter: Matter) -> list[EffectEvent]:
    """Where a weaker solution of the solute, or none, was poured into a stronger one."""
    streams = []
    for stream in movement_of(inputs).streams:
        if stream.target:
            source, target = (_molar(matter, declared, name, stream.times) for name in (stream.source, stream.target))
            streams.append(stream.part(np.flatnonzero(target > source)))
    events = []
    for flow in flows(streams, LEAST_ML):
        words = f"{flow.total_ml:.1f} mL from {flow.source} are poured into {declared['solute']} in {flow.target}"
        end, values = float(flow.times[-1]), {"volume_ml": flow.total_ml}
        events.append(EffectEvent(
            float(flow.times[0]), "wrong-order", (flow.source, flow.target), end, values,
            f"{words}: acid goes into water", "error", vector_of(flow.points[0]),
        ))  # fmt: skip
    return events


def _molar(matter: Matter, declared: Declaration, vessel: str, times: FloatArray) -> FloatArray:
    """mol/mL (n,) of the solute in a vessel just before each time; 0 where it is empty."""
    history = matter.histories[vessel]
    rows = np.maximum(0, np.searchsorted(history.times, times) - 1)
    volume = history.volume_ml[rows]
    return matter.amount(vessel, declared["solute"] + BROUGHT)[rows] / np.where(volume > 0.0, volume, np.inf)
