"""Concentrations, colour, solids, extents and gas are what amounts and volumes say.

Of `replay.effects.mixing`, `replay.effects.colour`, `replay.effects.precipitation` and `replay.effects.reaction`, views
of what `replay.effects.chemistry` reads in a scene.
"""

from functools import cache

import numpy as np
import pytest
from support.liquid_worlds import (
    MIXING_IN_FLASK,
    NEUTRALISATION,
    RADIUS,
    effects_of_tap_degrees,
    effects_of_tilt_degrees,
    glass,
    poses_at_rest,
    poses_of_tilted_glass,
    session_with_effects,
)
from support.small_worlds import STEP_S

from replay.effects.chemistry.contents import contents_of
from replay.effects.effect_summary import leading_event
from replay.effects.output import COLOURS, QUANTITIES
from replay.effects.vessels import Vessel
from replay.engine import compute
from replay.show.rerun_log.effects import effect_plots

MIXING_IN_B = ("mixing", {"in": ["b"]})


def reaction(equation, **more):
    """The table of a reaction, with other keys of it."""
    return "reaction", {"equation": equation, **more}


def test_concentrations_follow_from_volumes_poured_together():
    """Glass a with 0.2 mol/L of HCl is poured for two frames into b, 40 mL of 0.1 mol/L NaCl, which are 4 mmol.

    Nothing reacts; what is added of each is spread over both volumes. Only in these frames the effect mixing runs.
    """
    bodies = (glass("a", volume_ml=60.0, solute="HCl", molar=0.2), glass("b", volume_ml=40.0, solute="NaCl", molar=0.1))
    effects = effects_of_tilt_degrees([0.0, 60.0, 60.0, 0.0], bodies, MIXING_IN_B)
    series, moved_ml = effects["mixing"].series, effects["pour"].events[0].values["volume_ml"]
    assert set(series) == {"b/volume", "b/HCl added", "b/NaCl added"}
    assert series["b/volume"].values[-1] == pytest.approx(40.0 + moved_ml, rel=1e-9)
    assert series["b/HCl added"].values[-1] == pytest.approx(0.2 * moved_ml / (40.0 + moved_ml), rel=1e-9)
    first_molar, *_, last_molar = series["b/NaCl added"].values
    assert [first_molar, last_molar] == pytest.approx([0.1, 4.0 / (40.0 + moved_ml)], rel=1e-9)
    assert effects["mixing"].frames_run == 2


@pytest.mark.parametrize(
    ("liquid", "amounts"),
    [({}, {"H2O": 0.1 / 0.0180153}),
     ({"solute": "H2SO4", "molar": 18.0, "water_molar": 4.0}, {"H2SO4": 1.8, "H2O": 0.4})],
    ids=["pure water", "acid with declared water"],
)  # fmt: skip
def test_water_is_counted_where_pure_or_declared(liquid, amounts):
    """A glass has 100 mL: of water, 0.1 kg of 18 g/mol, or of an acid with 18 mol/L and 4 mol/L of water.

    ``amounts``: mol of each in the glass.
    """
    assert contents_of(Vessel(glass("a", volume_ml=100.0, **liquid))).amounts == pytest.approx(amounts)


PHENOLPHTHALEIN = {
    "in": "flask", "indicator": "phenolphthalein", "from_ph": 8.2, "to_ph": 10.0, "acid_colour": "colourless",
    "base_colour": "pink",
}  # fmt: skip


def lye_into_acid(**limits):
    """The effect colour while 1.3 mL of 0.1 mol/L lye run into 0.5 mL of as strong an acid with phenolphthalein.

    ``limits``: of its range, other than pH 8.2 to 10.
    """
    degrees = [0.0, 0.0, *([90.0] * 100), 0.0, 0.0]
    return effects_of_tap_degrees(degrees, MIXING_IN_FLASK, NEUTRALISATION, ("colour", {**PHENOLPHTHALEIN, **limits}))[
        "colour"
    ]


