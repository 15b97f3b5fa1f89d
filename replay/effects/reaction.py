"""Reactions of mixed liquids: by constants to equilibrium, by an equation to its end, at once or at a rate."""

from typing import Final

import numpy as np

from cdcore.numerics import BoolArray
from replay import words
from replay.effects.chemistry.assumed import assumption_events
from replay.effects.chemistry.before_start import reacted_before
from replay.effects.chemistry.components import METALS, PROTON, WATER, dissolved_components, solute_components
from replay.effects.chemistry.contents import MOST_DISSOLVED_MOLAR
from replay.effects.chemistry.database import formula_of
from replay.effects.chemistry.equilibrium_extent import GAS_J_MOL_K
from replay.effects.chemistry.formulas import charge_of, molar_mass
from replay.effects.chemistry.matter import MOST_FOREIGN_MOL_KG, Matter, matter_of
from replay.effects.chemistry.mixture import GAS, LIGANDS, SOLID, Mixture
from replay.effects.chemistry.reacted import reacted_events, solid_events
from replay.effects.chemistry.recipe import Reaction
from replay.effects.chemistry.redox import ZERO_C_KELVIN
from replay.effects.chemistry.salts import WATER_KG
from replay.effects.chemistry.solver import Solver, has_answer
from replay.effects.chemistry.supersaturated import aged_hydroxide_events, supersaturation_events
from replay.effects.chemistry.unreacted import LEAST_FORMED_FRACTION, no_reaction_events, stop_events
from replay.effects.end_points import end_points, ion_end_points
from replay.effects.inputs import EffectInputs
from replay.effects.output import EffectEvent, EffectOutput, Findings, FloatArray, LaneSpan, Series
from replay.effects.protocol import spec_of
from replay.effects.titrated_quantities import titrated_quantities
from replay.words import quantity

LEAST_GAS_MOL: Final = 1e-6
"""mol of a gas that nobody sees: a bubble of 0.02 mL."""

ATMOSPHERE_PA: Final = 101325.0
"""Pressure at which the volume of a gas is said."""

LEAST_GAS_FRACTION: Final = 0.05
"""Of a gas that left: less that could stay dissolved is not worth a word."""

LEAST_PH_CHANGE: Final = 0.05
"""A pH that ends nearer to its begin tells no result; a school's meter shows 0.1."""

EXACT_MOL_KG: Final = 1.0
VERY_STRONG_MOL_KG: Final = 5.0
"""Ionic strength up to which activities are taken without a word, and from which a pH may be off by more than tenths.

PHREEQC's data bases differ by up to 0.6 at 1 mol/kg of 25 salts, and by 1.2 at 3 mol/kg of calcium chloride, of ionic
strength 9 (tests/replay/effects/chemistry/test_strong_solutions.py).
"""

DOUBLED_SATURATION_INDEX: Final = 0.6
"""Saturation index at which a solution of a salt of two ions holds twice what it does at saturation."""

UNCERTAIN_FACTOR: Final = 1.2
"""By which more must dissolve at that index, for what dissolves to hang on the activities."""

EXAMINED_ROWS: Final = 8
"""Strong solutions of a vessel that are examined for such solids, evenly over its history."""

LEAST_REPORTED_FRACTION: Final = 1e-4
"""Of a metal that a complex holds at some time: less is not told unless an equation names it."""


STRONG_MOL_KG: Final = 6.0
"""Of one ion: beyond it PHREEQC's activities often have no answer."""

SETTLED_PH: Final = 0.01
"""A pH this near to its last value has come to its end."""


