"""Whether an equation without a constant proceeds by itself: its free energy, in acid, in water and in lye."""

from collections.abc import Mapping
from functools import cache
from typing import Final

import numpy as np

from replay import words
from replay.effects.chemistry.components import PROTON, WATER, dissolved_components, dry_components
from replay.effects.chemistry.contents import Contents
from replay.effects.chemistry.database import Database
from replay.effects.chemistry.enthalpy import FREE_ENERGY_KJ_MOL, free_energy_j
from replay.effects.chemistry.formulas import Equation, atoms
from replay.effects.chemistry.mixture import SOLID
from replay.effects.chemistry.phases import Phases
from replay.effects.chemistry.processes import Process

STRONG_ANIONS: Final = frozenset(("Cl-", "Br-", "I-", "NO3-", "ClO4-", "ClO3-", "SO4^2-"))
"""Anions of strong acids; the heat of sulfuric acid in water has a formula of its own."""

UNWILLING_J: Final = 20e3
"""Free energy of a mol of reaction above which it does not proceed by itself; chosen by us, 3.5 powers of ten."""

CONCENTRATED_MOLAR: Final = 8.0
"""mol/L of protons from which an acid is a concentrated one; chosen by us."""

CONCENTRATED_J: Final = 12e3
"""Free energy that a mol of protons of a concentrated acid has more than at 1 mol/L.

Of 12 mol/L of HCl, whose mean activity coefficient is 17 at 16 mol/kg: R T ln 270, less a little. Source: CRC Handbook.
"""

EVEN_J: Final = -12e3
"""Free energy from which a reaction leaves some of its reagents: of two that make two, 8 % at -12 kJ/mol."""

ESTER_J: Final = -3.4e3
"""Free energy of a carboxylic acid and an alcohol that make an ester and water: R T ln 4, whichever they are.

Source: P. Atkins and J. de Paula, Physical Chemistry, 10th ed.: ethanol and acetic acid, K = 4.
"""

SPECTATOR_IONS: Final = frozenset(("Li+", "Na+", "K+"))
"""Ions that only look on."""

NOBLEST_METALS: Final = frozenset(("Au(s)", "Pt(s)"))
"""Metals that aqua regia dissolves and nitric acid does not, whose salts no table has."""

SULFIDE: Final = "S^2-"

LOG_J: Final = 5.708e3
"""Free energy of a power of ten of a constant: R T ln 10 at 25 degC."""

NEUTRAL_PROTON_J: Final = 39.95e3
"""Free energy of a mol of protons taken from neutral water instead of from an acid: R T ln 10 times 7 at 25 degC."""


def strongest_acid(contents: Mapping[str, Contents]) -> float:
    """mol/L of protons in the strongest acid of any vessel; 0 where there is none."""
    strengths = [
        max(0, dissolved_components(formula).get(PROTON, 0)) * amount / content.volume_ml * 1e3
        for content in contents.values()
        for formula, amount in content.amounts.items()
        if content.volume_ml > 0.0 and set(dissolved_components(formula)) <= STRONG_ANIONS | {PROTON}
    ]
    return max(strengths, default=0.0)


def free_energy_of(
    process: Process, equation: Equation, phase: Mapping[str, str], phases: Phases, acid_molar: float
) -> float:
    """Free energy in J of a mol of an equation where it runs; NaN where no table knows one of its formulas.

    ``acid_molar``: mol/L of protons in the strongest acid that there is.
    """
    changes: dict[str, float] = {}
    joule, free_protons = 0.0, process.changes.get(PROTON, 0.0)
    for formula, coefficient in equation.changes.items():
        column = f"{formula}({phase.get(formula, '')})"
        # A solid that PHREEQC brings to equilibrium counts as the solid that it becomes.
        components: Mapping[str, int] = {column: 1} if column in FREE_ENERGY_KJ_MOL else dissolved_components(formula)
        if column in process.changes:
            components = {column: 1}
        elif not phase.get(formula):
            log_k = _log_constant(formula, phases)
            joule -= LOG_J * log_k * coefficient
            free_protons -= components.get(PROTON, 0) * coefficient if log_k else 0.0
        for component, many in components.items():
            changes[component] = changes.get(component, 0.0) + coefficient * many
    joule += free_energy_j({component: many for component, many in changes.items() if many})
    if np.isnan(joule):
        joule = _ester_joule(equation)
    if process.acid < 0.0:
        # Hydroxide takes up the protons that it makes: chlorine gives bleach in lye and not in water.
        joule -= 2.0 * NEUTRAL_PROTON_J * max(0.0, free_protons)
    if process.acid <= 0.0:
        joule += NEUTRAL_PROTON_J * max(0.0, -free_protons)
    if acid_molar >= CONCENTRATED_MOLAR:
        # As manganese dioxide frees chlorine from concentrated acid alone.
        joule -= CONCENTRATED_J * max(0.0, -process.changes.get(PROTON, 0.0))
    return joule


