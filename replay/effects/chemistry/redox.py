"""Redox potential of a solution by Nernst's equation, from the couples of the equations that ran in it.

An equation without a constant runs to its end, so that beside its end point one of its two couples has both its forms:
that couple sets the potential. Standard potentials follow from free energies of formation, at 25 degC; activities are
those of PHREEQC.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import lcm, log
from typing import Final

import numpy as np

from cdcore.numerics import FloatArray
from replay.effects.chemistry.components import PROTON, WATER
from replay.effects.chemistry.enthalpy import FREE_ENERGY_KJ_MOL
from replay.effects.chemistry.formulas import atoms, charge_of
from replay.effects.chemistry.iodine import IODIDE, IODINE, free_iodine
from replay.effects.chemistry.matter import Matter
from replay.effects.chemistry.mixture import GAS, SOLID
from replay.effects.chemistry.salts import WATER_KG
from replay.effects.chemistry.solver import Equilibrium

FARADAY_KJ_MOL_V: Final = 96.48533
"""Charge of a mol of electrons. Source: CODATA 2018."""

GAS_KJ_MOL_K: Final = 8.314463e-3
"""Gas constant. Source: CODATA 2018."""

ZERO_C_KELVIN: Final = 273.15

COMPLEXES_UNKNOWN: Final[Mapping[str, str]] = {"Ce^4+": "SO4^2-"}
"""Oxidised form -> what binds it without a constant in PHREEQC's data: cerium in sulfuric acid has 1.44 V, not 1.74."""

PEROXIDE: Final = "H2O2"


@dataclass(frozen=True)
class Couple:
    """Half a redox reaction: the oxidised form, protons and electrons make the reduced form and water."""

    oxidised: str  # columns of the ledger
    reduced: str
    oxidised_count: int
    reduced_count: int
    protons: int  # below 0: the oxidised form has the more
    electrons: int
    volt: float  # standard potential against that of hydrogen


def couples_of(changes: Mapping[str, float]) -> tuple[Couple, Couple] | None:
    """Couples of the oxidant and of the reductant of an equation.

    ``changes`` : column -> mol that one mol of reaction makes. ``None``: it is no redox reaction of two reagents, or no
    table has the free energy of a form.
    """
    products = [column for column, many in changes.items() if many > 0.0 and column not in (PROTON, WATER)]
    reagents = [column for column, many in changes.items() if many < 0.0 and column not in (PROTON, WATER)]
    known_couples = [
        couple for column in reagents if (couple := _couple(column, _product_of_reagent(column, products))) is not None
    ]
    oxidants = [couple for couple in known_couples if couple.oxidised in reagents]
    reductants = [couple for couple in known_couples if couple.reduced in reagents]
    if len(reagents) != 2 or len(oxidants) != 1 or len(reductants) != 1:
        return None
    return oxidants[0], reductants[0]


