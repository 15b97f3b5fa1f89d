"""Vessels as they stand at the first frame, reactions that wait for what they need, and solids that come back."""

import numpy as np
import pytest
from support.liquid_worlds import (
    BURETTE_COLUMN,
    MIXING_IN_FLASK,
    effects_of_tap_degrees,
    effects_of_tilt_degrees,
    glass,
    poses_at_rest,
    session_with_effects,
)

from replay.effects.effect_plan import plan_faults
from replay.engine import compute
from sessions.model.scene import SceneBody

NO_HEAT_LOSS = ("heat", {"of": "liquids", "ambient_c": 20.0, "loss_w_per_k": 0.0})
MIXING_IN_B = ("mixing", {"in": ["b"]})
TILTS = [0.0, *([60.0] * 3), *([0.0] * 60)]
"""Degrees by which a glass is tilted: it pours for 30 ms of 640 ms."""


def effects_of_standing(flask, *more, count=20):
    """Effects of a run in which a flask stands for so many frames of 0.1 s."""
    return compute(
        session_with_effects({"flask": poses_at_rest(count)}, (flask,), MIXING_IN_FLASK, *more, step_ns=100_000_000)
    ).effects


def precipitates(solid):
    """The table of an effect that follows this solid."""
    return "precipitation", {"solid": solid, "colour": "white"}


def reaction(equation, **more):
    """The table of an effect that lets an equation run; without ``rate_per_s`` it runs at once."""
    return "reaction", {"equation": equation, **more}


SULFATE = reaction("BaCl2 + Na2SO4 -> BaSO4 + 2 NaCl")


def test_precipitate_present_at_the_start_has_its_mass():
    """40 mL hold 0.05 mol/L of barium and of sulfate when the recording begins: 0.002 mol of BaSO4, 233.39 g/mol."""
    flask = glass("flask", volume_ml=40.0, solutes={"BaCl2": 0.05, "Na2SO4": 0.05})
    sulfate = reaction("BaCl2 + Na2SO4 -> BaSO4 + 2 NaCl")
    (event,) = effects_of_standing(flask, sulfate, precipitates("BaSO4"))["precipitation"].events
    assert event.name == "precipitate" and event.time == 0.0
    assert event.values["mass_g"] == pytest.approx(0.002 * 233.39, rel=1e-3)
    assert "have fallen out in flask before the recording begins" in event.text


def test_dissolved_mass_is_counted_from_the_first_precipitate():
    """2 mL hold 0.05 mol/L of silver and of chloride, so 0.1 mmol of AgCl (143.32 g/mol) fell out before the recording.

    Ammonia runs in and dissolves some of it: no more than that.
    """
    flask = glass("flask", volume_ml=2.0, solutes={"AgNO3": 0.05, "NaCl": 0.05})
    ammonia = glass("burette", volume_ml=50.0, solute="NH3", molar=8.0, cavity=BURETTE_COLUMN)
    equations = (reaction("AgNO3 + NaCl -> AgCl + NaNO3"), reaction("AgCl + 2 NH3 -> Ag(NH3)2+ + Cl-"))
    effects = effects_of_tap_degrees(
        [0.0, 0.0, *([90.0] * 60), 0.0], MIXING_IN_FLASK, *equations, precipitates("AgCl"), burette=ammonia, flask=flask
    )
    precipitate, dissolved = effects["precipitation"].events
    assert [precipitate.name, dissolved.name] == ["precipitate", "dissolved"]
    assert precipitate.values["mass_g"] == pytest.approx(1e-4 * 143.32, rel=1e-2)
    assert 0.0 < dissolved.values["mass_g"] <= precipitate.values["mass_g"]
    assert dissolved.values["left_g"] >= 0.0


