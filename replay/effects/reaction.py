"""What is mixed reacts: by constants to equilibrium, by an equation to its end, at once or at a rate; a pH shows it."""

from typing import Final

import numpy as np

from cdcore.numerics import BoolArray
from replay.effects.chemistry.components import METALS, PROTON, WATER, dissolved_parts
from replay.effects.chemistry.database import formula_of
from replay.effects.chemistry.formulas import charge_of, molar_mass
from replay.effects.chemistry.matter import MOST_FOREIGN_MOL_KG, Matter, matter_of
from replay.effects.chemistry.mixture import GAS, LIGANDS, SOLID, Mixture
from replay.effects.chemistry.recipe import Reaction, heavy_parts
from replay.effects.chemistry.unreacted import LEAST_FORMED, unreacted
from replay.effects.end_points import end_points
from replay.effects.inputs import EffectInputs
from replay.effects.output import EffectEvent, EffectOutput, Findings, FloatArray, LaneSpan, Series
from replay.effects.protocol import spec_of
from replay.words import quantity

LEAST_GAS: Final = 1e-6
"""mol of a gas that nobody sees: a bubble of 0.02 mL."""

LEAST_PH: Final = 0.05
"""A pH that ends nearer to its begin tells no result; a school's meter shows 0.1."""

DAVIES_MOL_KG: Final = 1.5
"""Ionic strength up to which PHREEQC's minteq.v4 is taken without a word; its activities (Davies) are fitted to 0.5."""

LEAST_TOLD: Final = 1e-4
"""Of a metal that a complex holds at some time: less is not told unless an equation names it."""


SETTLED_PH: Final = 0.01
"""A pH this near to its last value has come to its end."""


def compute(inputs: EffectInputs) -> EffectOutput:
    """Events ``end-point`` where acid and base, or oxidant and reductant, are equivalent, ``gas``, ``ph``, and others.

    ``no-reaction`` names an equation that made nothing, ``concentrated`` a solution beyond PHREEQC's activities.
    Series of pH, of ions that an equation names, of gas that left, and of the extent of what has no constant: at
    equilibrium no equation has its own.
    """
    matter, found = matter_of(inputs), Findings(len(inputs))
    reactions = matter.recipe.reactions
    formed = np.zeros(len(reactions), dtype=np.bool_)
    for vessel, history in matter.histories.items():
        mixed = bool(history.added_ml[-1].any())
        found.ran[history.frames[1:]] |= mixed
        for reaction in reactions:
            if reaction.process >= 0:
                _tell_extent(inputs, matter, reaction, vessel, found)
        if matter.solver is not None and mixed:
            moments = [_times(inputs, matter, one, vessel) for one in reactions]
            times = np.unique(np.concatenate(moments or [history.times]))
            formed |= _tell_solution(matter, vessel, times, found)
        _tell_gases(inputs, matter, vessel, found)
        _tell_solids(inputs, matter, vessel, found)
        found.events += _brines(matter, vessel)
        found.events += end_points(matter, vessel) or _changed_ph(vessel, found.series.get(f"{vessel}/pH"))
    found.events += unreacted(matter, formed)
    return found.output()


