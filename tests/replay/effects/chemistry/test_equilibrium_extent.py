"""Equations with a constant stop where the quotient of their amounts is that constant, forwards and backwards."""

from types import SimpleNamespace

import numpy as np
import pytest
from oracles.random_liquids import solver_of
from scipy.optimize import brentq

from replay.effects.chemistry.equilibrium_extent import EquilibriumExtents
from replay.effects.chemistry.iodine import TRIIODIDE_CONSTANT
from replay.effects.chemistry.processes import Process

COLUMNS = ("H+", "H2O", "A", "B", "B(g)", "CH3COO-", "C2H5OH", "CH3COOC2H5", "NH3", "Na+", "Cl-")
KILOGRAM_MOL = 55.508


def extent(process, most, *, celsius=25.0, holds_acid=(), solver=None, **mol):
    """Mol by which a process runs until its equilibrium, in a kilogram of water with so many mol of each column.

    ``most``: mol until a reagent is used up; ``holds_acid``: protons that a mol of a base binds.
    """
    column = {name: index for index, name in enumerate(COLUMNS)}
    changes = np.array([[process.changes.get(name, 0.0) for name in COLUMNS]])
    bound = np.array([dict(holds_acid).get(name, 0.0) for name in COLUMNS])
    amounts = np.array([[{"H2O": KILOGRAM_MOL, **mol}.get(name, 0.0) for name in COLUMNS]])
    extents = EquilibriumExtents([process], changes, column, solver, holds_acid=bound)
    assert extents.known(0)
    return float(extents.extent(0, amounts, np.array([most]), np.array([celsius]))[0])


ISOMER = {"A": -1.0, "B": 1.0}


def test_isomers_stop_at_the_ratio_of_their_constant():
    """There are ``a`` mol of A and ``b`` mol of its isomer B; x mol of A become B.

    (b + x) / (a - x) is then the constant K, so x = (K a - b) / (1 + K), below 0 where there is too much B. ``most``:
    mol by which it could run without an equilibrium, all of A.
    """
    for a, b, log_k in [(1.0, 0.0, 0.0), (0.2, 0.8, 0.0), (0.5, 0.5, 0.5), (0.5, 0.5, -0.5), (1.0, 0.0, 2.0)]:
        constant = 10.0**log_k
        expected = (constant * a - b) / (1.0 + constant)
        made_mol = extent(Process("", ISOMER, log_k=log_k), most=a, A=a, B=b)
        assert made_mol == pytest.approx(expected, abs=1e-4), (a, b, log_k)


def test_isomers_of_a_long_titration_stop_in_every_row():
    """In 100 rows A grows from 0.1 to 2 mol; at a constant of 1 half of it becomes its isomer B in each."""
    column = {name: index for index, name in enumerate(COLUMNS)}
    amounts = np.zeros((100, len(COLUMNS)))
    amounts[:, column["H2O"]], amounts[:, column["A"]] = KILOGRAM_MOL, np.linspace(0.1, 2.0, 100)
    changes = np.array([[ISOMER.get(name, 0.0) for name in COLUMNS]])
    unbound = np.zeros(len(COLUMNS))
    extents = EquilibriumExtents([Process("", ISOMER, log_k=0.0)], changes, column, solver=None, holds_acid=unbound)
    half = extents.extent(0, amounts, amounts[:, column["A"]], np.full(100, 25.0))
    assert half == pytest.approx(0.5 * amounts[:, column["A"]], abs=1e-4)


def test_slow_reactions_and_gases_never_run_back():
    """There are 0.2 mol of A and 0.8 mol of B, and the constant is 1: in equilibrium there is as much of both.

    So 0.3 mol of B would become A again, if A -> B were neither slow nor freed B as a gas.
    """
    for case, process in {
        "slow": Process("", ISOMER, rate=1.0, log_k=0.0),
        "B is a gas": Process("", {"A": -1.0, "B(g)": 1.0}, log_k=0.0),
    }.items():
        assert extent(process, most=0.2, **{"A": 0.2, "B": 0.8, "B(g)": 0.8}) >= 0.0, case