@pytest.mark.sampled(4)
@pytest.mark.parametrize(
    ("solute", "molar", "equation", "rate"),
    [
        ("Na2S2O3", 0.02, "S2O3^2- + 2 H+ -> SO2 + S + H2O", {}),
        ("Na2S2O3", 0.02, "S2O3^2- + 2 H+ -> SO2 + S + H2O", {"rate_per_s": 5.0}),
        ("NaHCO3", 1.0, "NaHCO3 + HCl -> NaCl + H2O + CO2", {"rate_per_s": 5.0}),
        ("K2CO3", 0.2, "CO3^2- + 2 H+ -> CO2(g) + H2O", {"rate_per_s": 5.0}),
    ],
)
def test_reactions_with_acid_start_when_acid_is_poured_in(solute, molar, equation, rate):
    """Acid is poured into 10 mL of a salt, whose own solution has no acid: nothing reacts before.

    Then more than half of it does, at once or by a rate. The extent is the mol of the equation that have run; where it
    runs by a rate its first row is that of the first acid.
    """
    bodies = (
        glass("a", volume_ml=60.0, solute="HCl", molar=1.0),
        glass("b", volume_ml=10.0, solute=solute, molar=molar),
    )
    effects = effects_of_tilt_degrees(TILTS, bodies, MIXING_IN_B, reaction(equation, **rate))
    extent = effects["reaction"].series["b/extent"]
    assert extent.values[0] == 0.0
    assert not extent.values[extent.times < effects["pour"].events[0].time].any()
    salt_mol = molar * 10e-3
    assert extent.values[-1] > 0.5 * salt_mol


ACIDS_THAT_FREE_GASES = {
    "CO2": ("NaHCO3", "HCl", "NaHCO3 + HCl -> NaCl + H2O + CO2"),
    "SO2": ("Na2SO3", "H2SO4", "Na2SO3 + H2SO4 -> Na2SO4 + H2O + SO2"),
    "H2S": ("Na2S", "HCl", "Na2S + 2 HCl -> 2 NaCl + H2S"),
}


@pytest.mark.sampled(2)
@pytest.mark.parametrize("molar", [0.02, 0.8])
@pytest.mark.parametrize("gas", ACIDS_THAT_FREE_GASES)
def test_amount_of_gas_does_not_depend_on_the_rate(gas, molar):
    """Acid is poured on 20 mL of a salt; the same mol of gas leave whether the equation runs at once or by 20 a second.

    An event says that some of the gas stays dissolved, or that all of it does.
    """
    salt, acid, equation = ACIDS_THAT_FREE_GASES[gas]
    bodies = (glass("a", volume_ml=60.0, solute=acid, molar=2.0), glass("b", volume_ml=20.0, solute=salt, molar=molar))
    at_once = effects_of_tilt_degrees(TILTS, bodies, MIXING_IN_B, reaction(equation))["reaction"].output
    slow = effects_of_tilt_degrees(TILTS, bodies, MIXING_IN_B, reaction(equation, rate_per_s=20.0))["reaction"].output
    moles_at_once, moles_slow = (
        sum(event.values["moles"] for event in output.events_named("gas")) for output in (at_once, slow)
    )
    assert moles_slow == pytest.approx(moles_at_once, rel=0.02, abs=1e-6)
    for output in (at_once, slow):
        some_stays = [event for event in output.events_named("gas") if "stay dissolved" in event.text]
        refusals = output.events_named("no-reaction")
        all_stays = [event for event in refusals if f"all {gas} stays dissolved" in event.text]
        assert len(some_stays) + len(all_stays) == 1


def test_reaction_lacking_its_acid_is_reported_as_not_proceeding():
    """Water is poured to thiosulfate, which gives sulphur only in acid: an event says so, and no sulphur falls out."""
    bodies = (glass("a", volume_ml=60.0), glass("b", volume_ml=10.0, solute="Na2S2O3", molar=0.1))
    effects = effects_of_tilt_degrees(
        TILTS, bodies, MIXING_IN_B, reaction("S2O3^2- + 2 H+ -> SO2 + S + H2O"), precipitates("S")
    )
    (event,) = effects["reaction"].output.events_named("no-reaction")
    assert "it needs acid, and none came into b" in event.text
    assert not effects["precipitation"].series["b/S"].values.any()


