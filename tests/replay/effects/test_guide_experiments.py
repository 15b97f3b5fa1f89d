"""Three experiments as a teacher writes them from the guide alone: Mohr's salt, nitre by temperature, copper ammine."""

import numpy as np
import pytest
from support.liquid_worlds import (
    BURETTE_COLUMN,
    MIXING_IN_FLASK,
    effects_of_tap_degrees,
    effects_of_tilt_degrees,
    glass,
)

from replay.effects.chemistry.salts import SOLUBILITY_G_PER_100_G
from replay.errors import PlanError

OPEN = [*([0.0] * 2), *([90.0] * 50), *([0.0] * 3)]
"""Degrees of the stopcock, one a frame of `STEP_NS`: it is open for 2 s, in which some 2.5 mL run in."""

STEP_NS = 40_000_000

MOHRS_SALT = {"formula": "(NH4)2Fe(SO4)2.6H2O", "mass_g": 0.0392}
"""0.1 mmol, for which 1 mL of 0.02 mol/L permanganate is equivalent."""


@pytest.mark.sampled(3)
@pytest.mark.parametrize(
    ("equation", "names", "weighed"),
    [
        ("MnO4- + 5 Fe2+ + 8 H+ -> Mn2+ + 5 Fe3+ + 4 H2O", "Fe^2+ and MnO4-", True),
        ("2 KMnO4 + 10 FeSO4 + 8 H2SO4 -> 2 MnSO4 + K2SO4 + 5 Fe2(SO4)3 + 8 H2O", "FeSO4 and KMnO4", False),
        (
            "2 KMnO4 + 10 (NH4)2Fe(SO4)2 + 8 H2SO4 -> 2 MnSO4 + K2SO4 + 5 Fe2(SO4)3 + 10 (NH4)2SO4 + 8 H2O",
            "(NH4)2Fe(SO4)2 and KMnO4",
            True,
        ),
    ],
    ids=["ions", "another salt of iron", "the salt itself"],
)
def test_permanganate_is_standardised_with_mohrs_salt(equation, names, weighed):
    """39.2 mg of Mohr's salt, 392.14 g/mol, are 0.1 mmol: ``weighed`` into 10 mL of acid, or dissolved in it before.

    Permanganate of 0.02 mol/L runs in; iron(II) takes a fifth of 0.1 mmol, which is in 1 mL. It is pink once iron is
    used up. The equation may be of ions or of any salt of iron(II); the event names both as the equation does.
    """
    dissolved_molar = 0.0392 / 392.14 / 10e-3
    solutes = {"H2SO4": 1.0} if weighed else {"H2SO4": 1.0, "(NH4)2Fe(SO4)2": dissolved_molar}
    properties = {"solid": MOHRS_SALT} if weighed else {}
    flask = glass("flask", volume_ml=10.0, properties=properties, solutes=solutes)
    burette = glass("burette", volume_ml=50.0, solute="KMnO4", molar=0.02, cavity=BURETTE_COLUMN)
    pink = ("colour", {"in": "flask", "species": "MnO4-"})
    effects = effects_of_tap_degrees(
        OPEN,
        MIXING_IN_FLASK,
        ("reaction", {"equation": equation}),
        pink,
        burette=burette,
        flask=flask,
        step_ns=STEP_NS,
    )
    (event,) = effects["reaction"].output.events_named("end-point")
    assert event.text.startswith(f"{names} are equivalent in flask after 1.00 mL")
    (appears,) = effects["colour"].output.events_named("colour-change")
    assert appears.time >= event.time and "appears" in appears.text


