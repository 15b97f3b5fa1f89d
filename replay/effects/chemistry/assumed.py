"""Assumptions of the chemistry where no data exist: solids without a constant, molecules beyond solubility."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from replay import words
from replay.effects.chemistry.components import PROTON, WATER, dissolved_components, solute_components
from replay.effects.chemistry.contents import MOST_DISSOLVED_MOLAR
from replay.effects.chemistry.formulas import charge_of
from replay.effects.chemistry.matter import Matter
from replay.effects.chemistry.mixture import GAS, SOLID
from replay.effects.chemistry.phases import Phases
from replay.effects.chemistry.processes import Process
from replay.effects.chemistry.salts import solubility_of
from replay.effects.chemistry.spontaneity import stops_early
from replay.effects.output import EffectEvent
from replay.words import quantity

LEAST_MOL: Final = 1e-9
"""Of a reaction: less is none."""

LEAST_HALOGEN_MOLAR: Final = 1e-4
"""Of a dissolved halogen, mol/L, from which is told what it makes of water or lye."""

MOST_PERMANGANATE_PH: Final = 4.0
"""From which on permanganate is said to become manganese dioxide and not manganese(II); chosen by us.

Titrations of laboratory manuals take 0.5 mol/L of sulfuric acid and more.
"""

LYE_EQUATIONS: Final = {
    "I2": (9.0, "3 I2 + 6 OH- -> 5 I- + IO3- + 3 H2O"),
    "Br2": (8.0, "3 Br2 + 6 OH- -> 5 Br- + BrO3- + 3 H2O"),
}
"""Halogen -> pH from which it is said to disproportionate, chosen by us, and the equation."""

HOT_C: Final = 45.0
LEAST_DISSOLVED_FRACTION: Final = 0.05
"""A constant with an enthalpy alone is taken without a word up to 20 K from its 25 degC, and where less of its solid
stands dissolved than this share."""

SOLUBILITY_FACTOR: Final = 1.2
"""Of a solubility, from which what is dissolved beyond it is told."""


def assumption_events(matter: Matter) -> Iterator[EffectEvent]:
    """Events ``assumed`` of solids whose solubility no data know, ``beyond`` of molecules that leave the water."""
    for row, process in enumerate(matter.ledger.processes):
        solid = _metathesis_solid(process)
        begin_times = [
            float(history.times[moments[0]])
            for history in matter.histories.values()
            if len(moments := np.flatnonzero(history.extents[:, row] > LEAST_MOL))
        ]
        if solid and begin_times:
            message = (
                f"no data know how much {solid} dissolves: {process.text} runs until one of its reagents is used up; "
                "to have some stay dissolved, give its log_k, phreeqc = '''PHASES ...'''"
            )
            yield EffectEvent(min(begin_times), "assumed", (), None, {"formula": solid}, message)
    yield from _dissolved_complexes(matter)
    yield from _early_stops(matter)
    yield from _hot_solids(matter)
    yield from _chlorine(matter)
    yield from _halogens_in_lye(matter)
    yield from _permanganate(matter)
    for vessel, history in matter.histories.items():
        litres = np.where(history.volume_ml > 0.0, history.volume_ml * 1e-3, np.inf)
        # Iodide takes up one iodine each, as triiodide.
        iodide = matter.amount(vessel, "I-") / litres
        for formula, solubility in MOST_DISSOLVED_MOLAR.items():
            molar = matter.amount(vessel, formula) / litres
            limit_molar = SOLUBILITY_FACTOR * (solubility + (iodide if formula == "I2" else 0.0))
            moments = np.flatnonzero(molar > limit_molar)
            if len(moments) and not {formula + GAS, formula + SOLID} & set(matter.ledger.column):
                leaving_clause = "falls out as a solid" if formula == "I2" else "leaves as a gas or a second liquid"
                message = (
                    f"{vessel} holds {quantity(float(molar[moments].max()), 'mol/L')} {formula}, beyond its "
                    f"solubility: what is beyond {leaving_clause}, and that is not computed"
                )
                time = float(history.times[moments[0]])
                yield EffectEvent(time, "beyond", (vessel,), None, {"formula": formula}, message, "warning")


def _dissolved_complexes(matter: Matter) -> Iterator[EffectEvent]:
    """Event of a salt that an equation makes of ions, and that the data know as a dissolved complex alone.

    Zinc oxalate falls out; magnesium sulfate does not. No data say which.
    """
    for reaction in matter.recipe.reactions:
        formulas = reaction.equation.formulas
        settles = reaction.process >= 0 or any(reaction.phases.get(formula) in ("s", "g") for formula in formulas)
        if settles or any({PROTON, "NH3"} & set(dissolved_components(formula)) for formula in formulas):
            continue
        salts = [
            formula
            for formula in reaction.equation.products
            if not charge_of(formula) and len(solute_components(formula)) > 1 and _is_complex_alone(matter, formula)
        ]
        if salts and all(charge_of(formula) for formula in reaction.equation.reagents):
            text = (
                f"{salts[0]} is counted as a dissolved complex: no data know it as a solid. If it falls out, "
                f"write {salts[0]}(s) in the equation"
            )
            first_time = min(float(history.times[0]) for history in matter.histories.values())
            yield EffectEvent(first_time, "assumed", (), None, {"formula": salts[0]}, text, "warning")


def _is_complex_alone(matter: Matter, formula: str) -> bool:
    """Whether PHREEQC's data know a formula as it stands dissolved, and no data know its solid."""
    if matter.solver is None or matter.solver.mixture.row_of(formula) is None or solubility_of(formula) is not None:
        return False
    return Phases(matter.solver.mixture.database, {}, frozenset()).entry(formula, "s") is None