def test_ammonium_hardly_dissolves_zinc_without_strong_acid():
    """Zinc lies in 10 mL with 5 mmol of ammonium; the tap of a burette with acid stays shut for 0.4 s.

    The rate of 50 a second is quick. At pH 7 about 0.6 % of ammonium has released its proton (pKa 9.25), so below 1 %
    is used up; a zinc ion takes two protons.
    """
    flask = glass(
        "flask", volume_ml=10.0, solute="NH4Cl", molar=0.5, properties={"solid": {"formula": "Zn", "mass_g": 1.0}}
    )
    burette = glass("burette", volume_ml=50.0, solute="HCl", molar=0.1, cavity=BURETTE_COLUMN)
    zinc = reaction("Zn + 2 HCl -> ZnCl2 + H2", rate_per_s=50.0)
    shut = [0.0] * 40
    effects = effects_of_tap_degrees(shut, MIXING_IN_FLASK, zinc, burette=burette, flask=flask)
    ammonium_moles = 10e-3 * 0.5
    assert effects["reaction"].series["flask/extent"].values.max() < 0.01 * ammonium_moles / 2


def test_catalysed_reaction_runs_only_where_the_catalyst_is():
    """Peroxide is poured from a into b, where the catalyst, manganese dioxide, lies: the reaction runs in b alone.

    The catalyst stands on both sides of the equation. A vessel in which it runs has a series of its extent.
    """
    bodies = (
        glass("a", volume_ml=60.0, solute="H2O2", molar=1.0),
        glass("b", volume_ml=0.0, properties={"solid": {"formula": "MnO2", "mass_g": 0.5}}),
    )
    decay = reaction("2 H2O2 + MnO2 -> 2 H2O + O2 + MnO2", rate_per_s=0.5)
    effects = effects_of_tilt_degrees(TILTS, bodies, ("mixing", {"in": ["a", "b"]}), decay)
    extents = {name: row.values for name, row in effects["reaction"].series.items() if name.endswith("extent")}
    assert set(extents) == {"b/extent"} and extents["b/extent"][-1] > 0.0


def test_vessel_starts_at_its_declared_temperature():
    """A flask of 50 mL at 80 degC has salt in it, all of which dissolves; that takes up heat.

    It has dissolved before the first frame: the temperature there is the declared, not a lower.
    """
    for mass_g in [5.0, 30.0]:
        properties = {"solid": {"formula": "KNO3", "mass_g": mass_g}, "temperature_c": 80.0}
        effects = effects_of_standing(glass("flask", volume_ml=50.0, properties=properties), NO_HEAT_LOSS)
        assert effects["heat"].series["flask/temperature"].values[0] == pytest.approx(80.0, abs=1e-9), mass_g


@pytest.mark.parametrize(
    ("solid", "more"),
    [("NH4NO3", ()), ("CaO", (reaction("CaO + H2O -> Ca(OH)2"), precipitates("Ca(OH)2")))],
    ids=["a salt that cools", "lime that warms"],
)
def test_temperature_of_wetted_solids_stays_between_reported_extremes(solid, more):
    """Water of 20 degC is poured on 4 g of a dry solid, which cools or warms it.

    20 degC and the temperature that the event of the warmest or the coldest states are the extremes of the series.
    """
    bodies = (
        glass("a", volume_ml=60.0),
        glass("b", volume_ml=0.0, properties={"solid": {"formula": solid, "mass_g": 4.0}}),
    )
    effects = effects_of_tilt_degrees(TILTS, bodies, MIXING_IN_B, NO_HEAT_LOSS, *more)["heat"]
    values = effects.series["b/temperature"].values
    stated = [event.values["to_c"] for event in effects.events if event.name in ("warmest", "coldest")]
    assert [values.min(), values.max()] == pytest.approx(sorted([20.0, *stated]), abs=1e-9)


