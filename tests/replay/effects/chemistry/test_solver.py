"""PHREEQC's memory, what it does at once and one by one, and what happens where it has no answer."""

import numpy as np
import pytest

from replay.effects.chemistry.components import dissolved_components
from replay.effects.chemistry.database import database_of
from replay.effects.chemistry.mixture import Phase, mixture_of
from replay.effects.chemistry.solver import Solver

WATER = 55.5
"""mol of water in a kilogram."""


def solver_and_totals(rows, solids=()):
    """PHREEQC as the product calls it, and the totals (n, components) of n solutions; ``rows``: formula -> mol/kg."""
    data = database_of()
    phases = [Phase(f"{solid}(s)", dissolved_components(solid), data.phases[name]) for solid, name in solids]
    columns = {component for row in rows for formula in row for component in dissolved_components(formula)}
    mixture = mixture_of(data, sorted(columns), phases)
    totals = np.zeros((len(rows), len(mixture.components)))
    for number, row in enumerate(rows):
        for formula, molal in row.items():
            for component, many in dissolved_components(formula).items():
                if component in mixture.components:
                    totals[number, mixture.components.index(component)] += many * molal
    return Solver(mixture), totals


def equilibrium(solver, totals, celsius=25.0):
    """Equilibria of solutions in a kilogram of water each."""
    count = len(totals)
    return solver.equilibrium(totals, np.full(count, WATER), np.full(count, celsius))


@pytest.mark.parametrize("solids", [(), (("CaCO3", "Calcite"), ("Mg(OH)2", "Brucite"))], ids=["none", "two"])
def test_memory_changes_no_answer_and_asks_each_composition_once(solids):
    """Fifteen random solutions are computed together, again backwards, and each alone by a solver without a memory.

    Together they take a query of PHREEQC each or more, backwards none; the answers are the same each time. ``solids``
    may fall out: (formula, PHREEQC's name).
    """
    rng = np.random.default_rng(1)
    formulas = ("CaCl2", "MgCl2", "Na2CO3", "NaOH", "CH3COOH", "HCl")
    rows = [{formula: 10.0 ** rng.uniform(-4, -1) for formula in formulas} for _ in range(15)]
    solver, totals = solver_and_totals(rows, solids)
    whole = equilibrium(solver, totals)
    queries = solver.queries
    again = equilibrium(solver, totals[::-1])
    assert solver.queries == queries >= 15
    assert again.species[::-1].tobytes() == whole.species.tobytes()
    forgetful, _ = solver_and_totals(rows, solids)
    forgetful.remember = False
    for number in rng.permutation(15):
        single = equilibrium(forgetful, totals[number : number + 1])
        assert single.ph[0] == pytest.approx(whole.ph[number], rel=1e-10)
        assert single.species[0] == pytest.approx(whole.species[number], rel=1e-10, abs=1e-16)
        assert single.phases[0] == pytest.approx(whole.phases[number], rel=1e-10, abs=1e-14)


def test_species_sum_to_totals_and_charges_to_zero():
    """A solution of many metals, acid and base; ``totals``: mol/kg of each component in all its species.

    H+ is a component too: its total, right to 1e-8, is what balances the charges.
    """
    solution = {"FeCl3": 0.05, "NaOH": 0.1, "NH3": 0.2, "H2SO4": 0.01, "CuSO4": 0.02, "AgNO3": 1e-9}
    solver, totals = solver_and_totals([solution])
    amounts_of_species = equilibrium(solver, totals).species
    components_per_species = solver.mixture.powers
    assert amounts_of_species @ components_per_species == pytest.approx(totals, rel=1e-8, abs=1e-10)


def test_oxidation_states_do_not_react_with_each_other():
    """By free energies iron(III) would oxidise iodide, and nitrite ammonium; every component keeps its total instead.

    ``solution``: mol/kg. A second solution with a ``reduced`` ion, iron(II) or sulfide, only makes this ion a component
    of both: none of it forms in the first.
    """
    for case, (solution, reduced) in {
        "iron(III) with iodide": ({"FeCl3": 0.01, "KI": 0.02}, "Fe^2+"),
        "ammonium with nitrite": ({"NH4NO3": 0.1, "NaNO2": 0.1}, "S^2-"),
    }.items():
        solver, totals = solver_and_totals([solution, {reduced: 0.01}])
        first_total, _second_total = totals
        first_species, _second_species = equilibrium(solver, totals).species
        dissolved = first_species @ solver.mixture.powers
        assert dissolved[solver.mixture.components.index(reduced)] == 0.0, case
        assert dissolved == pytest.approx(first_total, rel=1e-8, abs=1e-12), case


