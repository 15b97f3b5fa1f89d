"""A salt falls out as soon as its ion product exceeds its solubility product, and as much of it as evens the two."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

import numpy as np

from replay.effects.chemistry.formulas import molar_mass
from replay.effects.chemistry.matter import matter_of
from replay.effects.chemistry.mixture import SOLID
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
    blended,
)
from replay.effects.protocol import spec_of
from replay.words import quantity

CLOUDY_MOL_L: Final = 1e-3
"""Solid per litre that is drawn as fully cloudy; chosen by us, for the picture only."""

DISSOLVED_AGAIN: Final = 0.05
"""Share of the greatest mass of a precipitate from which on its dissolving is an event."""


def compute(inputs: EffectInputs) -> EffectOutput:
    """Events ``precipitate`` at its onset, ``dissolved``, mass as a series, and a cloudy liquid."""
    matter, drawn = matter_of(inputs), inputs.output("mixing").liquids
    findings = Findings(len(inputs))
    for declared in sorted(inputs.declared, key=lambda table: table["solid"]):
        solid = declared["solid"]
        for vessel, history in matter.histories.items():
            amount = matter.amount(vessel, solid + SOLID)
            initial = matter.recipe.contents[vessel].solids.get(solid, 0.0)
            untouched = not history.added_ml[-1].any() and not np.ptp(amount) and initial == amount[0]
            if untouched or solid + SOLID in matter.brines(vessel):
                continue
            findings.ran[history.frames] = True
            findings.series[f"{vessel}/{solid}"] = Series(history.times, amount * molar_mass(solid), "g")
            findings.events += _events(declared, vessel, history.times, amount, initial)
            if vessel in drawn:
                litres = np.where(history.volume_ml > 0.0, history.volume_ml * 1e-3, np.inf)
                cloud = blended(WATERY, COLOURS[declared["colour"]], amount / litres / CLOUDY_MOL_L)
                findings.liquids[vessel] = replace(drawn[vessel], rgba=cloud)
    return findings.output()


def _events(
    declared: Declaration, vessel: str, times: FloatArray, amount: FloatArray, initial: float
) -> Iterator[EffectEvent]:
    """Events of its onset with the greatest mass and of what dissolves after that, or of what dissolves at first.

    ``initial``: mol that the scene puts into the vessel; some of it may have dissolved before the first frame.
    """
    solid, per_mol = declared["solid"], molar_mass(declared["solid"])
    grown, fallen = np.flatnonzero(amount > amount[0]), np.flatnonzero(np.diff(amount) < 0.0)
    if len(grown):
        most = float(amount.max())
        values = {"mass_g": most * per_mol, "moles": most, "formula": solid}
        mass = quantity(values["mass_g"], "g")
        text = f"{solid} falls out in {vessel}: up to {mass}, {declared['colour']}"
        yield EffectEvent(float(times[grown[0]]), "precipitate", (vessel,), None, values, text)
        least = int(amount.argmax()) + int(amount[amount.argmax() :].argmin())
        gone, most_g = (most - float(amount[least])) * per_mol, most * per_mol
        if gone > DISSOLVED_AGAIN * most_g:
            values = {"mass_g": gone, "left_g": most_g - gone, "formula": solid}
            text = f"{quantity(gone, 'g')} of {quantity(most_g, 'g')} {solid} dissolve again in {vessel}"
            yield EffectEvent(float(times[least]), "dissolved", (vessel,), None, values, text)
    elif len(fallen) or amount[0] < initial:
        row = fallen[-1] + 1 if len(fallen) else 0
        gone, at_first = (initial - float(amount[-1])) * per_mol, initial * per_mol
        values = {"mass_g": gone, "left_g": at_first - gone, "formula": solid}
        text = f"{quantity(gone, 'g')} of {quantity(at_first, 'g')} {solid} dissolve in {vessel}"
        yield EffectEvent(float(times[row]), "dissolved", (vessel,), None, values, text)


SPEC = spec_of("precipitation", compute)
