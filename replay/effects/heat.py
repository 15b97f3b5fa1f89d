"""A flame heats what stands over it; liquids that are mixed warm and cool; water poured into acid is named."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

import numpy as np

from replay import words
from replay.effects.chemistry.warming import heating_curve
from replay.effects.declaring import Declaration
from replay.effects.flame import flame_power, flames_under_liquids, heat_of_ledger, spans_over_flame
from replay.effects.inputs import EffectInputs
from replay.effects.output import COLOURS, EffectEvent, EffectOutput, Findings, FloatArray, LaneSpan, Series
from replay.effects.protocol import spec_of
from replay.effects.temperatures import boils, note_temperature
from replay.effects.vessels import Vessel
from replay.errors import EffectError
from sessions.input_files import is_number
from sessions.model.scene import Scene, SceneBody

SOLID_G_ML: Final = 2.0
"""Of a solid whose density nobody states, for the picture only: most salts have 1.7 to 2.5."""


def find_flame_heating(inputs: EffectInputs, declared: Declaration, findings: Findings) -> None:
    """Find events ``heated`` and ``boil``, and the temperature from the first heat on."""
    name, lamp, times = declared["heats"], declared["source"], inputs.times
    spans = spans_over_flame(inputs, declared)
    first = spans[0][0] if spans else len(times)
    findings.ran[first:] = True
    is_in_ledger = declared in flames_under_liquids(inputs.tables)
    if is_in_ledger:
        from replay.effects.chemistry.matter import matter_of  # a flame alone loads no chemistry

        celsius = matter_of(inputs).celsius(name, times)
    else:
        celsius = heating_curve(
            times,
            flame_power(declared, spans, len(times)),
            capacity=_capacity(inputs.body(name)),
            loss=declared["loss_w_per_k"],
            ambient=declared["ambient_c"],
            boils=boils(declared),
        )
    findings.add_lane(name, *inputs.lane_spans(spans, "over the flame"))
    for span in spans:
        start, end = inputs.span_times(span)
        reached_c = float(celsius[min(span[1], len(times) - 1)])
        text, values = (
            f"{lamp} heats {name} to {words.decimal(reached_c, 0)} degC in {words.decimal(end - start, 1)} s",
            {"to_c": reached_c, "seconds": end - start},
        )
        findings.events.append(EffectEvent(start, "heated", (name, lamp), inputs.end(span[1]), values, text))
    if spans and declared["turns_c"] is not None:
        _change_colour(declared, findings, Vessel(inputs.body(name)), times, celsius)
    if not is_in_ledger:
        drawn_rows = [0, *range(max(1, first - 1), len(times))]
        note_temperature(findings, name, Series(times[drawn_rows], celsius[drawn_rows], "degC"), boils(declared))


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
    span_bounds = [float(times[row]) for row in (0, *changed_rows, -1)]
    colours = (colour_before, colour_after)
    findings.add_lane(
        f"{name} colour",
        *(
            LaneSpan(start, end, word, COLOURS[word])
            for start, end, word in zip(span_bounds, span_bounds[1:], colours, strict=False)
        ),
    )
    for row in changed_rows:
        message = f"{vessel.contents('solid')['formula']} in {name} turns from {colour_before} to {colour_after}"
        event_values = {"celsius": float(celsius[row]), "to": colour_after}
        findings.events.append(EffectEvent(float(times[row]), "turned", (name,), None, event_values, message))


def _capacity(body: SceneBody) -> float:
    heat_capacity: Any = (body.extra.get("properties") or {}).get("heat_capacity_j_per_k")
    if not is_number(heat_capacity) or not heat_capacity > 0.0:
        raise EffectError(f"scene: body {body.id!r} has heat_capacity_j_per_k = {heat_capacity!r}; give its m c in J/K")
    return float(heat_capacity)


FIELD_GROUPS: Final = {
    "flame": ("source", "heats", "within", "power_w", "base"),
    "liquid": ("heat_capacity_j_per_ml_k",),
    "turning solid": ("turns_c", "from_colour", "to_colour"),
}
"""Fields that describe one thing, all or none."""

HEAT_KINDS: Final[Mapping[str, tuple[tuple[str, ...], str]]] = {
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
    followed = heat_of_ledger(inputs.tables)
    if followed is not None:
        from replay.effects.heat_of_mixing import find_mixing_heat  # a flame alone loads no chemistry

        find_mixing_heat(inputs, followed, findings)
    return findings.output()


def _check_declaration(declared: Declaration, scene: Scene) -> None:
    kind = declared["of"]
    needed_things, optional_thing = HEAT_KINDS[kind]
    for thing, keys in FIELD_GROUPS.items():
        given_keys = [key for key in keys if declared[key] is not None]
        if given_keys and thing not in (*needed_things, optional_thing):
            raise declared.fail(f"{given_keys[0]} belongs to heat of a {thing}, and this is of a {kind}; leave it out")
        missing_keys = [key for key in keys if key not in given_keys] if given_keys or thing in needed_things else ()
        if missing_keys:
            raise declared.fail(f"{missing_keys[0]} is missing: heat of a {thing} needs {', '.join(keys)}")
    try:
        if kind == "flame" and declared["turns_c"] is not None:
            _check_solid(Vessel(_heated_body(declared, scene)))
    except EffectError as error:
        raise declared.fail(str(error).removeprefix("scene: ")) from error


def _check_solid(vessel: Vessel) -> None:
    """Raises EffectError: the vessel over the flame holds no solid that can change its colour."""
    formula = vessel.contents("solid").get("formula")
    if not formula or not isinstance(formula, str):
        raise vessel.fail("holds nothing that turns; give it properties.solid with its formula and mass_g")
    vessel.amount("solid", "mass_g")
    if vessel.amount("solid", "density_g_ml", SOLID_G_ML) <= 0.0:
        raise vessel.fail("has solid.density_g_ml = 0; give it in g/mL")


def _check_all(tables: Mapping[str, tuple[Declaration, ...]], scene: Scene, _file: str) -> None:
    """Raises PlanError: a flame heats what has no heat capacity, or a liquid of which nobody says how it boils."""
    targets = {name for kind in ("pour", "burette") for table in tables.get(kind, ()) for name in table["into"]}
    followed, in_ledger = heat_of_ledger(tables), flames_under_liquids(tables)
    for declared in tables.get("heat", ()):
        if declared["of"] != "flame":
            continue
        if declared in in_ledger:
            assert followed is not None
            if declared["ambient_c"] != followed["ambient_c"]:
                raise declared.fail(
                    f"ambient_c is {declared['ambient_c']:g} and {followed.table} says {followed['ambient_c']:g}; a "
                    "room has one temperature"
                )
            continue
        body = _heated_body(declared, scene)
        has_liquid = bool((body.extra.get("properties") or {}).get("liquid")) and Vessel(body).volume_ml > 0.0
        if declared["boils_c"] is None and (has_liquid or body.id in targets):
            verb = "holds a liquid" if has_liquid else "may receive a liquid"
            raise declared.fail(
                f'{body.id!r} {verb} over the flame: follow it by [[effect]] kind = "mixing", in = ["{body.id}"]; '
                "without that count the liquid in its heat_capacity_j_per_k, 4.18 J/K for a mL of water, and give "
                "boils_c of this effect"
            )
        try:
            _capacity(body)
        except EffectError as error:
            raise declared.fail(str(error).removeprefix("scene: ")) from error


def _heated_body(declared: Declaration, scene: Scene) -> SceneBody:
    return scene.body(declared["heats"]) or SceneBody(declared["heats"])


SPEC = spec_of("heat", compute, check=_check_declaration, check_all=_check_all)