@pytest.mark.slow
@pytest.mark.parametrize(
    ("celsius", "equations"),
    [(20.0, []), (60.0, [("reaction", {"equation": "KNO3(s) -> K+ + NO3-"})])],
    ids=["20 degC without an equation", "60 degC with an equation"],
)
def test_nitre_dissolves_up_to_its_solubility_by_temperature(celsius, equations):
    """Water is poured on 60 g of potassium nitrate, more than dissolves in it.

    So large a loss of heat (10 kW/K) keeps all at ``celsius``, for which the table says the g in 100 g of water.
    """
    salt = {"formula": "KNO3", "mass_g": 60.0}
    bodies = (
        glass("a", volume_ml=60.0, properties={"temperature_c": celsius}),
        glass("b", volume_ml=0.0, properties={"solid": salt, "temperature_c": celsius}),
    )
    precipitation = ("precipitation", {"solid": "KNO3", "colour": "white"})
    heat = {"of": "liquids", "ambient_c": celsius, "loss_w_per_k": 1e4, "heat_capacity_j_per_ml_k": 4.18}
    three_frames_tilted = [0.0, *([60.0] * 3), *([0.0] * 40)]
    effects = effects_of_tilt_degrees(
        three_frames_tilted, bodies, ("mixing", {"in": ["b"]}), *equations, precipitation, ("heat", heat)
    )
    (event,) = effects["precipitation"].events
    water_g = effects["mixing"].series["b/volume"].values[-1]  # 1 g/mL
    table = SOLUBILITY_G_PER_100_G["KNO3"]
    expected_g = np.interp(celsius, list(table), list(table.values())) * water_g / 100.0
    assert event.name == "dissolved" and event.values["mass_g"] == pytest.approx(expected_g, rel=0.02)


def test_copper_is_titrated_to_its_ammine():
    """Some 2.5 mL of ammonia, 6 mol/L, run into 2 mL of copper sulfate, 0.02 mol/L, by two equations of one effect.

    Copper hydroxide falls out first and dissolves again. 15 mmol of ammonia are nearly 400 times the 0.04 mmol of
    copper: at the end all of it, within 5 %, is the deep blue ammine.
    """
    copper_molar, copper_ml = 0.02, 2.0
    burette = glass("burette", volume_ml=50.0, solute="NH3", molar=6.0, cavity=BURETTE_COLUMN)
    flask = glass("flask", volume_ml=copper_ml, solute="CuSO4", molar=copper_molar)
    effects = effects_of_tap_degrees(
        OPEN,
        MIXING_IN_FLASK,
        ("reaction", {"equation": "CuSO4 + 4 NH3 -> Cu(NH3)4SO4"}),
        ("reaction", {"equation": "Cu2+ + 2 NH3 + 2 H2O -> Cu(OH)2 + 2 NH4+"}),
        ("precipitation", {"solid": "Cu(OH)2", "colour": "blue"}),
        ("colour", {"in": "flask", "species": "Cu(NH3)4^2+"}),
        burette=burette,
        flask=flask,
        step_ns=STEP_NS,
    )
    falls, dissolves = effects["precipitation"].events
    # Of 4e-5 mol; how much falls out before the first of it dissolves again is not computed here: a loose bound.
    a_quarter_of_the_copper_mol = 1e-5
    assert falls.name == "precipitate" and falls.values["moles"] > a_quarter_of_the_copper_mol
    assert dissolves.name == "dissolved" and "dissolve again in flask" in dissolves.text
    assert dissolves.values["left_g"] == 0.0 and dissolves.time > falls.time
    assert effects["precipitation"].series["flask/Cu(OH)2"].values[-1] == 0.0
    volume_ml = effects["mixing"].series["flask/volume"].values[-1]
    ammine_molar = effects["reaction"].series["flask/Cu(NH3)4^2+"].values[-1]
    assert ammine_molar * volume_ml == pytest.approx(copper_molar * copper_ml, rel=0.05)
    first_change, *_ = effects["colour"].output.events_named("colour-change")
    assert first_change.text == "the colour of Cu(NH3)4^2+ in flask appears"


COLOUR_OF_AMMINE = ("colour", {"in": "flask", "species": "Cu(NH3)4^2+"})


