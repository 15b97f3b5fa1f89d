"""Heats that a scene declares, in the columns of the ledger.

A declared heat is one between formulas as they stand in much water: of NaOH it ends with hydroxide, of NH4Cl with
ammonium. The ledger counts both with protons, so what a dissolved formula holds above its columns is taken off.
"""

from collections.abc import Mapping
from typing import Final

import numpy as np

from replay.effects.chemistry.components import WATER, dissolved_components
from replay.effects.chemistry.formulas import Equation
from replay.effects.chemistry.solver import Solver, has_answer

DILUTE_MOL_KG: Final = 0.1
"""Strength of the solution at which the heat of a dissolved formula is taken: a common one of a laboratory."""

WATER_MOL: Final = 55.508
"""Of a kilogram."""

STANDARD_C: Final = 25.0


def declared_joule(
    kilojoule: float, equation: Equation, states: Mapping[str, str], columns: Mapping[str, float], solver: Solver | None
) -> float:
    """Enthalpy in J between columns of the ledger of an equation that is declared with one between its formulas.

    ``columns`` : solids and gases that have their own -> J of a mol above what the equation counts them as.
    """
    joule = 1e3 * kilojoule
    for formula, many, state in equation.terms(states):
        substance = f"{formula}({state})"
        joule -= many * (columns[substance] if substance in columns else dissolved_joule(formula, solver))
    return joule


def dissolved_joule(formula: str, solver: Solver | None) -> float:
    """Enthalpy in J of a mol of a formula in much water above its columns; 0 where PHREEQC is not asked."""
    components = dissolved_components(formula)
    if solver is None or formula == WATER:
        return 0.0
    mixture = solver.mixture
    totals = np.array([[DILUTE_MOL_KG * components.get(name, 0) for name in mixture.components]])
    water = np.array([WATER_MOL])
    no_phases = np.zeros(len(mixture.phases), dtype=np.bool_)
    equilibria = solver.equilibrium(totals, water, np.array([STANDARD_C]), no_phases)
    if not has_answer(equilibria)[0]:
        return 0.0
    return float(equilibria.species[0] @ mixture.joule[: len(mixture.species)]) / DILUTE_MOL_KG
