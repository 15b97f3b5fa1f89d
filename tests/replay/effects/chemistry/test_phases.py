"""Salts fall out where an equation makes them if less than 0.1 mol/kg of them dissolves by PHREEQC's constant."""

from math import prod

import pytest

from replay.effects.chemistry.database import database_of
from replay.effects.chemistry.phases import Phases

# log10 of the solubility product, and how many ions of each kind. Source: minteq.v4.dat of PHREEQC.
PRODUCTS = [
    ("Ag2SeO4", -8.91, (2, 1)), ("Cd3(PO4)2", -32.6, (3, 2)), ("Mn2(SO4)3", -5.711, (2, 3)),
    ("Tl2SO4", -3.7868, (2, 1)), ("Cu2SO4", -1.95, (2, 1)), ("CoF2", -1.5969, (1, 2)), ("K2SeO4", -0.73, (2, 1)),
    ("Cr(OH)2", 10.8189 - 2 * 14.0, (1, 2)),
]  # fmt: skip


def phases_of_phreeqc():
    """Solids and gases by PHREEQC's data, in a scene without solubilities of its own and without rates."""
    return Phases(database_of(), {}, frozenset())


def test_salt_falls_out_below_a_tenth_mol_by_its_product():
    """``log_product``: log10 of a salt's solubility product in PHREEQC's data; ``counts``: n1, n2 ions in a unit of it.

    Its solubility s in mol/kg follows from product = (n1 s)^n1 (n2 s)^n2; below 0.1 the salt is sparingly soluble.
    """
    for formula, log_product, counts in PRODUCTS:
        molal = (10.0**log_product / prod(count**count for count in counts)) ** (1.0 / sum(counts))
        assert phases_of_phreeqc().is_sparingly_soluble(formula) == (molal < 0.1), formula


def test_salt_of_dissolved_molecules_or_hydrolysed_ions_stays():
    """None of these salts, nor an ion, is sparingly soluble.

    Dissolved CdI2 is a molecule, and tin(IV) a hydroxide with hardly a bare ion. Of SnSO4 18.8 g dissolve in 100 g of
    water (CRC Handbook), far more than by PHREEQC's constant.
    """
    for formula in ["CdI2", "Sn(SO4)2", "NaCl", "Na+", "SnSO4"]:
        assert not phases_of_phreeqc().is_sparingly_soluble(formula), formula


def test_salts_that_hold_protons_fall_out_of_school_solutions():
    """Struvite, its hydrate and calcium hydrogenphosphate are sparingly soluble, though their ions hold protons."""
    for formula in ["MgNH4PO4", "MgNH4PO4.6H2O", "CaHPO4"]:
        assert phases_of_phreeqc().is_sparingly_soluble(formula), formula


def test_solid_is_phreeqcs_or_a_salt_with_its_solubility():
    """AgCl(s) and CO2(g) are PHREEQC's; NaCl has a table, KNO3 the scene's 50 g in 100 g of water (101.1 g/mol).

    BaSO4 is taken by an equation with a rate, and CaCO3 is named without its phase: both are neither. Nothing dissolves
    at a rate, so there is no solver for that.
    """
    taken_by_a_rate = frozenset({"BaSO4"})
    phases = Phases(database_of(), {"KNO3": {25.0: 50.0}}, taken_by_a_rate)
    for formula, phase in (("AgCl", "s"), ("NaCl", "s"), ("KNO3", "s"), ("BaSO4", "s"), ("CaCO3", ""), ("CO2", "g")):
        phases.add(formula, phase)
    assert set(phases.phreeqc) == {"AgCl(s)", "CO2(g)"}
    assert set(phases.salts) == {"NaCl(s)", "KNO3(s)"}
    assert phases.salts["KNO3(s)"].molal.tolist() == pytest.approx([500.0 / 101.1], rel=1e-4)
    assert phases.has_known_solubility("AgCl") and phases.has_known_solubility("NaCl")
    assert phases.slow_solver([]) is None


def test_process_that_only_dissolves_a_solid_is_slow():
    """``changes``: mol of each formula that a mol of a process with a rate makes, or takes if below 0.

    ``column``: the solid that it only dissolves; none ("") where acid takes part, or the solid falls out.
    """
    for case, (changes, column) in {
        "carbonate": ({"CaCO3(s)": -1.0, "H2O": -1.0, "Ca^2+": 1.0, "CO3^2-": 1.0}, "CaCO3(s)"),
        "hydroxide": ({"Mg(OH)2(s)": -1.0, "Mg^2+": 1.0, "H+": -2.0, "H2O": 2.0}, "Mg(OH)2(s)"),
        "in acid": ({"CaCO3(s)": -1.0, "H+": -2.0, "Ca^2+": 1.0, "CO2(g)": 1.0, "H2O": 1.0}, ""),
        "falls out": ({"CaCO3(s)": 1.0, "Ca^2+": -1.0, "CO3^2-": -1.0}, ""),
    }.items():
        phases = phases_of_phreeqc()
        assert phases.dissolves_slowly(changes) == column, case
        assert set(phases.slow) == ({column} if column else set()), case


def test_without_phreeqc_no_solid_is_sparing_or_slow():
    """There is no data base, as where PHREEQC, an extra, is not installed: nothing is known, and nothing solved."""
    phases = Phases(None, {}, frozenset())
    phases.add("AgCl", "s")
    assert not phases.has_known_solubility("AgCl") and not phases.is_sparingly_soluble("AgCl")
    assert phases.solver([]) is None and phases.slow_solver([]) is None
    assert phases.dissolves_slowly({"CaCO3(s)": -1.0, "Ca^2+": 1.0, "CO3^2-": 1.0}) == ""
