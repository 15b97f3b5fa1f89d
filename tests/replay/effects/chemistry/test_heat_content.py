"""Heats of strong solutions against Pitzer's equations, integral heats of solution and heat capacities of handbooks."""

from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest
from support.liquid_worlds import heat_of_pouring
from support.processes import script

from replay.effects.chemistry.components import dissolved_components
from replay.effects.chemistry.formulas import molar_mass
from replay.effects.chemistry.heat_content import SALT_HEATS_KJ_MOL, HeatContent
from replay.effects.chemistry.heats import Heats
from replay.effects.chemistry.ledger_columns import ENERGY_COLUMNS, HEAT_CAPACITY_COLUMN, UNFOLLOWED_WARMTH, Warmth
from replay.effects.chemistry.warming import solid_j_per_mol_k

RT2 = 8.314462618 * 298.15**2
DEBYE_J = 1986.0
"""A of the enthalpy at 25 degC, J kg^0.5 mol^-1.5. Source: K. S. Pitzer, Activity Coefficients, 1991."""

PITZER = {
    "Na+ Cl-": (7.159e-4, 7.005e-4, -10.54e-5), "K+ Cl-": (5.794e-4, 10.71e-4, -5.095e-5),
    "Na+ NO3-": (12.66e-4, 20.6e-4, -23.16e-5), "K+ NO3-": (2.06e-4, 64.5e-4, 39.7e-5),
    "NH4+ Cl-": (0.779e-4, 12.58e-4, 2.1e-5), "Na+ OH-": (7e-4, 1.34e-4, -18.94e-5),
    "K+ I-": (9.914e-4, 11.86e-4, -9.44e-5), "K+ Br-": (7.39e-4, 17.4e-4, -7.004e-5),
    "Li+ Cl-": (-1.685e-4, 5.366e-4, -4.52e-5), "H+ Br-": (-2.049e-4, 4.467e-4, -5.685e-5),
    "H+ Cl-": (-3.081e-4, 1.419e-4, 6.213e-5), "Na+ I-": (8.355e-4, 8.28e-4, -8.35e-5),
}  # fmt: skip
"""Derivatives of beta0, beta1, C by temperature. Source: L. F. Silvester, K. S. Pitzer, J. Solution Chem. 7, 1978."""


def pitzer_kilojoule(key, molal):
    """Relative apparent molal enthalpy of a salt of two ions of one charge, by Pitzer's equation."""
    first, second, third = PITZER[key]
    root = np.sqrt(molal)
    decay = 2.0 * root
    middle = first + second * 2.0 * (1.0 - (1.0 + decay) * np.exp(-decay)) / decay**2
    debye = 2.0 * DEBYE_J / 2.4 * np.log1p(1.2 * root)
    return (debye - 2.0 * RT2 * (molal * middle + molal**2 * third / 2.0)) / 1e3


def test_heats_of_the_table_are_those_of_pitzers_equation():
    """Relative molal enthalpies of salts at 0.1 to 2 mol/kg of water: those of the table within 0.4 kJ/mol.

    The expected ones are by Pitzer's equation with published parameters.
    """
    for key, molal in product(PITZER, (0.1, 0.5, 1.0, 2.0)):
        heat = SALT_HEATS_KJ_MOL[key][f"{molal:g}"]
        assert heat == pytest.approx(pitzer_kilojoule(key, molal), abs=0.4), (key, molal)


def test_table_values_are_printed_again_from_their_parameters():
    """The script .ci/heat_contents computes kJ/mol of pairs of ions at mol/kg from parameters of the literature.

    For each of more than 280 rows what stands in the table is what it computes, within its own tolerance.
    """
    contents = script("heat_contents")
    rows = list(contents.rows())
    assert len(rows) > 280
    for pair, molal, tabled_kj, (_source, computed_kj) in rows:
        assert tabled_kj == pytest.approx(computed_kj, abs=contents.ENOUGH_KJ), (pair, molal)