@pytest.mark.slow
def test_advice_for_copper_in_ammonia_goes_in_no_circle():
    """Ammonia drips into copper sulfate, and the scene names the basic sulfate as the solid that falls out.

    It falls out, and no event advises to name another solid, such as the hydroxide, that is beyond its solubility.
    """
    flask = glass("flask", volume_ml=2.0, solute="CuSO4", molar=0.1)
    ammonia = glass("burette", volume_ml=50.0, solute="NH3", molar=1.0, cavity=BURETTE_COLUMN)
    fresh = reaction("4 CuSO4 + 6 NH3 + 6 H2O -> Cu4(OH)6SO4 + 3 (NH4)2SO4")
    drip = [0.0, 0.0, *([90.0] * 60), 0.0]
    effects = effects_of_tap_degrees(
        drip, MIXING_IN_FLASK, fresh, precipitates("Cu4(OH)6SO4"), burette=ammonia, flask=flask
    )
    assert not effects["reaction"].output.events_named("supersaturated")
    assert effects["precipitation"].output.events_named("precipitate")


@pytest.mark.slow
def test_salt_dissolved_hot_and_crystallised_cold_gives_both_events():
    """Water of 80 degC is poured on 6 g of potassium nitrate, which dissolve, and cools towards a room of 20 degC.

    Some of the salt falls out again then.
    """
    bodies = (
        glass("a", volume_ml=60.0, properties={"temperature_c": 80.0}),
        glass("b", volume_ml=0.0, properties={"solid": {"formula": "KNO3", "mass_g": 6.0}}),
    )
    cooling = ("heat", {"of": "liquids", "ambient_c": 20.0, "loss_w_per_k": 800.0})
    events = effects_of_tilt_degrees(TILTS, bodies, MIXING_IN_B, precipitates("KNO3"), cooling)["precipitation"].events
    assert [event.name for event in events] == ["dissolved", "precipitate"]
    dissolved, grown = events
    assert dissolved.time < grown.time and "fall out again" in grown.text
    assert 0.0 < grown.values["mass_g"] < dissolved.values["mass_g"] <= 6.0


@pytest.mark.parametrize("millilitres", [1.0, 2.2, 3.0])
def test_end_point_missed_by_a_few_millilitres_is_reported(millilitres):
    """Base of 0.1 mol/L runs into 25 mL of acid of 0.01 mol/L, about so many ``millilitres``; 2.5 mL are equivalent.

    Base that stops short of 2.5 mL is reported, with both volumes, if a quarter more would have reached them: of the
    three only 2.2 mL, 2.75 with a quarter more, for 1 mL would be 1.25 and 3 mL reach the end point.
    """
    flask = glass("flask", volume_ml=25.0, solute="HCl", molar=0.01)
    area_for_5_ml, frames_of_80_ms = 6e-7, 50
    effects = effects_of_tap_degrees(
        [0.0, *([90.0] * frames_of_80_ms), 0.0], MIXING_IN_FLASK, reaction("HCl + NaOH -> NaCl + H2O"), flask=flask,
        settings={"full_area_m2": area_for_5_ml * millilitres / 5.0}, step_ns=80_000_000,
    )  # fmt: skip
    added_ml, equivalent_ml = effects["burette"].events[0].values["volume_ml"], 2.5
    events = effects["reaction"].output.events_named("not-reached")
    is_just_short = added_ml < equivalent_ml <= 1.25 * added_ml
    assert len(events) == is_just_short, added_ml
    for event in events:
        assert event.values["volume_ml"] == pytest.approx(equivalent_ml, rel=1e-3)
        assert event.values["came_ml"] == pytest.approx(added_ml)


