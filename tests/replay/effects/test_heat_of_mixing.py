"""Heat of reaction against the tables it comes from, calorimetry against the closed form, at every rate."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from support.liquid_worlds import (
    NEUTRALISATION,
    effects_of_tap_degrees,
    effects_of_tilt_degrees,
    glass,
    poses_at_rest,
    poses_of_tilted_glass,
    session_with_effects,
)
from support.small_worlds import STEP_S

from replay.engine import compute

J_PER_ML_K = 4.18
HEAT = {"of": "liquids", "ambient_c": 20.0, "loss_w_per_k": 0.0, "heat_capacity_j_per_ml_k": J_PER_ML_K}
MIX_IN_BOTH = ("mixing", {"in": ["a", "b"]})
WIDE_TAP = {"full_area_m2": 6e-6}


HEATS = tomllib.loads(Path(__file__).with_name("heats.toml").read_text("utf-8"))["reaction"]
"""Of each equation: both solutions, as solute and mol/L, and kJ per mol of the first that warm the mixture."""


def vessel(name, volume, solute, molar, **properties):
    """A vessel with so many millilitres of a solution, mol/L."""
    return glass(name, volume, properties=properties, solute=solute, molar=molar)


@pytest.mark.parametrize("row", HEATS, ids=lambda row: row["equation"])
def test_a_reaction_gives_the_heat_of_its_enthalpies_of_formation(row):
    """20 mL of one are poured into 20 mL of the other, all of it; ``kj_mol``: by the NBS tables of 1982.

    Kelvin times 4.18 J/(mL K) times all millilitres is the heat, by the moles that were poured.
    """
    bodies = (vessel("a", 20.0, *row["first"]), vessel("b", 20.0, *row["second"]))
    settings = (MIX_IN_BOTH, ("reaction", {"equation": row["equation"]}), ("heat", HEAT))
    effects = effects_of_tilt_degrees([0.0, *([120.0] * 40), 0.0], bodies, *settings)
    moved = effects["pour"].events[0].values["volume_ml"]
    series = effects["heat"].series["b/temperature"]
    assert (series.times[0], series.values[0]) == (0.0, 20.0)
    kelvin = series.values[-1] - 20.0
    (event,) = [candidate for candidate in effects["heat"].output.events_named("warmest") if candidate.bodies == ("b",)]
    assert event.values["change_k"] == pytest.approx(kelvin) and "b warms from 20.00 to" in event.text
    _solute, molar = row["first"]
    kilojoule = 1e-3 * kelvin * J_PER_ML_K * (20.0 + moved)
    moles = molar * moved * 1e-3
    assert kilojoule / moles == pytest.approx(row["kj_mol"], rel=0.01)


def test_the_constant_of_the_vessel_and_the_starting_temperature_count():
    """Acid of 0.5 mol/L and 10 degC comes to lye in a vessel of 30 J/K at 30 degC; neutralisation: 55.84 kJ/mol."""
    bodies = (
        vessel("a", volume=20.0, solute="HCl", molar=0.5, temperature_c=10.0),
        vessel("b", volume=20.0, solute="NaOH", molar=1.0, temperature_c=30.0, heat_capacity_j_per_k=30.0),
    )
    tables = (MIX_IN_BOTH, ("reaction", {"equation": "HCl + NaOH -> NaCl + H2O"}), ("heat", HEAT))
    effects = effects_of_tilt_degrees([0.0, *([120.0] * 40), 0.0], bodies, *tables)
    moved = effects["pour"].events[0].values["volume_ml"]
    celsius = effects["heat"].series["b/temperature"].values
    # Joule above 20 degC: lye and vessel bring 10 K more, acid 10 K less, and each mol of acid its heat.
    energy = J_PER_ML_K * (20.0 * 10.0 - moved * 10.0) + 30.0 * 10.0 + 0.5e-3 * moved * 55.84e3
    assert celsius[0] == 30.0 and celsius[-1] == pytest.approx(
        20.0 + energy / (J_PER_ML_K * (20.0 + moved) + 30.0), rel=1e-5
    )


def test_a_vessel_cools_by_newtons_law_before_anything_comes_in():
    """50 mL of 80 degC lose 100 W/K in a room of 20 degC; a is tilted from frame 20 on."""
    bodies = (
        vessel("a", volume=60.0, solute="", molar=0.0),
        vessel("b", volume=50.0, solute="", molar=0.0, temperature_c=80.0),
    )
    heat = ("heat", {**HEAT, "loss_w_per_k": 100.0})
    effects = effects_of_tilt_degrees([*([0.0] * 20), *([120.0] * 10), 0.0], bodies, MIX_IN_BOTH, heat)
    series = effects["heat"].series["b/temperature"]
    early = series.times < effects["pour"].events[0].time - STEP_S
    expected = 20.0 + 60.0 * np.exp(-100.0 * (series.times[early] - series.times[0]) / (J_PER_ML_K * 50.0))
    assert early.sum() > 10 and series.values[early] == pytest.approx(expected, rel=1e-9)


def test_a_vessel_that_drifts_to_the_room_is_no_result():
    """Hot acid cools in its glass, and warms the lye that it is poured into: the second is what is reported."""
    bodies = (
        vessel("a", volume=60.0, solute="HCl", molar=0.001, temperature_c=60.0),
        vessel("b", volume=50.0, solute="NaOH", molar=0.001),
    )
    tables = (MIX_IN_BOTH, NEUTRALISATION, ("heat", {**HEAT, "loss_w_per_k": 10.0}))
    effects = effects_of_tilt_degrees([*([0.0] * 20), *([120.0] * 10), 0.0], bodies, *tables)
    assert {event.bodies for event in effects["heat"].events if event.name in ("warmest", "coldest")} == {("b",)}
    # Until liquid comes in, b has two temperatures: at the start and one frame before, so that a line rises there.
    volume, warming = effects["mixing"].series["b/volume"], effects["heat"].series["b/temperature"]
    filling_time = volume.times[1:][np.diff(volume.values) > 0.0][0]
    assert warming.values[warming.times < filling_time].tolist() == [20.0, 20.0]
    assert warming.times[1] == pytest.approx(filling_time - STEP_S)


def test_headline_of_a_dry_solid_is_that_of_the_mixture():
    """2 g of calcium chloride's hydrate cool 25 mL or so by 1.4 K.

    Its first drops, which are colder and may freeze, are not reported: the coldest is the last temperature.
    """
    solid = {"solid": {"formula": "CaCl2.6H2O", "mass_g": 2.0}}
    bodies = (vessel("a", volume=60.0, solute="", molar=0.0), glass("b", volume_ml=0.0, properties=solid))
    effects = effects_of_tilt_degrees(
        [0.0, *np.linspace(0.0, 120.0, 40), *([120.0] * 100)], bodies, MIX_IN_BOTH, ("heat", HEAT)
    )
    (coldest,) = effects["heat"].output.events_named("coldest")
    last = effects["heat"].series["b/temperature"].values[-1]
    assert coldest.values["to_c"] == pytest.approx(last, abs=0.01) and 17.0 < last < 19.9
    assert not effects["heat"].output.events_named("freeze")


def test_solution_that_freezes_states_its_coldest_temperature():
    """40 g of ammonium nitrate take 12.8 kJ, enough to cool 60 mL of water at 5 degC by 50 K."""
    solid = {"solid": {"formula": "NH4NO3", "mass_g": 40.0}}
    bodies = (vessel("a", volume=60.0, solute="", molar=0.0), glass("b", volume_ml=0.0, properties=solid))
    effects = effects_of_tilt_degrees([0.0, *([120.0] * 10)], bodies, MIX_IN_BOTH, ("heat", {**HEAT, "ambient_c": 5.0}))
    (event,) = effects["heat"].output.events_named("freeze")
    coldest = effects["heat"].series["b/temperature"].values.min()
    assert event.values["celsius"] == pytest.approx(coldest) and coldest < -10.0


@pytest.mark.parametrize(
    ("formula", "mass_g", "declared", "ions"),
    [
        ("Na2S2O3", 20.0, {}, "Na+ and S2O3^2-"), ("Na2S2O3", 2.0, {}, ""), ("CO(NH2)2", 20.0, {}, "CO(NH2)2"),
        ("Na2S2O3", 20.0, {"heat_kj_mol": 7.0}, ""), ("NaNO3", 20.0, {}, ""), ("LiCl", 40.0, {}, "Li+ and Cl-"),
    ],
)  # fmt: skip
def test_heat_of_a_strong_solution_without_a_table_is_named(formula, mass_g, declared, ions):
    """``declared``: a heat of solution by the scene; ``ions``: named in the warning, none where nothing is warned of.

    Water comes to the powder: 2 g give a weak solution, and sodium nitrate has a table of heats.
    """
    powder = {"solid": {"formula": formula, "mass_g": mass_g}}
    bodies = (vessel("a", volume=30.0, solute="", molar=0.0), glass("b", volume_ml=0.0, properties=powder))
    products = {"Na2S2O3": "2 Na+ + S2O3^2-", "CO(NH2)2": "CO(NH2)2(aq)", "LiCl": "Li+ + Cl-", "NaNO3": "Na+ + NO3-"}
    equation = [("reaction", {"equation": f"{formula}(s) -> {products[formula]}", **declared})] if declared else []
    effects = effects_of_tilt_degrees([0.0, *([120.0] * 40), 0.0], bodies, MIX_IN_BOTH, *equation, ("heat", HEAT))
    texts = [event.text for event in effects["heat"].output.events_named("strong")]
    assert len(texts) == bool(ions) and all(f"so strong a solution of {ions} as" in text for text in texts)


@pytest.mark.slow
def test_a_warm_titration_goes_by_drops():
    """A burette's inflow of over 20 mL is followed in steps below 0.2 mL where heat is followed.

    In larger ones permanganate coloured hot oxalic acid 0.55 mL after its end point.
    """
    opened = effects_of_tap_degrees(
        [*([0.0] * 2), *([90.0] * 200)], ("mixing", {"in": ["flask"]}), ("heat", HEAT), settings=WIDE_TAP
    )
    volume = opened["mixing"].series["flask/volume"].values
    assert np.ptp(volume) > 20.0 and np.diff(volume).max() < 0.2


def test_a_hot_dry_solid_does_not_boil():
    """Potassium nitrate of 250 degC in a glass without water; nothing is poured on it."""
    solid = {"solid": {"formula": "KNO3", "mass_g": 10.0}, "temperature_c": 250.0}
    bodies = (vessel("a", volume=60.0, solute="", molar=0.0), glass("b", volume_ml=0.0, properties=solid))
    effects = effects_of_tilt_degrees([0.0] * 20, bodies, MIX_IN_BOTH, ("heat", HEAT))
    assert not effects["heat"].output.events_named("boil")


def test_hot_copper_warms_the_water_poured_onto_the_metal():
    """100 g of copper of 90 degC have 38.5 J/K by the handbook's 0.385 J/(g K); the water has 20 degC."""
    metal = {"solid": {"formula": "Cu", "mass_g": 100.0}, "temperature_c": 90.0}
    bodies = (vessel("a", volume=60.0, solute="", molar=0.0), glass("b", volume_ml=0.0, properties=metal))
    effects = effects_of_tilt_degrees([0.0, *([120.0] * 40), 0.0], bodies, MIX_IN_BOTH, ("heat", HEAT))
    moved = effects["pour"].events[0].values["volume_ml"]
    celsius = effects["heat"].series["b/temperature"].values
    expected = (J_PER_ML_K * moved * 20.0 + 38.5 * 90.0) / (J_PER_ML_K * moved + 38.5)
    assert celsius[-1] - 20.0 == pytest.approx(expected - 20.0, rel=0.06)


