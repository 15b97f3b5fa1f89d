"""A flame heats what stands over it; an acid heats the water it is diluted with; the wrong order is named."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from replay.effects.declaring import Declaration, body, number, text, vector
from replay.effects.inputs import EffectInputs
from replay.effects.models.transfers import Load, Mixture, flows, total_ml
from replay.effects.models.warming import cooled, heat_given_off, warmed
from replay.effects.output import EffectEvent, EffectOutput, Findings, FloatArray, LaneSpan, Series
from replay.effects.protocol import EffectSpec, Need
from replay.effects.spans import BoolArray, Span, steadied
from replay.errors import EffectError
from sessions.model.scene import Scene
from sessions.scene_files.toml_table import is_number

LEAST_ML = 0.05
"""What is less in one go, about a drop, is no mistake of order; chosen by us."""

WATER = "H2O"


def diluted(inputs: EffectInputs, declared: Declaration, found: Findings) -> None:
    """Find events ``wrong-order`` and ``boil``, and the temperature of every vessel from its first change on."""
    mixed: Mixture = inputs.output("mixing").data
    warmth: dict[str, _Warmth] = {
        name: _Warmth(declared, float(history.volume_ml[0])) for name, history in mixed.histories.items() if len(inputs)
    }
    for load in mixed.loads:
        _receive(declared, warmth, load)
    inputs.count("mixtures heated", len(mixed.loads))
    for event in _wrong_orders(declared, mixed.loads):
        found.events.append(event)
        found.lane(event.bodies[-1], LaneSpan(event.time, event.end or event.time, "water into acid"))
    for name, one in warmth.items():
        if one.rows:
            first = one.rows[0][0]
            found.ran[first:] = True
            times = inputs.times[first:]
            _note_temperature(declared, found, name, Series(times, one.over(times), "degC"))


class _Warmth:
    """One vessel: how warm it was when something last changed, and a row of each change: frame, time, degC, mL."""

    def __init__(self, declared: Declaration, volume_ml: float) -> None:
        self.declared, self.volume_ml = declared, volume_ml
        self.celsius, self.time = declared.number("ambient_c"), 0.0
        self.rows: list[tuple[int, float, float, float]] = []

    def at(self, time: float) -> float:
        """Temperature by then; an empty vessel has that of the room."""
        return self._after(self.celsius, self.volume_ml, time - self.time)

    def note(self, frame: int, time: float, celsius: float, volume_ml: float) -> None:
        self.time, self.celsius, self.volume_ml = time, celsius, volume_ml
        self.rows.append((frame, time, celsius, volume_ml))

    def over(self, times: FloatArray) -> FloatArray:
        """(n,) at times from the first change on."""
        last = np.searchsorted([row[1] for row in self.rows], times, side="right") - 1
        changes = zip((self.rows[k] for k in last.tolist()), times.tolist(), strict=True)
        return np.array([self._after(celsius, ml, time - then) for (_, then, celsius, ml), time in changes])

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


def heated(inputs: EffectInputs, declared: Declaration, found: Findings) -> None:
    """Find events ``heated`` and ``boil``, and the temperature from the first heat on."""
    name, lamp = declared.body("heats"), declared.body("source")
    over = _over(inputs, declared)
    spans = steadied(over, np.ones(len(inputs), dtype=np.bool_))
    inputs.count("frames over a flame", int(over.sum()))
    ambient = declared.number("ambient_c")
    times = inputs.times
    if not spans:
        ends = times[[0, -1]] if len(times) else times
        found.series[f"{name}/temperature"] = Series(ends, np.full(len(ends), ambient), "degC")
        return
    first = spans[0][0]
    found.ran[first:] = True
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
    found.events += [_event(inputs, name, lamp, span, whole) for span in spans]
    found.lanes[name] = inputs.shown(spans, "over the flame")
    _note_temperature(declared, found, name, Series(times[shown], whole[shown], "degC"))


def _note_temperature(declared: Declaration, found: Findings, name: str, celsius: Series) -> None:
    """The series, and an event when it first reaches the declared boiling point."""
    found.series[f"{name}/temperature"] = celsius
    if declared.values["boils_c"] is not None:
        for row in np.flatnonzero(celsius.values >= declared.number("boils_c"))[:1].tolist():
            words = f"{name} reaches {declared.number('boils_c'):g} degC and would boil"
            found.events.append(EffectEvent(float(celsius.times[row]), "boil", (name,), None, {}, words, "warning"))


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


WANTED = {
    "flame": ("source", "heats", "within", "power_w", "base"),
    "dilution": ("solute", "heat_j_mol", "half_water", "heat_capacity_j_per_ml_k"),
}
"""Fields that each kind of heat cannot do without."""


def compute(inputs: EffectInputs) -> EffectOutput:
    """Events ``heated``, ``boil``, ``wrong-order``; temperatures as series."""
    found = Findings(len(inputs))
    for declared in inputs.declared:
        (heated if declared.text("of") == "flame" else diluted)(inputs, declared, found)
    return found.output() if inputs.declared else EffectOutput()


def _check(declared: Declaration, _scene: Scene) -> None:
    kind = declared.text("of")
    for key in WANTED[kind]:
        if declared.values[key] is None:
            raise declared.fail(f"{key} is missing: heat of a {kind} needs {', '.join(WANTED[kind])}")
    for other in set(WANTED) - {kind}:
        for key in WANTED[other]:
            if declared.values[key] is not None:
                raise declared.fail(f"{key} belongs to heat of a {other}, and this is of a {kind}; leave it out")


SPEC = EffectSpec(
    kind="heat",
    about="A flame or a dilution heats.",
    compute=compute,
    needs=(Need("mixing", "of", ("dilution",)),),
    fields={
        "of": text("what gives the heat", among=tuple(WANTED)),
        "ambient_c": number("of the room and of everything at first", "degC", above=-273.15),
        "loss_w_per_k": number("heat lost per kelvin above the room", "W/K", least=0.0),
        "boils_c": number("reaching it is an event; what boils off is not computed", "degC", default=None),
        "source": body("the lamp", required=False),
        "heats": body("what is heated; properties.heat_capacity_j_per_k", required=False),
        "base": vector("foot of the flame in the lamp's frame", default=None),
        "within": number("heated nearer than this to the flame's axis", "m", default=None, above=0.0),
        "power_w": number("heat that reaches it", "W", default=None, least=0.0),
        "solute": text("the acid", default=None),
        "heat_j_mol": number("heat of dilution of one mol in much water", "J/mol", default=None),
        "half_water": number("mol of water per mol of acid that give half of it", "", default=None, above=0.0),
        "heat_capacity_j_per_ml_k": number("of the liquids", "J/(mL K)", default=None, above=0.0),
    },
    trigger="the body over the flame and the time after, or liquid that is mixed and the time after",
    sources=(
        "m c dT/dt = P - k (T - Ta), closed form from frame to frame; constants: the scene's author",
        "heat of dilution a n / (n + b) per mol of acid in n mol of water (form of J. Thomsen); constants the author's",
        "acid into water: a more concentrated acid is poured into a weaker one, never the other way round",
    ),
    check=_check,
)  # fmt: skip