def test_a_liquid_over_a_flame_needs_its_boiling_point():
    """20 mL stand in a dish over a flame, and nothing in the scene says how its water is followed, or when it boils.

    With a boiling point the scene has no fault.
    """
    bodies = (SceneBody("lamp"), glass("dish", volume_ml=20.0, properties={"heat_capacity_j_per_k": 60.0}))
    poses = {name: poses_at_rest(count=2) for name in ("lamp", "dish")}
    (fault,) = plan_faults(session_with_effects(poses, bodies, ("heat", FLAME_UNDER_DISH)).scene)
    assert "'dish' holds a liquid over the flame: follow it by" in fault
    with_boiling_point = ("heat", {**FLAME_UNDER_DISH, "boils_c": 100.0})
    assert not plan_faults(session_with_effects(poses, bodies, with_boiling_point).scene)


FLAME_UNDER_DISH = {
    "of": "flame", "source": "lamp", "heats": "dish", "within": 0.02, "base": [0.0, 0.1, 0.0], "power_w": 160.0,
    "loss_w_per_k": 0.4, "ambient_c": 20.0,
}  # fmt: skip


def test_liquid_poured_over_a_flame_needs_a_boiling_point():
    """A pour into a dish over a flame is declared, and no mixing that would follow its water.

    The flame must say when it boils; with that the scene has no fault.
    """
    dish = glass("dish", volume_ml=0.0, properties={"heat_capacity_j_per_k": 60.0})
    bodies = (SceneBody("lamp"), dish, glass("a", volume_ml=60.0))
    pour = ("pour", {"from": ["a"], "into": ["dish"]})
    poses = {name: poses_at_rest(count=2) for name in ("lamp", "dish", "a")}
    (fault,) = plan_faults(session_with_effects(poses, bodies, pour, ("heat", FLAME_UNDER_DISH)).scene)
    assert "'dish' may receive a liquid over the flame: follow it by" in fault and "boils_c" in fault
    with_boiling_point = ("heat", {**FLAME_UNDER_DISH, "boils_c": 100.0})
    assert not plan_faults(session_with_effects(poses, bodies, pour, with_boiling_point).scene)


def test_acetic_acid_at_rest_has_its_ph():
    """0.1 mol/L of acetic acid stand in a flask: Ka = 1.75e-5 = x^2 / (0.1 - x) gives x = 1.31e-3 mol/L of H+.

    An event of the effect reaction states the pH, though nothing is poured.
    """
    flask = glass("flask", volume_ml=50.0, solute="CH3COOH", molar=0.1)
    (event,) = effects_of_standing(flask, reaction("CH3COOH -> CH3COO- + H+"))["reaction"].events
    assert event.name == "ph" and event.values["to_ph"] == pytest.approx(-np.log10(1.31e-3), abs=0.02)


LIME = glass("flask", volume_ml=50.0, properties={"solid": {"formula": "CaO", "mass_g": 1.0}})
SLAKING = "CaO + H2O -> Ca(OH)2(s)"


def test_lime_in_water_reacts_before_the_first_frame():
    """1 g of CaO lies in 50 mL of water when the recording begins, with an equation that runs at once.

    The heat of it is not computed, as an event of the effect heat says.
    """
    effects = effects_of_standing(LIME, NO_HEAT_LOSS, reaction(SLAKING), precipitates("Ca(OH)2"))
    assert not effects["reaction"].output.events_named("no-reaction")
    (before,) = effects["heat"].output.events_named("dissolved-before")
    assert "1 g CaO react with the water in flask before" in before.text


def test_slaking_lime_warms_water_by_its_heat_of_reaction():
    """1 g of CaO (56.08 g/mol) reacts in 50 mL of water by 2 a second, for 2.5 s, without loss of heat.

    All but exp(-5) of it reacts, 0.7 %.
    """
    slaking = reaction(SLAKING, rate_per_s=2.0)
    frames_of_0_1_s = 26
    effects = effects_of_standing(LIME, NO_HEAT_LOSS, slaking, precipitates("Ca(OH)2"), count=frames_of_0_1_s)
    (warmest,) = effects["heat"].output.events_named("warmest")
    slaking_j_per_mol = 65.2e3  # NBS tables, without the little that dissolves
    moles, water_j_per_k = 1.0 / 56.08, 50.0 * 4.18
    assert warmest.values["change_k"] == pytest.approx(slaking_j_per_mol * moles / water_j_per_k, rel=0.05)


