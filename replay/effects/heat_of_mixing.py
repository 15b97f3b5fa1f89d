"""The heat of liquids that come together: of dilution and neutralisation, from the ledger; the wrong order is named."""

from collections.abc import Mapping
from typing import Final

import numpy as np

from replay.effects.contents import WATER
from replay.effects.declaring import Declaration
from replay.effects.heat import CAPACITY, boils, note_temperature
from replay.effects.inputs import EffectInputs
from replay.effects.matter import matter_of
from replay.effects.models.history import NEUTRALISATION, Load
from replay.effects.models.ledger import BROUGHT
from replay.effects.models.outflow import Stream, flows
from replay.effects.models.warming import cooled, heat_given_off
from replay.effects.movement import movement_of
from replay.effects.output import EffectEvent, Findings, FloatArray, LaneSpan, Series, vector_of

LEAST_ML = 0.05
"""What is less in one go, about a drop, is no mistake of order; chosen by us."""

NEUTRALISATION_J_MOL: Final = 55.84e3
"""Of H+ + OH- -> H2O at 25 degC: 285.83 - 229.99 kJ/mol. Source: Wagman et al., NBS tables, 1982."""


def mixed(inputs: EffectInputs, declared: Declaration, found: Findings) -> None:
    """Find events ``wrong-order`` and ``boil``, and the temperature of every vessel from its first change on."""
    matter = matter_of(inputs)
    warmth = {name: _Warmth(declared, vessel.volume_ml) for name, vessel in matter.vessels.items()}
    told = [declared.text("solute") + BROUGHT, WATER]
    places = [matter.ledger.column.get(name, -1) for name in told]
    for load in matter.ledger.loads:
        _receive(declared, warmth, load, places, NEUTRALISATION in matter.ledger.processes)
    inputs.count("mixtures heated", len(matter.ledger.loads))
    if places[0] >= 0:
        for event in _wrong_orders(inputs, declared, [one for one in matter.ledger.loads if one.target], places[0]):
            found.events.append(event)
            found.lane(event.bodies[-1], LaneSpan(event.time, event.end or event.time, "water into acid"))
    for name, warm in warmth.items():
        if warm.rows:
            first = warm.rows[0][0]
            found.ran[first:] = True
            times = inputs.times[first:]
            note_temperature(declared, found, name, Series(times, warm.over(times), "degC"))


class _Warmth:
    """One vessel: how warm it was when something last changed, and a row of each change: frame, time, degC, mL."""

    def __init__(self, declared: Declaration, volume_ml: float) -> None:
        self.declared, self.volume_ml = declared, volume_ml
        self.celsius, self.time = declared.number("ambient_c"), 0.0
        self.rows: list[tuple[int, float, float, float]] = []

    def at(self, time: float) -> float:
        """Temperature by then; an empty vessel has that of the room."""
        return float(self._after(*(np.array([one]) for one in (self.celsius, self.volume_ml, time - self.time)))[0])

    def note(self, frame: int, time: float, celsius: float, volume_ml: float) -> None:
        self.time, self.celsius, self.volume_ml = time, min(celsius, boils(self.declared)), volume_ml
        self.rows.append((frame, time, self.celsius, volume_ml))

    def over(self, times: FloatArray) -> FloatArray:
        """(n,) at times from the first change on."""
        rows = np.array(self.rows)
        last = np.searchsorted(rows[:, 1], times, side="right") - 1
        return self._after(rows[last, 2], rows[last, 3], times - rows[last, 1])

    def _after(self, celsius: FloatArray, volume_ml: FloatArray, seconds: FloatArray) -> FloatArray:
        ambient, capacity = self.declared.number("ambient_c"), volume_ml * self.declared.number(CAPACITY)
        full = np.where(capacity > 0.0, capacity, 1.0)
        loss = self.declared.number("loss_w_per_k")
        after = cooled(celsius, seconds, power_w=0.0, capacity=full, loss=loss, ambient=ambient)
        return np.where(capacity > 0.0, after, ambient)


def _receive(
    declared: Declaration, warmth: Mapping[str, _Warmth], load: Load, places: list[int], neutral: bool
) -> None:
    source = warmth[load.source]
    incoming = source.at(load.time)
    left = max(0.0, source.volume_ml - load.volume_ml)
    if source.rows:
        source.note(load.frame, load.time, incoming, left)
    else:
        source.volume_ml = left
    if not load.target:
        return
    target = warmth[load.target]
    per_ml = declared.number(CAPACITY)
    there, more = per_ml * load.before_ml, per_ml * load.volume_ml
    given = load.reacted[0] * NEUTRALISATION_J_MOL if neutral else 0.0
    if declared.text("solute"):
        heat, half = declared.number("heat_j_mol"), declared.number("half_water")
        for sign, one in ((1.0, load.before + load.carried), (-1.0, load.before), (-1.0, load.carried)):
            acid, water = (float(one[place]) if place >= 0 else 0.0 for place in places)
            given += sign * heat_given_off(acid, water, heat, half)
    total = there + more
    # Energy above 0 degC is shared; what is given off is added. Nothing into nothing keeps the room's warmth.
    celsius = (there * target.at(load.time) + more * incoming + given) / total if total > 0.0 else incoming
    target.note(load.frame, load.time, celsius, load.before_ml + load.volume_ml)


def _wrong_orders(inputs: EffectInputs, declared: Declaration, loads: list[Load], place: int) -> list[EffectEvent]:
    """Where a weaker solution of the solute, or none, was poured into a stronger one."""
    wrong: dict[tuple[str, str], list[Load]] = {}
    for load in loads:
        if load.before[place] * load.volume_ml > load.carried[place] * load.before_ml:
            wrong.setdefault((load.source, load.target), []).append(load)
    streams = []
    for (source, target), parts in wrong.items():
        poured = [one for one in movement_of(inputs).streams if (one.source, one.target) == (source, target)]
        begins, frames, volumes = (
            np.array([getattr(one, key) for one in parts]) for key in ("begin", "frame", "volume_ml")
        )
        points = poured[0].points[np.searchsorted(poured[0].times, begins)]
        streams.append(Stream(source, target, False, begins, frames, volumes, points))
    events = []
    for flow in flows(streams, LEAST_ML):
        words = f"{flow.total_ml:.1f} mL from {flow.source} are poured into {declared.text('solute')} in {flow.target}"
        end, values = float(inputs.times[flow.frames[-1]]), {"volume_ml": flow.total_ml}
        events.append(EffectEvent(
            float(flow.times[0]), "wrong-order", (flow.source, flow.target), end, values,
            f"{words}: acid goes into water", "error", vector_of(flow.points[0]),
        ))  # fmt: skip
    return events
