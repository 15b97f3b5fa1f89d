"""End points (`replay.effects.end_points`) are where amounts say, at every rate; the pH is that of the charges."""

from collections import Counter

import numpy as np
import pytest
from support.liquid_worlds import COLUMN, MIX, glass, run_in

from replay.effects.effect_summary import titration_curves
from replay.effects.models.equilibrium import equilibrium
from replay.effects.models.speciation import speciation_of
from replay.effects.models.species import Chemistry

BASE, ACID = "HCl + NaOH -> NaCl + H2O", "H+ + OH- -> H2O"
TITRATIONS = [
    ({"HCl": 0.05}, {"NaOH": 0.1}, [5.0]), ({"HNO3": 0.02}, {"KOH": 0.05}, [4.0]),
    ({"HCl": 1e-3}, {"NaOH": 2e-3}, [5.0]), ({"HCl": 0.5}, {"Ba(OH)2": 0.5}, [5.0]),
    ({"NaOH": 0.05}, {"HCl": 0.1}, [5.0]), ({"Ba(OH)2": 0.05}, {"HCl": 0.1}, [10.0]),
    ({"CH3COOH": 0.05}, {"NaOH": 0.1}, [5.0]), ({"HF": 0.05}, {"KOH": 0.1}, [5.0]),
    ({"CH3COOH": 0.2}, {"Ba(OH)2": 0.2}, [5.0]),
    ({"NH3": 0.05}, {"HCl": 0.1}, [5.0]), ({"NH3": 0.1}, {"H2SO4": 0.1}, [5.0]),
    ({"H2SO4": 0.05}, {"NaOH": 0.1}, [10.0]),
    ({"NaHSO4": 0.05}, {"NaOH": 0.1}, [5.0]), ({"H3PO4": 0.05}, {"NaOH": 0.1}, [5.0, 10.0]),
    ({"NaH2PO4": 0.05}, {"NaOH": 0.1}, [5.0]), ({"Na2HPO4": 0.05}, {"HCl": 0.1}, [5.0]),
    ({"Na2CO3": 0.05}, {"HCl": 0.1}, [5.0, 10.0]), ({"NaHCO3": 0.05}, {"HCl": 0.1}, [5.0]),
    ({"HCl": 0.05, "CH3COOH": 0.05}, {"NaOH": 0.1}, [5.0, 10.0]),
    ({"HCl": 0.05, "NH4Cl": 0.05}, {"NaOH": 0.1}, [5.0, 10.0]),
    ({"Na2CO3": 0.03, "NaHCO3": 0.02}, {"HCl": 0.1}, [3.0, 8.0]),
    ({"CH3COOH": 0.05, "CH3COONa": 0.05}, {"NaOH": 0.1}, [5.0]),
    ({"HCl": 0.02, "H3PO4": 0.04}, {"NaOH": 0.1}, [6.0, 10.0]),
]  # fmt: skip


def titrated(flask, burette, equations=(ACID,), hz=90):
    """Effects of 10 mL in the flask into which the burette runs, 18 mL in 8 s."""
    acid, base = glass("flask", 10.0, solutes=flask), glass("burette", 50.0, solutes=burette, cavity=COLUMN)
    tables = [("reaction", {"equation": equation}) for equation in equations]
    degrees = [0.0, 0.0, *([90.0] * 8 * hz), 0.0]
    settings = {"full_area_m2": 1.2e-6}
    return run_in(degrees, MIX, *tables, acid=acid, base=base, step_ns=round(1e9 / hz), settings=settings)


def ph_of(solutes):
    """Of one solution, by the model alone."""
    chemistry, totals = Chemistry(), Counter({"H+": 0.0})
    for formula, molar in solutes.items():
        for part, many in chemistry.dissolved(formula).items():
            totals[part] += many * molar
    mixture = speciation_of(chemistry, totals, {}, ()).mixture
    return equilibrium(mixture, np.array([[totals[part] for part in mixture.parts]]), np.ones(1)).ph[0]


def check(flask, burette, ends, hz):
    effects = titrated(flask, burette, hz=hz)
    found = [event.values["volume_ml"] for event in effects["reaction"].output.named("end-point")]
    assert found == pytest.approx(ends, abs=0.01)
    ph, volume = effects["reaction"].series["flask/pH"], effects["mixing"].series["flask/volume"]
    # The same amounts, mixed at once, have the same pH, which tests of the models hold to the balance of charges.
    added = volume.values[-1] - 10.0
    amounts = {name: molar * 10.0 for name, molar in flask.items()} | {
        name: molar * added + flask.get(name, 0.0) * 10.0 for name, molar in burette.items()
    }
    whole = {name: amount / (10.0 + added) for name, amount in amounts.items()}
    assert ph.values[-1] == pytest.approx(ph_of(whole), abs=1e-9)
    assert ph.values[0] == pytest.approx(ph_of(flask), abs=1e-9)


