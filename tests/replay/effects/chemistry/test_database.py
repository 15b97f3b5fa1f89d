"""PHREEQC's species and phases are counted in the ions of the file, each oxidation state for itself."""

import pytest

from replay.effects.chemistry.database import database_of, formula_of

EXTRA = """
SOLUTION_SPECIES
CoCl4-2 + Br- = CoCl4Br-3 # a comment
 log_k 0.25
 delta_h 3.0
Co+2 + 4 Cl- = CoCl4-2
 delta_h 2.0 kcal
 log_k -1.0
Co+2 + Cl- = CoCl+
 log_k 7.0
PHASES
CobaltSalt
 Na2CoCl4 = 2 Na+ + CoCl4-2
 log_k 4.0
 delta_h 500 joules
OtherSalt
 NaCl = Na+ + Cl-
 log_k 1.5
"""
"""A complex before the one that it is made of, another constant of a complex of minteq.v4, and two solids."""


@pytest.fixture(scope="module")
def database_with_extra():
    """PHREEQC's data and the above."""
    return database_of(EXTRA)


def test_phase_is_made_of_ions_protons_and_water(database_with_extra):
    """``makeup``: what a solid (``phase``: its name in PHREEQC's data) is made of; a hydroxide is water less a proton.

    minteq.v4 counts chromium as Cr(OH)2+ and tin as Sn(OH)2; here both are bare ions. CobaltSalt, Na2CoCl4, is no
    solid of minteq.v4 but of text that the fixture adds.
    """
    for phase, makeup in [
        ("Cr(OH)3", {"Cr^3+": 1, "H+": -3, "H2O": 3}),
        ("Sn(OH)2", {"Sn^2+": 1, "H+": -2, "H2O": 2}),
        ("Ferrihydrite", {"Fe^3+": 1, "H+": -3, "H2O": 3}),
        ("Cerargyrite", {"Ag+": 1, "Cl-": 1}),
        ("CobaltSalt", {"Na+": 2, "Co^2+": 1, "Cl-": 4}),
    ]:
        assert database_with_extra.phases[phase].makeup == makeup, phase


def test_constant_of_a_complex_of_a_complex_is_their_sum(database_with_extra):
    """Text for PHREEQC makes CoCl4-2 of ions with log_k -1.0 and 2 kcal, and CoCl4Br-3 of it with 0.25 and 3 kJ."""
    species = database_with_extra.species
    complex_of_ions, complex_of_complex = species["CoCl4-2"], species["CoCl4Br-3"]
    kj_of_2_kcal = 2.0 * 4.184
    assert (complex_of_ions.log_k, complex_of_ions.kilojoule) == (-1.0, pytest.approx(kj_of_2_kcal))
    assert complex_of_complex.log_k == -1.0 + 0.25
    assert complex_of_complex.kilojoule == pytest.approx(kj_of_2_kcal + 3.0)
    assert complex_of_complex.makeup == {"Co^2+": 1, "Cl-": 4, "Br-": 1}


def test_solid_of_a_complex_has_the_constant_of_ions(database_with_extra):
    """Text for PHREEQC gives a solid Na2CoCl4 a log_k of 4.0 and 500 joules; CoCl4-2 has log_k -1.0 and 8.368 kJ.

    [Na]^2 [CoCl4] is 10^4 and [CoCl4] is 10^-1 [Co] [Cl]^4, so the product of the ions is 10^5. ``options``: lines of
    the text as they stand there.
    """
    solid = database_with_extra.phases["CobaltSalt"]
    assert solid.log_k == pytest.approx(4.0 + 1.0)
    assert solid.kilojoule == pytest.approx(0.5 - 8.368)
    assert solid.options == ("log_k 4.0", "delta_h 500 joules")


def test_later_constant_of_a_species_replaces_the_former(database_with_extra):
    """A scene's text for PHREEQC gives CoCl+ a log_k of 7.0; minteq.v4 has another."""
    assert database_with_extra.species["CoCl+"].log_k == 7.0
    assert database_of().species["CoCl+"].log_k != 7.0


def test_ion_differs_from_its_column_by_protons_and_water():
    """``ion``: its name in minteq.v4; ``makeup``: what the product counts it as, hydroxide as water less a proton."""
    for ion, makeup in [
        ("NH4+", {"NH3": 1, "H+": 1}),
        ("HS-", {"S^2-": 1, "H+": 1}),
        ("Cr(OH)2+", {"Cr^3+": 1, "H+": -2, "H2O": 2}),
        ("Ca+2", {"Ca^2+": 1}),
    ]:
        assert database_of().ions[ion] == makeup, ion


def test_species_of_electrons_or_solid_sulfur_are_left_out():
    """minteq.v4 makes polysulfides of sulfide and solid sulfur, and one oxidation state of another with electrons."""
    species = database_of().species
    assert "AgCl2-" in species and "S4-2" not in species and "S5-2" not in species
    assert {name for name, entry in species.items() if "e-" in entry.makeup} == {"e-"}


def test_phreeqcs_charge_is_written_before_its_sign():
    """``name``: of a species of PHREEQC, with the sign before the charge; ``formula``: as the product writes it."""
    for name, formula in [
        ("Cu(NH3)4+2", "Cu(NH3)4^2+"),
        ("SO4-2", "SO4^2-"),
        ("Na+", "Na+"),
        ("H4SiO4", "H4SiO4"),
        ("Hg2+2", "Hg2^2+"),
    ]:
        assert formula_of(name) == formula, name
