"""Scenes as somebody new wrote them from the guide, and what they stumbled over."""

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

from replay.effects.chemistry.components import FRESH_FORMULAS
from replay.effects.colour_tables import SOLID_COLOURS
from replay.effects.effect_plan import plan_faults
from replay.effects.output import COLOURS
from replay.engine import compute
from sessions.model.scene import Scene, SceneEffect
from sessions.scene_files.scene_toml import parse_scene

DRIP = [0.0, 0.0, *([90.0] * 60), *([0.0] * 4)]
"""Degrees of the tap, one a frame of 10 ms: it is open for 0.6 s, in which 0.8 mL run out."""

HEAT = ("heat", {"of": "liquids", "ambient_c": 20.0, "loss_w_per_k": 200.0})
CALM = ("heat", {"of": "liquids", "ambient_c": 20.0, "loss_w_per_k": 0.0})
NITRE = ("precipitation", {"solid": "KNO3", "colour": "white"})


def standing(seconds, flask, *more):
    """Effects of a run in which a flask stands for so long, 0.1 s a frame."""
    count = int(seconds * 10) + 1
    return compute(
        session_with_effects({"flask": poses_at_rest(count)}, (flask,), MIXING_IN_FLASK, *more, step_ns=100_000_000)
    ).effects


def nitre(celsius, mass_g=40.0):
    """A flask with 50 mL of water on potassium nitrate."""
    return glass(
        "flask", volume_ml=50.0, properties={"solid": {"formula": "KNO3", "mass_g": mass_g}, "temperature_c": celsius}
    )


@pytest.mark.slow
def test_a_salt_crystallises_where_its_solution_merely_cools():
    """40 g of potassium nitrate in 50 mL of water cool from 70 degC towards a room of 20 degC, without a pour."""
    effects = standing(4.0, nitre(celsius=70.0), NITRE, HEAT)
    (event,) = effects["precipitation"].events
    celsius = effects["heat"].series["flask/temperature"].values[-1]
    # 50 mL of hot water weigh as much less as it is lighter: 0.978 g/mL at 70 degC. Source: CRC Handbook.
    left = np.interp(celsius, [20.0, 30.0], [31.6, 45.8]) / 2.0 * 0.978
    assert event.name == "precipitate"
    # 40 g in 48.9 g of water are saturated at 48.3 degC: 63.9 g in 100 g at 40 degC, 85.5 g at 50 degC (Seidell).
    assert event.values["celsius"] == pytest.approx(48.3, abs=1.0)
    assert f"falls out in flask at {event.values['celsius']:.1f} degC" in event.text
    assert effects["precipitation"].series["flask/KNO3"].values[-1] == pytest.approx(40.0 - left, rel=0.02)


@pytest.mark.parametrize("celsius", [10.0, 20.0, 40.0])
def test_solid_in_water_dissolves_at_the_stated_temperature(celsius):
    """Half of 20.9, 31.6 or 63.9 g in 100 g of water (Seidell) dissolves in 50 mL, out of 40 g.

    Its heat is gone before the recording: an event of heat says so.
    """
    effects = standing(0.5, nitre(celsius), NITRE, CALM)
    (dissolved,) = effects["precipitation"].events
    expected = np.interp(celsius, [10.0, 20.0, 40.0], [20.9, 31.6, 63.9]) / 2.0
    assert dissolved.name == "dissolved" and dissolved.values["mass_g"] == pytest.approx(expected, rel=0.01)
    before = effects["heat"].output.events_named("dissolved-before")
    assert [event.values["formula"] for event in before] == ["KNO3"]
    assert before[0].values["mass_g"] == pytest.approx(expected, rel=0.01)


def test_heat_of_a_solid_is_released_by_equations_with_rates():
    """So the event advises: 4 g of anhydrous copper sulfate warm 50 mL of water by 7.9 K."""
    flask = glass("flask", volume_ml=50.0, properties={"solid": {"formula": "CuSO4", "mass_g": 4.0}})
    slowly = ("reaction", {"equation": "CuSO4(s) -> Cu2+ + SO4^2-", "rate_per_s": 1.0})
    effects = standing(10.0, flask, CALM, slowly)
    assert not effects["heat"].output.events_named("dissolved-before")
    (warmest,) = effects["heat"].output.events_named("warmest")
    # -66.1 kJ/mol by Nuffield Advanced Chemistry.
    assert warmest.values["change_k"] == pytest.approx(4.0 / 159.6 * 66.1e3 / (50.0 * 4.18), rel=0.03)