def _chlorine(matter: Matter) -> Iterator[EffectEvent]:
    """Event of chlorine water whose pH is given without the acid that chlorine makes of water."""
    reagents = [set(reaction.equation.reagents) for reaction in matter.recipe.reactions]
    if matter.solver is None or any("Cl2" in formulas and formulas & {WATER, "OH-"} for formulas in reagents):
        return
    for vessel, history in matter.histories.items():
        litres = np.where(history.volume_ml > 0.0, history.volume_ml * 1e-3, np.inf)
        moments = np.flatnonzero(matter.amount(vessel, "Cl2") / litres > LEAST_HALOGEN_MOLAR)
        if len(moments):
            text = (
                f"chlorine in {vessel} is counted as Cl2 alone, but some of it makes acid of water: for its pH add "
                '[[effect]] with kind = "reaction", equation = "Cl2 + H2O -> HCl + HClO"'
            )
            values: dict[str, float | str] = {"formula": "Cl2"}
            yield EffectEvent(float(history.times[moments[0]]), "assumed", (vessel,), None, values, text, "warning")


def _halogens_in_lye(matter: Matter) -> Iterator[EffectEvent]:
    """Events of iodine and bromine that stand in lye, where they disproportionate, without an equation that says so."""
    for formula, (limit_ph, equation) in LYE_EQUATIONS.items():
        reagents = [set(reaction.equation.reagents) for reaction in matter.recipe.reactions]
        reacts_with_base = any(
            formula in formulas and any(dissolved_components(other).get(PROTON, 0) < 0 for other in formulas)
            for formulas in reagents
        )
        for vessel, history in matter.histories.items() if matter.solver is not None and not reacts_with_base else ():
            litres = np.where(history.volume_ml > 0.0, history.volume_ml * 1e-3, np.inf)
            times = history.times[matter.amount(vessel, formula) / litres > LEAST_HALOGEN_MOLAR]
            if not len(times):
                continue
            wet, equilibria = matter.equilibria(vessel, times)
            basic = np.flatnonzero(equilibria.ph > limit_ph)
            if len(basic):
                text = (
                    f"{formula} in {vessel} is counted as such at a pH of "
                    f"{words.decimal(float(equilibria.ph[basic].max()), 1)}, but lye takes it apart: add "
                    f'[[effect]] with kind = "reaction", equation = "{equation}"'
                )
                values: dict[str, float | str] = {"formula": formula}
                yield EffectEvent(float(times[wet[basic[0]]]), "assumed", (vessel,), None, values, text, "warning")


