"""A salt falls out as soon as its ion product exceeds its solubility product, and as much of it as evens the two."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

import numpy as np

from replay import words
from replay.effects.chemistry.formulas import molar_mass
from replay.effects.chemistry.matter import Matter, matter_of
from replay.effects.chemistry.mixture import SOLID
from replay.effects.colour_tables import SOLID_COLOURS
from replay.effects.declaring import Declaration
from replay.effects.inputs import EffectInputs
from replay.effects.output import (
    COLOURS,
    WATERY,
    EffectEvent,
    EffectOutput,
    Findings,
    FloatArray,
    Series,
    blend_colours,
)
from replay.effects.protocol import spec_of
from replay.words import quantity
from sessions.model.scene import Scene

CLOUDY_MOL_L: Final = 1e-3
"""Solid per litre that is drawn as fully cloudy; chosen by us, for the picture only."""

LEAST_G: Final = 1e-3
"""A precipitate of less before the first frame is not told: nobody sees it in the glass."""

HARDLY_DISSOLVED_FRACTION: Final = 1e-3
"""Of a solid that was brought: what dissolves of it is said, but nobody sees it."""

DISSOLVED_AGAIN_FRACTION: Final = 0.05
"""Share of the greatest mass of a precipitate from which on its dissolving is an event."""


def compute(inputs: EffectInputs) -> EffectOutput:
    """Events ``precipitate`` at its onset, ``dissolved``, mass as a series, and a cloudy liquid."""
    matter, mixed_liquids = matter_of(inputs), inputs.output("mixing").liquids
    findings = Findings(len(inputs))
    for declared in sorted(inputs.declared, key=lambda table: table["solid"]):
        solid = declared["solid"]
        for vessel, history in matter.histories.items():
            amount = matter.amount(vessel, solid + SOLID)
            initial = matter.recipe.contents[vessel].solids.get(solid, 0.0)
            is_untouched = not history.added_ml[-1].any() and not np.ptp(amount) and initial == amount[0]
            if is_untouched or solid + SOLID in matter.brines(vessel):
                continue
            findings.ran[history.frames] = True
            findings.series[f"{vessel}/{solid}"] = Series(history.times, amount * molar_mass(solid), "g")
            is_salt = solid + SOLID in {salt.column for salt in matter.recipe.salts}
            has_reading = is_salt and matter.ledger.warmth.followed
            celsius = matter.celsius(vessel, history.times) if has_reading else None
            findings.events += _solid_events(declared, vessel, history.times, amount, initial, celsius)
            if vessel in mixed_liquids:
                litres = np.where(history.volume_ml > 0.0, history.volume_ml * 1e-3, np.inf)
                cloud_rgba = blend_colours(WATERY, COLOURS[colour_of(declared)], amount / litres / CLOUDY_MOL_L)
                findings.liquids[vessel] = replace(mixed_liquids[vessel], rgba=cloud_rgba)
    findings.events += _absent_solids(inputs, matter)
    return findings.output()


def _absent_solids(inputs: EffectInputs, matter: Matter) -> Iterator[EffectEvent]:
    """An event ``no-precipitate`` for each declared solid that never stood in a vessel, unless a reaction says why."""
    reasons = [event.values["equation"] for event in inputs.output("reaction").events_named("no-reaction")]
    for declared in inputs.declared:
        solid = declared["solid"]
        amounts = {vessel: matter.amount(vessel, solid + SOLID) for vessel in matter.histories}
        is_brine = any(solid + SOLID in matter.brines(vessel) for vessel in matter.histories)
        if is_brine or any(amount.any() for amount in amounts.values()):
            continue
        if any(solid in str(equation) for equation in reasons):
            continue
        last_time = max((float(history.times[-1]) for history in matter.histories.values()), default=0.0)
        text = f"no {solid} falls out: the solutions never hold more of it than dissolves"
        yield EffectEvent(last_time, "no-precipitate", (), None, {"formula": solid}, text, "warning")


def _solid_events(
    declared: Declaration,
    vessel: str,
    times: FloatArray,
    amount: FloatArray,
    initial: float,
    celsius: FloatArray | None,
) -> Iterator[EffectEvent]:
    """Events of what falls out with its greatest mass, of what dissolves, and of what falls out after that.

    ``initial``: mol that the scene puts into the vessel; of that some may have dissolved before the first frame, or
    more have fallen out. ``celsius``: temperatures, of a salt whose solubility depends on them.
    """
    solid, per_mol = declared["solid"], molar_mass(declared["solid"])
    fallen_mol, standing = float(amount[0]) - initial, max(initial, float(amount[0]))
    growth_rows, fallen_rows = np.flatnonzero(amount > amount[0]), np.flatnonzero(np.diff(amount) < 0.0)
    if fallen_mol * per_mol > LEAST_G:
        values = {"mass_g": fallen_mol * per_mol, "moles": fallen_mol, "formula": solid}
        text = f"{quantity(fallen_mol * per_mol, 'g')} {solid} have fallen out in {vessel} before the recording begins"
        yield EffectEvent(float(times[0]), "precipitate", (vessel,), None, values, f"{text}, {colour_of(declared)}")
    if len(growth_rows):
        most = float(amount.max())
        values = {"mass_g": most * per_mol, "moles": most, "formula": solid}
        mass = quantity(values["mass_g"], "g")
        temperature_text = _note_celsius(values, celsius, int(growth_rows[0]))
        onset = f" at {temperature_text}" if temperature_text else ""
        text = f"{solid} falls out in {vessel}{onset}: up to {mass}, {colour_of(declared)}"
        yield EffectEvent(float(times[growth_rows[0]]), "precipitate", (vessel,), None, values, text)
        least = int(amount.argmax()) + int(amount[amount.argmax() :].argmin())
        gone, most_g = (most - float(amount[least])) * per_mol, most * per_mol
        if gone > DISSOLVED_AGAIN_FRACTION * most_g:
            values = {"mass_g": gone, "left_g": most_g - gone, "formula": solid}
            text = f"{quantity(gone, 'g')} of {quantity(most_g, 'g')} {solid} dissolve again in {vessel}"
            yield EffectEvent(float(times[least]), "dissolved", (vessel,), None, values, text)
            yield from _grown_again(declared, vessel, times, amount, celsius, first=least, total_mol=most)
    elif len(fallen_rows) or amount[0] < initial:
        falls_again = float(amount[-1] - amount.min()) > DISSOLVED_AGAIN_FRACTION * standing
        row = int(amount.argmin()) if falls_again else int(fallen_rows[-1]) + 1 if len(fallen_rows) else 0
        gone, at_first = (standing - float(amount[row])) * per_mol, standing * per_mol
        if fallen_mol > 0.0 and (gone <= DISSOLVED_AGAIN_FRACTION * at_first or at_first <= LEAST_G):
            return
        values = {"mass_g": gone, "left_g": at_first - gone, "formula": solid}
        text = f"{quantity(gone, 'g')} of {quantity(at_first, 'g')} {solid} dissolve in {vessel}"
        if gone < HARDLY_DISSOLVED_FRACTION * at_first:
            text = f"{solid} hardly dissolves in {vessel}: {quantity(gone, 'g')} of {quantity(at_first, 'g')}"
        if row > 0 and amount[row] == 0.0:
            row = int(np.flatnonzero(amount == 0.0)[0])
            temperature_text = _note_celsius(values, celsius, row)
            text += f", wholly at {temperature_text}" if temperature_text else ""
        yield EffectEvent(float(times[row]), "dissolved", (vessel,), None, values, text)
        yield from _grown_again(declared, vessel, times, amount, celsius, first=row, total_mol=standing)


def _grown_again(
    declared: Declaration,
    vessel: str,
    times: FloatArray,
    amount: FloatArray,
    celsius: FloatArray | None,
    *,
    first: int,
    total_mol: float,
) -> Iterator[EffectEvent]:
    """Event of what falls out again after a row, if it is a share of the whole, in mol, worth telling."""
    growth_mol = float(amount[-1] - amount[first])
    if growth_mol <= DISSOLVED_AGAIN_FRACTION * total_mol:
        return
    solid, mass_g = declared["solid"], growth_mol * molar_mass(declared["solid"])
    onset = first + int(np.flatnonzero(amount[first:] > amount[first])[0])
    values: dict[str, float | str] = {"mass_g": mass_g, "moles": growth_mol, "formula": solid}
    reading = _note_celsius(values, celsius, onset)
    beginning = f" from {reading} on" if reading else ""
    text = f"{quantity(mass_g, 'g')} {solid} fall out again in {vessel}{beginning}, {colour_of(declared)}"
    yield EffectEvent(float(times[onset]), "precipitate", (vessel,), None, values, text)


def _note_celsius(values: dict[str, float | str], celsius: FloatArray | None, row: int) -> str:
    """Temperature of a row as text, noted in an event's values too; ``""`` where no temperature matters."""
    if celsius is None:
        return ""
    values["celsius"] = float(celsius[row])
    return f"{words.decimal(float(celsius[row]), 1)} degC"


def colour_of(declared: Declaration) -> str:
    """The colour of a solid, as declared or as tables know it; ``""``: nobody knows."""
    return declared["colour"] or SOLID_COLOURS.get(declared["solid"], "")


def _check(declared: Declaration, _scene: Scene) -> None:
    if not colour_of(declared):
        raise declared.fail(
            f'colour is missing: no table knows that of {declared["solid"]}; give it, as in colour = "white"'
        )


SPEC = spec_of("precipitation", compute, check=_check)