def _tell_solution(matter: Matter, vessel: str, times: FloatArray, found: Findings) -> BoolArray:
    """Series of pH and of the ions that equations make; which reactions made what they make, as (r,) bool."""
    assert matter.solver is not None
    mixture = matter.solver.mixture
    wet, solved = matter.solved(vessel, times)
    known = ~np.isnan(solved.ph)
    shown, rows = wet[known], np.flatnonzero(known)
    formed = np.zeros(len(matter.recipe.reactions), dtype=np.bool_)
    if not len(wet):
        return formed
    if len(rows):
        found.series[f"{vessel}/pH"] = Series(times[shown], solved.ph[rows], "pH")
    amounts, _, volume_ml = matter.states(vessel, times[wet])
    litres = volume_ml * 1e-3
    for name, row in _ions_to_tell(matter, mixture, solved.species[rows], amounts[rows]).items():
        values = solved.species[rows, row] / litres[rows]
        found.series[f"{vessel}/{name}"] = Series(times[shown], values, "mol/L")
    for number, reaction in enumerate(matter.recipe.reactions):
        for formula in reaction.equation.products:
            made = mixture.row_of(formula) if charge_of(formula) else None
            if made is None or reaction.process >= 0:
                continue
            scarcest = np.full(len(wet), np.inf)
            for part, many in heavy_parts(formula).items():
                scarcest = np.minimum(scarcest, amounts[:, matter.ledger.column[part]] / many)
            formed[number] |= bool((solved.species[:, made] > LEAST_FORMED * scarcest)[scarcest > 0.0].any())
    if not known.all():
        first = float(times[wet[~known][0]])
        moments = f"{int((~known).sum())} of {len(wet)} moments"
        words = f"PHREEQC finds no equilibrium in {vessel} at {moments}: no pH is given there"
        found.events.append(EffectEvent(first, "no-equilibrium", (vessel,), None, {}, words, "warning"))
    strong = np.flatnonzero(solved.ionic[rows] > DAVIES_MOL_KG)
    if len(strong):
        most = float(solved.ionic[rows].max())
        solids = _solids_at(matter, vessel, times[shown[strong]])
        doubtful = f", and of {' and '.join(solids)} twice as much or half may dissolve" if solids else ""
        words = (
            f"the solution in {vessel} is too concentrated for exact activities (ionic strength {most:.1f} mol/kg, "
            f"fitted up to 0.5): its pH may be off by some tenths{doubtful}"
        )
        values = {"ionic_strength_mol_kg": most}
        found.events.append(EffectEvent(float(times[shown[strong[0]]]), "concentrated", (vessel,), None, values, words))
    return formed


def _solids_at(matter: Matter, vessel: str, times: FloatArray) -> list[str]:
    """Solids of PHREEQC's that stand in a vessel at one of these times."""
    amounts = matter.states(vessel, times)[0]
    columns = [(matter.ledger.columns[place], place) for place in matter.ledger.phases.tolist()]
    return sorted(
        column.removesuffix(SOLID)
        for column, place in columns
        if column.endswith(SOLID) and (amounts[:, place] > 0.0).any()
    )


def _ions_to_tell(matter: Matter, mixture: Mixture, species: FloatArray, amounts: FloatArray) -> dict[str, int]:
    """Name -> row of the ions and molecules whose concentration is told.

    They are those that an equation or a vessel names, if they are complexes or weak acids and bases, and every complex
    of a metal with a ligand that holds a fraction of it worth telling.
    """
    found: dict[str, int] = {}
    equations = [formula for one in matter.recipe.reactions for formula in one.equation.formulas]
    brought = [formula for contents in matter.recipe.contents.values() for formula in contents.amounts]
    for formula in dict.fromkeys((*equations, *brought)):
        if formula != WATER:
            row = mixture.row_of(formula)
            heavy = heavy_parts(formula)
            complexed = bool(charge_of(formula)) and (len(heavy) > 1 or dissolved_parts(formula).get(PROTON, 0) < -1)
            weak = not charge_of(formula) and len(heavy) == 1 and not METALS & set(heavy)
            if row is not None and (complexed or weak):
                found[formula] = row
    told = set(found.values())
    for row, entry in enumerate(mixture.species):
        metals = [part for part in entry.makeup if part in METALS]
        if row in told or len(metals) != 1 or not set(entry.makeup) & LIGANDS or not len(species):
            continue
        whole = amounts[:, matter.ledger.column[metals[0]]]
        held = species[:, row] * entry.makeup[metals[0]]
        if (held > LEAST_TOLD * whole)[whole > 0.0].any() and held.max() > 0.0:
            found[formula_of(entry.name)] = row
    return found


def _tell_extent(inputs: EffectInputs, matter: Matter, reaction: Reaction, vessel: str, found: Findings) -> None:
    """How far an equation without a constant went in a vessel: a series, and a lane while it goes on."""
    times = _times(inputs, matter, reaction, vessel)
    extent = matter.states(vessel, times)[1][:, reaction.process]
    moving = np.flatnonzero(np.diff(extent, prepend=0.0))
    if len(moving):
        found.ran |= np.isin(inputs.times, times)
        equation = reaction.declared["equation"]
        # Named by the equation wherever there are several, so that no order of tables names one.
        which = f" of {equation}" if len(matter.recipe.reactions) > 1 else ""
        found.series[f"{vessel}/extent{which}"] = Series(times, extent, "mol")
        found.lane(vessel, LaneSpan(float(times[moving[0]]), float(times[moving[-1]]), equation))


