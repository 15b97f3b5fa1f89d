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


@pytest.mark.parametrize(("acid", "expected"), [(1.0, 0.0), (1.5, 0.5), (2.0, 1.0)])
def test_gas_leaves_only_beyond_its_hydrogen_salt(acid, expected):
    """A mol of sulfite takes a mol of acid as hydrogensulfite before any leaves as SO2."""
    assert limit(SO2, Cause.ACID, **{"H+": acid, "SO3^2-": 1.0}) == pytest.approx(expected, abs=1e-9)
    takes_water = replace(SO2, changes=SO2.changes | {"H2O": -1.0})
    moles = {"H+": acid, "SO3^2-": 1.0, "H2O": KILOGRAM_MOL}
    assert limit(takes_water, Cause.ACID, **moles) == pytest.approx(expected, abs=1e-9), "water holds no acid"


def test_lye_dissolves_half_as_many_mol_of_zinc():
    """A mol of zinc takes two of hydroxide, which count as protons below 0: 3 mol dissolve 1.5 mol."""
    assert limit(LYE, Cause.HYDROXIDE, **{"H+": -3.0, "Zn(s)": 9.0}) == pytest.approx(1.5)


@pytest.mark.parametrize(("acid", "sulfite", "expected"), [(0.5, 0.0, np.inf), (0.5, 1.0, 0.0), (0.0, 0.0, 0.0)])
def test_protons_of_a_weak_acid_catalyse_nothing(acid, sulfite, expected):
    """Half a mol of protons beside a mol of sulfite are hydrogensulfite, whose pKa is 7.2: 0 mol may run, else any."""
    assert limit(CATALYSED, Cause.CATALYST, **{"H+": acid, "SO3^2-": sulfite, "I2": 1.0}) == expected


def test_each_reagent_but_protons_and_water_is_a_limit():
    """3 mol of Zn at one a time, 4 mol of I2 at two a time: 2 mol of the process use up the iodine first."""
    process = Process("", {"Zn(s)": -1.0, "I2": -2.0, "H+": -1.0, "H2O": -1.0, "NO3-": 1.0})
    limits, amounts = limits_and_amounts(process, {"Zn(s)": 3.0, "I2": 4.0, "H+": 0.1, "H2O": 0.1, "NO3-": 7.0})
    assert limits.by_cause(0, amounts) == {"Zn(s)": 3.0, "I2": 2.0}
    assert limits.extent_to_the_end(row=0, amounts=amounts) == 2.0


def test_gas_that_stays_dissolved_does_not_leave():
    """A kilogram of water dissolves 1e-3 mol of a made-up gas; acid is enough for the whole mol of sulfite."""
    hardly_soluble = replace(SO2, gas_solubility=1e-3)
    limits, amounts = limits_and_amounts(hardly_soluble, {"SO3^2-": 1.0, "H+": 5.0, "H2O": KILOGRAM_MOL})
    assert limits.extent_to_the_end(row=0, amounts=amounts) == pytest.approx(1.0 - 1e-3)


def test_salt_dissolves_until_its_solution_is_saturated():
    """10 mol of KNO3, 101.1 g/mol, in a kilogram of water at 25 degC dissolve as far as the table says."""
    solubility = solubility_of("KNO3")
    process = Process("", {"KNO3(s)": -1.0, "K+": 1.0, "NO3-": 1.0}, 0.1, salt=salt_of("KNO3", solubility))
    dissolved = limit(process, Cause.SATURATION, **{"KNO3(s)": 10.0, "H2O": KILOGRAM_MOL})
    grams_per_100_g = np.interp(25.0, list(solubility), list(solubility.values()))
    assert dissolved == pytest.approx(10.0 * grams_per_100_g / 101.1, rel=1e-3)