def test_acid_with_phenolphthalein_turns_pink_in_lye():
    """Lye in excess makes acid basic: the indicator is colourless at first and wholly pink from pH 10 on.

    Liquid, lane and series, 0 to 1, show the change.
    """
    colour = lye_into_acid()
    (event,) = colour.events
    assert event.name == "colour-change" and event.values["to"] == "pink"
    assert event.end >= event.time
    first_rgba, *_, last_rgba = colour.output.liquids["flask"].rgba
    assert tuple(first_rgba) == COLOURS["colourless"] and tuple(last_rgba) == COLOURS["pink"]
    first_span, *_ = colour.output.lanes["flask"]
    assert first_span.word == "colourless"
    assert colour.series["flask/phenolphthalein colour"].values[[0, -1]].tolist() == [0.0, 1.0]


def test_a_stop_inside_the_range_leaves_a_change_open():
    """Lye in excess makes acid basic, but not of pH 14, where the range is made to end: the change does not end."""
    (event,) = lye_into_acid(from_ph=2.0, to_ph=14.0).events
    assert event.name == "colour-change" and event.values["to"] == "pink"
    assert event.end is None


SILVER_AND_CHLORIDE = reaction("AgNO3 + NaCl -> AgCl + NaNO3")
SILVER_CHLORIDE_FALLS_OUT = ("precipitation", {"solid": "AgCl", "colour": "white"})


def test_the_scarcer_ion_falls_out_almost_all_at_once():
    """Silver of 0.1 mol/L is poured from frame 1 on into 40 mL with 4 mmol of chloride, more than silver comes.

    A mol of silver chloride is 143.32 g. The liquid drawn, colourless at first, is white in the end.
    """
    bodies = (
        glass("a", volume_ml=60.0, solute="AgNO3", molar=0.1),
        glass("b", volume_ml=40.0, solute="NaCl", molar=0.1),
    )
    tables = (MIXING_IN_B, SILVER_AND_CHLORIDE, SILVER_CHLORIDE_FALLS_OUT)
    effects = effects_of_tilt_degrees([0.0, 60.0, 60.0], bodies, *tables)
    (event,) = effects["precipitation"].events
    silver_mol = 0.1 * 1e-3 * effects["pour"].events[0].values["volume_ml"]
    assert event.time == pytest.approx(1 * STEP_S)
    assert event.values["moles"] == pytest.approx(silver_mol, rel=1e-3)
    assert event.values["mass_g"] == pytest.approx(silver_mol * 143.32, rel=1e-3)
    assert effects["precipitation"].series["b/AgCl"].values[0] == 0.0
    first_rgba, *_, last_rgba = effects["precipitation"].output.liquids["b"].rgba
    assert tuple(first_rgba) == COLOURS["colourless"] and tuple(last_rgba) == COLOURS["white"]


def test_dissolved_and_remaining_solid_sum_to_the_initial_mass():
    """Acid of 1 mol/L is poured for two frames of 10 ms on 5 g of marble, more than it dissolves.

    The event is at the second of them.
    """
    bodies = (
        glass("a", volume_ml=60.0, solute="HCl", molar=1.0),
        glass("b", volume_ml=1.0, properties={"solid": {"formula": "CaCO3", "mass_g": 5.0}}),
    )
    marble = reaction("CaCO3 + 2 HCl -> CaCl2 + H2O + CO2"), ("precipitation", {"solid": "CaCO3", "colour": "white"})
    (event,) = effects_of_tilt_degrees([0.0, 60.0, 60.0], bodies, MIXING_IN_B, *marble)["precipitation"].events
    assert event.name == "dissolved" and event.time == 2 * STEP_S
    assert 1.0 < event.values["left_g"] < 5.0  # 9.3 mL, 9.3 mmol of acid, dissolve half as much: 0.47 g
    assert event.values["mass_g"] + event.values["left_g"] == pytest.approx(5.0, rel=1e-4)


