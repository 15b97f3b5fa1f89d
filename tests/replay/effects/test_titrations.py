"""End points (`replay.effects.end_points`) are where amounts say, at every rate; the pH is that of the charges."""

import tomllib
from pathlib import Path

import pytest
from support.liquid_worlds import BURETTE_COLUMN, MIXING_IN_FLASK, effects_of_tap_degrees, glass
from support.second_opinions import answer

from replay.effects.effect_summary import titration_curves

TABLE = tomllib.loads(Path(__file__).with_name("titrations.toml").read_text("utf-8"))

RATES_HZ = [30, pytest.param(90, marks=pytest.mark.slow), pytest.param(250, marks=pytest.mark.slow)]
"""Frames a second of a recording; an end point lies between two frames, and is the same at every rate."""


def titrated(flask, burette, equations=("H+ + OH- -> H2O",), hz=10):
    """Effects of 10 mL in the flask into which the burette runs, 18 mL in 8 s; both: solute -> mol/L."""
    tables = [("reaction", {"equation": equation}) for equation in equations]
    degrees = [0.0, 0.0, *([90.0] * 8 * hz), 0.0]
    settings = {"full_area_m2": 1.2e-6}
    return effects_of_tap_degrees(
        degrees,
        MIXING_IN_FLASK,
        *tables,
        flask=glass("flask", volume_ml=10.0, solutes=flask),
        burette=glass("burette", volume_ml=50.0, solutes=burette, cavity=BURETTE_COLUMN),
        step_ns=round(1e9 / hz),
        settings=settings,
    )


def ph_of(solutes):
    """The pH of one solution, by PHREEQC's minteq.v4 as it is."""
    return answer(solutes, {}, kilograms=1.0)["pH"]


@pytest.mark.parametrize("hz", RATES_HZ)
@pytest.mark.parametrize(
    "row", [pytest.param(row, marks=[] if k % 12 == 1 else pytest.mark.slow) for k, row in enumerate(TABLE["acid"])]
)
def test_end_points_and_ph_are_right_at_every_rate(row, hz):
    """``row``: mol/L in 10 mL in the flask and in the burette, and the mL of the end points, reckoned by hand.

    The first and the last pH are those that PHREEQC computes for what was in the flask, and for that and all that ran
    in. ``hz``: frames a second.
    """
    flask, burette, flask_ml = row["flask"], row["burette"], 10.0
    effects = titrated(flask, burette, hz=hz)
    ends_ml = [event.values["volume_ml"] for event in effects["reaction"].output.events_named("end-point")]
    assert ends_ml == pytest.approx(row["ends"], abs=0.01)
    ph, volume = effects["reaction"].series["flask/pH"], effects["mixing"].series["flask/volume"]
    added_ml = volume.values[-1] - flask_ml
    mixed = {
        name: (flask.get(name, 0.0) * flask_ml + burette.get(name, 0.0) * added_ml) / (flask_ml + added_ml)
        for name in flask | burette
    }
    assert ph.values[0] == pytest.approx(ph_of(flask), abs=0.01)
    assert ph.values[-1] == pytest.approx(ph_of(mixed), abs=0.01)


def end_point_texts(effects):
    """The texts of the end points, in order."""
    return [event.text for event in effects["reaction"].output.events_named("end-point")]


def test_a_mixture_names_the_strong_acid_first():
    """10 mL with 0.05 mol/L of either acid, 0.5 mmol each, take 5 mL of lye of 0.1 mol/L for each.

    The strong acid, HCl, reacts first; the order in which the scene names solutes and equations changes nothing.
    """
    equations = ("HCl + NaOH -> NaCl + H2O", "CH3COOH + NaOH -> CH3COONa + H2O")
    mixture = {"HCl": 0.05, "CH3COOH": 0.05}
    strong, both = end_point_texts(titrated(mixture, {"NaOH": 0.1}, equations))
    assert strong.startswith("HCl and NaOH are ") and "after 5.00 mL (end point 1 of 2)" in strong
    assert both.startswith("CH3COOH + HCl and NaOH are ") and "after 10.00 mL (end point 2 of 2); overshot" in both
    reversed_mixture, reversed_equations = dict(reversed(mixture.items())), equations[::-1]
    assert end_point_texts(titrated(reversed_mixture, {"NaOH": 0.1}, reversed_equations)) == [strong, both]


@pytest.mark.parametrize("hz", RATES_HZ)
def test_carbonate_titration_has_two_end_points_at_any_frame_rate(hz):
    """0.5 mmol of carbonate take a proton each to hydrogencarbonate (5 mL of 0.1 mol/L), a second to CO2 (10 mL).

    The curve of the pH, the only one, marks both. ``hz``: frames a second.
    """
    gas = "Na2CO3 + 2 HCl -> 2 NaCl + H2O + CO2"
    effects = titrated({"Na2CO3": 0.05}, {"HCl": 0.1}, (gas,), hz=hz)
    ends_ml = [event.values["volume_ml"] for event in effects["reaction"].output.events_named("end-point")]
    assert ends_ml == pytest.approx([5.0, 10.0], abs=0.01)
    (curve,) = titration_curves(effects)
    assert curve.quantity == "pH" and curve.ends_ml == pytest.approx([5.0, 10.0], abs=0.01)


@pytest.mark.sampled(7)
@pytest.mark.parametrize("row", TABLE["ions"], ids=lambda row: row["equation"])
def test_an_oxidation_in_ions_has_a_single_end_point(row):
    """``row``: mol/L in 10 mL in the flask and in the burette, and after how many mL which two are equivalent.

    The equation is in ions, as "MnO4- + 5 Fe2+ + 8 H+ -> ...".
    """
    (event,) = titrated(row["flask"], row["burette"], (row["equation"],))["reaction"].output.events_named("end-point")
    assert event.values["volume_ml"] == pytest.approx(row["volume_ml"], abs=0.01)
    assert event.text.startswith(f"{row['names']} are equivalent in flask")


@pytest.mark.sampled(5)
@pytest.mark.parametrize("row", TABLE["shared"], ids=lambda row: row["name"])
def test_end_points_of_ions_sharing_a_titrant_are_cumulative(row):
    """``row``: mol/L of ions in 10 mL in the flask, each with an equation, and of what binds them in the burette.

    ``ends`` has mL for the first ion, then for it and the next; ions that are bound alike (Ca, Mg) end together.
    """
    events = titrated(row["flask"], row["burette"], row["equations"])["reaction"].output.events_named("end-point")
    assert [event.values["volume_ml"] for event in events] == pytest.approx(row["ends"], abs=0.01)


def test_end_point_is_named_where_both_solutions_hold_the_acid():
    """Lye of 0.1 mol/L in the burette has 0.01 mol/L of the acid of the flask: 0.09 mol/L of lye are free.

    The flask's 10 mL of 0.05 mol/L, 0.5 mmol, take 5.56 mL of it.
    """
    (event,) = titrated({"HCl": 0.05}, {"NaOH": 0.1, "HCl": 0.01})["reaction"].output.events_named("end-point")
    acid_mmol, free_lye_molar = 10.0 * 0.05, 0.1 - 0.01
    assert event.values["volume_ml"] == pytest.approx(acid_mmol / free_lye_molar, abs=0.01)
    assert "HCl and NaOH" in event.text
