"""Heat of reaction against the tables it comes from, calorimetry against the closed form, at every rate."""

import tomllib
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from support.liquid_worlds import (
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
POURS_OUT_DEGREES = [0.0, *([120.0] * 40), 0.0]
"""Degrees of the upper glass, one a frame of 10 ms."""


HEATS = tomllib.loads(Path(__file__).with_name("heats.toml").read_text("utf-8"))["reaction"]
"""Of each equation: both solutions, as solute and mol/L, and kJ per mol of the first that warm the mixture."""


def vessel(name, volume, solute, molar, **properties):
    """A vessel with so many millilitres of a solution, mol/L."""
    return glass(name, volume, properties=properties, solute=solute, molar=molar)


@pytest.mark.sampled(3)
@pytest.mark.parametrize("row", HEATS, ids=lambda row: row["equation"])
def test_a_reaction_gives_the_heat_of_its_enthalpies_of_formation(row):
    """20 mL of the first solution are poured into 20 mL of the second, at 20 degC and without loss.

    Kelvin x 4.18 J/(mL K) x all mL is the heat; by the moles poured it is ``kj_mol``, of the NBS tables of 1982.
    """
    bodies = (vessel("a", 20.0, *row["first"]), vessel("b", 20.0, *row["second"]))
    settings = (MIX_IN_BOTH, ("reaction", {"equation": row["equation"]}), ("heat", HEAT))
    effects = effects_of_tilt_degrees(POURS_OUT_DEGREES, bodies, *settings)
    moved_ml = effects["pour"].events[0].values["volume_ml"]
    series = effects["heat"].series["b/temperature"]
    assert (series.times[0], series.values[0]) == (0.0, 20.0)
    kelvin = series.values[-1] - 20.0
    (event,) = [event for event in effects["heat"].output.events_named("warmest") if event.bodies == ("b",)]
    assert event.values["change_k"] == pytest.approx(kelvin) and "b warms from 20.00 to" in event.text
    _solute, molar = row["first"]
    kilojoule = 1e-3 * kelvin * J_PER_ML_K * (20.0 + moved_ml)
    moles = molar * moved_ml * 1e-3
    assert kilojoule / moles == pytest.approx(row["kj_mol"], rel=0.01)


def test_the_constant_of_the_vessel_and_the_starting_temperature_count():
    """20 mL of acid, 0.5 mol/L and 10 degC, come to 20 mL of lye, 1 mol/L and 30 degC, in a vessel of 30 J/K.

    A mol of the acid, all of which is neutralised, gives 55.84 kJ.
    """
    bodies = (
        vessel("a", volume=20.0, solute="HCl", molar=0.5, temperature_c=10.0),
        vessel("b", volume=20.0, solute="NaOH", molar=1.0, temperature_c=30.0, heat_capacity_j_per_k=30.0),
    )
    tables = (MIX_IN_BOTH, ("reaction", {"equation": "HCl + NaOH -> NaCl + H2O"}), ("heat", HEAT))
    effects = effects_of_tilt_degrees(POURS_OUT_DEGREES, bodies, *tables)
    moved_ml = effects["pour"].events[0].values["volume_ml"]
    celsius = effects["heat"].series["b/temperature"].values
    # Joule above 20 degC: lye and vessel bring 10 K more, acid 10 K less, and each mol of acid its heat.
    lye_and_vessel_j = (J_PER_ML_K * 20.0 + 30.0) * 10.0
    acid_j = J_PER_ML_K * moved_ml * -10.0
    neutralisation_j = 0.5e-3 * moved_ml * 55.84e3
    j_per_k = J_PER_ML_K * (20.0 + moved_ml) + 30.0
    expected_c = 20.0 + (lye_and_vessel_j + acid_j + neutralisation_j) / j_per_k
    assert celsius[0] == 30.0
    assert celsius[-1] == pytest.approx(expected_c, rel=1e-5)


def test_a_vessel_cools_by_newtons_law_before_anything_comes_in():
    """50 mL of 80 degC lose 100 W/K in a room of 20 degC for 20 frames; then a second glass is poured into them."""
    bodies = (
        vessel("a", volume=60.0, solute="", molar=0.0),
        vessel("b", volume=50.0, solute="", molar=0.0, temperature_c=80.0),
    )
    heat = ("heat", {**HEAT, "loss_w_per_k": 100.0})
    effects = effects_of_tilt_degrees([*([0.0] * 20), *([120.0] * 10), 0.0], bodies, MIX_IN_BOTH, heat)
    series = effects["heat"].series["b/temperature"]
    before_pour = series.times < effects["pour"].events[0].time - STEP_S
    assert before_pour.sum() > 10, "rows of most of the 20 frames"
    seconds = series.times[before_pour] - series.times[0]
    expected_c = 20.0 + (80.0 - 20.0) * np.exp(-100.0 * seconds / (J_PER_ML_K * 50.0))
    assert series.values[before_pour] == pytest.approx(expected_c, rel=1e-9)


OXIDATION = ("reaction", {"equation": "2 Fe3+ + 2 I- -> 2 Fe2+ + I2"})


@cache
def effects_of_hot_liquid_poured_into_cold():
    """Effects of a run: iron(III) chloride of 60 degC is poured from frame 20 on into iodide in glass b, a cold glass.

    Both are so dilute, 1 mmol/L, that their own heat is nothing. The room has 20 degC; both glasses lose 10 W/K.
    """
    bodies = (
        vessel("a", volume=60.0, solute="FeCl3", molar=0.001, temperature_c=60.0),
        vessel("b", volume=50.0, solute="KI", molar=0.001),
    )
    tables = (MIX_IN_BOTH, OXIDATION, ("heat", {**HEAT, "loss_w_per_k": 10.0}))
    return effects_of_tilt_degrees([*([0.0] * 20), *([120.0] * 10), 0.0], bodies, *tables)


def test_a_vessel_that_drifts_to_the_room_is_no_result():
    """The liquid of 60 degC cools in glass a, and reacts in glass b, which it warms: only b is reported."""
    heat = effects_of_hot_liquid_poured_into_cold()["heat"]
    assert {event.bodies for event in heat.events if event.name in ("warmest", "coldest")} == {("b",)}


def test_temperature_has_a_row_just_before_it_changes():
    """Glass b is as cold as the room, 20 degC, until a hot liquid is poured into it: nothing changes before.

    It has a row at the start and a row one frame before the pour, so that a line drawn rises from there.
    """
    effects = effects_of_hot_liquid_poured_into_cold()
    volume, celsius = effects["mixing"].series["b/volume"], effects["heat"].series["b/temperature"]
    pour_s = volume.times[1:][np.diff(volume.values) > 0.0][0]
    assert celsius.values[celsius.times < pour_s].tolist() == [20.0, 20.0]
    assert celsius.times[1] == pytest.approx(pour_s - STEP_S)


def test_headline_of_a_dry_solid_is_that_of_the_mixture():
    """60 mL of water of 20 degC are poured on 2 g of calcium chloride's hydrate, which cool it by half a kelvin or so.

    The first drops, which are colder and may freeze, are not reported: the event's coldest temperature is the last.
    """
    solid = {"solid": {"formula": "CaCl2.6H2O", "mass_g": 2.0}}
    bodies = (vessel("a", volume=60.0, solute="", molar=0.0), glass("b", volume_ml=0.0, properties=solid))
    effects = effects_of_tilt_degrees(
        [0.0, *np.linspace(0.0, 120.0, 40), *([120.0] * 100)], bodies, MIX_IN_BOTH, ("heat", HEAT)
    )
    (coldest,) = effects["heat"].output.events_named("coldest")
    last = effects["heat"].series["b/temperature"].values[-1]
    assert coldest.values["to_c"] == pytest.approx(last, abs=0.01)
    assert 17.0 < last < 19.9  # 9.1 mmol take up some 16 kJ/mol, 0.14 kJ; 60 mL have 0.25 kJ/K
    assert not effects["heat"].output.events_named("freeze")


def test_solution_that_freezes_states_its_coldest_temperature():
    """Up to 60 mL of water of 5 degC are poured on 40 g of ammonium nitrate: 0.5 mol take 25.7 kJ/mol, 12.8 kJ.

    That is enough to cool 60 mL by 50 K; the event states the lowest temperature of the series, below -10 degC.
    """
    solid = {"solid": {"formula": "NH4NO3", "mass_g": 40.0}}
    bodies = (vessel("a", volume=60.0, solute="", molar=0.0), glass("b", volume_ml=0.0, properties=solid))
    effects = effects_of_tilt_degrees([0.0, *([120.0] * 10)], bodies, MIX_IN_BOTH, ("heat", {**HEAT, "ambient_c": 5.0}))
    (event,) = effects["heat"].output.events_named("freeze")
    coldest = effects["heat"].series["b/temperature"].values.min()
    assert event.values["celsius"] == pytest.approx(coldest) and coldest < -10.0


@pytest.mark.parametrize(
    ("formula", "mass_g", "equations", "ions"),
    [
        ("Na2S2O3", 20.0, (), ["Na+ and S2O3^2-"]),
        ("CO(NH2)2", 20.0, (), ["CO(NH2)2"]),
        ("CO(NH2)2", 2.0, (), []),
        ("Na2S2O3", 20.0,
         [("reaction", {"equation": "Na2S2O3(s) -> 2 Na+ + S2O3^2-", "heat_kj_mol": 7.0})], []),
        ("NaNO3", 20.0, (), []),
    ],
    ids=["thiosulfate", "urea", "weak solution", "heat by the scene", "heat by a table"],
)  # fmt: skip
def test_heat_of_a_strong_solution_without_a_table_is_named(formula, mass_g, equations, ions):
    """30 mL of water are poured on a powder; ``ions``: of the warning that no heat of so strong a solution is known.

    There is none where 2 g of urea give a weak solution, where the scene declares an equation with its heat, or where a
    table has the heat, as of sodium nitrate.
    """
    powder = {"solid": {"formula": formula, "mass_g": mass_g}}
    bodies = (vessel("a", volume=30.0, solute="", molar=0.0), glass("b", volume_ml=0.0, properties=powder))
    effects = effects_of_tilt_degrees(POURS_OUT_DEGREES, bodies, MIX_IN_BOTH, *equations, ("heat", HEAT))
    texts = [event.text for event in effects["heat"].output.events_named("strong")]
    assert len(texts) == len(ions)
    assert all(f"so strong a solution of {name} as" in text for name, text in zip(ions, texts, strict=True))


@pytest.mark.slow
def test_a_warm_titration_goes_by_drops():
    """A burette runs for 2 s, more than 20 mL, through an opening of 6 mm2, and an effect heat follows the flask.

    The inflow is followed in steps below 0.2 mL, also where more comes in a frame. In larger ones permanganate
    coloured hot oxalic acid 0.55 mL after its end point.
    """
    effects = effects_of_tap_degrees(
        [*([0.0] * 2), *([90.0] * 200)],
        ("mixing", {"in": ["flask"]}),
        ("heat", HEAT),
        settings={"full_area_m2": 6e-6},
    )
    volume_ml = effects["mixing"].series["flask/volume"].values
    assert np.ptp(volume_ml) > 20.0
    assert np.diff(volume_ml).max() < 0.2


def test_a_hot_dry_solid_does_not_boil():
    """Potassium nitrate of 250 degC is in a glass without water; the glass of water beside it stays upright."""
    solid = {"solid": {"formula": "KNO3", "mass_g": 10.0}, "temperature_c": 250.0}
    bodies = (vessel("a", volume=60.0, solute="", molar=0.0), glass("b", volume_ml=0.0, properties=solid))
    effects = effects_of_tilt_degrees([0.0] * 20, bodies, MIX_IN_BOTH, ("heat", HEAT))
    assert not effects["heat"].output.events_named("boil")


def test_hot_copper_warms_the_water_poured_onto_the_metal():
    """100 g of copper of 90 degC have 38.5 J/K by the handbook's 0.385 J/(g K); the water has 20 degC.

    Both end at the temperature that their heat capacities share.
    """
    metal = {"solid": {"formula": "Cu", "mass_g": 100.0}, "temperature_c": 90.0}
    bodies = (vessel("a", volume=60.0, solute="", molar=0.0), glass("b", volume_ml=0.0, properties=metal))
    effects = effects_of_tilt_degrees(POURS_OUT_DEGREES, bodies, MIX_IN_BOTH, ("heat", HEAT))
    water_j_per_k = J_PER_ML_K * effects["pour"].events[0].values["volume_ml"]
    copper_j_per_k = 100.0 * 0.385
    warms_k = copper_j_per_k * (90.0 - 20.0) / (water_j_per_k + copper_j_per_k)
    celsius = effects["heat"].series["b/temperature"].values
    # The product counts copper by Kopp's rule, 26 J/(mol K), which is 6 % more than the handbook.
    assert celsius[-1] - 20.0 == pytest.approx(warms_k, rel=0.06)


@pytest.mark.parametrize("hz", [9, 90, *(pytest.param(hz, marks=pytest.mark.slow) for hz in (30, 250, 1000))])
def test_calorimetry_with_loss_follows_newtons_law_at_every_rate(hz):
    """20 mL of acid, 10 mmol, are poured into 20 mL with 20 mmol of lye: 55.84 kJ/mol warm 40 mL, which lose 5 W/K.

    The glass is emptied by 0.9 s: from 1 s on the mixture only cools. ``hz``: frames a second.
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
    above_room_k = series.values - 20.0
    start = np.searchsorted(series.times, 1.0)
    end = np.searchsorted(series.times, 1.0 + seconds - 0.15)  # a row near the end of the recording
    cooling_s = series.times[end] - series.times[start]
    j_per_k, loss_w_per_k = J_PER_ML_K * 40.0, 5.0
    expected_k = above_room_k[start] * np.exp(-loss_w_per_k * cooling_s / j_per_k)
    assert above_room_k[end] == pytest.approx(expected_k, rel=1e-6)
    # 3.340 K, of which some is lost while it is poured: the run with the most frames a second has 3.322 K.
    assert above_room_k.max() == pytest.approx(0.01 * 55.84e3 / j_per_k, rel=0.02)
    assert above_room_k.max() == pytest.approx(3.322, rel=0.005 if hz > 10 else 0.02)


@pytest.mark.slow
@pytest.mark.parametrize("hz", [30, 90, 250])
@pytest.mark.parametrize("order", [["a", "b"], ["b", "a"]])
def test_a_chain_of_pours_loses_no_energy(order, hz):
    """60 mL of water of 80 degC go from glass a into b while b, with 70 mL of 20 degC, runs into c.

    60 mL x 60 K above the room of 20 degC stay, wherever they end. 37.02 degC in c is what computed runs tend to as
    their steps get short; it is the same at every rate (``hz``: frames a second) and ``order`` of glasses in the scene.
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
    volume_ml = {name: effects["pour"].series[f"{name}/volume"].values[-1] for name in "abc"}
    celsius = {name: effects["heat"].series[f"{name}/temperature"].values[-1] for name in "abc"}
    assert volume_ml["c"] > 5.0 and effects["pour"].series["spilled/volume"].values[-1] == 0.0
    ml_times_k = sum(volume_ml[name] * (celsius[name] - 20.0) for name in "abc")
    assert ml_times_k == pytest.approx(60.0 * (80.0 - 20.0), rel=1e-9)
    assert celsius["c"] == pytest.approx(37.02, rel=0.005)


def test_water_comes_in_wrong_order_while_the_acid_is_strong():
    """Water is poured on 5 mL of sulfuric acid of 18 mol/L, 90 mmol, which are below 5 mol/L from 18 mL on.

    Below that it is no strong acid, so the error has the volume of the water that came before.
    """
    bodies = (vessel("a", volume=60.0, solute="", molar=0.0), vessel("b", volume=5.0, solute="H2SO4", molar=18.0))
    effects = effects_of_tilt_degrees([0.0, *([120.0] * 10)], bodies, MIX_IN_BOTH, ("heat", HEAT))
    (event,) = effects["heat"].output.events_named("wrong-order")
    volume_ml = effects["mixing"].series["b/volume"].values
    strong_until_ml = 5.0 * 18.0 / 5.0
    added_to_strong_acid_ml = np.diff(volume_ml)[volume_ml[:-1] < strong_until_ml].sum()
    assert event.values["volume_ml"] == pytest.approx(added_to_strong_acid_ml)
    (lane,) = effects["heat"].output.lanes["b"]
    assert event.time == lane.start < lane.end == event.end


def test_liquid_of_the_rooms_temperature_keeps_it():
    """60 mL of water are poured into 5 mL: the temperature of both is 20 degC in every frame."""
    bodies = (vessel("a", volume=60.0, solute="", molar=0.0), vessel("b", volume=5.0, solute="", molar=0.0))
    effects = effects_of_tilt_degrees([0.0, *([120.0] * 10)], bodies, MIX_IN_BOTH, ("heat", HEAT))
    temperatures = [effects["heat"].series[f"{name}/temperature"].values for name in "ab"]
    assert all(len(celsius) and (celsius == 20.0).all() for celsius in temperatures)
    assert not [event for event in effects["heat"].events if event.name in ("warmest", "coldest", "boil")]


@pytest.mark.parametrize(
    ("formula", "volume_ml", "verb"),
    [("NaCl", 50.0, "dissolve in"), ("CaO", 50.0, "react with the water in"), ("NaCl", 0.0, None)],
)
def test_solid_in_a_liquid_from_the_start_is_named(formula, volume_ml, verb):
    """1 g in ``volume_ml`` of water all dissolves, or becomes hydroxide, before the recording begins: an event says so.

    ``verb``: of the event's text; of a dry solid there is no event.
    """
    solid = {"solid": {"formula": formula, "mass_g": 1.0}}
    bodies = (vessel("a", volume=60.0, solute="", molar=0.0), glass("b", volume_ml=volume_ml, properties=solid))
    effects = effects_of_tilt_degrees([0.0, *([120.0] * 10)], bodies, MIX_IN_BOTH, ("heat", HEAT))
    events = effects["heat"].output.events_named("dissolved-before")
    assert [event.values["mass_g"] for event in events] == ([] if verb is None else [pytest.approx(1.0, abs=0.02)])
    assert all(verb in event.text for event in events)