def joule_of(solution, declared=()):
    """J of ions (formula -> mol) in a kilogram of water; ``declared``: formulas whose heat the scene declares."""
    columns = dict.fromkeys(name for formula in solution for name in dissolved_components(formula))
    column = {name: number for number, name in enumerate(dict.fromkeys(("H+", "H2O", *columns)))}
    amounts = np.zeros((1, len(column)))
    for formula, moles in solution.items():
        for name, many in dissolved_components(formula).items():
            amounts[0, column[name]] += many * moles
    content = HeatContent(column, mixture=None, declared=declared)
    moles = content.moles(amounts, np.zeros((1, 0)), column["H+"])
    return float(content.joule(moles, np.ones(1))[0])


def test_heat_of_dissolved_salts_depends_only_on_their_ions():
    """3 mol/kg of NaNO3 with KCl, and of NaCl with KNO3, are the same ions in water, and have the same heat."""
    assert joule_of({"NaNO3": 3.0, "KCl": 3.0}) == pytest.approx(joule_of({"NaCl": 3.0, "KNO3": 3.0}), rel=1e-12)


def test_heat_of_a_strong_solution_is_that_of_the_table():
    """J by which a solution (mol in 1 kg of water) differs from a dilute one; NaCl at 4 mol/kg has -1.43 kJ a mol.

    Up to 1.1 mol/kg of charges counts as dilute, whatever the table has: HCl has 1 here, and Na2CO3 2 x 0.5.
    """
    for solution, joule in [({"NaCl": 4.0}, -4.0 * 1430.0), ({"HCl": 1.0}, 0.0), ({"Na2CO3": 0.5}, 0.0)]:
        assert joule_of(solution) == pytest.approx(joule, rel=1e-9), solution


def test_declared_salt_has_no_tabled_heat_of_its_own():
    """The table has a heat of 4 mol/kg of NaCl, unless the scene declares the heat of NaCl itself."""
    assert joule_of({"NaCl": 4.0}, declared=["NaCl"]) == 0.0
    assert joule_of({"NaCl": 4.0}, declared=["NaNO3"]) == joule_of({"NaCl": 4.0}) < 0.0


# kJ/mol of a solid in so many mol/kg. Source: integral heats of solution of R. M. Felder and R. W. Rousseau, Elementary
# Principles of Chemical Processes, of NaOH, moved to the 44.51 of V. B. Parker at infinite dilution; of CaCl2 in 10 and
# 20 mol of water the NBS tables of 1982.
INTEGRAL_HEATS = [
    ("NaOH", 5.551, -44.15), ("NaOH", 2.775, -44.48), ("NaOH", 7.5, -42.4), ("CaCl2", 5.551, -66.9),
    ("CaCl2", 2.775, -74.3),
]  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(("formula", "molal", "kilojoule_per_mole"), INTEGRAL_HEATS)
def test_a_solid_in_little_water_has_its_integral_heat(formula, molal, kilojoule_per_mole):
    """100 mL of water are poured on as much of a solid as makes ``molal`` mol/kg.

    The heat that warms them is, with the other sign, the integral heat of solution of handbooks, within 3 %.
    """
    kilograms_of_water = 0.1
    moles = kilograms_of_water * molal
    solid = {"properties": {"solid": {"formula": formula, "mass_g": moles * molar_mass(formula)}}, "volume_ml": 0.0}
    joule, _coldest_c, _warmest_c = heat_of_pouring({"volume_ml": 1000 * kilograms_of_water}, solid, equation=None)
    assert -joule / moles / 1e3 == pytest.approx(kilojoule_per_mole, rel=0.03)


# J that a mol gives off when it is diluted from one ratio of water to another. Source: Felder and Rousseau, table B.11.
DILUTED = [
    ("NaOH", 10.0, 1.0, 4.8e3, 0.1), ("HCl", 12.0, 1.0, 15.4e3, 0.1), ("H2SO4", 18.35, 1.0, 70.0e3, 0.05),
]  # fmt: skip