@pytest.mark.parametrize("hz", [9, 90, *(pytest.param(hz, marks=pytest.mark.slow) for hz in (30, 250, 1000))])
def test_calorimetry_with_loss_follows_newtons_law_at_every_rate(hz):
    """10 mmol of acid and of lye give 55.84 kJ/mol to 40 mL, which lose 5 W/K; ``hz`` frames a second.

    The glass is emptied by 0.9 s: from 1 s on the mixture only cools.
    """
    seconds, count = 6.0, round(7.0 * hz)
    degrees = np.interp(np.arange(count) / hz, [0.0, 0.2, 0.7, 0.9], [0.0, 0.0, 120.0, 120.0])
    poses = {"a": poses_of_tilted_glass(degrees), "b": poses_at_rest(count)}
    bodies = (vessel("a", volume=20.0, solute="HCl", molar=0.5), vessel("b", volume=20.0, solute="NaOH", molar=1.0))
    tables = (
        MIX_IN_BOTH,
        ("pour", {"from": ["a"], "into": ["b"]}),
        ("reaction", {"equation": "HCl + NaOH -> NaCl + H2O"}),
    )
    heat = ("heat", {**HEAT, "loss_w_per_k": 5.0})
    series = (
        compute(session_with_effects(poses, bodies, *tables, heat, step_ns=round(1e9 / hz)))
        .effects["heat"]
        .series["b/temperature"]
    )
    excess = series.values - 20.0
    at = np.searchsorted(series.times, 1.0)
    end = np.searchsorted(series.times, 1.0 + seconds - 0.15)
    since = series.times[end] - series.times[at]
    assert excess[end] == pytest.approx(excess[at] * np.exp(-5.0 * since / (J_PER_ML_K * 40.0)), rel=1e-6)
    # All heat less what is lost while it is poured, which leaves 3.322 K at the highest rate.
    assert excess.max() == pytest.approx(0.01 * 55.84e3 / (J_PER_ML_K * 40.0), rel=0.02)
    assert excess.max() == pytest.approx(3.322, rel=0.005 if hz > 10 else 0.02)