def compute(inputs: EffectInputs) -> EffectOutput:
    """Events ``end-point`` where acid and base, or oxidant and reductant, are equivalent, ``gas``, ``ph``, and others.

    ``before`` tells what reacted before the first frame, ``reacted`` an equation that no other event tells,
    ``no-reaction`` one that made nothing,
    ``concentrated`` a solution beyond PHREEQC's activities.
    Series of pH, redox potential and free metal, of ions that an equation names, of gas that left, and of the extent of
    what has no constant: at equilibrium no equation has its own.
    """
    matter, findings = matter_of(inputs), Findings(len(inputs))
    reactions = matter.recipe.reactions
    has_formed = np.zeros(len(reactions), dtype=np.bool_)
    for vessel, history in matter.histories.items():
        has_inflow = bool(history.added_ml[-1].any())
        findings.ran[history.frames[1:]] |= has_inflow
        for reaction in reactions:
            if reaction.process >= 0:
                _add_extent(inputs, matter, reaction, vessel, findings)
        if matter.solver is not None and (has_inflow or matter.is_still):
            moments = [_times(inputs, matter, reaction, vessel) for reaction in reactions]
            times = np.unique(np.concatenate([history.times, *moments]))
            has_formed |= _add_solution(matter, vessel, times, findings)
        if has_inflow:
            findings.series.update(titrated_quantities(matter, vessel))
        _add_gases(inputs, matter, vessel, findings)
        _add_solids(inputs, matter, vessel, findings)
        findings.events += _brines(matter, vessel)
        findings.events += ion_end_points(matter, vessel)
        points = end_points(matter, vessel)
        findings.events += points
        # A titration that was not ended still tells where its pH has come to.
        if not any(point.name == "end-point" for point in points):
            series = findings.series.get(f"{vessel}/pH")
            changes = _changed_ph(vessel, series)
            findings.events += changes or (_standing_ph(vessel, series) if matter.is_still else [])
    followed_solids = {table["solid"] for table in inputs.tables.get("precipitation", ())}
    findings.events += reacted_before(matter, followed_solids)
    findings.events += no_reaction_events(matter, has_formed)
    findings.events += stop_events(matter)
    findings.events += reacted_events(matter, followed_solids, findings.events)
    findings.events += solid_events(matter, followed_solids)
    findings.events += supersaturation_events(matter)
    findings.events += aged_hydroxide_events(matter)
    findings.events += assumption_events(matter)
    return findings.output()


def _add_solution(matter: Matter, vessel: str, times: FloatArray, findings: Findings) -> BoolArray:
    """Series of pH and of the ions that equations make; which reactions made what they make, as (r,) bool."""
    assert matter.solver is not None
    mixture = matter.solver.mixture
    wet, equilibria = matter.equilibria(vessel, times)
    is_answered = has_answer(equilibria)
    known_times, rows = wet[is_answered], np.flatnonzero(is_answered)
    has_formed = np.zeros(len(matter.recipe.reactions), dtype=np.bool_)
    if not len(wet):
        return has_formed
    if len(rows):
        findings.series[f"{vessel}/pH"] = Series(times[known_times], equilibria.ph[rows], "pH")
    amounts, _, volume_ml = matter.states(vessel, times[wet])
    litres = volume_ml * 1e-3
    for name, row in _reported_ions(matter, mixture, equilibria.species[rows], amounts[rows]).items():
        values = equilibria.species[rows, row] / litres[rows]
        findings.series[f"{vessel}/{name}"] = Series(times[known_times], values, "mol/L")
    for number, reaction in enumerate(matter.recipe.reactions):
        for formula in reaction.equation.products:
            made = _complexes(mixture, formula) if charge_of(formula) else []
            if not made or reaction.process >= 0:
                continue
            scarcest = np.full(len(wet), np.inf)
            for component, many in solute_components(formula).items():
                scarcest = np.minimum(scarcest, amounts[:, matter.ledger.column[component]] / many)
            moles = equilibria.species[:, made].sum(axis=1)
            has_formed[number] |= bool((moles > LEAST_FORMED_FRACTION * scarcest)[scarcest > 0.0].any())
    if not is_answered.all():
        first = float(times[wet[~is_answered][0]])
        moments = f"{int((~is_answered).sum())} of {len(wet)} moments"
        kilograms = np.maximum(amounts[~is_answered, matter.ledger.water] * WATER_KG, 1e-300)
        molal = float((np.abs(matter.totals(amounts[~is_answered])).max(axis=1) / kilograms).max())
        text = f"no pH is given in {vessel} at {moments}, and solids stay there as they were: PHREEQC has no answer"
        if molal > STRONG_MOL_KG:
            text += f" for so strong a solution ({quantity(molal, 'mol/kg')}); a weaker one has a pH"
        else:
            text += " there; the pH before and after holds"
        findings.events.append(EffectEvent(first, "no-equilibrium", (vessel,), None, {}, text, "warning"))
    mixed = matter.is_mixed(vessel, times[wet], volume_ml)[rows]
    strong = np.flatnonzero((equilibria.ionic[rows] > EXACT_MOL_KG) & mixed)
    if len(strong):
        most = float(equilibria.ionic[rows[strong]].max())
        solids = _uncertain_solids(matter, vessel, times[known_times[strong]])
        solid_note = f", and of {' and '.join(solids)} twice as much or half may dissolve" if solids else ""
        ph_note = "by 1 or more" if most > VERY_STRONG_MOL_KG else "by some tenths"
        text = (
            f"the solution in {vessel} is too concentrated for exact activities "
            f"(ionic strength {words.decimal(most, 1)} mol/kg, fitted up to 0.5): its pH may be off "
            f"{ph_note}{solid_note}"
        )
        values = {"ionic_strength_mol_kg": most}
        findings.events.append(
            EffectEvent(float(times[known_times[strong[0]]]), "concentrated", (vessel,), None, values, text)
        )
    return has_formed


