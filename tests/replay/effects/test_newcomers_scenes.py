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

HEAT_WITH_LOSS = ("heat", {"of": "liquids", "ambient_c": 20.0, "loss_w_per_k": 200.0})
HEAT_WITHOUT_LOSS = ("heat", {"of": "liquids", "ambient_c": 20.0, "loss_w_per_k": 0.0})
NITRE_PRECIPITATES = ("precipitation", {"solid": "KNO3", "colour": "white"})


def effects_of_standing(seconds, flask, *more):
    """Effects of a run in which a flask stands for so long, 0.1 s a frame."""
    count = int(seconds * 10) + 1
    return compute(
        session_with_effects({"flask": poses_at_rest(count)}, (flask,), MIXING_IN_FLASK, *more, step_ns=100_000_000)
    ).effects


def faults_of_flask(flask, *tables):
    """Faults of a scene of this flask with these effects."""
    return plan_faults(session_with_effects({"flask": poses_at_rest(count=2)}, (flask,), *tables).scene)


def flask_of_nitre(celsius):
    """A flask with 50 mL of water on 40 g of potassium nitrate."""
    solid = {"formula": "KNO3", "mass_g": 40.0}
    return glass("flask", volume_ml=50.0, properties={"solid": solid, "temperature_c": celsius})


@pytest.mark.slow
def test_a_salt_crystallises_where_its_solution_merely_cools():
    """40 g of potassium nitrate, dissolved in 50 mL of water, cool for 4 s from 70 degC to below 30, without a pour."""
    effects = effects_of_standing(4.0, flask_of_nitre(celsius=70.0), NITRE_PRECIPITATES, HEAT_WITH_LOSS)
    (event,) = effects["precipitation"].events
    celsius = effects["heat"].series["flask/temperature"].values[-1]
    # 50 mL of hot water weigh as much less as it is lighter: 0.978 g/mL at 70 degC. Source: CRC Handbook.
    water_g = 50.0 * 0.978
    # In 100 g of water dissolve 31.6 g at 20 degC, 45.8 at 30, 63.9 at 40, 85.5 at 50. Source: Seidell.
    dissolved_g = np.interp(celsius, [20.0, 30.0], [31.6, 45.8]) / 100.0 * water_g
    assert event.name == "precipitate"
    # 40 g in 48.9 g of water, 81.8 g in 100 g, are saturated at 48.3 degC.
    assert event.values["celsius"] == pytest.approx(48.3, abs=1.0)
    assert f"falls out in flask at {event.values['celsius']:.1f} degC" in event.text
    assert effects["precipitation"].series["flask/KNO3"].values[-1] == pytest.approx(40.0 - dissolved_g, rel=0.02)


@pytest.mark.parametrize("celsius", [10.0, 20.0, 40.0])
def test_solid_in_water_dissolves_at_the_stated_temperature(celsius):
    """50 mL of water stand on 40 g of potassium nitrate; of 100 g of water 20.9, 31.6 or 63.9 g are soluble (Seidell).

    It dissolved before the recording, so its heat is not computed: an event "dissolved-before" of heat says so.
    """
    effects = effects_of_standing(0.5, flask_of_nitre(celsius), NITRE_PRECIPITATES, HEAT_WITHOUT_LOSS)
    expected_g = {10.0: 20.9, 20.0: 31.6, 40.0: 63.9}[celsius] / 2.0
    (dissolved,) = effects["precipitation"].events
    assert dissolved.name == "dissolved" and dissolved.values["mass_g"] == pytest.approx(expected_g, rel=0.01)
    (before,) = effects["heat"].output.events_named("dissolved-before")
    assert before.values["formula"] == "KNO3"
    assert before.values["mass_g"] == pytest.approx(expected_g, rel=0.01)


