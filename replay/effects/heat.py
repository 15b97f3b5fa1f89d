"""A flame heats what stands over it; an acid heats the water it is diluted with; the wrong order is named."""

from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from replay.effects.chemistry import WATER
from replay.effects.declaring import Declaration, body, number, text, vector
from replay.effects.inputs import EffectInputs
from replay.effects.matter import matter_of
from replay.effects.models.history import NEUTRALISATION, Load
from replay.effects.models.ledger import BROUGHT
from replay.effects.models.transfers import Stream, flows
from replay.effects.models.warming import cooled, heat_given_off, warmed
from replay.effects.movement import movement_of
from replay.effects.output import EffectEvent, EffectOutput, Findings, FloatArray, LaneSpan, Series, vector_of
from replay.effects.protocol import EffectSpec, Need
from replay.effects.spans import BoolArray, Span, steadied
from replay.errors import EffectError
from sessions.model.scene import Scene, SceneBody
from sessions.scene_files.toml_table import is_number

LEAST_ML = 0.05
"""What is less in one go, about a drop, is no mistake of order; chosen by us."""

CAPACITY: Final = "heat_capacity_j_per_ml_k"
WATER_BOILS_C: Final = 100.0
NEUTRALISATION_J_MOL: Final = 55.84e3
"""Of H+ + OH- -> H2O at 25 degC: 285.83 - 229.99 kJ/mol. Source: Wagman et al., NBS tables, 1982."""


def diluted(inputs: EffectInputs, declared: Declaration, found: Findings) -> None:
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
            _note_temperature(declared, found, name, Series(times, warm.over(times), "degC"))


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
        self.time, self.celsius, self.volume_ml = time, min(celsius, _boils(self.declared)), volume_ml
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
        words = f"{flow.total_ml:.1f} mL from {flow.source} poured into {declared.text('solute')} in {flow.target}"
        end, values = float(inputs.times[flow.frames[-1]]), {"volume_ml": flow.total_ml}
        events.append(EffectEvent(
            float(flow.times[0]), "wrong-order", (flow.source, flow.target), end, values,
            f"{words}: acid goes into water", "error", vector_of(flow.points[0]),
        ))  # fmt: skip
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
        times[first:], power[first:], capacity=_capacity(inputs.body(name)), loss=declared.number("loss_w_per_k"),
        ambient=ambient, boils=_boils(declared),
    )  # fmt: skip
    whole = np.concatenate([np.full(first, ambient), celsius])
    shown = np.arange(len(times)) >= max(0, first - 1)
    shown[0] = True
    found.events += [_event(inputs, name, lamp, span, whole) for span in spans]
    found.lanes[name] = inputs.shown(spans, "over the flame")
    _note_temperature(declared, found, name, Series(times[shown], whole[shown], "degC"))


def _note_temperature(declared: Declaration, found: Findings, name: str, celsius: Series) -> None:
    """The series, and an event when it first reaches its boiling point."""
    found.series[f"{name}/temperature"] = celsius
    for row in np.flatnonzero(celsius.values >= _boils(declared))[:1].tolist():
        words = f"{name} reaches {_boils(declared):g} degC and boils: it gets no hotter, what boils off is not computed"
        found.events.append(EffectEvent(float(celsius.times[row]), "boil", (name,), None, {}, words, "warning"))


def _boils(declared: Declaration) -> float:
    """Where the temperature stays: as declared, else that of water where liquids are mixed."""
    if declared.values["boils_c"] is None:
        return np.inf if declared.text("of") == "flame" else WATER_BOILS_C
    return declared.number("boils_c")


def _over(inputs: EffectInputs, declared: Declaration) -> BoolArray:
    """(T,) whether the body's origin is above the flame's foot and near its axis; where not seen, as last seen."""
    lamp, dish = (inputs.poses(declared.body(key)).held() for key in ("source", "heats"))
    local = lamp.local(dish.translation) - np.array(declared.vector("base"))
    near = np.hypot(local[:, 0], local[:, 2]) < declared.number("within")
    return np.asarray(near & (local[:, 1] > 0.0) & lamp.valid & dish.valid)


def _capacity(body: SceneBody) -> float:
    value: Any = (body.extra.get("properties") or {}).get("heat_capacity_j_per_k")
    if not is_number(value) or not value > 0.0:
        raise EffectError(f"scene: body {body.id!r} has heat_capacity_j_per_k = {value!r}; give its m c in J/K")
    return float(value)


def _event(inputs: EffectInputs, name: str, lamp: str, span: Span, celsius: FloatArray) -> EffectEvent:
    start, end = inputs.ends(span)
    reached = float(celsius[min(span[1], len(celsius) - 1)])
    words = f"{lamp} heats {name} to {reached:.0f} degC in {end - start:.1f} s"
    values = {"to_c": reached, "seconds": end - start}
    return EffectEvent(start, "heated", (name, lamp), inputs.end(span[1]), values, words)


WANTED = {
    "flame": ("source", "heats", "within", "power_w", "base"),
    "dilution": ("solute", "heat_j_mol", "half_water", CAPACITY),
    "neutralisation": (CAPACITY,),
}
"""Fields that each kind of heat cannot do without."""


def compute(inputs: EffectInputs) -> EffectOutput:
    """Events ``heated``, ``boil``, ``wrong-order``; temperatures as series."""
    found = Findings(len(inputs))
    for declared in inputs.declared:
        (heated if declared.text("of") == "flame" else diluted)(inputs, declared, found)
    return found.output() if inputs.declared else EffectOutput()


def _check(declared: Declaration, scene: Scene) -> None:
    kind = declared.text("of")
    for key in WANTED[kind]:
        if declared.values[key] is None:
            raise declared.fail(f"{key} is missing: heat of a {kind} needs {', '.join(WANTED[kind])}")
    for other in set(WANTED) - {kind}:
        for key in set(WANTED[other]) - set(WANTED[kind]):
            if declared.values[key] is not None:
                raise declared.fail(f"{key} belongs to heat of a {other}, and this is of a {kind}; leave it out")
    if kind == "flame":
        try:
            _capacity(scene.body(declared.body("heats")) or SceneBody(declared.body("heats")))
        except EffectError as error:
            raise declared.fail(str(error).removeprefix("scene: ")) from error


SPEC = EffectSpec(
    kind="heat",
    about="A flame or a dilution heats.",
    compute=compute,
    needs=(Need("mixing", "of", ("dilution", "neutralisation")), Need("reaction", "of", ("neutralisation",))),
    fields={
        "of": text("what gives the heat", among=tuple(WANTED)),
        "ambient_c": number("of the room and of everything at first", "degC", above=-273.15),
        "loss_w_per_k": number("heat lost per kelvin above the room", "W/K", least=0.0),
        "boils_c": number("hotter it does not get; absent: 100 for liquids, none over a flame", "degC", default=None),
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
        "heat of neutralisation 55.84 kJ per mol of water formed: NBS tables, 25 degC",
        "heat of dilution a n / (n + b) per mol of acid in n mol of water (form of J. Thomsen); constants the author's",
        "acid into water: a more concentrated acid is poured into a weaker one, never the other way round",
    ),
    check=_check,
)  # fmt: skip
