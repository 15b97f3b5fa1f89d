"""Well soluble salts dissolve up to their measured solubility, and crystallise when it gets colder."""

import numpy as np
import pytest

from replay.effects.chemistry.components import PROTON, WATER
from replay.effects.chemistry.formulas import molar_mass
from replay.effects.chemistry.salts import (
    SOLUBILITY_G_PER_100_G,
    salt_of,
    saturation_fraction,
    settled_solid,
    solubility_of,
)

KILOGRAM = 1.0 / 0.0180153
"""Mol of water in a kilogram."""


def moles_left_solid(formula, moles, celsius=20.0, **others):
    """Mol that stay solid of so many in a kilogram of water; ``others``: mol of other things dissolved in it."""
    salt = salt_of(formula, solubility_of(formula))
    names = [PROTON, WATER, *salt.components, *others]
    column = {name: index for index, name in enumerate(dict.fromkeys(names))}
    amounts = np.zeros((1, len(column)))
    amounts[0, column[WATER]] = KILOGRAM
    for component, many in salt.components.items():
        amounts[0, column[component]] += many * moles
    for component, amount in others.items():
        amounts[0, column[component]] += amount
    return float(settled_solid(salt, column, amounts, np.array([celsius]))[0])


CRYSTAL_WATER = {**dict.fromkeys(SOLUBILITY_G_PER_100_G, 0), "Na2B4O7.10H2O": 10, "CuSO4.5H2O": 5}
"""Salt -> molecules of its crystal water."""


def test_salts_beyond_their_solubility_stay_solid():
    """In a kilogram of water at 20 degC 90 % of the tabled solubility dissolve wholly; of 150 % a third stays.

    The table is of g of dry salt in 100 g of water; crystal water of the solid dissolves its salt too.
    """
    for formula, crystal_water in CRYSTAL_WATER.items():
        dry_formula = formula.partition(".")[0]
        row = SOLUBILITY_G_PER_100_G[dry_formula]
        molal = 10.0 * np.interp(20.0, list(row), list(row.values())) / molar_mass(dry_formula)
        soluble_mol = molal / (1.0 - molal * crystal_water / KILOGRAM)
        assert moles_left_solid(formula, 0.9 * soluble_mol) == pytest.approx(0.0, abs=1e-9), formula
        assert moles_left_solid(formula, 1.5 * soluble_mol) == pytest.approx(0.5 * soluble_mol, rel=1e-9, abs=0), (
            formula
        )


def test_solution_of_the_tabled_solubility_is_saturated():
    """A solution of the tabled g in 100 g of water, crystal water included, is saturated at each temperature there.

    One of half as much is saturated by half.
    """
    for formula, crystal_water in CRYSTAL_WATER.items():
        dry_formula = formula.partition(".")[0]
        celsius, grams = (np.array(values) for values in zip(*SOLUBILITY_G_PER_100_G[dry_formula].items(), strict=True))
        salt = salt_of(formula, SOLUBILITY_G_PER_100_G[dry_formula])
        column = {name: index for index, name in enumerate(dict.fromkeys([PROTON, WATER, *salt.components]))}
        for fraction in (0.5, 1.0):
            moles = fraction * 10.0 * grams / molar_mass(dry_formula)
            amounts = np.zeros((len(moles), len(column)))
            for component, many in salt.components.items():
                amounts[:, column[component]] = many * moles
            amounts[:, column[WATER]] += KILOGRAM - crystal_water * moles
            assert saturation_fraction(salt, column, amounts, celsius) == pytest.approx(fraction), formula


def test_potassium_nitrate_crystallises_on_cooling():
    """10 mol of it, 101.1 g/mol, lie in a kilogram of water: at 60 degC all dissolve, at 20 degC 316 g (Lange)."""
    assert moles_left_solid("KNO3", moles=10.0, celsius=60.0) == 0.0
    assert moles_left_solid("KNO3", moles=10.0, celsius=20.0) == pytest.approx(10.0 - 316.0 / 101.1, rel=1e-3)


def test_dichromate_dissolves_up_to_its_table_when_hot():
    """A kilogram of water at 80 degC dissolves 709 g (CRC Handbook) of 3 mol, 294.2 g/mol: within 0.2 %."""
    assert moles_left_solid("K2Cr2O7", moles=3.0, celsius=80.0) == pytest.approx(3.0 - 709.0 / 294.2, rel=2e-3)


def test_a_common_ion_salts_out():
    """A kilogram of water at 20 degC, with 2 mol of chloride from elsewhere, dissolves s mol of 10 mol of NaCl.

    The product of the two ions is that of the saturated solution of 359 g, 6.14 mol: s (s + 2) = 6.14^2.
    """
    saturated_mol = 359.0 / 58.44
    dissolved_mol = -1.0 + np.sqrt(1.0 + saturated_mol**2)
    left_mol = moles_left_solid("NaCl", moles=10.0, celsius=20.0, **{"Cl-": 2.0, "Na+": 0.0})
    assert left_mol == pytest.approx(10.0 - dissolved_mol, rel=1e-3)


def test_a_hydroxide_goes_on_dissolving_in_acid():
    """A kilogram of water at 20 degC dissolves the tabled mol, about half of 40; with 39 mol of acid all dissolve."""
    table = SOLUBILITY_G_PER_100_G["NaOH"]
    soluble_mol = 10.0 * np.interp(20.0, list(table), list(table.values())) / molar_mass("NaOH")
    assert moles_left_solid("NaOH", moles=40.0) == pytest.approx(40.0 - soluble_mol, rel=1e-3)
    assert moles_left_solid("NaOH", moles=40.0, **{PROTON: 39.0}) == 0.0


@pytest.mark.parametrize("solubility", [0.0, -1.0, "much", {20: 0}, {}], ids=str)
def test_a_solubility_that_cannot_be_is_refused(solubility):
    """A scene gives g in 100 g of water, or such by degC: here none, less than none, a word, none at 20 degC, no row.

    KNO3 has a table, which the wrong value would replace.
    """
    with pytest.raises(ValueError, match="g in 100 g of water"):
        solubility_of("KNO3", solubility)