def _complexes(mixture: Mixture, formula: str) -> list[int]:
    """Rows of a complex, and of those of the same ions that more of its ligand makes of it: FeF3 of FeF^2+."""
    solutes = set(solute_components(formula))
    row = mixture.row_of(formula)
    if row is None or len(solutes) == 1:
        return [] if row is None else [row]
    return [k for k, entry in enumerate(mixture.species) if set(entry.makeup) - {PROTON, WATER} == solutes]


def _uncertain_solids(matter: Matter, vessel: str, times: FloatArray) -> list[str]:
    """Solids of PHREEQC's in a vessel of which twice as much would dissolve if their solution held twice as much.

    Of marble in acid the acid decides how much dissolves, whatever its product of solubility is.
    """
    assert matter.solver is not None
    ledger = matter.ledger
    times = times[np.unique(np.linspace(0, len(times) - 1, EXAMINED_ROWS).astype(np.int64))]
    amounts = matter.states(vessel, times)[0]
    columns = [
        (row, index)
        for row, index in enumerate(ledger.reactions.phases.tolist())
        if not ledger.reactions.gas[row] and (amounts[:, index] > 0.0).any()
    ]
    if not columns:
        return []
    solver = Solver(matter.solver.mixture, DOUBLED_SATURATION_INDEX)
    totals, water = matter.totals(amounts), amounts[:, ledger.water]
    equilibria = solver.equilibrium(totals, water, matter.celsius(vessel, times))
    uncertain_solids = []
    for row, index in columns:
        ions = [k for k, many in enumerate(matter.solver.mixture.uses[row]) if many > 0.0 and k > 0]
        most = np.min([totals[:, k] / matter.solver.mixture.uses[row, k] for k in ions], axis=0)
        dissolved, dissolved_beyond = most - amounts[:, index], most - equilibria.phases[:, row]
        is_uncertain = (amounts[:, index] > 0.0) & (dissolved_beyond > UNCERTAIN_FACTOR * dissolved)
        if (is_uncertain & has_answer(equilibria)).any():
            uncertain_solids.append(ledger.columns[index].removesuffix(SOLID))
    return sorted(uncertain_solids)


