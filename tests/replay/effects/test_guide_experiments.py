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

OPEN = [*([0.0] * 2), *([90.0] * 200), *([0.0] * 10)]
"""Degrees of the stopcock: some 2 mL run in."""

MOHR = {"formula": "(NH4)2Fe(SO4)2.6H2O", "mass_g": 0.0392}
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
)
def test_permanganate_is_standardised_with_mohrs_salt(equation, names, weighed):
    """39.2 mg of the salt, 392.14 g/mol, are 0.1 mmol: weighed, or dissolved before in 10 mL.

    The equation is of ions or of any of its salts; a fifth of 0.1 mmol is in 1 mL of permanganate of 0.02 mol/L.
    """
    solutes = {"H2SO4": 1.0} if weighed else {"H2SO4": 1.0, "(NH4)2Fe(SO4)2": 0.0392 / 392.14 / 10e-3}
    properties = {"solid": MOHR} if weighed else {}
    flask = glass("flask", volume_ml=10.0, properties=properties, solutes=solutes)
    burette = glass("burette", volume_ml=50.0, solute="KMnO4", molar=0.02, cavity=BURETTE_COLUMN)
    pink = ("colour", {"in": "flask", "species": "MnO4-"})
    effects = effects_of_tap_degrees(
        OPEN, MIXING_IN_FLASK, ("reaction", {"equation": equation}), pink, burette=burette, flask=flask
    )
    (event,) = effects["reaction"].output.events_named("end-point")
    assert event.text.startswith(f"{names} are equivalent in flask after 1.00 mL")
    (appears,) = effects["colour"].output.events_named("colour-change")
    assert appears.time >= event.time and "appears" in appears.text


@pytest.mark.slow
@pytest.mark.parametrize(("celsius", "declared"), [(20.0, False), (60.0, True)])
def test_nitre_dissolves_up_to_its_solubility_by_temperature(celsius, declared):
    """Warm water is poured on more salt than dissolves; with or without an equation."""
    bodies = (
        glass("a", volume_ml=60.0, properties={"temperature_c": celsius}),
        glass("b", volume_ml=0.0, properties={"solid": {"formula": "KNO3", "mass_g": 60.0}, "temperature_c": celsius}),
    )
    equation = [("reaction", {"equation": "KNO3(s) -> K+ + NO3-"})] if declared else []
    falls = ("precipitation", {"solid": "KNO3", "colour": "white"})
    heat = {"of": "liquids", "ambient_c": celsius, "loss_w_per_k": 1e4, "heat_capacity_j_per_ml_k": 4.18}
    effects = effects_of_tilt_degrees(
        [0.0, *([60.0] * 3), *([0.0] * 40)], bodies, ("mixing", {"in": ["b"]}), *equation, falls, ("heat", heat)
    )
    (event,) = effects["precipitation"].events
    water_g = effects["mixing"].series["b/volume"].values[-1]
    table = SOLUBILITY_G_PER_100_G["KNO3"]
    expected = np.interp(celsius, list(table), list(table.values())) * water_g / 100.0
    assert event.name == "dissolved" and event.values["mass_g"] == pytest.approx(expected, rel=0.02)


def test_copper_is_titrated_to_its_ammine():
    """Copper hydroxide falls out first and dissolves again; nearly all copper is the deep blue ammine at the end."""
    burette = glass("burette", volume_ml=50.0, solute="NH3", molar=6.0, cavity=BURETTE_COLUMN)
    flask = glass("flask", volume_ml=2.0, solute="CuSO4", molar=0.02)
    effects = effects_of_tap_degrees(
        OPEN,
        MIXING_IN_FLASK,
        ("reaction", {"equation": "CuSO4 + 4 NH3 -> Cu(NH3)4SO4"}),
        ("reaction", {"equation": "Cu2+ + 2 NH3 + 2 H2O -> Cu(OH)2 + 2 NH4+"}),
        ("precipitation", {"solid": "Cu(OH)2", "colour": "blue"}),
        ("colour", {"in": "flask", "species": "Cu(NH3)4^2+"}),
        burette=burette,
        flask=flask,
    )
    falls, dissolves = effects["precipitation"].events
    assert falls.name == "precipitate" and falls.values["moles"] > 1e-5
    assert dissolves.name == "dissolved" and "dissolve again in flask" in dissolves.text
    assert dissolves.values["left_g"] == 0.0 and dissolves.time > falls.time
    assert effects["precipitation"].series["flask/Cu(OH)2"].values[-1] == 0.0
    volume = effects["mixing"].series["flask/volume"].values[-1]
    ammine = effects["reaction"].series["flask/Cu(NH3)4^2+"].values[-1]
    assert ammine * volume == pytest.approx(0.02 * 2.0, rel=0.05)
    assert (
        effects["colour"].output.events_named("colour-change")[0].text == "the colour of Cu(NH3)4^2+ in flask appears"
    )


AMMINE = ("colour", {"in": "flask", "species": "Cu(NH3)4^2+"})


def titrated_with_ammonia(molar, *tables, salt="CuSO4"):
    """Effects of 2 mL or so of ammonia that run into 1 mL of a copper salt."""
    burette = glass("burette", volume_ml=50.0, solute="NH3", molar=molar, cavity=BURETTE_COLUMN)
    flask = glass("flask", volume_ml=1.0, solute=salt, molar=0.1)
    return effects_of_tap_degrees(OPEN, MIXING_IN_FLASK, *tables, AMMINE, burette=burette, flask=flask)


@pytest.mark.slow
def test_basic_copper_sulfate_dissolves_in_more_ammonia():
    """In a flask the pale precipitate goes, and all copper is the deep blue ammine; 1 mol/L is enough."""
    effects = titrated_with_ammonia(
        1.0,
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
    """Fresh hydroxide is a basic salt of the copper salt's anion; the event advises to name ``basic`` alone instead."""
    ammine = ("reaction", {"equation": "Cu2+ + 4 NH3 -> [Cu(NH3)4]2+"})
    effects = titrated_with_ammonia(1.0, ammine, ("precipitation", {"solid": "Cu(OH)2"}), salt=salt)
    (event,) = effects["reaction"].output.events_named("aged")
    assert f"at first is {basic}" in event.text and event.level == "warning"
    both = titrated_with_ammonia(
        1.0, ammine, *(("precipitation", {"solid": solid}) for solid in ("Cu(OH)2", basic)), salt=salt
    )
    (event,) = both["reaction"].output.events_named("aged")
    assert event.text.endswith(f"name {basic} alone and not Cu(OH)2")
    # The advice is right: all of that dissolves.
    instead = titrated_with_ammonia(1.0, ammine, ("precipitation", {"solid": basic}), salt=salt)
    assert instead["precipitation"].series[f"flask/{basic}"].values[-1] == 0.0
    assert not instead["reaction"].output.events_named("supersaturated")


def test_unknown_basic_salt_is_refused_with_the_known_named():
    """Cu2(OH)2SO4 is in no table; Cu4(OH)6SO4 is made of the same ions."""
    basic = ("reaction", {"equation": "2 CuSO4 + 2 NH3 + 2 H2O -> Cu2(OH)2SO4 + (NH4)2SO4"})
    with pytest.raises(PlanError, match=r"'Cu2\(OH\)2SO4' dissolves; of its ions they have .*Cu4\(OH\)6SO4"):
        titrated_with_ammonia(1.0, basic)
