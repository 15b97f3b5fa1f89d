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
    """90 % of the tabled solubility dissolve wholly; of 150 % a third stays; crystal water dissolves its salt too."""
    for formula, crystal_water in CRYSTAL_WATER.items():
        dry_formula = formula.partition(".")[0]
        row = SOLUBILITY_G_PER_100_G[dry_formula]
        molal = 10.0 * np.interp(20.0, list(row), list(row.values())) / molar_mass(dry_formula)
        soluble = molal / (1.0 - molal * crystal_water / KILOGRAM)
        assert moles_left_solid(formula, 0.9 * soluble) == pytest.approx(0.0, abs=1e-9), formula
        assert moles_left_solid(formula, 1.5 * soluble) == pytest.approx(0.5 * soluble, rel=1e-9), formula


def test_solution_of_the_tabled_solubility_is_saturated():
    """At each temperature of its table, which counts crystal water as water; of half as much by half."""
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
    """A kilogram of water at 20 degC dissolves 316 g, at 60 degC all of 10 mol (Lange's Handbook); 101.1 g/mol."""
    assert moles_left_solid("KNO3", moles=10.0, celsius=60.0) == 0.0
    assert moles_left_solid("KNO3", moles=10.0, celsius=20.0) == pytest.approx(10.0 - 316.0 / 101.1, rel=1e-3)


def test_dichromate_dissolves_up_to_its_table_when_hot():
    """709 g in a kilogram of water at 80 degC (CRC Handbook), 294.2 g/mol; 7 % less came out before."""
    assert moles_left_solid("K2Cr2O7", moles=3.0, celsius=80.0) == pytest.approx(3.0 - 709.0 / 294.2, rel=2e-3)


def test_a_common_ion_salts_out():
    """The product of two ions is that of the saturated solution: s (s + 2) = 6.14^2."""
    more = {"Cl-": 2.0, "Na+": 0.0}
    root = -1.0 + np.sqrt(1.0 + (359.0 / 58.44) ** 2)
    assert moles_left_solid("NaCl", moles=10.0, celsius=20.0, **more) == pytest.approx(10.0 - root, rel=1e-3)


def test_a_hydroxide_goes_on_dissolving_in_acid():
    """A kilogram of water at 20 degC dissolves the tabled mol, about half of 40; with 39 mol of acid all dissolve."""
    table = SOLUBILITY_G_PER_100_G["NaOH"]
    soluble = 10.0 * np.interp(20.0, list(table), list(table.values())) / molar_mass("NaOH")
    assert moles_left_solid("NaOH", moles=40.0) == pytest.approx(40.0 - soluble, rel=1e-3)
    assert moles_left_solid("NaOH", moles=40.0, **{PROTON: 39.0}) == 0.0


@pytest.mark.parametrize("wrong", [0.0, -1.0, "much", {20: 0}, {}])
def test_a_solubility_that_cannot_be_is_refused(wrong):
    with pytest.raises(ValueError, match="g in 100 g of water"):
        solubility_of("KNO3", wrong)