def effects_of_ammonia_into(salt, *tables):
    """Effects of some 2.5 mL of ammonia, 1 mol/L, that run into 1 mL of a copper salt, 0.1 mol/L."""
    burette = glass("burette", volume_ml=50.0, solute="NH3", molar=1.0, cavity=BURETTE_COLUMN)
    flask = glass("flask", volume_ml=1.0, solute=salt, molar=0.1)
    return effects_of_tap_degrees(
        OPEN, MIXING_IN_FLASK, *tables, COLOUR_OF_AMMINE, burette=burette, flask=flask, step_ns=STEP_NS
    )


@pytest.mark.slow
def test_basic_copper_sulfate_dissolves_in_more_ammonia():
    """2.5 mmol of ammonia run into 0.1 mmol of copper sulfate: a basic sulfate falls out, and dissolves again wholly.

    No event "aged" says that another solid falls out than the scene names.
    """
    effects = effects_of_ammonia_into(
        "CuSO4",
        ("reaction", {"equation": "4 CuSO4 + 6 NH3 + 6 H2O -> Cu4(OH)6SO4 + 3 (NH4)2SO4"}),
        ("reaction", {"equation": "Cu4(OH)6SO4 + 16 NH3 -> 4 Cu(NH3)4^2+ + SO4^2- + 6 OH-"}),
        ("precipitation", {"solid": "Cu4(OH)6SO4", "colour": "blue"}),
    )
    assert [event.name for event in effects["precipitation"].events] == ["precipitate", "dissolved"]
    assert effects["precipitation"].series["flask/Cu4(OH)6SO4"].values[-1] == 0.0
    assert not effects["reaction"].output.events_named("aged")


BASIC_SALTS = [("CuSO4", "Cu4(OH)6SO4"), ("Cu(NO3)2", "Cu2(OH)3NO3"), ("CuCl2", "Cu2(OH)3Cl")]


@pytest.mark.sampled(3)
@pytest.mark.parametrize(("salt", "basic"), BASIC_SALTS)
def test_copper_hydroxide_with_ammonia_is_reported_as_aged(salt, basic):
    """Ammonia runs into a copper salt; the scene names Cu(OH)2 as the solid that falls out, alone or with ``basic``.

    What falls out at first is ``basic``, a basic salt of the copper salt's anion: an event says so, and advises to name
    it alone. That is right: nothing stays beyond its solubility then, and all of it dissolves in more ammonia.
    """
    ammine = ("reaction", {"equation": "Cu2+ + 4 NH3 -> [Cu(NH3)4]2+"})
    hydroxide, basic_salt = (("precipitation", {"solid": solid}) for solid in ("Cu(OH)2", basic))
    (aged,) = effects_of_ammonia_into(salt, ammine, hydroxide)["reaction"].output.events_named("aged")
    assert f"at first is {basic}" in aged.text and aged.level == "warning"
    (aged,) = effects_of_ammonia_into(salt, ammine, hydroxide, basic_salt)["reaction"].output.events_named("aged")
    assert aged.text.endswith(f"name {basic} alone and not Cu(OH)2")
    as_advised = effects_of_ammonia_into(salt, ammine, basic_salt)
    assert as_advised["precipitation"].series[f"flask/{basic}"].values[-1] == 0.0
    assert not as_advised["reaction"].output.events_named("supersaturated")


def test_unknown_basic_salt_is_refused_with_the_known_named():
    """An equation makes Cu2(OH)2SO4, which is in no table; the error names Cu4(OH)6SO4, which is made of the same ions.

    The scene is refused before ammonia runs into copper sulfate.
    """
    basic = ("reaction", {"equation": "2 CuSO4 + 2 NH3 + 2 H2O -> Cu2(OH)2SO4 + (NH4)2SO4"})
    with pytest.raises(PlanError, match=r"'Cu2\(OH\)2SO4' dissolves; of its ions they have .*Cu4\(OH\)6SO4"):
        effects_of_ammonia_into("CuSO4", basic)