@pytest.mark.parametrize(("formula", "strong_molar", "weak_molar", "joule_mol", "relative"), DILUTED)
def test_a_strong_solution_gives_off_its_heat_of_dilution(formula, strong_molar, weak_molar, joule_mol, relative):
    """50 mL of water are poured into so much of a strong solution that ``weak_molar`` mol/L result.

    ``joule_mol``: of the solute, by the literature; ``relative``: how far the heat may be from it.
    """
    strong_ml = 50.0 * weak_molar / (strong_molar - weak_molar)
    strong = {"volume_ml": strong_ml, "solutes": {formula: strong_molar}}
    joule, _coldest_c, _warmest_c = heat_of_pouring({"volume_ml": 50.0}, strong, equation=None)
    moles = strong_ml * strong_molar * 1e-3
    assert joule / moles == pytest.approx(joule_mol, rel=relative)


def test_heat_of_neutralisation_grows_with_concentration():
    """50 mL of acid and of lye, 2 mol/L each, 0.1 mol: 58.6 kJ/mol, within 1 %.

    That is 55.84 kJ/mol of ions and the heats of dilution of both; calorimeters of schools have 57.5 to 59.
    """
    acid, base = ({"volume_ml": 50.0, "solutes": {formula: 2.0}} for formula in ("HCl", "NaOH"))
    joule, _coldest_c, _warmest_c = heat_of_pouring(acid, base, "HCl + NaOH -> NaCl + H2O")
    assert joule / 0.1 == pytest.approx(58.6e3, rel=0.01)


# J/K of a solution in a kilogram of water. Source: M. Laliberte, J. Chem. Eng. Data 54, 2009.
CAPACITIES = [
    ("NaNO3", 3.0, 4414.0), ("NaNO3", 10.0, 5275.0), ("NH4NO3", 10.0, 5317.0), ("NH4NO3", 15.0, 6040.0),
    ("NH4Cl", 6.0, 4435.0), ("CaCl2", 6.0, 4230.0), ("NaOH", 6.0, 4502.0), ("KNO3", 3.0, 4351.0), ("NaCl", 5.0, 4380.0),
]  # fmt: skip


def test_a_dissolved_solid_adds_to_the_heat_capacity():
    """A kilogram of water, 4180 J/K, has ``molal`` mol of a salt; with it ``joule_k`` in all by the literature.

    The product is within 7 % of that; all of the salt is dissolved, so nothing is added for a solid.
    """
    for formula, molal, joule_k in CAPACITIES:
        solid_j_per_k, dissolved_j_per_k = capacities_of(formula, moles=molal, solid_moles=0.0)
        assert solid_j_per_k == 0.0, (formula, molal)
        assert 4180.0 + dissolved_j_per_k == pytest.approx(joule_k, rel=0.07), (formula, molal)


def test_undissolved_solid_adds_its_own_heat_capacity():
    """3 mol of NaNO3 lie in a kilogram of water and none of it is dissolved."""
    solid_j_per_k, dissolved_j_per_k = capacities_of("NaNO3", moles=3.0, solid_moles=3.0)
    assert solid_j_per_k == pytest.approx(3.0 * solid_j_per_mol_k("NaNO3"))
    assert dissolved_j_per_k == pytest.approx(0.0)


def capacities_of(formula, moles, solid_moles):
    """J/K that a solid adds, and that what is dissolved adds, of ``moles`` in a kilogram of water, some of it solid."""
    column = {name: number for number, name in enumerate(("H+", "H2O", f"{formula}(s)", *ENERGY_COLUMNS))}
    heats = Heats(column, mixture=None, salts=(), warmth=Warmth(per_ml=4.18, glass={}, excess={}, loss=0.0, most=80.0))
    amounts = np.zeros(len(column))
    amounts[column["H2O"]] = 1.0 / 0.0180153
    amounts[column[f"{formula}(s)"]] = solid_moles
    amounts[column[HEAT_CAPACITY_COLUMN]] = moles * solid_j_per_mol_k(formula)
    return heats.capacities(amounts)