def potential(matter: Matter, vessel: str, times: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Times (n,) at which a couple of a vessel has both its forms, and its potential in V (n,) there.

    Of several equations the couple of which there is most counts: it holds the potential. There is none where both
    couples of an equation have all their forms, as one that stopped for want of acid, or where couples are not known.
    """
    pairs = _couples_that_ran(matter, vessel)
    couples = list(dict.fromkeys(couple for pair in pairs for couple in pair))
    if not couples or matter.solver is None:
        return np.zeros(0), np.zeros(0)
    wet_rows, equilibria = matter.equilibria(vessel, times)
    amounts = matter.states(vessel, times[wet_rows])[0]
    celsius = matter.celsius(vessel, times[wet_rows])
    electrons = np.array([_exchangeable_electrons(matter, amounts, couple) for couple in couples])
    volts = np.array([_nernst_potential(matter, amounts, equilibria, celsius, couple) for couple in couples])
    electrons[~np.isfinite(volts)] = 0.0
    best_couple = np.argmax(electrons, axis=0)
    rows = np.arange(len(wet_rows))
    has_electrons = electrons[best_couple, rows] > 0.0
    for pair in pairs:
        has_both_forms = [electrons[couples.index(couple)] > 0.0 for couple in pair]
        has_electrons &= ~np.logical_and(*has_both_forms)
    return times[wet_rows][has_electrons], volts[best_couple, rows][has_electrons]


def _couples_that_ran(matter: Matter, vessel: str) -> list[tuple[Couple, Couple]]:
    """Couples of each equation that ran at once in a vessel; none where those of one are not known."""
    pairs: list[tuple[Couple, Couple]] = []
    for row, process in enumerate(matter.recipe.processes):
        reagents = [column for column, many in process.changes.items() if many < 0.0 and column not in (PROTON, WATER)]
        if len(reagents) != 2 or not matter.histories[vessel].extents[-1, row] > 0.0:
            continue
        pair = couples_of(process.changes)
        if process.rate is not None or pair is None or any(_unknown_complex(matter, vessel, couple) for couple in pair):
            return []
        pairs.append(pair)
    return pairs


def _unknown_complex(matter: Matter, vessel: str, couple: Couple) -> bool:
    """Whether something in a vessel binds a form of a couple in complexes that PHREEQC's data lack."""
    binding_ligand = COMPLEXES_UNKNOWN.get(couple.oxidised)
    return binding_ligand is not None and bool(matter.amount(vessel, binding_ligand).any())


def _product_of_reagent(column: str, products: Sequence[str]) -> str:
    """Return the product that a reagent becomes: that with its atoms but hydrogen and oxygen; ``""``: not one alone."""
    mine = _heavy_atoms(column)
    if column == PEROXIDE:
        return next((product for product in products if product.removesuffix(GAS) == "O2"), WATER)
    possible_products = [product for product in products if mine and _heavy_atoms(product).keys() == mine.keys()]
    return possible_products[0] if len(possible_products) == 1 else ""


def _couple(reagent: str, product: str) -> Couple | None:
    """Couple of a reagent and what it becomes; ``None``: neither is oxidised, or a free energy is missing."""
    if not product or not {reagent, product} <= FREE_ENERGY_KJ_MOL.keys():
        return None
    element = next(iter(_heavy_atoms(reagent)), "O")
    count, product_count = _atoms(reagent).get(element, 0), _atoms(product).get(element, 0)
    common_multiple = lcm(count, product_count)
    count, product_count = common_multiple // count, common_multiple // product_count
    counted_sides = [(count, _atoms(reagent)), (-product_count, _atoms(product))]
    water = sum(many * counted.get("O", 0) for many, counted in counted_sides) if product != WATER else 0
    protons = 2 * water - sum(many * counted.get("H", 0) for many, counted in counted_sides)
    electrons = count * _charge(reagent) + protons - product_count * _charge(product)
    if electrons == 0:
        return None
    if electrons < 0:
        return _couple(product, reagent)
    kilojoule = (
        product_count * FREE_ENERGY_KJ_MOL[product]
        + water * FREE_ENERGY_KJ_MOL[WATER]
        - count * FREE_ENERGY_KJ_MOL[reagent]
    )
    return Couple(
        oxidised=reagent,
        reduced=product,
        oxidised_count=count,
        reduced_count=product_count,
        protons=protons,
        electrons=electrons,
        volt=-kilojoule / (electrons * FARADAY_KJ_MOL_V),
    )


def _atoms(column: str) -> Mapping[str, int]:
    return atoms(column.removesuffix(SOLID).removesuffix(GAS))


def _heavy_atoms(column: str) -> dict[str, int]:
    """Atoms of a column but hydrogen and oxygen."""
    return {element: many for element, many in _atoms(column).items() if element not in "HO"}


def _charge(column: str) -> int:
    return charge_of(column.removesuffix(SOLID).removesuffix(GAS))


def _exchangeable_electrons(matter: Matter, amounts: FloatArray, couple: Couple) -> FloatArray:
    """Mol of electrons (n,) that the scarcer form of a couple takes or gives."""
    column_counts = ((couple.oxidised, couple.oxidised_count), (couple.reduced, couple.reduced_count))
    electrons_of_forms = [amounts[:, matter.ledger.column[column]] / count for column, count in column_counts]
    return couple.electrons * np.minimum(*electrons_of_forms)


def _nernst_potential(
    matter: Matter, amounts: FloatArray, equilibria: Equilibrium, celsius: FloatArray, couple: Couple
) -> FloatArray:
    """Potential (n,) in V by Nernst's equation; NaN or infinite where a form has no activity."""
    quotient = (
        couple.reduced_count * _log_activity(matter, amounts, equilibria, couple.reduced)
        - couple.oxidised_count * _log_activity(matter, amounts, equilibria, couple.oxidised)
        + couple.protons * equilibria.ph
    )
    slope = log(10.0) * GAS_KJ_MOL_K * (celsius + ZERO_C_KELVIN) / (couple.electrons * FARADAY_KJ_MOL_V)
    return couple.volt - slope * quotient


def _log_activity(matter: Matter, amounts: FloatArray, equilibria: Equilibrium, column: str) -> FloatArray:
    """log10 of the activity (n,) of a form: of an ion by PHREEQC, of a molecule its mol/kg; solids and gases have 1."""
    if column == WATER or column.endswith((SOLID, GAS)):
        return np.zeros(len(amounts))
    kilograms = amounts[:, matter.ledger.water] * WATER_KG
    free_iodine_molal = free_iodine(matter.ledger.column, amounts, kilograms)
    components = () if matter.solver is None else matter.solver.mixture.components
    with np.errstate(divide="ignore", invalid="ignore"):
        if column not in components:
            molal = amounts[:, matter.ledger.column[column]] / kilograms
            return np.log10(free_iodine_molal[IODINE] if column == IODINE else molal)
        ion = equilibria.log_activity[:, components.index(column)]
        if column != IODIDE:
            return ion
        return ion + np.log10(free_iodine_molal[IODIDE] * kilograms / amounts[:, matter.ledger.column[IODIDE]])
