"""The concentration that a titration gives: what a student computes from the burette's volume."""

from collections.abc import Mapping
from fractions import Fraction
from typing import Final

from replay.effects.chemistry.components import dissolved_components, solute_components
from replay.effects.chemistry.contents import Contents
from replay.effects.chemistry.formulas import molar_mass
from replay.words import quantity

LARGEST_COEFFICIENT: Final = 10
"""Coefficient of an equation; a ratio of larger ones is no stoichiometry."""

STOICHIOMETRY_TOLERANCE: Final = 0.02
"""Share by which a ratio of amounts may differ from one of whole numbers."""


def titrated_concentration(
    contents: Mapping[str, Contents], vessel: str, source: str, names: tuple[str, str], volume_ml: float
) -> tuple[str, dict[str, float | str]]:
    """Text and values of the concentration that a titration gives; empty where it gives none.

    ``source``: the vessel of the titrant, of which ``volume_ml`` came until the end point in ``vessel``.
    ``names``: what is equivalent there. It gives one only where one reagent stands on either side.
    """
    titrant, sample = contents.get(source), contents.get(vessel)
    if titrant is None or sample is None or titrant.volume_ml <= 0.0 or volume_ml <= 0.0:
        return "", {}
    reagents = _matching(titrant.amounts, names)
    analytes = _matching({**sample.amounts, **sample.solids}, names)
    if len(reagents) != 1 or len(analytes) != 1 or reagents == analytes:
        return "", {}
    ((reagent, reagent_mol),) = reagents.items()
    ((analyte, moles),) = analytes.items()
    molar = reagent_mol / titrant.volume_ml * 1e3
    titrated = molar * volume_ml * 1e-3
    whole = Fraction(moles / titrated).limit_denominator(LARGEST_COEFFICIENT)
    if (
        not 0 < whole.numerator <= LARGEST_COEFFICIENT
        or abs(float(whole) * titrated / moles - 1.0) > STOICHIOMETRY_TOLERANCE
    ):
        return "", {}
    if analyte in sample.solids:
        result = moles / float(whole) / volume_ml * 1e3
        mass = moles * molar_mass(analyte)
        text = f"; by {quantity(mass, 'g')} of {analyte}, {reagent} has {quantity(result, 'mol/L')}"
        return text, {"formula": reagent, "mol_per_l": result}
    result = titrated * float(whole) / sample.volume_ml * 1e3
    volume = quantity(sample.volume_ml, "mL")
    text = f"; by {quantity(molar, 'mol/L')} {reagent}, {analyte} had {quantity(result, 'mol/L')} in the first {volume}"
    # Which of the two is the standard a scene does not say.
    text += f" (or, with {analyte} as the standard, {reagent} has {quantity(molar, 'mol/L')})"
    return text, {"formula": analyte, "mol_per_l": result}


def _matching(amounts: Mapping[str, float], names: tuple[str, str]) -> dict[str, float]:
    """Formulas of amounts that are named, or hold all ions of a name, as a hydrate does, or any of them."""
    ions_by_name = {name: set(solute_components(name)) for name in names if " + " not in name}
    ions = set().union(*ions_by_name.values())
    named = {formula: amount for formula, amount in amounts.items() if formula in names}
    whole = {
        formula: amount
        for formula, amount in amounts.items()
        if any(named_ions and named_ions <= set(dissolved_components(formula)) for named_ions in ions_by_name.values())
    }
    if named or whole:
        return named or whole
    return {
        formula: amount
        for formula, amount in amounts.items()
        if amount > 0.0 and ions & set(dissolved_components(formula))
    }
