"""The colour of a liquid: an indicator by the pH or by an ion, or an ion that has a colour of its own."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np

from replay import words
from replay.effects.chemistry.matter import Matter, matter_of
from replay.effects.colour_tables import INDICATORS, ION_COLOURS, coloured_species
from replay.effects.declaring import Declaration
from replay.effects.inputs import EffectInputs
from replay.effects.output import (
    COLOURS,
    EffectEvent,
    EffectOutput,
    Findings,
    FloatArray,
    LaneSpan,
    Series,
    blend_colours,
)
from replay.effects.protocol import spec_of
from replay.effects.spans import spans_of
from sessions.input_files import nearest
from sessions.model.scene import Scene

ABSENT_LOG10_MOLAR: Final = -30.0
"""log10 of mol/L that stands for none at all."""

FAINT_FRACTION: Final = 0.02
"""Of its full colour an ion's own is not seen: permanganate, full at 1e-4 mol/L, is pink from 2e-6 mol/L on.

Source: Vogel, Quantitative Chemical Analysis, 5th ed., 10.91 (0.01 mL of 0.02 mol/L in 100 mL).
"""

SLOW_CHANGE_S: Final = 0.5
"""Seconds from which a change of colour has a begin and an end that are told; chosen by us."""

OWN_INDICATOR_KEYS: Final = ("from_ph", "to_ph", "acid_colour", "base_colour")
"""Keys of an indicator of the author's own."""


@dataclass(frozen=True)
class Shade:
    """A change of colour: its quantity, its range and both colours."""

    name: str
    species: tuple[str, ...]  # ions whose concentration decides; none: the pH does
    start: float  # pH, log10 of mol/L, or mol/L of an ion's own colour
    stop: float
    colour_before: str
    colour_after: str


def shade_of(declared: Declaration) -> Shade:
    """The colour change that a table declares."""
    formula = declared["species"]
    if formula:
        ion = coloured_species(formula)
        colour, full = ION_COLOURS.get(ion, ("", 0.0))
        full = full if declared["full_mol_l"] is None else declared["full_mol_l"]
        return Shade(ion, (ion,), 0.0, full, "colourless", declared["colour"] or colour)
    name = declared["indicator"]
    indicator_row = {
        **INDICATORS.get(name, {}),
        **{key: declared[key] for key in OWN_INDICATOR_KEYS if declared[key] is not None},
    }
    by_ion = tuple(indicator_row.get("species", ()))
    start, stop = (
        (indicator_row["from_log"], indicator_row["to_log"])
        if by_ion
        else (indicator_row["from_ph"], indicator_row["to_ph"])
    )
    return Shade(name, by_ion, float(start), float(stop), indicator_row["acid_colour"], indicator_row["base_colour"])


def compute(inputs: EffectInputs) -> EffectOutput:
    """Event ``colour-change`` from entering the range to leaving it by the other side; colour in the glass."""
    findings = Findings(len(inputs))
    for declared in sorted(inputs.declared, key=lambda table: shade_of(table).name):
        shade, vessel = shade_of(declared), declared["in"]
        quantity = _measured_series(inputs, vessel, shade)
        if quantity is None or not len(quantity.times):
            inputs.count("vessels without a pH: nothing came in")
            continue
        fraction = np.clip((quantity.values - shade.start) / (shade.stop - shade.start), 0.0, 1.0)
        findings.ran |= np.isin(inputs.times, quantity.times)
        findings.series[f"{vessel}/{shade.name} colour"] = Series(quantity.times, fraction, "fraction")
        findings.events += _colour_changes(shade, vessel, quantity.times, fraction)
        lane_name = vessel if vessel not in findings.lanes else f"{vessel} {shade.name}"
        findings.lanes[lane_name] = _colour_lane(shade, quantity.times, fraction)
        mixed_liquid = findings.liquids.get(vessel) or inputs.output("mixing").liquids.get(vessel)
        if mixed_liquid is not None:
            rows = np.maximum(0, np.searchsorted(quantity.times, mixed_liquid.times, side="right") - 1)
            # What has no colour of its own lets that of another ion through.
            start_rgba = mixed_liquid.rgba if shade.colour_before == "colourless" else COLOURS[shade.colour_before]
            findings.liquids[vessel] = replace(
                mixed_liquid, rgba=blend_colours(start_rgba, COLOURS[shade.colour_after], fraction[rows])
            )
    return findings.output()


def _measured_series(inputs: EffectInputs, vessel: str, shade: Shade) -> Series | None:
    """The pH, the mol/L of an ion, or its logarithm for an indicator of it."""
    if not shade.species:
        return inputs.output("reaction").series.get(f"{vessel}/pH")
    matter = matter_of(inputs)
    times = matter.histories[vessel].times
    if matter.ledger.slow:
        times = np.union1d(times, inputs.times)
    concentration = np.sum([_molar(matter, vessel, ion, times) for ion in shade.species], axis=0)
    if shade.name in shade.species:
        return Series(times, concentration, "mol/L")
    with np.errstate(divide="ignore"):
        return Series(times, np.maximum(ABSENT_LOG10_MOLAR, np.log10(concentration)), "log")


