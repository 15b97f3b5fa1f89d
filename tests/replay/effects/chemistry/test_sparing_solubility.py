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
HEAT = ("heat", {"of": "liquids", "ambient_c": 20.0, "loss_w_per_k": 0.0})


def session_of_standing(flask, *effects):
    """A session in which a flask stands for two frames, with a heat effect that follows its temperature."""
    return session_with_effects({"flask": poses_at_rest(count=2)}, (flask,), MIXING_IN_FLASK, HEAT, *effects)


@pytest.mark.sampled(4)
@pytest.mark.parametrize(("solid", "celsius", "tabled_g"), ROWS)
def test_sparing_solubility_agrees_with_tables_hot_and_cold(solid, celsius, tabled_g):
    """100 mL of water of so many degC stand on three times ``tabled_g``, which dissolve in it by a handbook.

    The event says that within 18 % of ``tabled_g`` have dissolved.
    """
    contents = {"solid": {"formula": solid, "mass_g": 3.0 * tabled_g}, "temperature_c": float(celsius)}
    flask = glass("flask", volume_ml=100.0, cavity={"radius": 0.05, "height": 0.08}, properties=contents)
    effects = compute(session_of_standing(flask, ("precipitation", {"solid": solid}))).effects
    dissolved, *_ = effects["precipitation"].output.events_named("dissolved")
    assert dissolved.values["mass_g"] == pytest.approx(tabled_g, rel=0.18)


@pytest.mark.parametrize(("solid", "events"), [("AgBr", 1), ("AgCl", 0)])
def test_a_hot_solid_without_a_course_is_reported(solid, events):
    """A mg of a solid lies in 50 mL of water of 80 degC: an event says that its solubility is that of 25 degC.

    Not of AgCl: PHREEQC's data have a course of its constant by temperature, and of AgBr none.
    """
    contents = {"solid": {"formula": solid, "mass_g": 0.001}, "temperature_c": 80.0}
    halide = solid.removeprefix("Ag")
    reaction = ("reaction", {"equation": f"{solid} -> Ag+ + {halide}-"})
    flask = glass("flask", volume_ml=50.0, properties=contents)
    output = compute(session_of_standing(flask, reaction)).effects["reaction"].output
    texts = [event.text for event in output.events_named("assumed")]
    assert len(texts) == events
    assert all(f"how much {solid} dissolves" in text for text in texts)


@pytest.mark.parametrize(
    ("phase", "text_of_fault"),
    [
        ("PbCl2 = Pb+2 + 2 Cl-", ""),
        ("PbCl2 = PbCl2", "-analytic holds for an equation of the data base's own ions"),
    ],
    ids=["of its ions", "without ions"],
)
def test_solubility_by_temperature_needs_ions_of_the_data_base(phase, text_of_fault):
    """A scene's author gives PHREEQC's ``-analytic``, a course by temperature, for a ``phase`` of lead chloride."""
    course = f"PHASES\nMine\n {phase}\n log_k -4.78\n -analytic -4.78 0 0 0\n"
    reaction = ("reaction", {"equation": "Pb2+ + 2 Cl- -> PbCl2", "phreeqc": course})
    flask = glass("flask", volume_ml=50.0, solutes={"PbCl2": 0.01})
    bodies, precipitation = (flask,), ("precipitation", {"solid": "PbCl2"})
    poses = {"flask": poses_at_rest(count=2)}
    faults = plan_faults(session_with_effects(poses, bodies, MIXING_IN_FLASK, reaction, precipitation).scene)
    if text_of_fault:
        assert any(text_of_fault in fault for fault in faults)
    else:
        assert faults == ()
