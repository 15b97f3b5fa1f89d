"""Acid, hydroxide and catalysts end a process without a constant."""

from dataclasses import replace

import numpy as np
import pytest
from oracles.random_liquids import solver_of

from replay.effects.chemistry.limits import Cause, Limits
from replay.effects.chemistry.processes import Process
from replay.effects.chemistry.salts import salt_of, solubility_of

COLUMNS = ("H+", "H2O", "SO3^2-", "Zn(s)", "SO2(g)", "I2", "KNO3(s)", "K+", "NO3-")
SO2 = Process("", {"SO3^2-": -1.0, "H+": -2.0, "SO2(g)": 1.0, "H2O": 1.0}, acid=2.0, gas_solubility=1e-3)
LYE = Process("", {"Zn(s)": -1.0, "H+": 2.0}, acid=-2.0)
CATALYSED = Process("", {"I2": -1.0}, catalysts=frozenset({"H+"}))


KILOGRAM_MOL = 1.0 / 0.0180153
"""Mol of water in a kilogram."""


def limits_and_amounts(process, amounts):
    """Limits of one process, and the row of a liquid with so many mol of each column."""
    column = {name: index for index, name in enumerate(COLUMNS)}
    changes = np.array([[process.changes.get(name, 0.0) for name in COLUMNS]])
    limits = Limits([process], changes, column, solver_of(["SO3^2-"]), slow_solids=None, room_c=25.0)
    row = np.zeros(len(COLUMNS))
    for name, moles in amounts.items():
        row[column[name]] = moles
    return limits, row


def limit(process, cause, **amounts):
    """Mol of a process until a cause ends it, in a liquid with so many mol of each column."""
    limits, row = limits_and_amounts(process, amounts)
    return float(limits.by_cause(0, row)[cause])


@pytest.mark.parametrize("water_mol", [0.0, KILOGRAM_MOL], ids=["no water in the equation", "water in the equation"])
@pytest.mark.parametrize(("acid_mol", "expected_mol"), [(1.0, 0.0), (1.5, 0.5), (2.0, 1.0)])
def test_gas_leaves_only_beyond_its_hydrogen_salt(acid_mol, expected_mol, water_mol):
    """SO3^2- + 2 H+ -> SO2(g) + H2O with a mol of sulfite: it takes a mol of acid as hydrogensulfite before any leaves.

    ``expected_mol``: until acid ends it. Water that the equation takes up binds no acid, and changes nothing.
    """
    process = replace(SO2, changes=SO2.changes | {"H2O": -1.0}) if water_mol else SO2
    mol = {"H+": acid_mol, "SO3^2-": 1.0, "H2O": water_mol}
    assert limit(process, Cause.ACID, **mol) == pytest.approx(expected_mol, abs=1e-9)


def test_lye_dissolves_half_as_many_mol_of_zinc():
    """A mol of zinc takes two of hydroxide, which count as protons below 0: 3 mol dissolve 1.5 of 9 mol."""
    assert limit(LYE, Cause.HYDROXIDE, **{"H+": -3.0, "Zn(s)": 9.0}) == pytest.approx(1.5)


def test_protons_of_a_weak_acid_catalyse_nothing():
    """Protons are the catalyst of a process: with them any amount of it may run (infinite), without them none.

    Half a mol of protons beside a mol of sulfite become hydrogensulfite, a weak acid, pKa 7.2: none is free.
    """
    for case, (acid_mol, sulfite_mol, expected_mol) in {
        "strong acid": (0.5, 0.0, np.inf),
        "weak acid": (0.5, 1.0, 0.0),
        "no acid": (0.0, 0.0, 0.0),
    }.items():
        mol = {"H+": acid_mol, "SO3^2-": sulfite_mol, "I2": 1.0}
        assert limit(CATALYSED, Cause.CATALYST, **mol) == expected_mol, case


def test_each_reagent_but_protons_and_water_is_a_limit():
    """A process takes a mol of Zn, two of I2, one of H+ and H2O; there are 3 mol of Zn, 4 of I2, and little else.

    By Zn 3 mol could run, by I2 2 mol, which use it up first.
    """
    process = Process("", {"Zn(s)": -1.0, "I2": -2.0, "H+": -1.0, "H2O": -1.0, "NO3-": 1.0})
    limits, amounts = limits_and_amounts(process, {"Zn(s)": 3.0, "I2": 4.0, "H+": 0.1, "H2O": 0.1, "NO3-": 7.0})
    assert limits.by_cause(0, amounts) == {"Zn(s)": 3.0, "I2": 2.0}
    assert limits.extent_to_the_end(row=0, amounts=amounts) == 2.0


def test_gas_that_stays_dissolved_does_not_leave():
    """A mol of sulfite makes SO2 with acid in excess; a kilogram of water dissolves a millimol of it, which is made up.

    So much less leaves as a gas.
    """
    soluble_mol_kg = 1e-3
    hardly_soluble = replace(SO2, gas_solubility=soluble_mol_kg)
    limits, amounts = limits_and_amounts(hardly_soluble, {"SO3^2-": 1.0, "H+": 5.0, "H2O": KILOGRAM_MOL})
    assert limits.extent_to_the_end(row=0, amounts=amounts) == pytest.approx(1.0 - soluble_mol_kg)


def test_salt_dissolves_until_its_solution_is_saturated():
    """10 mol of KNO3, 101.1 g/mol, in a kilogram of water at 25 degC dissolve as far as the table says."""
    solubility = solubility_of("KNO3")
    process = Process("", {"KNO3(s)": -1.0, "K+": 1.0, "NO3-": 1.0}, 0.1, salt=salt_of("KNO3", solubility))
    dissolved = limit(process, Cause.SATURATION, **{"KNO3(s)": 10.0, "H2O": KILOGRAM_MOL})
    grams_per_100_g = np.interp(25.0, list(solubility), list(solubility.values()))
    assert dissolved == pytest.approx(10.0 * grams_per_100_g / 101.1, rel=1e-3)
