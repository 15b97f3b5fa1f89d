"""The heat of liquids that come together, from the ledger: of dilution and reaction; the wrong order is named."""

import numpy as np

from replay import words
from replay.effects.chemistry.components import PROTON, WATER, dissolved_components
from replay.effects.chemistry.formulas import atoms, charge_of, molar_mass
from replay.effects.chemistry.ledger_columns import ADDED_SUFFIX, HEAT_COLUMN, LATENT_HEAT_COLUMN
from replay.effects.chemistry.matter import Matter, matter_of
from replay.effects.chemistry.mixture import SOLID
from replay.effects.declaring import Declaration
from replay.effects.inputs import EffectInputs
from replay.effects.models.outflow import flows
from replay.effects.movement import movement_of
from replay.effects.output import EffectEvent, Findings, FloatArray, LaneSpan, Series, vector_of
from replay.effects.temperatures import liquid_boils, note_temperature
from replay.words import quantity

LEAST_ML = 0.05
"""What is less in one go, about a drop, is no mistake of order; chosen by us."""

STRONG_MOL_ML = 5e-3
"""An acid of less is no strong one: a quarter of sulfuric acid by mass; chosen by us."""

BOILING_TOLERANCE_K = 1e-9
"""Kelvin below the boiling point that are none."""

LEAST_GRAM = 1e-3
"""Of a solid whose heat nobody measures."""

DILUTE_MOLAL = 2.0
"""mol/kg of a molecule, such as urea, from which its heat may differ much from a dilute one's; chosen by us."""

LEAST_KELVIN = 0.05
"""A vessel whose temperature changes by less tells no result; a school's thermometer shows 0.1."""


def find_mixing_heat(inputs: EffectInputs, declared: Declaration, findings: Findings) -> None:
    """Find events ``warmest``, ``coldest``, ``wrong-order`` and ``boil``, and the temperature of every vessel."""
    matter = matter_of(inputs)
    for event in _wrong_order_events(inputs, matter):
        findings.events.append(event)
        findings.add_lane(event.bodies[-1], LaneSpan(event.time, event.end or event.time, "water into acid"))
    for name, history in matter.histories.items():
        findings.events += [
            *_early_dissolution_events(name, matter),
            *_strong_solution_events(name, matter),
            *_estimated_capacity_events(name, matter),
        ]
        changed_rows = np.flatnonzero(np.diff(history.volume_ml, prepend=history.volume_ml[0]))
        is_over_flame = name in matter.ledger.warmth.flames
        if not (len(changed_rows) or is_over_flame or matter.amount(name, HEAT_COLUMN).any()):
            continue
        first = int(history.frames[changed_rows[0]]) if len(changed_rows) else 0
        if not is_over_flame:
            findings.ran[first:] = True
        # What is warmer or colder than the room, or over a flame, changes before anything comes in.
        first_moving_frame = 1 if is_over_flame or matter.amount(name, HEAT_COLUMN)[0] else max(1, first - 1)
        times = inputs.times[[0, *range(first_moving_frame, len(inputs))]]
        celsius = declared["ambient_c"] + matter.kelvin(name, times)
        # What boils is told so, whatever its heat over its capacity is rounded to.
        rows = history.rows(times)
        volume_ml = history.volume_ml[rows]
        boils_c = liquid_boils(declared)
        celsius[(celsius > boils_c - BOILING_TOLERANCE_K) & (volume_ml > 0.0)] = boils_c
        # The first drops on a dry solid have no temperature of their own.
        mixed_rows = matter.is_mixed(name, times, volume_ml)
        # An emptied vessel has no temperature, unless glass or solids keep one.
        keeps_heat = matter.ledger.capacity(matter.ledger.at[name], volume_ml, history.amounts[rows]) > 0.0
        mixed_rows &= keeps_heat | ~np.maximum.accumulate(keeps_heat)
        series = Series(times[mixed_rows], celsius[mixed_rows], "degC")
        note_temperature(findings, name, series, boils_c, volume_ml[mixed_rows] > 0.0)
        if not _drifts_alone(name, matter):
            findings.events += _extreme_events(name, times[mixed_rows], celsius[mixed_rows])
        findings.events += _freezing_events(name, matter, declared["ambient_c"])