def test_edta_abbreviation_is_refused_with_the_full_formula():
    """``written``: the solute of a flask in a scene, as labels of bottles have it; EDTA and Y are no elements.

    The fault names the formula to write instead.
    """
    for written in ["Na2H2EDTA", "EDTA", "Na2H2Y", "Na2EDTA"]:
        flask = glass("flask", volume_ml=9.0, solute=written, molar=0.01)
        scene = session_with_effects({"flask": poses_at_rest(count=2)}, (flask,), MIXING_IN_FLASK).scene
        (fault,) = plan_faults(scene)
        assert "write the disodium salt of EDTA as 'Na2C10H14N2O8.2H2O'" in fault, written


@pytest.mark.parametrize(
    ("solutes", "equation", "sentences"),
    [
        ({"NaHCO3": 1.0, "C6H8O7": 0.4}, "HCO3- + H+ -> CO2 + H2O", ["48.2 mmol CO2 have left flask as gas"]),
        (
            {"H2O2": 1.0},
            "2 H2O2 -> 2 H2O + O2",
            ["25 mmol O2 have left flask as gas", "2 H2O2 -> 2 H2O + O2 has run in flask"],
        ),
        ({"Ca(OH)2": 1.0}, "Ca(OH)2 + 2 HCl -> CaCl2 + 2 H2O", ["3.62 g Ca(OH)2 have fallen out in flask"]),
        ({"HCl": 0.1, "NaOH": 0.05}, "HCl + NaOH -> NaCl + H2O", []),
    ],
    ids=["gas", "a decay that gives gas", "a solid", "neutralisation"],
)
def test_reactions_of_the_starting_mixture_are_reported_as_before(solutes, equation, sentences):
    """A flask of 50 mL contains both reactants at the start, or a solid beyond its solubility, and so reacts before.

    60 mmol of protons make 50 mmol of CO2, of which 48.2 leave and the rest stays dissolved; 25 mmol of O2 are half of
    50 mmol of H2O2; 50 mmol of lime are 3.7 g, of which 0.08 g dissolve; acid that neutralises is no event.
    """
    flask = glass("flask", volume_ml=50.0, solutes=solutes)
    # The equations with HCl need a vessel that brings it, which is never poured.
    other = glass("other", volume_ml=1.0, solutes={"HCl": 0.1} if "HCl" in equation else {})
    bodies, poses = (flask, other), {"flask": poses_at_rest(count=3), "other": poses_at_rest(count=3)}
    tables = (("mixing", {"in": ["flask", "other"]}), reaction(equation))
    events = compute(session_with_effects(poses, bodies, *tables)).effects["reaction"].output.events_named("before")
    expected = [f"{text} before the recording begins" for text in sentences]
    assert [event.text.partition(", by ")[0] for event in events] == expected


def test_an_emptied_vessel_has_no_temperature():
    """60 mL of 80 degC are poured out, in a room of 20 degC and without loss.

    The temperature of the glass ends with its water, at 80 degC, and no event of heat is of it.
    """
    hot = glass("a", volume_ml=60.0, properties={"temperature_c": 80.0})
    effects = effects_of_tilt_degrees(
        [0.0, *np.linspace(0.0, 120.0, 40), 120.0], (hot, glass("b", volume_ml=10.0)), MIXING_IN_B, NO_HEAT_LOSS
    )
    series = effects["heat"].series["a/temperature"]
    assert effects["pour"].series["a/volume"].values[-1] == 0.0 and series.values.min() == pytest.approx(80.0)
    assert not [event for event in effects["heat"].events if event.bodies == ("a",)]