def test_every_fresh_precipitate_has_a_default_colour():
    """Each formula that stands for a fresh solid has a colour that can be drawn."""
    assert [solid for solid in FRESH_FORMULAS if SOLID_COLOURS.get(solid) not in COLOURS] == []


@pytest.mark.parametrize("colour", ["deep blue", "light blue", "pale yellow", "blue-green", "dark red-brown", "grey"])
def test_colours_may_have_shades_and_be_halves_of_two(colour):
    """The scene has no fault: a shade before a colour, or two colours with a dash, need no row of their own."""
    tables = (MIXING_IN_FLASK, HEAT, ("precipitation", {"solid": "KNO3", "colour": colour}))
    assert (
        plan_faults(session_with_effects({"flask": poses_at_rest(count=2)}, (nitre(celsius=20.0),), *tables).scene)
        == ()
    )


def test_shades_are_ordered_from_pale_to_dark():
    """Brightness is the sum of red, green and blue."""
    brightness = [sum(COLOURS[f"{shade} blue"][:3]) for shade in ("pale", "light", "bright", "deep")]
    assert brightness == sorted(brightness, reverse=True)


@pytest.mark.parametrize("liquid", [{}, {"solute": "H2O"}, {"solute": "water"}])
def test_plain_water_needs_no_concentration(liquid):
    """A liquid of 50 mL that names no solute, or water as its solute."""
    scene = session_with_effects(
        {"flask": poses_at_rest(count=2)}, (glass("flask", volume_ml=50.0, **liquid),), MIXING_IN_FLASK
    ).scene
    assert plan_faults(scene) == ()


def test_a_solute_without_its_concentration_is_named():
    """The flask names HCl and no mol/L."""
    scene = session_with_effects(
        {"flask": poses_at_rest(count=2)}, (glass("flask", volume_ml=50.0, solute="HCl"),), MIXING_IN_FLASK
    ).scene
    (fault,) = plan_faults(scene)
    assert "body 'flask' has no liquid.molar; give a finite number" in fault


def test_two_ions_colour_a_liquid_and_each_change_is_reported():
    """Chromate becomes dichromate: its colour gives way to the other's, in the glass too."""
    burette = glass("burette", volume_ml=50.0, solute="H2SO4", molar=1.0, cavity=BURETTE_COLUMN)
    colours = [("colour", {"in": "flask", "species": ion}) for ion in ("CrO4 2-", "Cr2O7 2-")]
    effects = effects_of_tap_degrees(
        DRIP, MIXING_IN_FLASK, ("reaction", {"equation": "2 CrO4^2- + 2 H+ -> Cr2O7^2- + H2O"}), *colours,
        burette=burette, flask=glass("flask", volume_ml=2.0, solute="K2CrO4", molar=0.1),
    )  # fmt: skip
    texts = sorted(event.text for event in effects["colour"].events)
    assert texts == [
        "the colour of Cr2O7^2- in flask appears", "the colour of CrO4^2- in flask disappears",
    ]  # fmt: skip
    rgba = effects["colour"].output.liquids["flask"].rgba
    assert rgba[0].tolist() != rgba[-1].tolist()
    assert rgba[-1].tolist() == list(COLOURS["orange"])