def _drifts_alone(name: str, matter: Matter) -> bool:
    """Whether a vessel comes nearer to the room and no more, while another one is poured into."""
    history, flames = matter.histories[name], matter.ledger.flames
    has_no_inflow = not history.added_ml[-1].any() and matter.ledger.at[name] not in flames
    has_reacted = bool((history.extents[-1] > history.extents[0]).any())
    return has_no_inflow and not has_reacted and not matter.is_still


def _early_dissolution_events(name: str, matter: Matter) -> list[EffectEvent]:
    """Events of solids that stand in a liquid from the start: the heat of their dissolving is not seen."""
    events = []
    for solid, initial in matter.recipe.contents[name].solids.items():
        mass = (initial - float(matter.amount(name, solid + SOLID)[0])) * molar_mass(solid)
        if mass > LEAST_GRAM:
            is_oxide = {"O"} < set(atoms(solid)) and len(atoms(solid)) == 2 and PROTON in dissolved_components(solid)
            verb = "react with the water in" if is_oxide else "dissolve in"
            message = (
                f"{quantity(mass, 'g')} {solid} {verb} {name} before the recording begins, and the heat of it is not "
                "counted: pour the liquid onto the solid, or give the equation of it a rate_per_s"
            )
            event_values: dict[str, float | str] = {"formula": solid, "mass_g": mass}
            time = float(matter.histories[name].times[0])
            events.append(EffectEvent(time, "dissolved-before", (name,), None, event_values, message, "warning"))
    return events


def _strong_solution_events(name: str, matter: Matter) -> list[EffectEvent]:
    """Event of a strong solution whose heat no table has: it is counted as that of a dilute one."""
    history, ledger = matter.histories[name], matter.ledger
    rows = np.flatnonzero(matter.is_mixed(name, history.times, history.volume_ml) & (history.volume_ml > 0.0))
    species = np.zeros((len(rows), 0))
    if matter.solver is not None and len(rows):
        wet_rows, equilibria = matter.equilibria(name, history.times[rows])
        rows, species = rows[wet_rows], equilibria.species
    amounts = history.amounts[rows]
    if not len(rows) or ledger.heats.content is None:
        return []
    kilograms = ledger.heats.water_kg(amounts)
    moles = ledger.heats.content.moles(amounts, species, ledger.proton)
    molal, ions = ledger.heats.content.unknown(moles, kilograms)
    for salt in matter.recipe.salts:
        if all(charge_of(column) == 0 for column in salt.components) and salt.formula not in ledger.warmth.declared:
            (component,) = (column for column in salt.components if column != WATER)
            dissolved = amounts[:, ledger.column[component]] / kilograms
            is_stronger = dissolved > np.maximum(molal, DILUTE_MOLAL)
            molal = np.where(is_stronger, dissolved, molal)
            ions = [salt.formula if mine else other for mine, other in zip(is_stronger.tolist(), ions, strict=True)]
    if not molal.any():
        return []
    row = int(np.argmax(molal))
    message = (
        f"no table has the heat of so strong a solution of {ions[row]} as {quantity(float(molal[row]), 'mol/kg')} in "
        f"{name}: it is taken for that of a dilute one, and the change of temperature may be off by a half"
    )
    event_values: dict[str, float | str] = {"ions": ions[row], "mol_kg": float(molal[row])}
    first_time = float(history.times[rows[np.flatnonzero(molal)[0]]])
    return [EffectEvent(first_time, "strong", (name,), None, event_values, message, "warning")]