@pytest.mark.parametrize("fraction", [0.0, 0.25])
def test_a_decanted_liquid_leaves_its_solid(fraction):
    """Glass a is emptied into b in frames 2 to 4, and then b into c in 5 to 7, with a ``fraction`` of its solid.

    20 mL of 0.1 mol/L of silver and of chloride make 2 mmol of AgCl, 143.32 g/mol: 0.28664 g.
    """
    silver_chloride_g = 0.28664
    bodies = (
        glass("a", volume_ml=20.0, solute="AgNO3", molar=0.1),
        glass("b", volume_ml=20.0, solute="NaCl", molar=0.1),
        glass("c"),
    )
    poses = {
        "a": poses_of_tilted_glass([0.0, 0.0, 120.0, 120.0, 120.0, 0.0, 0.0, 0.0, 0.0]),
        "b": poses_of_tilted_glass([*([0.0] * 5), 120.0, 120.0, 120.0, 0.0], (RADIUS, 0.1, 0.0)),
        "c": poses_at_rest(count=9, position=(RADIUS, 0.0, 0.0)),
    }  # fmt: skip
    pour = ("pour", {"from": ["a", "b"], "into": ["b", "c"], "solid_fraction": fraction})
    tables = (pour, ("mixing", {"in": ["b", "c"]}), SILVER_AND_CHLORIDE, SILVER_CHLORIDE_FALLS_OUT)
    step_that_empties_a_glass_ns = 100_000_000
    session = session_with_effects(poses, bodies, *tables, step_ns=step_that_empties_a_glass_ns)
    series = compute(session).effects["precipitation"].series
    in_b_g, in_c_g = (series[f"{name}/AgCl"].values[-1] for name in "bc")
    assert in_c_g == pytest.approx(fraction * silver_chloride_g, rel=1e-3)
    assert in_b_g + in_c_g == pytest.approx(silver_chloride_g, rel=1e-3)


@cache
def slow_zinc_reaction():
    """The effect reaction where acid is poured on 0.05 g of zinc for a second; its rate is 2 a second."""
    acid = glass("a", volume_ml=60.0, solute="HCl", molar=2.0)
    zinc = glass("b", properties={"solid": {"formula": "Zn", "mass_g": 0.05}})
    slow = reaction("Zn + 2 HCl -> ZnCl2 + H2", rate_per_s=2.0)
    return effects_of_tilt_degrees([0.0, *([60.0] * 100)], (acid, zinc), MIXING_IN_B, slow)["reaction"]


def test_a_slow_reaction_uses_up_its_limiting_reagent():
    """0.05 g of zinc (65.38 g/mol) lie in much acid, which is poured from frame 1 on; it reacts by 2 a second.

    From frame 2 to frame 100, of 10 ms, a fraction 1 - exp(-rate x seconds) reacts; the extent is mol of the equation.
    """
    run = slow_zinc_reaction()
    extent = run.series["b/extent"]
    first_frame, last_frame = 2, 100
    assert extent.values[0] == 0.0 and extent.times[0] == first_frame * STEP_S
    assert len(extent.times) == run.frames_run == last_frame - first_frame + 1
    seconds, zinc_mol = (last_frame - first_frame) * STEP_S, 0.05 / 65.38
    assert extent.values[-1] == pytest.approx(zinc_mol * (1.0 - np.exp(-2.0 * seconds)), rel=1e-9)


def test_gas_of_a_slow_reaction_is_a_single_event():
    """Zinc reacts in acid that is poured from frame 1 to frame 100, of 10 ms, by a rate: a mol of H2 a mol of zinc.

    The event lasts from the first frame with gas, 3, to the last frame, at 1 s; it leads the summary, and has as many
    mol as the equation has run.
    """
    run = slow_zinc_reaction()
    (event,) = run.events
    extent, gone = run.series["b/extent"], run.series["b/H2 gone"]
    assert event.name == "gas" and event.values["formula"] == "H2" and event.values["moles"] == extent.values[-1]
    assert gone.values[-1] == extent.values[-1] and gone.unit == "mol"
    assert (event.time, event.end) == pytest.approx((3 * STEP_S, 1.0))
    assert leading_event({"reaction": run}) == event


def test_slow_reaction_is_plotted_in_mol_and_has_no_ph():
    """Zinc reacts in acid by a rate: no equilibrium, and so no pH, is computed; the last plot is of mol."""
    run = slow_zinc_reaction()
    assert "b/pH" not in run.series
    *_, (quantity, *_series) = effect_plots({"reaction": run})
    assert quantity == QUANTITIES["mol"]


def effects_of_acid_on(base, equation):
    """Effects of acid of 1 mol/L that is poured for half a second into 10 mL of a base of 0.5 mol/L, 5 mmol."""
    bodies = glass("a", volume_ml=60.0, solute="HCl", molar=1.0), glass("b", volume_ml=10.0, solute=base, molar=0.5)
    return effects_of_tilt_degrees([0.0, *([60.0] * 50)], bodies, MIXING_IN_B, reaction(equation))