@pytest.mark.parametrize(
    ("flask", "burette", "ends"),
    [pytest.param(*row, marks=[] if k % 4 == 1 else pytest.mark.slow) for k, row in enumerate(TITRATIONS)],
)
def test_end_points_and_ph_are_those_of_amounts_and_charges_at_every_rate(flask, burette, ends):
    for hz in (30, 90, 250):
        check(flask, burette, ends, hz)


def told(effects):
    return [event.text for event in effects["reaction"].output.named("end-point")]


def test_a_mixture_names_the_strong_acid_first_and_then_the_sum_whatever_the_order_of_tables():
    tables = ("HCl + NaOH -> NaCl + H2O", "CH3COOH + NaOH -> CH3COONa + H2O")
    mixture = {"HCl": 0.05, "CH3COOH": 0.05}
    texts = told(titrated(mixture, {"NaOH": 0.1}, tables))
    assert [text.partition(" are ")[0] for text in texts] == ["HCl and NaOH", "CH3COOH + HCl and NaOH"]
    assert "after 5.00 mL (end point 1 of 2)" in texts[0] and "after 10.00 mL (end point 2 of 2); overshot" in texts[1]
    assert told(titrated(dict(reversed(mixture.items())), {"NaOH": 0.1}, tables[::-1])) == texts


@pytest.mark.parametrize("hz", [30, 90, 250])
def test_carbonate_has_its_first_end_point_where_half_the_acid_is_in_at_every_rate(hz):
    """With CO2 as a gas, which the base once let go before each carbonate had its proton."""
    gas = "Na2CO3 + 2 HCl -> 2 NaCl + H2O + CO2"
    effects = titrated({"Na2CO3": 0.05}, {"HCl": 0.1}, (gas,), hz=hz)
    found = [event.values["volume_ml"] for event in effects["reaction"].output.named("end-point")]
    assert found == pytest.approx([5.0, 10.0], abs=0.01)
    drawn = titration_curves(effects)["flask"][2]
    assert drawn == pytest.approx([5.0, 10.0], abs=0.01)
    assert titration_curves({"reaction": effects["reaction"]}) == {} == titration_curves({"mixing": effects["mixing"]})


@pytest.mark.parametrize(
    ("flask", "burette", "equation", "ends", "names"),
    [({"FeSO4": 0.05, "H2SO4": 0.5}, {"KMnO4": 0.02}, "MnO4- + 5 Fe2+ + 8 H+ -> Mn2+ + 5 Fe3+ + 4 H2O", [5.0], "MnO4-"),
     ({"I2": 0.05}, {"Na2S2O3": 0.1}, "I2 + 2 S2O32- -> 2 I- + S4O6^2-", [10.0], "S2O3^2-")],
)  # fmt: skip
def test_a_titration_by_oxidation_has_one_end_point(flask, burette, equation, ends, names):
    (event,) = titrated(flask, burette, (equation,))["reaction"].output.named("end-point")
    assert event.values["volume_ml"] == pytest.approx(ends[0], abs=0.01) and names in event.text


@pytest.mark.parametrize(
    ("equation", "flask", "burette"),
    [("HCO3- + H+ -> CO2 + H2O", {"NaHCO3": 0.05}, {"HCl": 0.1}),
     ("NH4+ + OH- -> NH3 + H2O", {"NH4Cl": 0.05}, {"NaOH": 0.1}),
     ("H2PO4- + OH- -> HPO4^2- + H2O", {"NaH2PO4": 0.05}, {"NaOH": 0.1}),
     ("HSO4- + OH- -> SO42- + H2O", {"NaHSO4": 0.05}, {"NaOH": 0.1}),
     ("H3O+ + OH- -> 2 H2O", {"HCl": 0.05}, {"NaOH": 0.1})],
)  # fmt: skip
def test_ions_are_reagents_under_their_own_formulas(equation, flask, burette):
    (event, *_) = titrated(flask, burette, (equation,))["reaction"].output.named("end-point")
    assert event.values["volume_ml"] == pytest.approx(5.0, abs=0.01)
