"""pH, solids and gases against the balance of charges in forty digits."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from mpmath import mpf
from support.charge_balance import CARBONATES, HALIDES, HYDROXIDES, Solution

from replay.effects.models.equilibrium import equilibrium
from replay.effects.models.speciation import speciation_of
from replay.effects.models.species import KSP, Chemistry

CHEMISTRY = Chemistry()
PARTS = {
    "acetate": "CH3COO-", "sulfate": "SO4^2-", "phosphate": "PO4^3-", "ammonia": "NH3", "fluoride": "F-",
    "carbonate": "CO3^2-", "Fe": "Fe^3+", "Cu": "Cu^2+", "Mg": "Mg^2+", "Ca": "Ca^2+", "Ba": "Ba^2+", "Zn": "Zn^2+",
    "Ag": "Ag+", "Cl": "Cl-", "Br": "Br-", "I": "I-",
}  # fmt: skip


def solved(molar, solids=(), gases=(), litres=1.0):
    """pH and phases, mol/L, of formulas or parts in mol/L."""
    totals = {"H+": 0.0}
    for formula, amount in molar.items():
        for part, many in (CHEMISTRY.parts(formula) or {formula: 1}).items():
            totals[part] = totals.get(part, 0.0) + many * amount * litres
    made = speciation_of(CHEMISTRY, totals, {name: KSP[name] for name in solids}, gases)
    row = np.array([[totals.get(part, 0.0) for part in made.mixture.parts]])
    found = equilibrium(made.mixture, row, np.array([litres]))
    return float(found.ph[0]), dict(zip(made.mixture.phases, (found.phases[0] / litres).tolist(), strict=True))


def a_mixture(seed):
    """Parts in mol/L with their protons, solids, whether gas bubbles, and the truth."""
    rng = np.random.default_rng(seed)

    def some(names, most):
        return [str(name) for name in rng.choice(names, int(rng.integers(0, most + 1)), replace=False)]

    def amount():
        return float(10.0 ** rng.uniform(-5.0, 0.0))

    acids = {
        name: amount() for name in some(["acetate", "sulfate", "phosphate", "ammonia", "fluoride", "carbonate"], 3)
    }
    metals = {name: amount() for name in some(["Fe", "Cu", "Mg", "Ca", "Ba", "Zn"], 3)}
    halides = {name: amount() for name in some(["Cl", "Br", "I"], 3)}
    if halides and rng.random() < 0.7:
        metals["Ag"] = amount()
    solids = [s for s, (m, *_) in HYDROXIDES.items() if m in metals and rng.random() < 0.7]
    solids += [s for s, (m, _) in CARBONATES.items() if m in metals and "carbonate" in acids and rng.random() < 0.8]
    solids += [s for s, (x, _) in HALIDES.items() if x in halides and "Ag" in metals]
    gas = "carbonate" in acids and rng.random() < 0.5
    proton = float(rng.choice([-1.0, 1.0]) * amount())
    # Protons beyond the parts without any: their charge says what the ions that only look on have.
    charges = {"acetate": -1, "sulfate": -2, "phosphate": -3, "ammonia": 0, "fluoride": -1, "carbonate": -2}
    positive = {"Fe": 3, "Ag": 1}
    parts = [(charges[name], value) for name, value in acids.items()] + [(-1, value) for value in halides.values()]
    parts += [(positive.get(name, 2), value) for name, value in metals.items()]
    strong = -mpf(proton) - sum((charge * mpf(value) for charge, value in parts), mpf(0))
    exact = [{name: mpf(value) for name, value in one.items()} for one in (acids, metals, halides)]
    molar = {PARTS[name]: value for one in (acids, metals, halides) for name, value in one.items()}
    return {"H+": proton, **molar}, solids, gas, Solution(*exact, strong, solids, gas)


def check(seed):
    molar, solids, gas, truth = a_mixture(seed)
    ph, phases = solved(molar, solids, ["CO2"] if gas else [], litres=float(10.0 ** (seed % 5 - 3)))
    true_ph, true_phases = truth.result()
    assert ph == pytest.approx(float(true_ph), abs=1e-9), seed
    for name, amount in true_phases.items():
        formed = phases[name + ("(g)" if name == "CO2" else "(s)")]
        assert formed == pytest.approx(float(amount), rel=1e-9, abs=1e-13 * max(molar.values())), (seed, name)


@pytest.mark.parametrize("seed", range(12))
def test_acids_solids_and_gas_agree_with_the_balance_of_charges_in_forty_digits(seed):
    check(seed)


@pytest.mark.slow
def test_three_hundred_mixtures_agree_with_the_balance_of_charges_in_forty_digits():
    for seed in range(1000, 1300):
        check(seed)


BY_HAND = tomllib.loads(Path(__file__).with_name("by_hand.toml").read_text("utf-8"))["solution"]


@pytest.mark.parametrize("row", BY_HAND, ids=lambda row: " ".join(row["molar"]))
def test_what_a_teacher_would_try_first_is_as_reckoned_by_hand(row):
    ph, phases = solved(row["molar"], row.get("solids", ()), row.get("gases", ()))
    formed = row.get("formed", {})
    assert ph == pytest.approx(row["ph"], abs=0.05)
    assert {name: phases[name] for name in formed} == pytest.approx(formed, rel=row.get("within", 0.02), abs=0.0)
