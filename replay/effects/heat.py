"""A flame heats what stands over it; liquids that are mixed warm and cool; water poured into acid is named."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

import numpy as np

from replay import words
from replay.effects.chemistry.warming import heating_curve
from replay.effects.declaring import Declaration
from replay.effects.inputs import EffectInputs
from replay.effects.output import COLOURS, EffectEvent, EffectOutput, Findings, FloatArray, LaneSpan, Series
from replay.effects.protocol import spec_of
from replay.effects.spans import BoolArray, steady_spans
from replay.effects.temperatures import boils, note_temperature
from replay.effects.vessels import Vessel
from replay.errors import EffectError
from sessions.input_files import is_number
from sessions.model.scene import Scene, SceneBody

SOLID_G_ML: Final = 2.0
"""Of a solid whose density nobody states, for the picture only: most salts have 1.7 to 2.5."""


def find_flame_heating(inputs: EffectInputs, declared: Declaration, findings: Findings) -> None:
    """Find events ``heated`` and ``boil``, and the temperature from the first heat on."""
    name, lamp = declared["heats"], declared["source"]
    spans, times = steady_spans(_is_over_flame(inputs, declared), np.ones(len(inputs), dtype=np.bool_)), inputs.times
    power = np.zeros(len(times))
    for begin, stop in spans:
        power[begin:stop] = declared["power_w"]
    first = spans[0][0] if spans else len(times)
    findings.ran[first:] = True
    celsius = heating_curve(
        times,
        power,
        capacity=_capacity(inputs.body(name)),
        loss=declared["loss_w_per_k"],
        ambient=declared["ambient_c"],
        boils=boils(declared),
    )
    drawn_rows = [0, *range(max(1, first - 1), len(times))]
    findings.add_lane(name, *inputs.lane_spans(spans, "over the flame"))
    for span in spans:
        start, end = inputs.span_times(span)
        reached_c = float(celsius[min(span[1], len(times) - 1)])
        text, values = (
            f"{lamp} heats {name} to {words.decimal(reached_c, 0)} degC in {words.decimal(end - start, 1)} s",
            {"to_c": reached_c, "seconds": end - start},
        )
        findings.events.append(EffectEvent(start, "heated", (name, lamp), inputs.end(span[1]), values, text))
    if spans and _has_reactions(inputs, name):
        text = (
            f"what dissolves and reacts in {name} is computed without the heat of {lamp}: for what it does hot, give "
            'the body its temperature_c, and let it cool by an effect heat with of = "liquids"'
        )
        start = inputs.span_times(spans[0])[0]
        findings.events.append(EffectEvent(start, "not-heated", (name, lamp), None, {}, text, "warning"))
    if spans and declared["turns_c"] is not None:
        _change_colour(declared, findings, Vessel(inputs.body(name)), times, celsius)
    note_temperature(declared, findings, name, Series(times[drawn_rows], celsius[drawn_rows], "degC"))


def _has_reactions(inputs: EffectInputs, name: str) -> bool:
    """Whether an effect computes what dissolves or reacts in a vessel."""
    followed_vessels = {vessel for table in inputs.tables.get("mixing", ()) for vessel in table["in"]}
    return name in followed_vessels and any(inputs.tables.get(kind) for kind in ("reaction", "precipitation"))


def _change_colour(
    declared: Declaration, findings: Findings, vessel: Vessel, times: FloatArray, celsius: FloatArray
) -> None:
    """The solid that is heated takes another colour when it is first so hot, and keeps it."""
    name, colour_before, colour_after = vessel.body.id, declared["from_colour"], declared["to_colour"]
    volume = vessel.amount("solid", "mass_g") / vessel.amount("solid", "density_g_ml", SOLID_G_ML)
    changed_rows = np.flatnonzero(celsius >= declared["turns_c"])[:1].tolist()
    rows = np.array([0, *changed_rows])
    liquid = vessel.liquid_to_draw(times[rows], np.full(len(rows), volume))
    findings.liquids[name] = replace(
        liquid, rgba=np.array([COLOURS[colour_before], COLOURS[colour_after]], dtype=np.uint8)[: len(rows)]
    )
    ends = [float(times[row]) for row in (0, *changed_rows, -1)]
    colours = (colour_before, colour_after)
    findings.add_lane(
        f"{name} colour",
        *(LaneSpan(start, end, word, COLOURS[word]) for start, end, word in zip(ends, ends[1:], colours, strict=False)),
    )
    for row in changed_rows:
        text = f"{vessel.contents('solid')['formula']} in {name} turns from {colour_before} to {colour_after}"
        values = {"celsius": float(celsius[row]), "to": colour_after}
        findings.events.append(EffectEvent(float(times[row]), "turned", (name,), None, values, text))


def _is_over_flame(inputs: EffectInputs, declared: Declaration) -> BoolArray:
    """(T,) whether the body's origin is above the flame's foot and near its axis; where not seen, as last seen."""
    lamp, dish = (inputs.poses(declared[key]).last_known() for key in ("source", "heats"))
    local = lamp.to_body_frame(dish.translation) - np.array(declared["base"])
    is_near_axis = np.hypot(local[:, 0], local[:, 2]) < declared["within"]
    is_above_foot = (local[:, 1] > 0.0) & (local[:, 1] <= declared["height"])
    return is_near_axis & is_above_foot & lamp.valid & dish.valid


def _capacity(body: SceneBody) -> float:
    value: Any = (body.extra.get("properties") or {}).get("heat_capacity_j_per_k")
    if not is_number(value) or not value > 0.0:
        raise EffectError(f"scene: body {body.id!r} has heat_capacity_j_per_k = {value!r}; give its m c in J/K")
    return float(value)


FIELDS: Final = {
    "flame": ("source", "heats", "within", "power_w", "base"),
    "liquid": ("heat_capacity_j_per_ml_k",),
    "turning solid": ("turns_c", "from_colour", "to_colour"),
}
"""Fields that describe one thing, all or none."""

KINDS: Final[Mapping[str, tuple[tuple[str, ...], str]]] = {
    "flame": (("flame",), "turning solid"),
    "liquids": ((), "liquid"),
}
"""Kind of heat -> what it needs, and what it may have besides."""


def compute(inputs: EffectInputs) -> EffectOutput:
    """Events ``heated``, ``boil``, ``wrong-order``; temperatures as series."""
    findings = Findings(len(inputs))
    for declared in inputs.declared:
        if declared["of"] == "flame":
            find_flame_heating(inputs, declared, findings)
        else:
            from replay.effects.heat_of_mixing import find_mixing_heat  # a flame alone loads no chemistry

            find_mixing_heat(inputs, declared, findings)
    return findings.output()


def _check(declared: Declaration, scene: Scene) -> None:
    kind = declared["of"]
    needed_things, optional_thing = KINDS[kind]
    for thing, keys in FIELDS.items():
        given = [key for key in keys if declared[key] is not None]
        if given and thing not in (*needed_things, optional_thing):
            raise declared.fail(f"{given[0]} belongs to heat of a {thing}, and this is of a {kind}; leave it out")
        missing = [key for key in keys if key not in given] if given or thing in needed_things else ()
        if missing:
            raise declared.fail(f"{missing[0]} is missing: heat of a {thing} needs {', '.join(keys)}")
    try:
        if kind == "flame":
            heats = scene.body(declared["heats"]) or SceneBody(declared["heats"])
            # What a liquid needs is told at once, its share of the capacity included.
            if (heats.extra.get("properties") or {}).get("liquid"):
                _check_liquid(declared, Vessel(heats))
            _capacity(heats)
            if declared["turns_c"] is not None:
                _check_solid(Vessel(heats))
    except EffectError as error:
        raise declared.fail(str(error).removeprefix("scene: ")) from error


def _check_liquid(declared: Declaration, vessel: Vessel) -> None:
    """Raises EffectError: a liquid stands over the flame at first, and nothing says when it boils."""
    if vessel.contents("liquid") and vessel.volume_ml > 0.0 and declared["boils_c"] is None:
        raise vessel.fail(
            "holds a liquid over a flame, which heats heat_capacity_j_per_k alone: count the liquid in it, 4.18 J/K "
            "for a mL of water, and give boils_c of this effect"
        )


def _check_solid(vessel: Vessel) -> None:
    """Raises EffectError: the vessel over the flame holds no solid that can change its colour."""
    formula = vessel.contents("solid").get("formula")
    if not formula or not isinstance(formula, str):
        raise vessel.fail("holds nothing that turns; give it properties.solid with its formula and mass_g")
    vessel.amount("solid", "mass_g")
    if vessel.amount("solid", "density_g_ml", SOLID_G_ML) <= 0.0:
        raise vessel.fail("has solid.density_g_ml = 0; give it in g/mL")


def _check_all(tables: Mapping[str, tuple[Declaration, ...]], _scene: Scene, _file: str) -> None:
    """Raises PlanError: a liquid may come over a flame later, and nothing says when it boils."""
    targets = {name for kind in ("pour", "burette") for table in tables.get(kind, ()) for name in table["into"]}
    for declared in tables.get("heat", ()):
        name = declared["heats"]
        if declared["of"] == "flame" and declared["boils_c"] is None and name in targets:
            raise declared.fail(
                f"a liquid may be poured into {name!r}, which a flame heats by its heat_capacity_j_per_k alone: count "
                "the liquid in it, 4.18 J/K for a mL of water, and give boils_c of this effect"
            )


SPEC = spec_of("heat", compute, check=_check, check_all=_check_all)