def test_undissolved_solid_leaves_the_capacity_of_its_solution_alone():
    """3 of 8 mol of NaNO3 in a kilogram of water are solid: the other 5 count as if they were alone."""
    solid_j_per_k, beside_solid_j_per_k = capacities_of("NaNO3", moles=8.0, solid_moles=3.0)
    _no_solid, alone_j_per_k = capacities_of("NaNO3", moles=5.0, solid_moles=0.0)
    assert solid_j_per_k == pytest.approx(3.0 * solid_j_per_mol_k("NaNO3"))
    assert beside_solid_j_per_k == pytest.approx(alone_j_per_k) and alone_j_per_k > 0.0


def test_solid_that_does_not_dissolve_is_warmed():
    """100 mL of water, 40 K above the room's 20 degC, are poured on 1 mol of silver chloride of the room's temperature.

    The water's heat stays in vessel b, and warms both, by the sum of their heat capacities.
    """
    room_c, excess_k, water_j_per_k, solid_j_per_k = 20.0, 40.0, 100.0 * 4.18, 52.0
    chloride = {"properties": {"solid": {"formula": "AgCl", "mass_g": 143.32}}, "volume_ml": 0.0}
    joule, _coldest, warmest = heat_of_pouring(
        {"volume_ml": 100.0}, chloride, equation=None, solids={"b": solid_j_per_k}, excess={"a": excess_k}
    )
    assert joule == pytest.approx(water_j_per_k * excess_k, rel=1e-4)
    assert warmest == pytest.approx(room_c + joule / (water_j_per_k + solid_j_per_k), abs=0.1)


def test_heat_content_is_not_computed_where_no_heat_is_followed():
    """The scene has no effect heat, so the heat of solutions is nobody's concern."""
    column = {"H+": 0, "H2O": 1, **dict.fromkeys(ENERGY_COLUMNS, 2)}
    assert Heats(column, mixture=None, salts=(), warmth=UNFOLLOWED_WARMTH).content is None


SPECIES = [
    ({"H+": 1.0}, {"H+": 1.0}),
    ({"H+": -1.0, "H2O": 1.0}, {"OH-": 1.0}),
    ({"H2O": 1.0}, {}),
    ({"SO4^2-": 1.0, "H+": 1.0}, {"HSO4-": 1.0}),
    ({"SO4^2-": 1.0, "H+": 2.0}, {}),
    ({"Cl-": 1.0, "H+": 2.0}, {"H+": 1.0}),
    ({"NH3": 1.0}, {}),
    ({"NH3": 1.0, "H+": 1.0}, {"NH4+": 1.0}),
    ({"Na+": 1.0, "CO3^2-": 1.0}, {"Na+": 1.0, "CO3^2-": 1.0}),
    ({"Fe^3+": 1.0, "H+": -1.0, "H2O": 1.0}, {"Fe^3+": 1.0}),
    ({"Ca^2+": 1.0, "H+": -1.0, "H2O": 1.0}, {"Ca^2+": 1.0, "OH-": 1.0}),
]
"""Makeup of a species of PHREEQC, and the ions whose heat it has: a pair of ions has both, a molecule none."""


def test_species_have_the_heat_of_their_ions():
    """A mol of a species of PHREEQC has the heat of the ions that SPECIES has beside its makeup.

    A pair of ions has that of both, an ion with a hydroxide's water that of the ion, a molecule none.
    """
    mixture = SimpleNamespace(species=[SimpleNamespace(makeup=makeup) for makeup, _ in SPECIES])
    content = HeatContent({}, mixture)
    a_mol_of_each = np.eye(len(SPECIES))
    # The other two arguments are for liquids that PHREEQC is not asked about.
    moles = content.moles(np.zeros((1, 0)), species=a_mol_of_each, proton=0)
    for row, (makeup, ions) in zip(moles, SPECIES, strict=True):
        assert {name: many for name, many in zip(content.ions, row, strict=True) if many} == ions, makeup