def test_colour_appears_when_its_ion_is_visible():
    """Not with the first drop: the copper ammine is 1e-33 mol/L then."""
    burette = glass("burette", volume_ml=50.0, solute="NH3", molar=1.0, cavity=BURETTE_COLUMN)
    deep = ("colour", {"in": "flask", "species": "Cu(NH3)4 2+"})
    reaction = ("reaction", {"equation": "Cu2+ + 4 NH3 -> Cu(NH3)4 2+"})
    flask = glass("flask", volume_ml=2.0, solute="CuSO4", molar=0.05)
    effects = effects_of_tap_degrees(DRIP, MIXING_IN_FLASK, reaction, deep, burette=burette, flask=flask)
    (appears,) = effects["colour"].events
    series = effects["colour"].series["flask/Cu(NH3)4^2+ colour"]
    before = series.values[series.times < appears.time]
    assert before.max() <= 0.02 and series.values[-1] == 1.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("burette", "flask", "equation", "solid"),
    [
        (("NH3", 1.0), ("CuSO4", 0.1), "Cu2+ + 4 NH3 -> Cu(NH3)4^2+", "Cu4(OH)6SO4"),
        (("NaOH", 1.0), ("FeCl3", 0.1), "HCl + NaOH -> NaCl + H2O", "Fe(OH)3"),
        (("Na2SO4", 0.5), ("BaCl2", 0.1), "CH3COOH -> CH3COO- + H+", "BaSO4"),
        (("K2CrO4", 0.1), ("AgNO3", 0.1), "2 CrO4^2- + 2 H+ -> Cr2O7^2- + H2O", "Ag2CrO4"),
    ],
)
def test_a_solid_that_no_table_names_is_announced(burette, flask, equation, solid):
    """Without a word it would stay dissolved, far beyond its solubility."""
    solutes = {flask[0]: flask[1], "HCl": 0.001, "CH3COOH": 0.001} if flask[0] != "AgNO3" else {flask[0]: flask[1]}
    effects = effects_of_tap_degrees(
        DRIP, MIXING_IN_FLASK, ("reaction", {"equation": equation}),
        burette=glass("burette", volume_ml=50.0, solute=burette[0], molar=burette[1], cavity=BURETTE_COLUMN),
        flask=glass("flask", volume_ml=2.0, solutes=solutes),
    )  # fmt: skip
    texts = [event.text for event in effects["reaction"].output.events_named("supersaturated")]
    assert len(texts) == 1 and texts[0].startswith(f"{solid} is beyond its solubility in flask")
    named = effects_of_tap_degrees(
        DRIP, MIXING_IN_FLASK, ("reaction", {"equation": equation}),
        ("precipitation", {"solid": solid, "colour": "white"}),
        burette=glass("burette", volume_ml=50.0, solute=burette[0], molar=burette[1], cavity=BURETTE_COLUMN),
        flask=glass("flask", volume_ml=2.0, solutes=solutes),
    )  # fmt: skip
    assert not named["reaction"].output.events_named("supersaturated")
    assert [event.name for event in named["precipitation"].events][:1] == ["precipitate"]


def test_nothing_is_announced_where_all_stays_dissolved():
    """Neither of water poured into water, nor of calcium chloride into a solution that it makes no solid with."""
    effects = effects_of_tilt_degrees([0.0, *([60.0] * 3), 0.0], None, ("mixing", {"in": ["b"]}))
    assert "reaction" not in effects
    salts = (
        glass("a", volume_ml=60.0, solute="CaCl2", molar=0.01),
        glass("b", volume_ml=10.0, solutes={"NaNO3": 0.1, "HCl": 0.1}),
    )
    indicator = ("colour", {"in": "b", "indicator": "litmus"})
    effects = effects_of_tilt_degrees([0.0, *([60.0] * 3), 0.0], salts, ("mixing", {"in": ["b"]}), indicator)
    assert not effects["reaction"].output.events_named("supersaturated")


@pytest.mark.parametrize(
    ("temperature", "ambient", "solutes", "words"),
    [
        (150.0, 20.0, {}, "'flask' has 150 degC at first; it is a liquid between 0.0 and 100 degC"),
        (-5.0, 20.0, {}, "'flask' has -5 degC at first"),
        (None, -15.0, {}, "'flask' has -15 degC at first"),
        (-5.0, 20.0, {"NaCl": 3.0}, ""),
        (99.0, 20.0, {}, ""),
    ],
)
def test_initial_temperature_must_be_between_freezing_and_boiling(temperature, ambient, solutes, words):
    """Salt of 3 mol/L freezes below -5 degC; without a temperature of its own the flask has that of the room."""
    properties = {} if temperature is None else {"temperature_c": temperature}
    heat = ("heat", {"of": "liquids", "ambient_c": ambient, "loss_w_per_k": 0.0})
    flask = glass("flask", volume_ml=50.0, properties=properties, solutes=solutes)
    faults = plan_faults(session_with_effects({"flask": poses_at_rest(count=2)}, (flask,), MIXING_IN_FLASK, heat).scene)
    assert len(faults) == (1 if words else 0) and all(words in fault for fault in faults)