def test_heat_of_a_solid_is_released_by_equations_with_rates():
    """4 g of anhydrous copper sulfate dissolve in 50 mL of water in 5 s, but for exp(-5), by a rate of 1 a second.

    Their heat warms the water, without loss; no event says that they dissolved before the recording.
    """
    flask = glass("flask", volume_ml=50.0, properties={"solid": {"formula": "CuSO4", "mass_g": 4.0}})
    slowly = ("reaction", {"equation": "CuSO4(s) -> Cu2+ + SO4^2-", "rate_per_s": 1.0})
    effects = effects_of_standing(5.0, flask, HEAT_WITHOUT_LOSS, slowly)
    assert not effects["heat"].output.events_named("dissolved-before")
    (warmest,) = effects["heat"].output.events_named("warmest")
    moles, joule_per_mol = 4.0 / 159.6, 66.1e3  # Source: Nuffield Advanced Chemistry.
    kelvin = moles * joule_per_mol / (50.0 * 4.18)  # 7.9
    assert warmest.values["change_k"] == pytest.approx(kelvin, rel=0.03)


def test_every_fresh_precipitate_has_a_default_colour():
    """Each formula that stands for a fresh solid has a colour in the table of solids, which can be drawn."""
    assert len(FRESH_FORMULAS) > 0
    assert [solid for solid in FRESH_FORMULAS if SOLID_COLOURS.get(solid) not in COLOURS] == []


def test_colours_may_have_shades_and_be_halves_of_two():
    """A scene gives a precipitate a colour: a shade before a colour, or two colours with a dash, are no fault."""
    for colour in ["deep blue", "light blue", "pale yellow", "blue-green", "dark red-brown", "grey"]:
        precipitation = ("precipitation", {"solid": "KNO3", "colour": colour})
        faults = faults_of_flask(flask_of_nitre(celsius=20.0), MIXING_IN_FLASK, HEAT_WITH_LOSS, precipitation)
        assert faults == (), colour


def test_an_unknown_colour_is_a_fault():
    """A scene gives a precipitate the colour "gruen"."""
    precipitation = ("precipitation", {"solid": "KNO3", "colour": "gruen"})
    faults = faults_of_flask(flask_of_nitre(celsius=20.0), MIXING_IN_FLASK, HEAT_WITH_LOSS, precipitation)
    assert len(faults) == 1 and "gruen" in faults[0]


def test_shades_are_ordered_from_pale_to_dark():
    """Brightness is the sum of red, green and blue."""
    brightness = [sum(COLOURS[f"{shade} blue"][:3]) for shade in ("pale", "light", "bright", "deep")]
    assert brightness == sorted(brightness, reverse=True)


def test_plain_water_needs_no_concentration():
    """A flask of 50 mL names no solute, or water as the solute: no fault, though the scene has no mol/L."""
    for liquid in [{}, {"solute": "H2O"}, {"solute": "water"}]:
        assert faults_of_flask(glass("flask", volume_ml=50.0, **liquid), MIXING_IN_FLASK) == (), liquid


def test_a_solute_without_its_concentration_is_named():
    """A scene's 50 mL of liquid name HCl as the solute and no mol/L."""
    (fault,) = faults_of_flask(glass("flask", volume_ml=50.0, solute="HCl"), MIXING_IN_FLASK)
    assert "body 'flask' has no liquid.molar; give a finite number" in fault


def test_two_ions_colour_a_liquid_and_each_change_is_reported():
    """0.8 mmol of sulfuric acid run into 0.2 mmol of chromate, which becomes dichromate: yellow gives way to orange.

    Each ion has an effect colour; the liquid drawn in the glass ends orange.
    """
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
    """0.8 mL of ammonia run into copper sulfate: the deep blue ammine appears, but not with the first drop.

    The series is the strength of its colour, 0 to 1; the first drop of ammonia makes 1e-33 mol/L of the ammine.
    """
    burette = glass("burette", volume_ml=50.0, solute="NH3", molar=1.0, cavity=BURETTE_COLUMN)
    deep = ("colour", {"in": "flask", "species": "Cu(NH3)4 2+"})
    reaction = ("reaction", {"equation": "Cu2+ + 4 NH3 -> Cu(NH3)4 2+"})
    flask = glass("flask", volume_ml=2.0, solute="CuSO4", molar=0.05)
    effects = effects_of_tap_degrees(DRIP, MIXING_IN_FLASK, reaction, deep, burette=burette, flask=flask)
    (appears,) = effects["colour"].events
    series = effects["colour"].series["flask/Cu(NH3)4^2+ colour"]
    strength_before = series.values[series.times < appears.time]
    visible_from = 0.02  # of its full colour: permanganate, full at 1e-4 mol/L, is pink from 2e-6 mol/L on (Vogel)
    assert strength_before.max() <= visible_from and series.values[-1] == 1.0