def _tell_gases(inputs: EffectInputs, matter: Matter, vessel: str, found: Findings) -> None:
    """What left as a gas, wherever it went: an event from the first to the last of it, and its amount as a series."""
    times = inputs.times if matter.ledger.slow else matter.histories[vessel].times
    amounts = matter.states(vessel, times)[0]
    for column, place in matter.ledger.column.items():
        gone = np.maximum.accumulate(amounts[:, place] - amounts[0, place])
        if column.endswith(GAS) and gone[-1] > LEAST_GAS:
            gas, growing = column.removesuffix(GAS), np.flatnonzero(np.diff(gone, prepend=0.0))
            start, end = (float(times[row]) for row in growing[[0, -1]])
            words = f"{quantity(1e3 * gone[-1], 'mmol')} {gas} leave {vessel} as gas"
            found.series[f"{vessel}/{gas} gone"] = Series(times, gone, "mol")
            found.events.append(
                EffectEvent(start, "gas", (vessel,), end, {"moles": float(gone[-1]), "formula": gas}, words)
            )


def _tell_solids(inputs: EffectInputs, matter: Matter, vessel: str, found: Findings) -> None:
    """Mass of each solid at equilibrium that changes, where no effect precipitation follows it."""
    followed = {declared["solid"] for declared in inputs.tables.get("precipitation", ())}
    ledger = matter.ledger
    history, brines = matter.histories[vessel], matter.brines(vessel)
    for place in (*ledger.phases.tolist(), *ledger.salt_columns.tolist()):
        solid = ledger.columns[place].removesuffix(SOLID)
        amount = history.amounts[:, place]
        if ledger.columns[place] in brines:
            continue
        if ledger.columns[place].endswith(SOLID) and solid not in followed and np.ptp(amount) > 0.0:
            found.series[f"{vessel}/{solid}"] = Series(history.times, amount * molar_mass(solid), "g")


def _brines(matter: Matter, vessel: str) -> list[EffectEvent]:
    """Salts of which nothing says how much dissolves, because too many other ions are beside them."""
    events = []
    for column, time in matter.brines(vessel).items():
        solid = column.removesuffix(SOLID)
        text = (
            f"{solid} is in a brine in {vessel}, beside more than {MOST_FOREIGN_MOL_KG:g} mol/kg of other ions: how "
            "much of it dissolves there is not known (its table is of pure water), so that no mass of it is told"
        )
        values = {"formula": solid}
        events.append(EffectEvent(time, "brine", (vessel,), None, values, text, "warning"))
    return events


def _changed_ph(vessel: str, series: Series | None) -> list[EffectEvent]:
    """What became of a pH that has no end point, at its last change."""
    if series is None or not len(series.times) or abs(series.values[-1] - series.values[0]) < LEAST_PH:
        return []
    times, ph = series.times, series.values
    # While it cools it drifts on; what counts is when it had come near its last value.
    changes = np.flatnonzero(np.abs(ph - ph[-1]) > SETTLED_PH)
    values = {"from_ph": float(ph[0]), "to_ph": float(ph[-1])}
    words = f"the pH in {vessel} goes from {ph[0]:.2f} to {ph[-1]:.2f}"
    return [EffectEvent(float(times[changes[-1] + 1]), "ph", (vessel,), None, values, words)]


def _times(inputs: EffectInputs, matter: Matter, reaction: Reaction, vessel: str) -> FloatArray:
    """Where it is told: at every change, and in every frame from its begin on where it is slow."""
    history = matter.histories[vessel]
    if reaction.declared["rate_per_s"] is None or reaction.process < 0:
        return history.times
    on = (history.pending[:, reaction.process] > 0.0) | (history.extents[:, reaction.process] > 0.0)
    first = int(history.frames[int(np.argmax(on))]) if on.any() else len(inputs)
    return inputs.times[first:]


SPEC = spec_of("reaction", compute)