def constant_of(changes: Mapping[str, float], equation: Equation) -> tuple[float, bool]:
    """log10 of the constant of what an equation changes, and whether it makes or splits an ester; NaN: not known.

    Sulfide is left out: its free energy and PHREEQC's constant of hydrogen sulfide differ by four powers of ten; so is
    thiosulfate that falls apart into sulfur, which in acid goes on to its end by way of other acids of sulfur.
    """
    ester = _ester_joule(equation)
    if not np.isnan(ester):
        return -ester / LOG_J, True
    if SULFIDE in changes or {"S2O3^2-", "S(s)"} <= changes.keys():
        return float("nan"), False
    return -free_energy_j(changes) / LOG_J, False


def energy_in_water(process: Process) -> float:
    """Free energy in J between the columns of a process, with protons that it makes in neutral water."""
    joule = -LOG_J * process.log_k
    protons = process.changes.get(PROTON, 0.0)
    if process.acid > 0.0:
        protons = max(0.0, protons)
    return joule - NEUTRAL_PROTON_J * protons


def reason_not_to_proceed(joule: float, process: Process, equation: Equation) -> str:
    """Why an equation does not proceed by itself; ``""``: it does, or nobody knows its free energy."""
    noble = sorted(NOBLEST_METALS & {column for column, many in process.changes.items() if many < 0.0})
    ligands = {atom for formula in equation.reagents for atom in ("Cl", "CN") if atom in formula}
    if np.isnan(joule) and noble and not ligands:
        return f"{noble[0].removesuffix(SOLID)} dissolves in no acid without chloride"
    if not joule > UNWILLING_J:
        return ""
    metal = next(
        (
            column.removesuffix(SOLID)
            for column, many in process.changes.items()
            if column.endswith(SOLID) and many < 0.0
        ),
        "",
    )
    if metal and "H2" in equation.products:
        return f"{metal} is nobler than hydrogen"
    return f"its free energy is {words.decimal(joule / 1e3, 0, signed=True)} kJ/mol"


def stops_early(joule: float) -> bool:
    """Whether an equation that is computed to its end would stop at an equilibrium before it."""
    return bool(np.isfinite(joule)) and EVEN_J < joule <= UNWILLING_J


def _ester_joule(equation: Equation) -> float:
    """Free energy in J of making an ester, or of taking it apart with water; NaN of any other equation."""
    reagents, products = set(equation.reagents), set(equation.products)
    for sign, made_of, makes in ((1.0, reagents, products), (-1.0, products, reagents)):
        organic = all(set(atoms(formula)) == {"C", "H", "O"} for formula in made_of | makes - {WATER})
        acids = {formula for formula in made_of if dissolved_components(formula).get(PROTON, 0) > 0}
        if organic and WATER in makes and len(made_of) == len(makes) == len(acids) + 1 == 2:
            return sign * ESTER_J
    return float("nan")


def _log_constant(formula: str, phases: Phases) -> float:
    """log10 of the constant with which an acid, hydroxide or complex comes from its ions; 0 where PHREEQC has none.

    Of a salt such as K2Cr2O7 that of its ion.
    """
    if phases.database is None:
        return 0.0
    components = dry_components(dissolved_components(formula))
    ion = {component: many for component, many in components.items() if component not in SPECTATOR_IONS}
    logs = _log_constants(phases.database)
    log_k = logs.get(frozenset(ion.items()))
    if log_k is None:
        return 0.0
    return log_k - sum(many * logs.get(frozenset({(component, 1.0)}), 0.0) for component, many in ion.items())


@cache
def _log_constants(database: Database) -> Mapping[frozenset[tuple[str, float]], float]:
    """Ions of a species without its water -> log10 of its constant."""
    return {frozenset(dry_components(entry.makeup).items()): entry.log_k for entry in database.species.values()}
