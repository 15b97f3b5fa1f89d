"""The water in a litre of a solution: what the room that its solutes take leaves of the litre.

The room of an ion at infinite dilution is known, and grows with the ionic strength. A litre of water is taken to hold a
kilogram at 25 degC, and so is a litre of a dilute solution, as constants of equilibria are used at school; at another
temperature it holds as much more or less as water does.
"""

from collections.abc import Mapping
from functools import cache, lru_cache
from typing import Final

import numpy as np

from replay.effects.chemistry.components import PROTON, WATER, components_of
from replay.effects.chemistry.enthalpy import CONSTANTS
from replay.effects.chemistry.formulas import charge_of

MOLAR_VOLUME_ML: Final[Mapping[str, list[float]]] = CONSTANTS["volume"]
"""Component -> mL/mol alone and with 1, 2, ... protons, at infinite dilution."""

STRONG_WATER: Final[Mapping[str, list[float]]] = CONSTANTS["strong_water"]
"""Acid or base -> mol/L of a strong solution, and g of water in a litre of it."""

HYDROXIDE_ML: Final = -4.18
"""Of a mol of OH-. Source: Shock and Helgeson, Geochim. Cosmochim. Acta 52, 1988."""

WATER_ML: Final = 18.0153
"""Of a mol of water."""

LITRE_ML: Final = 1000.0

GROWTH_ML: Final = 1.5
"""Millilitres in a litre by which ions need more room, times the ionic strength to the power of 1.5.

The limiting law of Debye and Hueckel has 1.868 (Redlich and Meyer, Chem. Rev. 64, 1964). With 1.5 the water of strong
solutions of 1:1 and 2:2 salts is that of their densities to 2 %; carbonates and salts of 3:1 are up to 7 % off.
"""

LEAST_ML: Final = 1.0
"""Of water in a litre: pure acids keep so much."""

DILUTE_MOLAR: Final = 0.5
"""Solutions of less in all hold a kilogram of water a litre; from twice as much on all of the room counts."""

MOST_UNKNOWN_MOLAR: Final = 1.0
"""Up to this a solute whose room is not known counts as none."""

REFERENCE_C: Final = 25.0
KELL_COEFFICIENTS: Final = (999.83952, 16.945176, -7.9870401e-3, -46.170461e-6, 105.56302e-9, -280.54253e-12)

HALVINGS: Final = 50
"""Of an interval of concentrations."""


def water_molar(concentrations: Mapping[str, float]) -> float:
    """Returns the mol of water in a litre of solutes (formula -> mol/L), without the water that they bring themselves.

    Raises KeyError: the formula of a solute of more than ``MOST_UNKNOWN_MOLAR`` whose room nobody knows.
    """
    room, strength, brought = 0.0, 0.0, 0.0
    for formula, molar in concentrations.items():
        if formula in STRONG_WATER:
            room += molar * _strong_volume(formula, molar)
            continue
        volume = _volume(formula)
        if volume is None:
            if molar > MOST_UNKNOWN_MOLAR:
                raise KeyError(formula)
            continue
        room += molar * volume
        strength += molar * _ionic_strength(formula)
        brought += molar * _crystal_water(formula)
    room += GROWTH_ML * strength**1.5
    room *= min(1.0, max(0.0, sum(concentrations.values()) / DILUTE_MOLAR - 1.0))
    return max(LITRE_ML - room, LEAST_ML) / WATER_ML - brought


def expansion(celsius: float) -> float:
    """Density of water at a temperature as a share of that at 25 degC.

    Source: G. S. Kell, J. Chem. Eng. Data 20, 1975.
    """
    return _density(celsius) / _density(REFERENCE_C)


def _density(celsius: float) -> float:
    """Density of water, kg/m3, between freezing and boiling."""
    bounded = min(100.0, max(0.0, celsius))
    return float(np.polynomial.polynomial.polyval(bounded, KELL_COEFFICIENTS)) / (1.0 + 16.87985e-3 * bounded)


@lru_cache(maxsize=1024)
def molar_of_molal(formula: str, molal: float) -> float:
    """Returns the mol/L of a solution that holds so many mol of a formula in a kilogram of water."""
    lower, upper = 0.0, molal
    for _ in range(HALVINGS):
        molar = 0.5 * (lower + upper)
        try:
            kilograms = (water_molar({formula: molar}) + molar * _crystal_water(formula)) * WATER_ML / LITRE_ML
        except KeyError:
            return molal
        lower, upper = (molar, upper) if molar < molal * kilograms else (lower, molar)
    return lower


def _strong_volume(formula: str, molar: float) -> float:
    """Millilitres of a mol of an acid or base: from those of its ions to those of its strong solution."""
    strong, water = STRONG_WATER[formula]
    dilute = _volume(formula)
    strongest = (LITRE_ML - water) / strong
    # The room of ions grows with the root of their concentration.
    fraction = min(1.0, (molar / strong) ** 0.5)
    return strongest if dilute is None else dilute + (strongest - dilute) * fraction


@cache
def _species(formula: str) -> tuple[tuple[str, int, int], ...] | None:
    """Species of a mol of a formula: component, its number, protons on each; ``None``: one has no volume."""
    counts = components_of(formula)
    if counts is None:
        return None
    protons = max(0, counts.get(PROTON, 0))
    species = []
    for component, protonated in MOLAR_VOLUME_ML.items():
        count = counts.get(component, 0)
        if count:
            bound = min(len(protonated) - 1, protons // count)
            protons -= bound * count
            species.append((component, count, bound))
    present = {component for component, _, _ in species}
    return tuple(species) if present >= set(counts) - {PROTON, WATER} else None


def _volume(formula: str) -> float | None:
    """Millilitres of a mol of a formula at infinite dilution; ``None``: not known."""
    species = _species(formula)
    if species is None:
        return None
    volume = sum(count * MOLAR_VOLUME_ML[component][bound] for component, count, bound in species)
    return volume + HYDROXIDE_ML * _hydroxides(formula)


def _ionic_strength(formula: str) -> float:
    """Ionic strength of a mol in a litre."""
    species = _species(formula) or ()
    ions = [(count, charge_of(component) + bound) for component, count, bound in species]
    charges = sum(count * charge for count, charge in ions)
    # What the ions lack are protons or hydroxide.
    return 0.5 * (sum(count * charge**2 for count, charge in ions) + abs(charges - charge_of(formula)))


def _hydroxides(formula: str) -> int:
    return max(0, -(components_of(formula) or {}).get(PROTON, 0))


def _crystal_water(formula: str) -> int:
    """Molecules of water that a formula brings; below 0 it takes some up, as dichromate does."""
    return (components_of(formula) or {}).get(WATER, 0) - _hydroxides(formula)