def _estimated_capacity_events(name: str, matter: Matter) -> list[EffectEvent]:
    """Event of a strong solution whose heat capacity no table has: it is that of its water and its solutes."""
    history = matter.histories[name]
    rows = np.flatnonzero(
        matter.is_mixed(name, history.times, history.volume_ml)
        & (history.volume_ml > 0.0)
        & matter.ledger.heats.is_estimated(history.amounts)
    )
    if not len(rows):
        return []
    message = (
        f"the heat capacity of the strong solution in {name} is estimated from its water and what is dissolved: a "
        "change of its temperature may be off by a tenth, in strong acids by a fifth; a measured one is given as "
        "heat_capacity_j_per_ml_k"
    )
    return [EffectEvent(float(history.times[rows[0]]), "estimated", (name,), None, {}, message)]


def _freezing_events(name: str, matter: Matter, room_celsius: float) -> list[EffectEvent]:
    """Event of a solution that reaches its freezing point: it gets no colder while ice is there."""
    history = matter.histories[name]
    is_frozen = (matter.amount(name, LATENT_HEAT_COLUMN) < 0.0) & matter.is_mixed(
        name, history.times, history.volume_ml
    )
    rows = np.flatnonzero(is_frozen)[:1]
    events = []
    for row in rows.tolist():
        celsius = room_celsius + float(matter.kelvin(name, history.times[row : row + 1])[0])
        point = f"{name} reaches its freezing point, {words.decimal(celsius, 1)} degC"
        message = f"{point}: it gets no colder, how much ice forms is not computed"
        event_values = {"celsius": celsius}
        events.append(EffectEvent(float(history.times[row]), "freeze", (name,), None, event_values, message, "warning"))
    return events


def _extreme_events(name: str, times: FloatArray, celsius: FloatArray) -> list[EffectEvent]:
    """The warmest and the coldest that a vessel gets after its start: what calorimetry reads."""
    events = []
    for word, row, extreme_sign in (
        ("warmest", int(np.argmax(celsius)), 1.0),
        ("coldest", int(np.argmin(celsius)), -1.0),
    ):
        temperature_change = float(celsius[row] - celsius[0])
        if extreme_sign * temperature_change > LEAST_KELVIN:
            verb = "warms" if extreme_sign > 0.0 else "cools"
            message = f"{name} {verb} from {words.decimal(celsius[0], 2)} to {words.decimal(celsius[row], 2)} degC"
            event_values = {"from_c": float(celsius[0]), "to_c": float(celsius[row]), "change_k": temperature_change}
            events.append(EffectEvent(float(times[row]), word, (name,), None, event_values, message))
    return events


def _wrong_order_events(inputs: EffectInputs, matter: Matter) -> list[EffectEvent]:
    """Events of a weaker sulfuric acid, or water, poured into a strong one."""
    streams = []
    acid = matter.ledger.warmth.solute
    if not acid:
        return []
    for stream in movement_of(inputs).streams:
        if stream.target:
            source, target = (_molar(matter, acid, name, stream.times) for name in (stream.source, stream.target))
            streams.append(stream.select(np.flatnonzero((target > source) & (target > STRONG_MOL_ML))))
    events = []
    for flow in flows(streams, LEAST_ML):
        amount, acid_name = words.decimal(flow.total_ml, 1), acid.removesuffix(ADDED_SUFFIX)
        message = f"{amount} mL from {flow.source} are poured into {acid_name} in {flow.target}"
        end_time, event_values = float(flow.times[-1]), {"volume_ml": flow.total_ml}
        events.append(
            EffectEvent(
                float(flow.times[0]),
                "wrong-order",
                (flow.source, flow.target),
                end_time,
                event_values,
                f"{message}: acid goes into water",
                "error",
                vector_of(flow.points[0]),
            )
        )
    return events


def _molar(matter: Matter, acid: str, vessel: str, times: FloatArray) -> FloatArray:
    """mol/mL (n,) of the acid in a vessel just before each time; 0 where it is empty."""
    history = matter.histories[vessel]
    rows = np.maximum(0, np.searchsorted(history.times, times) - 1)
    volume = history.volume_ml[rows]
    return matter.amount(vessel, acid)[rows] / np.where(volume > 0.0, volume, np.inf)