def test_leaving_gas_is_the_amount_beyond_solubility():
    """Acid in excess is poured into 5 mmol of NaHCO3; of the CO2 a litre keeps 3.3e-4 mol/(m3 Pa) x 101325 Pa.

    Gas that left stays away: most of it is gone when acid for all of the soda has come, 5 mL (5 mmol), in 15 mL.
    """
    effects = effects_of_acid_on("NaHCO3", "NaHCO3 + HCl -> NaCl + H2O + CO2")
    volume_ml = effects["mixing"].series["b/volume"].values
    (event,) = effects["reaction"].output.events_named("gas")
    litres_with_enough_acid = 1e-3 * volume_ml[volume_ml >= 15.0][0]
    dissolved_mol = 3.3e-7 * 101325.0 * litres_with_enough_acid
    assert event.values["moles"] == pytest.approx(5e-3 - dissolved_mol, rel=0.01)
    # 24.46 mL of an ideal gas are a mmol at 25 degC. Source: CODATA's gas constant.
    assert event.values["gas_ml"] == pytest.approx(24.465e3 * event.values["moles"], rel=1e-4)
    assert f"mmol CO2 leave b as gas, {event.values['gas_ml']:.0f} mL dry at 25 degC and 1 atm" in event.text


def test_neutralisation_frees_no_gas():
    """Acid in excess is poured into lye, which makes salt and water."""
    effects = effects_of_acid_on("NaOH", "HCl + NaOH -> NaCl + H2O")
    assert not effects["reaction"].output.events_named("gas")


def test_gas_of_before_the_session_does_not_leave():
    """Soda and acid stand together in 10 mL at the start; more than 20 mL of water that come later free no gas."""
    soda = glass("b", volume_ml=10.0, solutes={"NaHCO3": 0.5, "HCl": 0.4})
    tables = MIXING_IN_B, reaction("NaHCO3 + HCl -> NaCl + H2O + CO2")
    effects = effects_of_tilt_degrees([0.0, *([60.0] * 50)], (glass("a", volume_ml=60.0), soda), *tables)
    assert not effects["reaction"].output.events_named("gas")
    assert effects["mixing"].series["b/volume"].values[-1] > 10.0 + 20.0


def test_a_ph_without_end_point_is_reported_when_settled():
    """Acid of 0.002 mol/L with 0.001 mol/L of lye, which leaves 0.001 mol/L, has a pH of 3; more is poured into it.

    The pour takes nine frames; the event is at its end, when the volume is largest.
    """
    bodies = (
        glass("a", volume_ml=60.0, solute="HCl", molar=0.1),
        glass("b", volume_ml=40.0, solutes={"HCl": 0.002, "NaOH": 0.001}),
    )
    effects = effects_of_tilt_degrees([0.0, *([60.0] * 9), *([0.0] * 90)], bodies, MIXING_IN_B, NEUTRALISATION)
    (event,), volume = effects["reaction"].events, effects["mixing"].series["b/volume"]
    assert event.time == volume.times[np.argmax(volume.values)]
    assert event.values["from_ph"] == pytest.approx(3.0, rel=0.02)


def test_a_solid_without_precipitation_is_a_series():
    """Silver of 0.1 mol/L is poured into chloride and ammonia; the scene has no effect precipitation.

    The effect reaction has a series of the g of AgCl, 143.32 g/mol, nearly all of the silver; ammonia, 0.01 mol/L at
    first, dissolves little of it.
    """
    bodies = (
        glass("a", volume_ml=60.0, solute="AgNO3", molar=0.1),
        glass("b", volume_ml=40.0, solutes={"NaCl": 0.1, "NH3": 0.01}),
    )
    effects = effects_of_tilt_degrees([0.0, 60.0, 60.0], bodies, MIXING_IN_B, SILVER_AND_CHLORIDE)
    silver_mol = 0.1 * 1e-3 * effects["pour"].events[0].values["volume_ml"]
    series = effects["reaction"].series
    assert series["b/AgCl"].values[-1] == pytest.approx(143.32 * silver_mol, rel=0.01)
    assert 0.0 < series["b/NH3"].values[-1] < 0.01
