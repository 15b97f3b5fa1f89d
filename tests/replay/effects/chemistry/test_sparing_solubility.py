"""Sparingly soluble salts by temperature against tables of solubility, and PHREEQC text with a course of its own."""

import pytest
from support.liquid_worlds import MIXING_IN_FLASK, glass, poses_at_rest, session_with_effects

from replay.effects.effect_plan import plan_faults
from replay.engine import compute

# Solid -> degC -> g that dissolve in 100 g of water. Source: Lange's Handbook of Chemistry, 15th ed., table 5.1;
# of PbI2 Seidell, Solubilities of Inorganic Compounds, 4th ed.; of CaSO4.2H2O as the dihydrate; of AgCl and BaSO4 CRC
# Handbook, near 100 degC.
SOLUBILITY = {
    "PbCl2": {5: 0.74, 20: 1.00, 40: 1.42, 60: 1.94, 80: 2.54, 95: 3.04},
    "PbI2": {15: 0.0613, 25: 0.0764, 45: 0.1453, 65: 0.2183, 80: 0.302, 95: 0.396},
    "PbBr2": {5: 0.55, 20: 0.86, 40: 1.53, 60: 2.36, 80: 3.34},
    "CaSO4.2H2O": {5: 0.234, 20: 0.255, 40: 0.265, 60: 0.244, 80: 0.234, 95: 0.212},
    "Ca(OH)2": {5: 0.185, 20: 0.173, 40: 0.141, 60: 0.121, 80: 0.094, 95: 0.081},
    "AgCl": {99: 0.0021},
    "BaSO4": {25: 0.000246, 99: 0.00041},
    "Ag2SO4": {5: 0.635, 20: 0.80, 40: 0.98, 60: 1.15, 80: 1.30, 95: 1.38},
}
ROWS = [(solid, celsius, grams) for solid, row in SOLUBILITY.items() for celsius, grams in row.items()]
CALM = ("heat", {"of": "liquids", "ambient_c": 20.0, "loss_w_per_k": 0.0})


def dissolved(solid, celsius, grams):
    """g of a solid that dissolve in 100 mL of water at a temperature, of three times as much."""
    contents = {"solid": {"formula": solid, "mass_g": 3.0 * grams}, "temperature_c": float(celsius)}
    flask = glass("flask", volume_ml=100.0, cavity={"radius": 0.05, "height": 0.08}, properties=contents)
    effects = compute(
        session_with_effects(
            {"flask": poses_at_rest(count=2)}, (flask,), MIXING_IN_FLASK, CALM, ("precipitation", {"solid": solid})
        )
    ).effects
    return effects["precipitation"].output.events_named("dissolved")[0].values["mass_g"]


@pytest.mark.sampled(2)
@pytest.mark.parametrize(("solid", "celsius", "grams"), ROWS)
def test_sparing_solubility_agrees_with_tables_hot_and_cold(solid, celsius, grams):
    """``grams`` are the tabled solubility at that temperature; agreement within 18 %."""
    assert dissolved(solid, celsius, grams) == pytest.approx(grams, rel=0.18)


@pytest.mark.parametrize(("solid", "is_reported"), [("AgBr", True), ("AgCl", False)])
def test_a_hot_solid_without_a_course_is_reported(solid, is_reported):
    """At 80 degC PHREEQC has a course of the constant of AgCl by temperature, of AgBr none."""
    flask = glass(
        "flask", volume_ml=50.0, properties={"solid": {"formula": solid, "mass_g": 0.001}, "temperature_c": 80.0}
    )
    reaction = ("reaction", {"equation": f"{solid} -> Ag+ + {solid[2:]}-"})
    output = (
        compute(session_with_effects({"flask": poses_at_rest(count=2)}, (flask,), MIXING_IN_FLASK, CALM, reaction))
        .effects["reaction"]
        .output
    )
    assert [f"how much {solid} dissolves" in event.text for event in output.events_named("assumed")] == [
        True
    ] * is_reported


def test_solubility_by_temperature_needs_ions_of_the_data_base():
    """An author may give PHREEQC's ``-analytic`` for lead chloride and its ions, not for an equation without ions."""
    flask = glass("flask", volume_ml=50.0, solutes={"PbCl2": 0.01})
    course = "PHASES\nMine\n PbCl2 = Pb+2 + 2 Cl-\n log_k -4.78\n -analytic {}\n"
    falls = ("precipitation", {"solid": "PbCl2"})

    def faults(text):
        reaction = ("reaction", {"equation": "Pb2+ + 2 Cl- -> PbCl2", "phreeqc": text})
        return plan_faults(
            session_with_effects({"flask": poses_at_rest(count=2)}, (flask,), MIXING_IN_FLASK, reaction, falls).scene
        )

    assert faults(course.format("-4.78 0 0 0")) == ()
    other = course.format("-2.0 0 0 0").replace("PbCl2 = Pb+2 + 2 Cl-", "PbCl2 = PbCl2")
    assert any("-analytic holds for an equation of the data base's own ions" in fault for fault in faults(other))