@pytest.mark.parametrize("celsius", [0.0, 50.0, 90.0])
def test_vessel_temperature_without_a_heat_effect_is_refused(celsius):
    """Potassium nitrate would dissolve at 25 degC whatever the scene says; an effect heat gives it its temperature."""
    bodies = (nitre(celsius),)
    tables = (SceneEffect("mixing", {"in": ["flask"]}), SceneEffect(*NITRE))
    (fault,) = plan_faults(Scene(bodies=bodies, effects=tables))
    assert f"temperature_c = {celsius:g} and no effect follows it" in fault
    assert plan_faults(Scene(bodies=bodies, effects=(*tables, SceneEffect(*HEAT)))) == ()


@pytest.mark.slow
def test_strong_solution_crystallises_by_its_mass_of_water():
    """A litre with 7 mol of potassium nitrate weighs 1,415 g or so: 708 g of it are salt, and as much is water.

    The flask cools from 62 degC for four seconds, by a loss so large that it ends near its surroundings of 20 degC.
    """
    volume_ml, molar, water_g_per_ml = 50.0, 7.0, 0.708
    salt_g = volume_ml * 1e-3 * molar * 101.10
    flask = glass("flask", volume_ml, properties={"temperature_c": 62.0}, solute="KNO3", molar=molar)
    effects = standing(4.0, flask, NITRE, HEAT)
    celsius = effects["heat"].series["flask/temperature"].values[-1]
    assert 20.0 <= celsius <= 30.0
    grams_in_100_g_of_water = np.interp(celsius, [20.0, 30.0], [31.6, 45.8])
    dissolved_g = volume_ml * water_g_per_ml / 100.0 * grams_in_100_g_of_water
    crystals_g = effects["precipitation"].series["flask/KNO3"].values[-1]
    assert crystals_g == pytest.approx(salt_g - dissolved_g, rel=0.02)


@pytest.mark.slow
def test_excess_bicarbonate_uses_up_all_poured_acid():
    """Every mole of acid frees a mole of CO2, and the pH ends above 5."""
    powder = {"solid": {"formula": "NaHCO3", "mass_g": 50.0}}
    bodies = (glass("a", volume_ml=60.0, solute="HCl", molar=6.0), glass("b", volume_ml=0.0, properties=powder))
    equation = ("reaction", {"equation": "NaHCO3 + HCl -> NaCl + H2O + CO2"})
    effects = effects_of_tilt_degrees([0.0, *([120.0] * 3), 0.0, 0.0], bodies, ("mixing", {"in": ["b"]}), equation)
    series = effects["reaction"].series
    acid_mmol = 6.0 * effects["pour"].series["b/volume"].values[-1]
    assert series["b/pH"].values[-1] > 5.0
    assert 1e3 * series["b/CO2 gone"].values[-1] == pytest.approx(acid_mmol, rel=0.05)


def test_an_empty_vessel_with_a_temperature_needs_heat_capacity():
    """Without a liquid nothing says how much heat the hot flask brings."""
    tables = (SceneEffect("mixing", {"in": ["flask"]}), SceneEffect(*HEAT))
    (fault,) = plan_faults(
        Scene(bodies=(glass("flask", volume_ml=0.0, properties={"temperature_c": 80.0}),), effects=tables)
    )
    assert "'flask' is empty and has temperature_c = 80: give properties.heat_capacity_j_per_k" in fault
    warm = {"temperature_c": 80.0, "heat_capacity_j_per_k": 50.0}
    assert not plan_faults(Scene(bodies=(glass("flask", volume_ml=0.0, properties=warm),), effects=tables))


def test_a_fault_names_the_file_of_its_scene():
    """The kind ``pours`` does not exist."""
    text = '[[body]]\nid = "flask"\n\n[[effect]]\nkind = "pours"\n'
    (fault,) = plan_faults(parse_scene(text, "lesson-3.toml"))
    assert fault.startswith("lesson-3.toml: ")