@pytest.mark.slow
@pytest.mark.parametrize("hz", [30, 90, 250])
@pytest.mark.parametrize("order", [["a", "b"], ["b", "a"]])
def test_a_chain_of_pours_loses_no_energy(order, hz):
    """Hot water goes from a into b while b runs into c: 60 mL of 60 K above the room, wherever they end.

    37.02 degC in c is what computed runs tend to as their steps get short; it is the same at every rate and order.
    """
    times = np.arange(round(4.0 * hz)) / hz
    poses = {
        "a": poses_of_tilted_glass(np.interp(times, [0.2, 3.5], [0.0, 75.0]), (0.0, 0.5, 0.0)),
        "b": poses_of_tilted_glass(np.interp(times, [0.2, 3.5], [0.0, 25.0]), (0.02, 0.2, 0.0)),
        "c": poses_at_rest(len(times), (0.02, 0.0, 0.0)),
    }  # fmt: skip
    bodies = [
        vessel("a", volume=60.0, solute="", molar=0.0, temperature_c=80.0),
        vessel("b", volume=70.0, solute="", molar=0.0),
        vessel("c", volume=0.0, solute="", molar=0.0),
    ]
    settings = (("pour", {"from": order, "into": ["b", "c"]}), ("mixing", {"in": sorted(order)}), ("heat", HEAT))
    bodies = bodies if order[0] == "a" else bodies[::-1]
    effects = compute(session_with_effects(poses, bodies, *settings, step_ns=round(1e9 / hz))).effects
    volumes = {name: effects["pour"].series[f"{name}/volume"].values[-1] for name in "abc"}
    celsius = {name: effects["heat"].series[f"{name}/temperature"].values[-1] for name in "abc"}
    assert volumes["c"] > 5.0 and celsius["c"] > 21.0 and effects["pour"].series["spilled/volume"].values[-1] == 0.0
    energy = sum(volumes[name] * (celsius[name] - 20.0) for name in "abc")
    assert energy == pytest.approx(60.0 * 60.0, rel=1e-9)
    assert celsius["c"] == pytest.approx(37.02, rel=0.005)


def test_water_comes_in_wrong_order_while_the_acid_is_strong():
    """5 mL of 18 mol/L are below 5 mol/L, which is no strong acid, from 18 mL on: the water until then counts."""
    bodies = (vessel("a", volume=60.0, solute="", molar=0.0), vessel("b", volume=5.0, solute="H2SO4", molar=18.0))
    effects = effects_of_tilt_degrees([0.0, *([120.0] * 10)], bodies, MIX_IN_BOTH, ("heat", HEAT))
    (event,) = effects["heat"].output.events_named("wrong-order")
    volume = effects["mixing"].series["b/volume"].values
    assert event.values["volume_ml"] == pytest.approx(np.diff(volume)[volume[:-1] < 18.0].sum())