def _molar(matter: Matter, vessel: str, ion: str, times: FloatArray) -> FloatArray:
    """mol/L (n,) of an ion at times: as PHREEQC says, else all there is of it."""
    amounts, _, volume_ml = matter.states(vessel, times)
    litres = np.where(volume_ml > 0.0, volume_ml * 1e-3, np.inf)
    row = None if matter.solver is None else matter.solver.mixture.row_of(ion)
    if row is not None:
        wet_rows, equilibria = matter.equilibria(vessel, times)
        moles = np.zeros(len(times))
        # Where PHREEQC finds no equilibrium the last one stands; before the first there is no colour.
        is_solved = ~np.isnan(equilibria.ph)
        last_known = np.maximum.accumulate(np.where(is_solved, np.arange(len(is_solved)), 0))
        moles[wet_rows] = np.where(is_solved[last_known], equilibria.species[last_known, row], 0.0)
        return moles / litres
    index = matter.ledger.column.get(ion)
    return np.zeros(len(times)) if index is None else amounts[:, index] / litres


def _colour_changes(shade: Shade, vessel: str, times: FloatArray, fraction: FloatArray) -> Iterator[EffectEvent]:
    """Passages through the range: from the last row at one end to the first at the other, which may not be reached."""
    least_fraction = FAINT_FRACTION if shade.name in shade.species else 0.0
    side = np.where(fraction <= least_fraction, -1, np.where(fraction >= 1.0, 1, 0))
    end_rows = np.flatnonzero(side).tolist()
    passages: list[tuple[int, int | None]] = [
        (row_before, row_after) for row_before, row_after in pairwise(end_rows) if side[row_before] != side[row_after]
    ]
    if end_rows and end_rows[-1] < len(side) - 1:
        passages.append((end_rows[-1], None))
    for row_before, row_after in passages:
        colour_before, colour_after = (
            (shade.colour_before, shade.colour_after)
            if side[row_before] < 0
            else (shade.colour_after, shade.colour_before)
        )
        message = f"{shade.name} in {vessel} turns from {colour_before} to {colour_after}"
        if shade.name in shade.species:
            verb = "appears" if side[row_before] < 0 else "pales" if row_after is None else "disappears"
            message = f"the colour of {shade.name} in {vessel} {verb}"
        start, end = float(times[row_before + 1]), None if row_after is None else float(times[row_after])
        if shade.name not in shade.species and end is None:
            message += ", not wholly by the end"
        elif shade.name not in shade.species and end is not None and end - start > SLOW_CHANGE_S:
            message += f", wholly at {words.moment(end)}"
        yield EffectEvent(start, "colour-change", (vessel,), end, {"to": colour_after}, message)


def _colour_lane(shade: Shade, times: FloatArray, fraction: FloatArray) -> list[LaneSpan]:
    start_rgba, end_rgba = COLOURS[shade.colour_before], COLOURS[shade.colour_after]
    middle_rgba = tuple(blend_colours(start_rgba, end_rgba, np.array([0.5]))[0].tolist())
    masks = (
        (fraction <= 0.0, shade.colour_before, start_rgba),
        ((fraction > 0.0) & (fraction < 1.0), f"{shade.colour_before} to {shade.colour_after}", middle_rgba),
        (fraction >= 1.0, shade.colour_after, end_rgba),
    )
    return [
        LaneSpan(float(times[first]), float(times[min(stop, len(times) - 1)]), colour_word, rgba)
        for mask, colour_word, rgba in masks
        for first, stop in spans_of(mask)
    ]


def _check_declaration(declared: Declaration, _scene: Scene) -> None:
    name, formula = declared["indicator"], declared["species"]
    if bool(name) == bool(formula):
        raise declared.fail("give indicator, by name, or species, an ion that has a colour")
    if formula:
        try:
            shade = shade_of(declared)
        except ValueError as error:
            raise declared.fail(f"species: {error}") from error
        given_keys = [key for key in OWN_INDICATOR_KEYS if declared[key] is not None]
        if given_keys:
            raise declared.fail(
                f"{given_keys[0]} belongs to an indicator, and this is the colour of {shade.name}; leave it out"
            )
        if not shade.colour_after:
            raise declared.fail(
                f"colour is missing: no table knows that of {shade.name!r}{nearest(shade.name, ION_COLOURS)}"
            )
        if not shade.stop > 0.0:
            raise declared.fail("full_mol_l is missing: the mol/L at which the colour is full")
        return
    is_unknown_indicator = name not in INDICATORS and any(declared[key] is None for key in OWN_INDICATOR_KEYS)
    if is_unknown_indicator:
        indicator_problem = f"indicator: no table knows {name!r}; one of your own has {', '.join(OWN_INDICATOR_KEYS)}"
        raise declared.fail(indicator_problem + nearest(name, INDICATORS))
    by_ph = [declared[key] for key in ("from_ph", "to_ph")]
    if INDICATORS.get(name, {}).get("species") and any(value is not None for value in by_ph):
        raise declared.fail(f"from_ph: {name} shows {', '.join(INDICATORS[name]['species'])} and no pH; leave it out")
    shade = shade_of(declared)
    if not shade.start < shade.stop:
        raise declared.fail("from_ph is not below to_ph; give the range in which the indicator changes, rising")


SPEC = spec_of("colour", compute, check=_check_declaration)