def test_equal_amounts_that_hardly_react_are_no_end_point():
    """Permanganate needs protons; without acid its amount equals that of iron, and hardly any reacts."""
    iron = "MnO4- + 5 Fe2+ + 8 H+ -> Mn2+ + 5 Fe3+ + 4 H2O"
    events = {}
    for name, acid in (("weak", {"H2SO4": 1e-4}), ("acid", {"H2SO4": 0.5})):
        effects = effects_of_tap_degrees(
            DRIP, MIXING_IN_FLASK, ("reaction", {"equation": iron}),
            burette=glass("burette", volume_ml=50.0, solute="KMnO4", molar=0.02, cavity=BURETTE_COLUMN),
            flask=glass("flask", volume_ml=2.0, solutes={"FeSO4": 0.01, **acid}),
        )  # fmt: skip
        output = effects["reaction"].output
        events[name] = output.events_named("end-point"), output.events_named("incomplete")
    assert len(events["acid"][0]) == 1 and not events["acid"][1]
    assert not events["weak"][0] and "have reacted: no end point" in events["weak"][1][0].text


def test_no_acid_is_named_where_protons_are_lacking():
    """Neither iron(II) in the flask nor permanganate brings acid, and the equation takes 8 protons."""
    effects = effects_of_tap_degrees(
        DRIP, MIXING_IN_FLASK, ("reaction", {"equation": "MnO4- + 5 Fe2+ + 8 H+ -> Mn2+ + 5 Fe3+ + 4 H2O"}),
        burette=glass("burette", volume_ml=50.0, solute="KMnO4", molar=0.02, cavity=BURETTE_COLUMN),
        flask=glass("flask", volume_ml=2.0, solutes={"FeSO4": 0.01}),
    )  # fmt: skip
    (event,) = effects["reaction"].output.events_named("no-reaction")
    assert "does not proceed: it needs acid, and none came into flask" in event.text


@pytest.mark.parametrize(
    ("solutes", "equation", "proceeds"),
    [
        ({"Fe(NO3)3": 0.001, "NaF": 0.1, "HNO3": 0.01}, "Fe3+ + F- -> FeF2+", True),
        ({"ZnCl2": 0.01, "NH3": 0.1, "HCl": 1.0}, "Zn2+ + 4 NH3 -> Zn(NH3)4^2+", False),
    ],
)
def test_complexes_of_more_ligands_count_as_formed(solutes, equation, proceeds):
    """In much fluoride iron stands as FeF3, beyond the FeF2+ of the equation: it has proceeded.

    In 1 mol/L of acid ammonia is ammonium, and zinc gets none.
    """
    effects = standing(0.5, glass("flask", volume_ml=2.0, solutes=solutes), ("reaction", {"equation": equation}))
    assert bool(effects["reaction"].output.events_named("no-reaction")) != proceeds


def test_iodine_clock_turns_blue_when_thiosulfate_is_used_up():
    """Persulfate oxidises iodide at 0.05 a second; thiosulfate binds the iodine while it lasts, two for one.

    A clock reaction is no titration, so it has no end point.
    """
    bodies = (
        glass("a", volume_ml=20.0, solute="K2S2O8", molar=0.1),
        glass("b", volume_ml=40.0, solutes={"KI": 0.2, "Na2S2O3": 0.005}),
    )
    tables = (
        ("mixing", {"in": ["b"]}),
        ("reaction", {"equation": "S2O8^2- + 2 I- -> 2 SO4^2- + I2", "rate_per_s": 0.05}),
        ("reaction", {"equation": "I2 + 2 S2O3^2- -> 2 I- + S4O6^2-"}),
        ("colour", {"in": "b", "indicator": "starch"}),
    )
    effects = effects_of_tilt_degrees([0.0, *([120.0] * 40), *([0.0] * 200)], bodies, *tables)
    (flow,) = effects["pour"].events
    persulfate_mmol, thiosulfate_mmol = 0.1 * flow.values["volume_ml"], 0.005 * 40.0
    seconds = -np.log(1.0 - 0.5 * thiosulfate_mmol / persulfate_mmol) / 0.05
    (blue,) = effects["colour"].events
    assert flow.time + seconds < blue.time < flow.end + seconds
    assert not effects["reaction"].output.events_named("end-point")