def _permanganate(matter: Matter) -> Iterator[EffectEvent]:
    """Event of permanganate that became manganese(II) in so little acid that it makes manganese dioxide."""
    for row, process in enumerate(matter.ledger.processes):
        if not process.changes.get("MnO4-", 0.0) < 0.0 < process.changes.get("Mn^2+", 0.0) or matter.solver is None:
            continue
        for vessel, history in matter.histories.items():
            running_rows = np.flatnonzero(np.diff(history.extents[:, row]) > LEAST_MOL) + 1
            times = history.times[running_rows]
            wet, equilibria = matter.equilibria(vessel, times) if len(times) else (running_rows, None)
            weak = np.flatnonzero(equilibria.ph > MOST_PERMANGANATE_PH) if equilibria is not None else running_rows
            if equilibria is not None and len(weak):
                text = (
                    f"{process.text} is computed in {vessel} up to a pH of "
                    f"{words.decimal(float(equilibria.ph[weak].max()), 1)}, but in so little acid permanganate makes "
                    "MnO2: add acid, or write the equation with MnO2"
                )
                time, values = float(times[wet[weak[0]]]), {"equation": process.text}
                yield EffectEvent(time, "assumed", (vessel,), None, values, text, "warning")


def _hot_solids(matter: Matter) -> Iterator[EffectEvent]:
    """Event of a solid that dissolves hot to speak of, by a constant of 25 degC and its enthalpy alone."""
    phases = () if matter.solver is None else matter.solver.mixture.phases
    for phase in phases if matter.ledger.warmth.followed else ():
        if phase.column.endswith(GAS) or any("analytic" in option for option in phase.entry.options):
            continue
        ions = {name: many for name, many in phase.components.items() if name not in (PROTON, WATER)}
        for vessel, history in matter.histories.items():
            solid = matter.amount(vessel, phase.column)
            dissolved = np.min([matter.amount(vessel, name) / many for name, many in ions.items()], axis=0)
            celsius = matter.celsius(vessel, history.times)
            hot = (solid > 0.0) & (dissolved > LEAST_DISSOLVED_FRACTION * solid) & (celsius > HOT_C)
            moments = np.flatnonzero(hot & (history.volume_ml > 0.0))
            if len(moments):
                formula, hottest = phase.column.removesuffix(SOLID), float(celsius[moments].max())
                text = (
                    f"how much {formula} dissolves in {vessel} at {words.decimal(hottest, 0)} degC is taken from "
                    "its constant and enthalpy at 25 degC: it may be off by a third"
                )
                values: dict[str, float | str] = {"formula": formula, "celsius": hottest}
                yield EffectEvent(float(history.times[moments[0]]), "assumed", (vessel,), None, values, text, "warning")
                break


def _early_stops(matter: Matter) -> Iterator[EffectEvent]:
    """Event of an equation that ran to its end, and whose free energy would let it stop before."""
    for reaction in matter.recipe.reactions:
        is_computed = reaction.process >= 0 and matter.ledger.limits.has_equilibrium(reaction.process)
        if reaction.process < 0 or is_computed or not stops_early(reaction.free_energy_j):
            continue
        extents = {name: history.extents[:, reaction.process] for name, history in matter.histories.items()}
        begin_times = [
            float(matter.histories[name].times[np.flatnonzero(extent > LEAST_MOL)[0]])
            for name, extent in extents.items()
            if (extent > LEAST_MOL).any()
        ]
        if begin_times:
            equation, kilojoule = reaction.declared["equation"], reaction.free_energy_j / 1e3
            message = (
                f"{equation} is computed until one of its reagents is used up, but its free energy is "
                f"{words.decimal(kilojoule, 0, signed=True)} kJ/mol: it stops at an equilibrium before, and how much "
                "of each is left is not computed"
            )
            event_values = {"equation": equation, "kilojoule": kilojoule}
            yield EffectEvent(min(begin_times), "assumed", (), None, event_values, message, "warning")


def _metathesis_solid(process: Process) -> str:
    """The solid that dissolved ions make without any change of theirs; ``""``: another equation."""
    made_columns = [column for column, many in process.changes.items() if many > 0.0 and column not in (PROTON, WATER)]
    used_columns = [column for column, many in process.changes.items() if many < 0.0]
    solids = [column for column in made_columns if column.endswith(SOLID)]
    if (
        process.rate is not None
        or len(solids) != 1
        or len(made_columns) > 1
        or any(name.endswith((SOLID, GAS)) for name in used_columns)
    ):
        return ""
    return solids[0].removesuffix(SOLID)