def test_a_charged_composition_keeps_its_charge():
    """0.01 mol/kg of H+ without an anion has a pH of 2, or 2.04 by its activity: neither H+ nor an anion is made up."""
    solver, totals = solver_and_totals([{"H+": 0.01, "Na+": 1e-9}])  # hardly any salt, as some component is needed
    (ph,) = equilibrium(solver, totals).ph
    assert ph == pytest.approx(2.0, abs=0.06)


@pytest.mark.parametrize("impossible", [{"HCl": 1e6}, {"NaOH": 58.0}], ids=["too much to compute", "PHREEQC refuses"])
def test_an_unanswered_row_leaves_the_others_answered(impossible):
    """Three solutions, mol/kg, of which the second has no answer: a million mol of acid, or 58 of lye in 55.5 of water.

    0.01 mol/kg of acid have a pH of 2.04 by an activity coefficient of 0.9.
    """
    solver, totals = solver_and_totals([{"HCl": 0.01}, impossible, {"HCl": 0.02}])
    ph = equilibrium(solver, totals).ph
    assert np.isnan(ph).tolist() == [False, True, False] and solver.unanswered_queries == 1
    assert ph[0] == pytest.approx(2.04, abs=0.02)


def test_traces_have_the_ph_and_solids_of_a_kilogram():
    """A glass that was poured out may keep 1e-17 kg: its pH is that of a kilogram, each amount the same share of it.

    Zinc in ammonia and hydrochloric acid, and gypsum beyond its solubility of about 0.015 mol/kg.
    """
    dissolved = {"HCl": 0.38, "NH4Cl": 0.12, "NH3": 0.13, "ZnCl2": 0.06}
    solver, totals = solver_and_totals([dissolved, {"CaCl2": 0.1, "Na2SO4": 0.1}], [("CaSO4.2H2O", "Gypsum")])
    water = np.full(2, WATER)
    celsius = np.full(2, 24.0)
    whole = solver.equilibrium(totals, water, celsius)
    assert whole.phases[1, 0] == pytest.approx(0.08, abs=0.01)
    for factor in (1e-8, 1e-17):
        trace = solver.equilibrium(factor * totals, factor * water, celsius)
        assert trace.ph == pytest.approx(whole.ph, abs=1e-6), factor
        assert trace.species / factor == pytest.approx(whole.species, rel=1e-6, abs=1e-12), factor
        assert trace.phases / factor == pytest.approx(whole.phases, rel=1e-6), factor


def test_a_warmer_solution_has_the_ion_product_of_its_temperature():
    """The pKw of pure water, twice its pH, is 13.995 at 25 and 13.02 at 60 degC (IAPWS R11-07)."""
    solver, totals = solver_and_totals([{"NaCl": 1e-9}])  # hardly any salt, as some component is needed
    (ph_at_25_c,), (ph_at_60_c,) = (equilibrium(solver, totals, celsius=celsius).ph for celsius in (25.0, 60.0))
    assert 2.0 * ph_at_25_c == pytest.approx(13.995, abs=0.01)
    assert 2.0 * ph_at_60_c == pytest.approx(13.02, abs=0.06)


def test_no_sulfide_is_a_polysulfide():
    """The data base minteq.v4 has polysulfides beside solid sulfur, which is not there in a solution of sodium sulfide.

    Of species of S^2- and H+ alone the product's data keep the three that dissolve without it.
    """
    data = database_of()
    sulfides = [
        entry for entry in data.species.values() if set(entry.makeup) <= {"S^2-", "H+"} and "S^2-" in entry.makeup
    ]
    assert sorted(entry.name for entry in sulfides) == ["H2S", "HS-", "S-2"]


# g of Ca(OH)2 in a kg of water, at equilibrium. Source: CRC Handbook and Lange's Handbook, which differ by 6 %.
def test_calcium_hydroxide_dissolves_less_in_hot_water():
    """0.05 mol of Ca(OH)2 (74.09 g/mol) are put into a kilogram of water; ``grams`` of it dissolve, by tables.

    To the solver that is 0.05 mol of Ca^2+ and -0.1 mol of H+, for a hydroxide is water without a proton.
    """
    for celsius, grams in [(0.0, 1.87), (20.0, 1.69), (60.0, 1.18), (80.0, 0.93), (99.0, 0.75)]:
        data, added_mol = database_of(""), 0.05
        lime = Phase("Ca(OH)2(s)", {"Ca^2+": 1, "H+": -2, "H2O": 2}, data.phases["Portlandite"])
        solver = Solver(mixture_of(data, ["Ca^2+"], [lime]))
        h_and_ca = np.array([[-2.0 * added_mol, added_mol]])
        water_mol = WATER + 2.0 * added_mol
        ((solid_mol,),) = solver.equilibrium(h_and_ca, np.array([water_mol]), np.array([celsius])).phases
        assert 74.09 * (added_mol - solid_mol) == pytest.approx(grams, rel=0.05), celsius