TRACES_OF_ACIDS = {"HCl": 0.001, "CH3COOH": 0.001}
"""What equations that make no solid need."""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("burette", "flask", "equation", "solid"),
    [
        ({"NH3": 1.0}, {"CuSO4": 0.1, **TRACES_OF_ACIDS}, "Cu2+ + 4 NH3 -> Cu(NH3)4^2+", "Cu4(OH)6SO4"),
        ({"NaOH": 1.0}, {"FeCl3": 0.1, **TRACES_OF_ACIDS}, "HCl + NaOH -> NaCl + H2O", "Fe(OH)3"),
        ({"Na2SO4": 0.5}, {"BaCl2": 0.1, **TRACES_OF_ACIDS}, "CH3COOH -> CH3COO- + H+", "BaSO4"),
        ({"K2CrO4": 0.1}, {"AgNO3": 0.1}, "2 CrO4^2- + 2 H+ -> Cr2O7^2- + H2O", "Ag2CrO4"),
    ],
)
def test_a_solid_that_no_table_names_is_announced(burette, flask, equation, solid):
    """0.8 mL run into 2 mL (both in mol/L); the scene has an equation, which is not of the solid that the two make.

    Without an effect precipitation the solid stays dissolved far beyond its solubility, and an event says so; with it,
    the solid falls out.
    """
    reaction = ("reaction", {"equation": equation})
    precipitation = ("precipitation", {"solid": solid, "colour": "white"})
    without_precipitation, with_precipitation = (
        effects_of_tap_degrees(
            DRIP, MIXING_IN_FLASK, reaction, *more,
            burette=glass("burette", volume_ml=50.0, solutes=burette, cavity=BURETTE_COLUMN),
            flask=glass("flask", volume_ml=2.0, solutes=flask),
        )
        for more in ((), (precipitation,))
    )  # fmt: skip
    (event,) = without_precipitation["reaction"].output.events_named("supersaturated")
    assert event.text.startswith(f"{solid} is beyond its solubility in flask")
    assert not with_precipitation["reaction"].output.events_named("supersaturated")
    first, *_ = with_precipitation["precipitation"].events
    assert first.name == "precipitate"


THREE_FRAMES_TILTED = [0.0, *([60.0] * 3), 0.0]
"""Degrees of glass a over glass b, one a frame of 10 ms."""


def test_water_poured_into_water_has_no_reaction():
    """60 mL of water are poured into 10 mL, and the effect mixing follows what is in the glass."""
    assert "reaction" not in effects_of_tilt_degrees(THREE_FRAMES_TILTED, None, ("mixing", {"in": ["b"]}))


def test_nothing_is_announced_where_all_stays_dissolved():
    """Calcium chloride is poured into nitrate and acid, with which it makes no solid; litmus shows the acid."""
    salts = (
        glass("a", volume_ml=60.0, solute="CaCl2", molar=0.01),
        glass("b", volume_ml=10.0, solutes={"NaNO3": 0.1, "HCl": 0.1}),
    )
    indicator = ("colour", {"in": "b", "indicator": "litmus"})
    effects = effects_of_tilt_degrees(THREE_FRAMES_TILTED, salts, ("mixing", {"in": ["b"]}), indicator)
    assert not effects["reaction"].output.events_named("supersaturated")


def test_initial_temperature_must_be_between_freezing_and_boiling():
    """A flask of 50 mL has the ``temperature_c`` of its ``properties`` or else that of the room, ``room_c``.

    ``texts``: in the scene's faults, where it is not between freezing and boiling. Water with 3 mol/L of NaCl freezes
    below -5 degC.
    """
    for case, (properties, room_c, solutes, texts) in {
        "steam": (
            {"temperature_c": 150.0},
            20.0,
            {},
            ["'flask' has 150 degC at first; it is a liquid between 0.0 and 100"],
        ),
        "ice": ({"temperature_c": -5.0}, 20.0, {}, ["'flask' has -5 degC at first"]),
        "as cold as the room": ({}, -15.0, {}, ["'flask' has -15 degC at first"]),
        "brine": ({"temperature_c": -5.0}, 20.0, {"NaCl": 3.0}, []),
        "hot water": ({"temperature_c": 99.0}, 20.0, {}, []),
    }.items():
        heat = ("heat", {"of": "liquids", "ambient_c": room_c, "loss_w_per_k": 0.0})
        flask = glass("flask", volume_ml=50.0, properties=properties, solutes=solutes)
        faults = faults_of_flask(flask, MIXING_IN_FLASK, heat)
        assert len(faults) == len(texts), case
        assert all(text in fault for text, fault in zip(texts, faults, strict=True)), case