def _reported_ions(matter: Matter, mixture: Mixture, species: FloatArray, amounts: FloatArray) -> dict[str, int]:
    """Name -> row of the ions and molecules whose concentration is reported.

    They are those that an equation or a vessel names, if they are complexes or weak acids and bases, and every complex
    of a metal with a ligand that holds more than a trace of it.
    """
    rows_by_name: dict[str, int] = {}
    equations = [formula for reaction in matter.recipe.reactions for formula in reaction.equation.formulas]
    brought = [formula for contents in matter.recipe.contents.values() for formula in contents.amounts]
    for formula in dict.fromkeys((*equations, *brought)):
        if formula != WATER:
            row = mixture.row_of(formula)
            solutes = solute_components(formula)
            complexed = bool(charge_of(formula)) and (
                len(solutes) > 1 or dissolved_components(formula).get(PROTON, 0) < -1
            )
            weak = not charge_of(formula) and len(solutes) == 1 and not METALS & set(solutes)
            if row is not None and (complexed or weak):
                rows_by_name[formula] = row
    rows_reported = set(rows_by_name.values())
    for row, entry in enumerate(mixture.species):
        metals = [component for component in entry.makeup if component in METALS]
        if row in rows_reported or len(metals) != 1 or not set(entry.makeup) & LIGANDS or not len(species):
            continue
        whole = amounts[:, matter.ledger.column[metals[0]]]
        bound = species[:, row] * entry.makeup[metals[0]]
        if (bound > LEAST_REPORTED_FRACTION * whole)[whole > 0.0].any() and bound.max() > 0.0:
            rows_by_name[formula_of(entry.name)] = row
    return rows_by_name


def _add_extent(inputs: EffectInputs, matter: Matter, reaction: Reaction, vessel: str, findings: Findings) -> None:
    """How far an equation without a constant went in a vessel: a series, and a lane while it goes on."""
    times = _times(inputs, matter, reaction, vessel)
    extent = matter.states(vessel, times)[1][:, reaction.process]
    moving_rows = np.flatnonzero(np.diff(extent, prepend=0.0))
    if len(moving_rows):
        findings.ran |= np.isin(inputs.times, times)
        equation = reaction.declared["equation"]
        # Named by the equation wherever there are several, so that no order of tables names one.
        equation_note = f" of {equation}" if len(matter.recipe.reactions) > 1 else ""
        findings.series[f"{vessel}/extent{equation_note}"] = Series(times, extent, "mol")
        findings.add_lane(vessel, LaneSpan(float(times[moving_rows[0]]), float(times[moving_rows[-1]]), equation))


def _add_gases(inputs: EffectInputs, matter: Matter, vessel: str, findings: Findings) -> None:
    """Adds gas that left, wherever it went: an event from the first to the last of it, and its amount as a series."""
    times = inputs.times if matter.ledger.slow else matter.histories[vessel].times
    amounts = matter.states(vessel, times)[0]
    for column, index in matter.ledger.column.items():
        gone = np.maximum.accumulate(amounts[:, index] - amounts[0, index])
        if column.endswith(GAS) and gone[-1] > LEAST_GAS_MOL:
            gas, growing = column.removesuffix(GAS), np.flatnonzero(np.diff(gone, prepend=0.0))
            start, end = (float(times[row]) for row in growing[[0, -1]])
            room_c = matter.ledger.warmth.room
            gas_ml = 1e6 * float(gone[-1]) * GAS_J_MOL_K * (room_c + ZERO_C_KELVIN) / ATMOSPHERE_PA
            text = f"{quantity(1e3 * gone[-1], 'mmol')} {gas} leave {vessel} as gas, {quantity(gas_ml, 'mL')} dry at "
            text += f"{room_c:g} degC and 1 atm"
            text += _dissolved_gas(matter, vessel, gas, float(gone[-1]))
            findings.series[f"{vessel}/{gas} gone"] = Series(times, gone, "mol")
            values: dict[str, float | str] = {"moles": float(gone[-1]), "gas_ml": gas_ml, "formula": gas}
            findings.events.append(EffectEvent(start, "gas", (vessel,), end, values, text))


