"""Acid, hydroxide and catalysts end a process without a constant."""

import numpy as np
import pytest
from oracles.random_liquids import solver_of

from replay.effects.chemistry.limits import Cause, Limits
from replay.effects.chemistry.processes import Process

COLUMNS = ("H+", "H2O", "SO3^2-", "Zn(s)", "SO2(g)", "I2")
SO2 = Process("", {"SO3^2-": -1.0, "H+": -2.0, "SO2(g)": 1.0, "H2O": 1.0}, acid=2.0, gas_solubility=1e-3)
LYE = Process("", {"Zn(s)": -1.0, "H+": 2.0}, acid=-2.0)
CATALYSED = Process("", {"I2": -1.0}, catalysts=frozenset({"H+"}))


def limit(process, cause, **amounts):
    """Mol of a process until a cause ends it, in a liquid with so many mol of each column."""
    column = {name: index for index, name in enumerate(COLUMNS)}
    changes = np.array([[process.changes.get(name, 0.0) for name in COLUMNS]])
    limits = Limits([process], changes, column, solver_of(["SO3^2-"]), slow_solids=None, room_c=25.0)
    row = np.zeros(len(COLUMNS))
    for name, moles in amounts.items():
        row[column[name]] = moles
    return float(limits.by_cause(0, row)[cause])


@pytest.mark.parametrize(("acid", "expected"), [(1.0, 0.0), (1.5, 0.5), (2.0, 1.0)])
def test_gas_leaves_only_beyond_its_hydrogen_salt(acid, expected):
    """A mol of sulfite takes a mol of acid as hydrogensulfite before any leaves as SO2."""
    assert limit(SO2, Cause.ACID, **{"H+": acid, "SO3^2-": 1.0}) == pytest.approx(expected, abs=1e-9)


def test_lye_dissolves_half_a_mol_of_zinc():
    assert limit(LYE, Cause.HYDROXIDE, **{"H+": -3.0, "Zn(s)": 9.0}) == pytest.approx(1.5)


@pytest.mark.parametrize(("acid", "sulfite", "expected"), [(0.5, 0.0, np.inf), (0.5, 1.0, 0.0), (0.0, 0.0, 0.0)])
def test_protons_of_a_weak_acid_catalyse_nothing(acid, sulfite, expected):
    """Half a mol of protons beside a mol of sulfite are hydrogensulfite, whose pKa is 7.2."""
    assert limit(CATALYSED, Cause.CATALYST, **{"H+": acid, "SO3^2-": sulfite, "I2": 1.0}) == expected
