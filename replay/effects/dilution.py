"""Heat of dilution: what an acid gives off goes into the liquid it is mixed with; water into acid is a mistake."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from replay.effects.declaring import Declaration
from replay.effects.flame_heating import boiling
from replay.effects.inputs import EffectInputs
from replay.effects.models.transfers import flows, total_ml
from replay.effects.models.warming import cooled, heat_given_off
from replay.effects.output import EffectEvent, EffectOutput, Findings, FloatArray, LaneSpan, Series

if TYPE_CHECKING:
    from collections.abc import Mapping

    from replay.effects.models.mixing import Load, Mixture

LEAST_ML = 0.05
"""What is less in one go, about a drop, is no mistake of order; chosen by us."""

WATER = "H2O"


def diluted(inputs: EffectInputs, declared: Declaration) -> EffectOutput:
    """Events ``wrong-order`` and ``boil``; the temperature of every vessel from its first change on."""
    mixed: Mixture = inputs.output("mixing").data
    warmth: dict[str, _Warmth] = {
        name: _Warmth(declared, float(history.volume_ml[0])) for name, history in mixed.histories.items() if len(inputs)
    }
    for load in mixed.loads:
        _receive(declared, warmth, load)
    inputs.count("mixtures heated", len(mixed.loads))
    found = Findings(len(inputs))
    found.events = _wrong_orders(declared, mixed.loads)
    for event in found.events:
        found.lane(event.bodies[-1], LaneSpan(event.time, event.end or event.time, "water into acid"))
    for name, one in warmth.items():
        if one.rows:
            first = one.rows[0][0]
            found.ran[first:] = True
            times = inputs.times[first:]
            celsius = one.over(times)
            found.series[f"{name}/temperature"] = Series(times, celsius, "degC")
            found.events += boiling(declared, name, times, celsius)
    return found.output()


@dataclass
class _Warmth:
    """One vessel: how warm it was when something last changed, and a row of each change: frame, time, degC, mL."""

    declared: Declaration
    volume_ml: float
    celsius: float = field(init=False)
    time: float = 0.0
    rows: list[tuple[int, float, float, float]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.celsius = self.declared.number("ambient_c")

    def at(self, time: float) -> float:
        """Temperature by then; an empty vessel has that of the room."""
        return self._after(self.celsius, self.volume_ml, time - self.time)

    def note(self, frame: int, time: float, celsius: float, volume_ml: float) -> None:
        self.time, self.celsius, self.volume_ml = time, celsius, volume_ml
        self.rows.append((frame, time, celsius, volume_ml))

    def over(self, times: FloatArray) -> FloatArray:
        """(n,) at times from the first change on."""
        last = np.searchsorted([row[1] for row in self.rows], times, side="right") - 1
        return np.array(
            [
                self._after(self.rows[k][2], self.rows[k][3], float(time) - self.rows[k][1])
                for k, time in zip(last.tolist(), times, strict=True)
            ]
        )

    def _after(self, celsius: float, volume_ml: float, seconds: float) -> float:
        ambient = self.declared.number("ambient_c")
        capacity = self.declared.number("heat_capacity_j_per_ml_k") * volume_ml
        if capacity <= 0.0:
            return ambient
        loss = self.declared.number("loss_w_per_k")
        return cooled(celsius, seconds, power_w=0.0, capacity=capacity, loss=loss, ambient=ambient)


def _receive(declared: Declaration, warmth: Mapping[str, _Warmth], load: Load) -> None:
    one = load.transfer
    source = warmth[one.source]
    incoming = source.at(one.time)
    left = source.volume_ml - one.volume_ml
    if source.rows:
        source.note(one.frame, one.time, incoming, max(0.0, left))
    else:
        source.volume_ml = max(0.0, left)
    if not one.target:
        return
    target = warmth[one.target]
    per_ml = declared.number("heat_capacity_j_per_ml_k")
    there, more = per_ml * load.before_ml, per_ml * one.volume_ml
    given = _given(declared, _sum(load)) - _given(declared, load.before) - _given(declared, load.amounts)
    total = there + more
    # Energy above 0 degC is shared; what the acid gives off is added. Nothing into nothing keeps the room's warmth.
    celsius = (there * target.at(one.time) + more * incoming + given) / total if total > 0.0 else incoming
    target.note(one.frame, one.time, celsius, load.before_ml + one.volume_ml)


def _sum(load: Load) -> dict[str, float]:
    return {key: load.before.get(key, 0.0) + load.amounts.get(key, 0.0) for key in {**load.before, **load.amounts}}


def _given(declared: Declaration, amounts: Mapping[str, float]) -> float:
    acid = amounts.get(declared.text("solute"), 0.0)
    if acid > 0.0 and WATER not in amounts:
        raise declared.unmet(
            f"nothing says how much water is with the {declared.text('solute')}; "
            "give liquid.water_molar, mol of water per litre of the solution"
        )
    return heat_given_off(acid, amounts.get(WATER, 0.0), declared.number("heat_j_mol"), declared.number("half_water"))


def _wrong_orders(declared: Declaration, loads: tuple[Load, ...]) -> list[EffectEvent]:
    """Where a weaker solution of the solute, or none, was poured into a stronger one."""
    solute = declared.text("solute")
    wrong = [
        load.transfer
        for load in loads
        if load.transfer.target
        and load.before.get(solute, 0.0) * load.transfer.volume_ml > load.amounts.get(solute, 0.0) * load.before_ml
    ]
    events = []
    for flow in flows(wrong, LEAST_ML):
        first, volume = flow[0], total_ml(flow)
        words = f"{volume:.1f} mL from {first.source} poured into {solute} in {first.target}: acid goes into water"
        bodies = (first.source, first.target)
        events.append(
            EffectEvent(
                first.time, "wrong-order", bodies, flow[-1].time, {"volume_ml": volume}, words, "error", first.point
            )
        )
    return events