def _dissolved_gas(matter: Matter, vessel: str, gas: str, gone: float) -> str:
    """End of the sentence of a gas: how much of it stays dissolved, or that nothing counts what does."""
    last = matter.histories[vessel].times[-1:]
    row = None if matter.solver is None else matter.solver.mixture.row_of(gas)
    if row is not None:
        wet, equilibria = matter.equilibria(vessel, last)
        if len(wet) and not np.isnan(equilibria.ph[0]):
            return f"; {quantity(1e3 * float(equilibria.species[0, row]), 'mmol')} stay dissolved"
        return ""
    most = MOST_DISSOLVED_MOLAR.get(gas, 0.0) * 1e-3 * float(matter.histories[vessel].volume_ml[-1])
    if most < LEAST_GAS_FRACTION * gone:
        return ""
    return f"; water would keep up to {quantity(1e3 * most, 'mmol')} of it, which is counted as gas"


def _add_solids(inputs: EffectInputs, matter: Matter, vessel: str, findings: Findings) -> None:
    """Mass of each solid at equilibrium that changes, where no effect precipitation follows it."""
    followed_solids = {declared["solid"] for declared in inputs.tables.get("precipitation", ())}
    ledger = matter.ledger
    history, brines = matter.histories[vessel], matter.brines(vessel)
    for index in (*ledger.reactions.phases.tolist(), *ledger.reactions.salt_columns.tolist()):
        solid = ledger.columns[index].removesuffix(SOLID)
        amount = history.amounts[:, index]
        if ledger.columns[index] in brines:
            continue
        if ledger.columns[index].endswith(SOLID) and solid not in followed_solids and np.ptp(amount) > 0.0:
            findings.series[f"{vessel}/{solid}"] = Series(history.times, amount * molar_mass(solid), "g")


def _brines(matter: Matter, vessel: str) -> list[EffectEvent]:
    """Salts of which nothing says how much dissolves, because too many other ions are beside them."""
    events = []
    for column, time in matter.brines(vessel).items():
        solid = column.removesuffix(SOLID)
        text = (
            f"{solid} is in a brine in {vessel}, beside more than {MOST_FOREIGN_MOL_KG:g} mol/kg of other ions: how "
            "much of it dissolves there is not known (its table is of pure water), so no mass of it is given"
        )
        values = {"formula": solid}
        events.append(EffectEvent(time, "brine", (vessel,), None, values, text, "warning"))
    return events


def _changed_ph(vessel: str, series: Series | None) -> list[EffectEvent]:
    """Event of a pH that has no end point, at its last change."""
    if series is None or not len(series.times) or abs(series.values[-1] - series.values[0]) < LEAST_PH_CHANGE:
        return []
    times, ph = series.times, series.values
    # While it cools it drifts on; what counts is when it had come near its last value.
    changes = np.flatnonzero(np.abs(ph - ph[-1]) > SETTLED_PH)
    values = {"from_ph": float(ph[0]), "to_ph": float(ph[-1])}
    text = f"the pH in {vessel} goes from {words.decimal(ph[0], 2)} to {words.decimal(ph[-1], 2)}"
    return [EffectEvent(float(times[changes[-1] + 1]), "ph", (vessel,), None, values, text)]


def _standing_ph(vessel: str, series: Series | None) -> list[EffectEvent]:
    """Event of the pH of a solution that merely stands, at the first moment."""
    if series is None or not len(series.times):
        return []
    ph = float(series.values[0])
    text = f"the solution in {vessel} has a pH of {words.decimal(ph, 2)}"
    return [EffectEvent(float(series.times[0]), "ph", (vessel,), None, {"to_ph": ph}, text)]


def _times(inputs: EffectInputs, matter: Matter, reaction: Reaction, vessel: str) -> FloatArray:
    """Times at which it is reported: at every change, and in every frame from its begin on where it is slow."""
    history = matter.histories[vessel]
    if reaction.declared["rate_per_s"] is None or reaction.process < 0:
        return history.times
    is_running = (history.pending[:, reaction.process] > 0.0) | (history.extents[:, reaction.process] > 0.0)
    first = int(history.frames[int(np.argmax(is_running))]) if is_running.any() else len(inputs)
    return inputs.times[first:]


SPEC = spec_of("reaction", compute)