def test_free_protons_count_in_the_quotient_and_water_does_not():
    """A + H+ -> B + H2O with a constant of 1, from 0.5 mol of A and 0.5 mol of H+, of which ammonia binds 0.2.

    In a kilogram x mol react until x = (0.5 - x) (0.3 - x).
    """
    process = Process("", {"A": -1.0, "H+": -1.0, "B": 1.0, "H2O": 1.0}, log_k=0.0)
    a_mol, ammonia_mol = 0.5, 0.2
    free_mol = 0.5 - ammonia_mol
    expected = brentq(lambda x: x - (a_mol - x) * (free_mol - x), 0.0, free_mol)
    mol = {"A": a_mol, "H+": 0.5, "NH3": ammonia_mol}
    assert extent(process, most=free_mol, holds_acid={"NH3": 1.0}, **mol) == pytest.approx(expected, rel=1e-2)


def test_reaction_leaving_less_than_a_thousandth_is_complete():
    """A mol of A becomes its isomer B: a constant of 2,000 would leave 0.5 mmol of A, one of 500 leaves 2 mmol."""
    for constant, expected in [(1e12, 1.0), (2000.0, 1.0), (500.0, 500.0 / 501.0)]:
        made_mol = extent(Process("", ISOMER, log_k=np.log10(constant)), most=1.0, A=1.0)
        assert made_mol == pytest.approx(expected, abs=1e-6), constant


def test_isomers_unknown_to_phreeqc_stop_by_their_concentrations():
    """A mol of A becomes its isomer B in salt water, of which PHREEQC knows only the salt: B by A becomes 3."""
    solver = solver_of(["Na+", "Cl-", "H+"])
    salt_water = {"Na+": 0.5, "Cl-": 0.5}
    made_mol = extent(Process("", ISOMER, log_k=np.log10(3.0)), most=1.0, solver=solver, A=1.0, **salt_water)
    assert made_mol == pytest.approx(3.0 / (1.0 + 3.0), abs=1e-4)


def test_constant_of_an_exothermic_equation_falls_with_temperature():
    """A mol of A becomes its isomer B with -50 kJ/mol; the constant is 1 at 25 degC, and by van 't Hoff elsewhere.

    Of constant K a fraction K / (1 + K) is B.
    """
    for celsius in [25.0, 60.0]:
        constant = np.exp(50e3 / 8.314462618 * (1.0 / (celsius + 273.15) - 1.0 / 298.15))
        process = Process("", ISOMER, joule=-50e3, log_k=0.0)
        made_mol = extent(process, most=1.0, celsius=celsius, A=1.0)
        assert made_mol == pytest.approx(constant / (1.0 + constant), abs=1e-4), celsius


ESTER = Process(
    "", {"CH3COO-": -1.0, "H+": -1.0, "C2H5OH": -1.0, "CH3COOC2H5": 1.0, "H2O": 1.0}, log_k=np.log10(4.0), is_ester=True
)


@pytest.mark.parametrize("ammonia_mol", [0.0, 0.4])
def test_ester_and_water_stop_at_four_times_acid_and_alcohol(ammonia_mol):
    """A mol of acetic acid and a mol of alcohol without water; x mol become ester until x^2 = 4 (free - x) (1 - x).

    Free is what no base binds of the acid: ammonia takes a proton each.
    """
    free_mol = 1.0 - ammonia_mol
    hardly_any_water_mol = 1e-6  # none would divide by 0
    expected = brentq(lambda x: x * (x + hardly_any_water_mol) - 4.0 * (free_mol - x) * (1.0 - x), 0.0, free_mol)
    mol = {"CH3COO-": 1.0, "H+": 1.0, "C2H5OH": 1.0, "NH3": ammonia_mol, "H2O": hardly_any_water_mol}
    assert extent(ESTER, most=free_mol, holds_acid={"NH3": 1.0}, **mol) == pytest.approx(expected, abs=1e-4)


class CountingSolver:
    """PHREEQC with silver chloride, and how many solutions it has computed."""

    def __init__(self, components):
        self._solver = solver_of(components, ["AgCl"])
        self.mixture, self.solutions = self._solver.mixture, 0

    def equilibrium(self, totals, water, celsius):
        self.solutions += len(water)
        return self._solver.equilibrium(totals, water, celsius)