def test_vessel_temperature_without_a_heat_effect_is_refused():
    """A flask with water and potassium nitrate has a temperature, which nothing uses without an effect heat: a fault.

    The salt would dissolve as at 25 degC; with such an effect the scene has no fault.
    """
    for celsius in [0.0, 50.0, 90.0]:
        bodies = (flask_of_nitre(celsius),)
        tables = (SceneEffect(*MIXING_IN_FLASK), SceneEffect(*NITRE_PRECIPITATES))
        (fault,) = plan_faults(Scene(bodies=bodies, effects=tables))
        assert f"temperature_c = {celsius:g} and no effect follows it" in fault, celsius
        assert plan_faults(Scene(bodies=bodies, effects=(*tables, SceneEffect(*HEAT_WITH_LOSS)))) == (), celsius


@pytest.mark.slow
def test_strong_solution_crystallises_by_its_mass_of_water():
    """50 mL with 7 mol/L of potassium nitrate cool from 62 degC to near 20 for four seconds, and salt falls out.

    A litre weighs 1,415 g or so: 7 mol x 101.10 g/mol = 708 g of it are salt, and about as much is water, in which
    31.6 g in 100 g stay dissolved at 20 degC, 45.8 g at 30 degC (Seidell).
    """
    volume_ml, molar, water_g_per_ml = 50.0, 7.0, 0.708
    salt_g = volume_ml * 1e-3 * molar * 101.10
    flask = glass("flask", volume_ml, properties={"temperature_c": 62.0}, solute="KNO3", molar=molar)
    effects = effects_of_standing(4.0, flask, NITRE_PRECIPITATES, HEAT_WITH_LOSS)
    celsius = effects["heat"].series["flask/temperature"].values[-1]
    assert 20.0 <= celsius <= 30.0
    grams_in_100_g_of_water = np.interp(celsius, [20.0, 30.0], [31.6, 45.8])
    dissolved_g = volume_ml * water_g_per_ml / 100.0 * grams_in_100_g_of_water
    crystals_g = effects["precipitation"].series["flask/KNO3"].values[-1]
    assert crystals_g == pytest.approx(salt_g - dissolved_g, rel=0.02)


@pytest.mark.slow
def test_excess_bicarbonate_uses_up_all_poured_acid():
    """Up to 60 mL of acid of 6 mol/L, 0.36 mol, are poured on 50 g of powder, 0.6 mol.

    Every mole of acid poured frees a mole of CO2; no acid is left: the pH ends above 5.
    """
    powder, acid_molar = {"solid": {"formula": "NaHCO3", "mass_g": 50.0}}, 6.0
    bodies = (glass("a", volume_ml=60.0, solute="HCl", molar=acid_molar), glass("b", volume_ml=0.0, properties=powder))
    equation = ("reaction", {"equation": "NaHCO3 + HCl -> NaCl + H2O + CO2"})
    effects = effects_of_tilt_degrees([0.0, *([120.0] * 3), 0.0, 0.0], bodies, ("mixing", {"in": ["b"]}), equation)
    series = effects["reaction"].series
    acid_mmol = acid_molar * effects["pour"].series["b/volume"].values[-1]
    assert series["b/pH"].values[-1] > 5.0
    assert 1e3 * series["b/CO2 gone"].values[-1] == pytest.approx(acid_mmol, rel=0.05)


def test_an_empty_vessel_with_a_temperature_needs_heat_capacity():
    """A flask of 80 degC without a liquid is a fault: nothing says how much heat it brings to what is poured into it.

    With a heat capacity of its own it is none.
    """
    hot = {"temperature_c": 80.0}
    (fault,) = faults_of_flask(glass("flask", volume_ml=0.0, properties=hot), MIXING_IN_FLASK, HEAT_WITH_LOSS)
    assert "'flask' is empty and has temperature_c = 80: give properties.heat_capacity_j_per_k" in fault
    hot |= {"heat_capacity_j_per_k": 50.0}
    assert not faults_of_flask(glass("flask", volume_ml=0.0, properties=hot), MIXING_IN_FLASK, HEAT_WITH_LOSS)


