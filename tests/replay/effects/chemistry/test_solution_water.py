"""Water in a litre of a solution against densities of solutions."""

import pytest

from replay.effects.chemistry.components import components_of
from replay.effects.chemistry.enthalpy import CONSTANTS
from replay.effects.chemistry.formulas import molar_mass
from replay.effects.chemistry.solution_water import (
    HYDROXIDE_ML,
    MOLAR_VOLUME_ML,
    WATER_ML,
    expansion,
    molar_of_molal,
    water_molar,
)

# Mass fraction in percent and density in g/mL at 20 degC. Source: CRC Handbook, Concentrative Properties of Aqueous
# Solutions.
DENSITIES = [
    ("NaCl", 26, 1.1972), ("KNO3", 24, 1.1623), ("KCl", 24, 1.1623), ("NaNO3", 40, 1.3175), ("KI", 40, 1.3959),
    ("AgNO3", 40, 1.4773), ("LiCl", 30, 1.1808), ("NH4Cl", 24, 1.0674), ("NH4NO3", 50, 1.2258), ("CaCl2", 40, 1.3957),
    ("MgCl2", 30, 1.2688), ("MgSO4", 26, 1.2961), ("ZnSO4", 16, 1.1789), ("CuSO4", 18, 1.2060), ("Na2CO3", 14, 1.1463),
    ("HCl", 20, 1.0980), ("NaOH", 20, 1.2192), ("NaOH", 40, 1.4299), ("KOH", 30, 1.2879), ("NH3", 20, 0.9228),
]  # fmt: skip
ROUGH = [("H2SO4", 50, 1.3951), ("H2SO4", 20, 1.1398), ("HNO3", 40, 1.2466), ("CH3COOH", 50, 1.0562)]


def test_water_of_strong_solutions_is_that_of_their_density():
    """A solution of so many mass ``percent``; a litre weighs 1000 g times the handbook's ``density`` in g/mL.

    All of that but the mass fraction of the solute is water; the mL of water that the product counts in a litre, 1 g
    each, agree within 2 %, or 4 % for acids in ``ROUGH``.
    """
    for formula, percent, density, tolerance in [
        *((*row, 0.02) for row in DENSITIES),
        *((*row, 0.04) for row in ROUGH),
    ]:
        molar = 10.0 * percent * density / molar_mass(formula)
        water_g = 10.0 * (100 - percent) * density
        assert WATER_ML * water_molar({formula: molar}) == pytest.approx(water_g, rel=tolerance), (formula, percent)


def test_dilute_solutions_contain_a_kilogram_of_water_a_litre():
    """A litre with up to 0.5 mol of solutes in all has 1000 mL of water; 0.7 mol displace some of it.

    WATER_ML: the volume of a mol of water.
    """
    assert WATER_ML * water_molar({"NaCl": 0.3, "HCl": 0.2}) == pytest.approx(1000.0)
    assert WATER_ML * water_molar({"NaCl": 0.6, "HCl": 0.1}) < 1000.0
    assert WATER_ML * water_molar({}) == pytest.approx(1000.0)


def test_hydrates_and_salts_make_the_same_solution():
    """A litre has 1 mol of either; the hydrate brings five mol of its water itself, so much less water is added.

    1 mol in a kilogram of water is as many mol/L of either.
    """
    hydrate, salt = (water_molar({formula: 1.0}) for formula in ("CuSO4.5H2O", "CuSO4"))
    assert hydrate + 5.0 == pytest.approx(salt)
    assert molar_of_molal("CuSO4.5H2O", 1.0) == pytest.approx(molar_of_molal("CuSO4", 1.0))


def test_ions_and_their_salt_make_the_same_solution():
    """1 mol/L of each ion, or of the salt: the water in a litre is the same."""
    assert water_molar({"Na+": 1.0, "Cl-": 1.0}) == pytest.approx(water_molar({"NaCl": 1.0}))


def test_hydroxide_takes_its_room_and_brings_no_water():
    """1 mol/L of barium hydroxide and of barium chloride, of the same ionic strength.

    Their water differs by the volume of the two anions of each, mL/mol.
    """
    chloride_ml, *_ = MOLAR_VOLUME_ML["Cl-"]
    beside_hydroxide, beside_chloride = (water_molar({formula: 1.0}) for formula in ("Ba(OH)2", "BaCl2"))
    assert (beside_hydroxide - beside_chloride) * WATER_ML == pytest.approx(2.0 * (chloride_ml - HYDROXIDE_ML))


def test_saturated_molalities_convert_to_handbook_molarities():
    """38 g of KNO3 and 36 g of NaCl in 100 g of water at 25 degC, 3.79 and 6.15 mol/kg, are 3.29 and 5.43 mol/L."""
    assert molar_of_molal("KNO3", 3.79) == pytest.approx(3.29, rel=0.01)
    assert molar_of_molal("NaCl", 6.15) == pytest.approx(5.43, rel=0.01)


def test_much_of_a_solute_without_known_room_is_refused():
    """Nobody knows how much water 1.5 mol/L of sugar displace; 0.5 mol/L are neglected."""
    assert water_molar({"C12H22O11": 0.5}) == pytest.approx(water_molar({}))
    with pytest.raises(KeyError, match="C12H22O11"):
        water_molar({"C12H22O11": 1.5})


def test_every_room_is_that_of_a_component():
    """Each key of the table of volumes is an ion or molecule by which amounts are counted: its own only component."""
    assert len(MOLAR_VOLUME_ML) > 0
    assert all(components_of(name) == {name: 1} for name in MOLAR_VOLUME_ML)


def test_each_strongest_solution_has_its_water():
    """Two tables: mol/L of the strongest solution of each solute that is sold, and of the water in it."""
    assert set(CONSTANTS["strong_water"]) == set(CONSTANTS["strongest"])


# Density of water, g/mL. Source: CRC Handbook, Properties of Water.
def test_density_of_water_falls_with_temperature_as_tabled():
    """``expansion`` is the density relative to that at 25 degC, 0.99705 g/mL."""
    for celsius, density in [(4.0, 0.99997), (25.0, 0.99705), (60.0, 0.98320), (80.0, 0.97179)]:
        assert expansion(celsius) == pytest.approx(density / 0.99705, abs=2e-5), celsius