SILVER_COLUMNS = ("H+", "H2O", "Ag+", "Cl-", "AgCl(s)", "Fe^2+", "Fe^3+", "Ag(s)", "NO3-")
IRON_MOL = 0.1


def silver_made_of(rows, log_k=0.5):
    """Mol of silver that iron(II) makes of silver ions, in a kilogram of water a row, and solutions asked of PHREEQC.

    ``rows``: column -> mol beside 0.1 mol of iron(II), 0.5 of acid and 0.9 of nitrate.
    """
    process = Process("", {"Fe^2+": -1.0, "Ag+": -1.0, "Fe^3+": 1.0, "Ag(s)": 1.0}, log_k=log_k)
    changes = np.array([[process.changes.get(name, 0.0) for name in SILVER_COLUMNS]])
    column = {name: index for index, name in enumerate(SILVER_COLUMNS)}
    solver = CountingSolver([name for name in SILVER_COLUMNS if not name.endswith("(s)") and name != "H2O"])
    extents = EquilibriumExtents([process], changes, column, solver, holds_acid=np.zeros(len(column)))
    liquid = {"H2O": KILOGRAM_MOL, "H+": 0.5, "NO3-": 0.9, "Fe^2+": IRON_MOL}
    amounts = np.array([[{**liquid, **row}.get(name, 0.0) for name in SILVER_COLUMNS] for row in rows])
    most = np.minimum(IRON_MOL, amounts[:, column["Ag+"]] + amounts[:, column["AgCl(s)"]])
    return extents.extent(0, amounts, most, np.full(len(rows), 25.0)), solver.solutions


def test_extent_depends_on_totals_and_not_on_what_has_settled():
    """0.1 mol of iron(II) make silver of 0.2 mol of silver ions, half of which are silver chloride.

    In one row that is solid already, in the other silver and chloride are ions still, which PHREEQC lets settle.
    """
    (of_ions, of_solid), _ = silver_made_of([{"Ag+": 0.2, "Cl-": 0.1}, {"Ag+": 0.1, "AgCl(s)": 0.1}])
    assert of_solid == pytest.approx(of_ions, abs=1e-6)
    assert 0.01 < of_ions < 0.09, "neither nothing nor all of the iron"


@pytest.mark.parametrize(
    ("chloride_mol", "log_k", "most_a_row"), [(0.0, 0.5, 2.2), (0.1, 2.0, 5.5)], ids=["no chloride", "chloride"]
)
def test_few_phreeqc_solutions_are_computed_a_row(chloride_mol, log_k, most_a_row):
    """Silver is titrated into 0.1 mol of iron(II) in 40 steps; bisection would take 17 solutions of PHREEQC a step.

    ``most_a_row``: how many may be computed a step, just more than the 1.9 and 5.0 that were. Beside chloride silver
    settles first, so that concentrations are a poor guide to activities, and a larger constant is needed. More silver
    makes no less silver metal, and in the end most of the iron has reacted.
    """
    rows = [{"Ag+": silver_mol, "Cl-": chloride_mol} for silver_mol in np.linspace(0.01, 0.4, 40)]
    extents, solutions = silver_made_of(rows, log_k=log_k)
    assert (np.diff(extents) > -1e-6).all() and extents[-1] > 0.8 * IRON_MOL
    assert solutions <= most_a_row * len(rows), solutions


def test_complete_reaction_needs_no_answer_of_phreeqc():
    """At a constant of 1e12 all 0.05 mol of silver react with 0.1 mol of iron(II), of 0.4 mol 0.1 mol."""
    extents, solutions = silver_made_of([{"Ag+": 0.05}, {"Ag+": 0.4}], log_k=12.0)
    assert extents.tolist() == [0.05, 0.1]
    assert solutions == 0


class PowerLaw:
    """Stands in for PHREEQC: the activity of A and of B is a power of its mol/kg. Counts solutions."""

    mixture = SimpleNamespace(components=("A", "B"), bare_names=("A", "B"), phases=(), changes=())

    def __init__(self, power):
        self.power, self.solutions = power, 0

    def equilibrium(self, totals, water, celsius):
        self.solutions += len(water)
        log_activity = self.power * np.log10(np.maximum(totals, 1e-30))
        return SimpleNamespace(ph=np.full(len(water), 7.0), log_activity=log_activity)