def test_a_fault_names_the_file_of_its_scene():
    """lesson-3.toml declares an effect of a kind that does not exist."""
    text = '[[body]]\nid = "flask"\n\n[[effect]]\nkind = "pours"\n'
    (fault,) = plan_faults(parse_scene(text, "lesson-3.toml"))
    assert fault.startswith("lesson-3.toml: ")


def reaction_of_iron_with_permanganate(**acid):
    """The effect reaction while 0.8 mL of permanganate, 0.02 mol/L, run into 2 mL of iron(II) of 0.01 mol/L and acid.

    0.2 mL are equivalent: 20 micromole of iron are five times 4 micromole of permanganate.
    """
    return effects_of_tap_degrees(
        DRIP, MIXING_IN_FLASK, ("reaction", {"equation": "MnO4- + 5 Fe2+ + 8 H+ -> Mn2+ + 5 Fe3+ + 4 H2O"}),
        burette=glass("burette", volume_ml=50.0, solute="KMnO4", molar=0.02, cavity=BURETTE_COLUMN),
        flask=glass("flask", volume_ml=2.0, solutes={"FeSO4": 0.01, **acid}),
    )["reaction"].output  # fmt: skip


def test_equal_amounts_that_hardly_react_are_no_end_point():
    """MnO4- + 5 Fe2+ + 8 H+: with nearly no acid the amounts become equivalent, and hardly any has reacted.

    An event "incomplete" says so; with enough acid there is an end point and no such event.
    """
    nearly_no_acid = reaction_of_iron_with_permanganate(H2SO4=1e-4)
    assert not nearly_no_acid.events_named("end-point")
    assert "have reacted: no end point" in nearly_no_acid.events_named("incomplete")[0].text
    enough_acid = reaction_of_iron_with_permanganate(H2SO4=0.5)
    assert len(enough_acid.events_named("end-point")) == 1 and not enough_acid.events_named("incomplete")


def test_no_acid_is_named_where_protons_are_lacking():
    """Permanganate runs into iron(II); neither brings acid, and the equation takes 8 H+."""
    (event,) = reaction_of_iron_with_permanganate().events_named("no-reaction")
    assert "does not proceed: it needs acid, and none came into flask" in event.text


@pytest.mark.parametrize(
    ("solutes", "equation", "proceeds"),
    [
        ({"Fe(NO3)3": 0.001, "NaF": 0.1, "HNO3": 0.01}, "Fe3+ + F- -> FeF2+", True),
        ({"ZnCl2": 0.01, "NH3": 0.1, "HCl": 1.0}, "Zn2+ + 4 NH3 -> Zn(NH3)4^2+", False),
    ],
    ids=["iron in fluoride", "zinc in acid"],
)
def test_complexes_of_more_ligands_count_as_formed(solutes, equation, proceeds):
    """In much fluoride iron stands as FeF3, with more ligands than the FeF2+ of the equation: it has proceeded.

    In 1 mol/L of acid ammonia is ammonium, and zinc gets none: an event says that it did not. ``solutes``: mol/L.
    """
    flask = glass("flask", volume_ml=2.0, solutes=solutes)
    effects = effects_of_standing(0.5, flask, ("reaction", {"equation": equation}))
    assert len(effects["reaction"].output.events_named("no-reaction")) == (0 if proceeds else 1)


def test_iodine_clock_turns_blue_when_thiosulfate_is_used_up():
    """Persulfate, poured within 0.4 s, oxidises iodide at 0.05 a second; thiosulfate binds the iodine, two for one.

    Starch turns blue when the iodine made, persulfate x (1 - exp(-0.05 t)), is half the thiosulfate. A clock reaction
    is no titration, so it has no end point.
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
    rate_per_s = 0.05
    seconds = -np.log(1.0 - 0.5 * thiosulfate_mmol / persulfate_mmol) / rate_per_s
    (blue,) = effects["colour"].events
    # Persulfate that comes first has been there for the whole pour longer than what comes last.
    assert flow.time + seconds < blue.time < flow.end + seconds
    assert not effects["reaction"].output.events_named("end-point")