def test_isomers_stop_where_their_activities_have_the_constant():
    """A becomes its isomer B in 20 mixtures of 0.1 to 2 mol of A, until (B / A) to a power is the constant.

    ``PowerLaw`` stands in for PHREEQC: an activity is mol/kg to this power. At a ``ratio`` r of B to A, r / (1 + r) of
    all is B: more than 0.999 counts as all, 1e-7 as nothing. At most 2.5 solutions of PHREEQC are computed a mixture;
    bisection to 1e-5 would take 17.
    """
    a_mol = np.linspace(0.1, 2.0, 20)
    amounts = np.zeros((len(a_mol), len(COLUMNS)))
    amounts[:, COLUMNS.index("H2O")], amounts[:, COLUMNS.index("A")] = KILOGRAM_MOL, a_mol
    changes = np.array([[ISOMER.get(name, 0.0) for name in COLUMNS]])
    column = {name: index for index, name in enumerate(COLUMNS)}
    for power in (0.2, 0.5, 2.0):
        for ratio, fraction in [(1e-7, 0.0), (0.01, 0.01 / 1.01), (3.0, 0.75), (300.0, 300.0 / 301.0), (3e3, 1.0)]:
            solver, process = PowerLaw(power), Process("", ISOMER, log_k=power * np.log10(ratio))
            extents = EquilibriumExtents([process], changes, column, solver, holds_acid=np.zeros(len(COLUMNS)))
            made_mol = extents.extent(0, amounts, a_mol, np.full(len(a_mol), 25.0))
            assert made_mol == pytest.approx(fraction * a_mol, abs=2e-5), (power, ratio)
            assert solver.solutions <= 2.5 * len(a_mol), (power, ratio)


def test_only_free_iodide_and_iodine_count_in_the_quotient():
    """A + I- -> B has a constant of 100; a kilogram of water has 0.1 mol of A and of iodide, and 0.05 mol of iodine.

    x mol of B are made until x = 100 (0.1 - x) times the iodide that iodine does not bind as triiodide.
    """
    column = {name: index for index, name in enumerate(("H+", "H2O", "A", "B", "I-", "I2"))}
    process = Process("", {"A": -1.0, "I-": -1.0, "B": 1.0}, log_k=2.0)
    changes = np.array([[process.changes.get(name, 0.0) for name in column]])
    solver = PowerLaw(1.0)
    solver.mixture = SimpleNamespace(components=("A", "I-"), bare_names=("A", "I-"), phases=(), changes=())
    mol = {"H2O": KILOGRAM_MOL, "A": 0.1, "I-": 0.1, "I2": 0.05}
    amounts = np.array([[mol.get(name, 0.0) for name in column]])
    extents = EquilibriumExtents([process], changes, column, solver, holds_acid=np.zeros(len(column)))
    (made_mol,) = extents.extent(0, amounts, np.array([0.1]), np.array([25.0]))

    def free_iodide(iodide):
        bound = brentq(lambda x: x - TRIIODIDE_CONSTANT * (0.05 - x) * (iodide - x), 0.0, min(0.05, iodide))
        return iodide - bound

    expected = brentq(lambda x: x - 100.0 * (0.1 - x) * free_iodide(0.1 - x), 0.0, 0.1)
    assert made_mol == pytest.approx(expected, abs=1e-5)
    assert made_mol < 0.9 * brentq(lambda x: x - 100.0 * (0.1 - x) ** 2, 0.0, 0.1), "triiodide matters"


def test_reaction_without_an_answer_of_phreeqc_runs_to_its_end():
    """A mol of A becomes its isomer B with a constant of 1, by which half would be left.

    All reacts where PHREEQC, for which ``PowerLaw`` stands in, gives no activities (NaN).
    """
    solver, process = PowerLaw(np.nan), Process("", ISOMER, log_k=0.0)
    assert extent(process, most=1.0, solver=solver, A=1.0) == 1.0
