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

MIXED_IN_B = ("mixing", {"in": ["b"]})


def reaction(equation, **more):
    """The table of a reaction, with other keys of it."""
    return "reaction", {"equation": equation, **more}


def test_concentrations_follow_from_volumes_poured_together():
    """Glass a holds 0.2 mol/L of HCl, b 40 mL of 0.1 mol/L NaCl (4 mmol); ``moved``: the mL that ran from a into b."""
    bodies = (glass("a", volume_ml=60.0, solute="HCl", molar=0.2), glass("b", volume_ml=40.0, solute="NaCl", molar=0.1))
    effects = effects_of_tilt_degrees([0.0, 60.0, 60.0, 0.0], bodies, MIXED_IN_B)
    series, moved = effects["mixing"].series, effects["pour"].events[0].values["volume_ml"]
    assert series["b/volume"].values[-1] == pytest.approx(40.0 + moved, rel=1e-9)
    assert series["b/HCl added"].values[-1] == pytest.approx(0.2 * moved / (40.0 + moved), rel=1e-9)
    assert series["b/NaCl added"].values[[0, -1]] == pytest.approx([0.1, 4.0 / (40.0 + moved)], rel=1e-9)
    assert effects["mixing"].frames_run == 2 and set(series) == {"b/volume", "b/HCl added", "b/NaCl added"}


@pytest.mark.parametrize(
    ("liquid", "amounts"),
    [({}, {"H2O": 0.1 / 0.0180153}),
     ({"solute": "H2SO4", "molar": 18.0, "water_molar": 4.0}, {"H2SO4": 1.8, "H2O": 0.4})],
)  # fmt: skip
def test_water_is_counted_where_pure_or_declared(liquid, amounts):
    """100 mL of water, 18 g/mol; or of an acid with 18 mol/L and 4 mol/L of water."""
    assert contents_of(Vessel(glass("a", volume_ml=100.0, **liquid))).amounts == pytest.approx(amounts)


PINK = {
    "in": "flask", "indicator": "phenolphthalein", "from_ph": 8.2, "to_ph": 10.0, "acid_colour": "colourless",
    "base_colour": "pink",
}  # fmt: skip


@pytest.mark.parametrize(("ends", "limits"), [(True, {}), (False, {"from_ph": 2.0, "to_ph": 14.0})])
def test_a_stop_inside_the_range_leaves_a_change_open(ends, limits):
    """1.3 mL of 0.1 mol/L lye make 0.5 mL of acid basic: pink by phenolphthalein, whose change ends at pH 10.

    With a range up to pH 14 the change has begun and does not end.
    """
    run = effects_of_tap_degrees(
        [0.0, 0.0, *([90.0] * 100), 0.0, 0.0], MIXING_IN_FLASK, NEUTRALISATION, ("colour", {**PINK, **limits})
    )["colour"]
    (event,) = run.events
    assert event.name == "colour-change" and event.values["to"] == "pink"
    assert event.end >= event.time if ends else event.end is None
    if ends:
        shade = run.output.liquids["flask"].rgba
        assert tuple(shade[0]) == COLOURS["colourless"] and tuple(shade[-1]) == COLOURS["pink"]
        assert run.output.lanes["flask"][0].word == "colourless"
        assert run.series["flask/phenolphthalein colour"].values[[0, -1]].tolist() == [0.0, 1.0]


SILVER = reaction("AgNO3 + NaCl -> AgCl + NaNO3")
SILVER_CHLORIDE_FALLS_OUT = ("precipitation", {"solid": "AgCl", "colour": "white"})


def test_the_scarcer_ion_falls_out_almost_all_at_once():
    """b holds 4 mmol of chloride, more than the silver that comes from frame 1 on; AgCl: 143.32 g/mol."""
    bodies = (
        glass("a", volume_ml=60.0, solute="AgNO3", molar=0.1),
        glass("b", volume_ml=40.0, solute="NaCl", molar=0.1),
    )
    effects = effects_of_tilt_degrees([0.0, 60.0, 60.0], bodies, MIXED_IN_B, SILVER, SILVER_CHLORIDE_FALLS_OUT)
    (event,) = effects["precipitation"].events
    litres = 1e-3 * effects["pour"].events[0].values["volume_ml"]
    moles = 0.1 * litres
    assert event.time == pytest.approx(1 * STEP_S) and event.values["moles"] == pytest.approx(moles, rel=1e-3)
    assert event.values["mass_g"] == pytest.approx(moles * 143.32, rel=1e-3)
    assert effects["precipitation"].series["b/AgCl"].values[0] == 0.0
    drawn = effects["precipitation"].output.liquids["b"].rgba
    assert tuple(drawn[0]) == COLOURS["colourless"] and tuple(drawn[-1]) == COLOURS["white"]


def test_dissolved_and_remaining_solid_sum_to_the_initial_mass():
    """5 g of marble; the acid comes from frame 1 on, 10 ms a frame."""
    bodies = (
        glass("a", volume_ml=60.0, solute="HCl", molar=1.0),
        glass("b", volume_ml=1.0, properties={"solid": {"formula": "CaCO3", "mass_g": 5.0}}),
    )
    marble = reaction("CaCO3 + 2 HCl -> CaCl2 + H2O + CO2"), ("precipitation", {"solid": "CaCO3", "colour": "white"})
    (event,) = effects_of_tilt_degrees([0.0, 60.0, 60.0], bodies, MIXED_IN_B, *marble)["precipitation"].events
    assert event.name == "dissolved" and event.time == 0.02 and 1.0 < event.values["left_g"] < 5.0
    assert event.values["mass_g"] + event.values["left_g"] == pytest.approx(5.0, rel=1e-4)


@pytest.mark.parametrize("fraction", [0.0, 0.25])
def test_a_decanted_liquid_leaves_its_solid(fraction):
    """2 mmol of AgCl are 0.28664 g; glass b is emptied into c, with this fraction of its solid."""
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
    # A step in which a glass can be emptied.
    session = session_with_effects(
        poses, bodies, pour, ("mixing", {"in": ["b", "c"]}), SILVER, SILVER_CHLORIDE_FALLS_OUT, step_ns=100_000_000
    )
    series = compute(session).effects["precipitation"].series
    stays, goes = (series[f"{name}/AgCl"].values[-1] for name in "bc")
    assert goes == pytest.approx(fraction * 0.28664, rel=1e-3) and stays + goes == pytest.approx(0.28664, rel=1e-3)


ZINC = "Zn + 2 HCl -> ZnCl2 + H2"


def glass_with_zinc(grams, volume=0.0, **more):
    """Glass b, empty unless a volume in mL is given, with so much zinc."""
    return glass("b", volume, properties={"solid": {"formula": "Zn", "mass_g": grams}}, **more)


@cache
def slow_zinc_reaction():
    """The reaction where acid is poured on 0.05 g of zinc for a second; its rate is 2 a second."""
    acid, slow = glass("a", volume_ml=60.0, solute="HCl", molar=2.0), reaction(ZINC, rate_per_s=2.0)
    degrees = [0.0, *([60.0] * 100)]
    return effects_of_tilt_degrees(degrees, (acid, glass_with_zinc(grams=0.05)), MIXED_IN_B, slow)["reaction"]


def test_a_slow_reaction_uses_up_its_limiting_reagent():
    """0.05 g of zinc (65.38 g/mol) in much acid, which comes in frame 1; a frame is 10 ms.

    From the frame after to frame 100 a fraction 1 - exp(-rate seconds) reacts.
    """
    run = slow_zinc_reaction()
    extent = run.series["b/extent"]
    assert extent.values[0] == 0.0 and extent.times[0] == 2 * STEP_S
    assert len(extent.times) == run.frames_run == 99
    seconds, zinc_moles = 98 * STEP_S, 0.05 / 65.38
    assert extent.values[-1] == pytest.approx(zinc_moles * (1.0 - np.exp(-2.0 * seconds)), rel=1e-9)


def test_gas_of_a_slow_reaction_is_a_single_event():
    """It leads the summary, from the first frame with gas to the last frame, 1 s."""
    run = slow_zinc_reaction()
    (event,) = run.events
    extent, gone = run.series["b/extent"], run.series["b/H2 gone"]
    assert event.name == "gas" and event.values["formula"] == "H2" and event.values["moles"] == extent.values[-1]
    assert gone.values[-1] == extent.values[-1] and gone.unit == "mol"
    assert (event.time, event.end) == pytest.approx((3 * STEP_S, 1.0))
    assert leading_event({"reaction": run}) == event


def test_slow_reaction_is_plotted_in_mol_and_has_no_ph():
    """No equilibrium, and so no pH, is computed of it."""
    run = slow_zinc_reaction()
    assert "b/pH" not in run.series
    quantity, *_ = effect_plots({"reaction": run})[-1]
    assert quantity == QUANTITIES["mol"]


def test_leaving_gas_is_the_amount_beyond_solubility():
    """Soda of 0.5 mol/L with acid in excess: a litre keeps 3.3e-4 mol/(m3 Pa) times an atmosphere of the CO2."""

    def run(base, equation):
        bodies = glass("a", volume_ml=60.0, solute="HCl", molar=1.0), glass("b", volume_ml=10.0, solute=base, molar=0.5)
        return effects_of_tilt_degrees([0.0, *([60.0] * 50)], bodies, MIXED_IN_B, reaction(equation))

    effects = run("NaHCO3", "NaHCO3 + HCl -> NaCl + H2O + CO2")
    volume = effects["mixing"].series["b/volume"].values
    (event,) = effects["reaction"].output.events_named("gas")
    # Gas that left stays away: most of it is gone in the first row with acid for all of the soda, at its volume.
    litres = 1e-3 * volume[volume >= 15.0][0]
    assert event.values["moles"] == pytest.approx(5e-3 - 3.3e-7 * 101325.0 * litres, rel=0.01)
    # 24.46 mL of an ideal gas are a mmol at 25 degC. Source: CODATA's gas constant.
    assert event.values["gas_ml"] == pytest.approx(24.465e3 * event.values["moles"], rel=1e-4)
    assert f"mmol CO2 leave b as gas, {event.values['gas_ml']:.0f} mL dry at 25 degC and 1 atm" in event.text
    assert not run("NaOH", NEUTRALISATION[1]["equation"])["reaction"].output.events_named("gas")


def test_gas_of_before_the_session_does_not_leave():
    """Soda and acid stand together at the start; water that comes later frees no gas."""
    soda = glass("b", volume_ml=10.0, solutes={"NaHCO3": 0.5, "HCl": 0.4})
    settings = MIXED_IN_B, reaction("NaHCO3 + HCl -> NaCl + H2O + CO2")
    effects = effects_of_tilt_degrees([0.0, *([60.0] * 50)], (glass("a", volume_ml=60.0), soda), *settings)
    assert not effects["reaction"].output.events_named("gas") and effects["mixing"].series["b/volume"].values[-1] > 30.0


def test_a_ph_without_end_point_is_reported_when_settled():
    """0.002 - 0.001 mol/L of acid is pH 3; more acid comes for nine frames, after which the event is."""
    bodies = (
        glass("a", volume_ml=60.0, solute="HCl", molar=0.1),
        glass("b", volume_ml=40.0, solutes={"HCl": 0.002, "NaOH": 0.001}),
    )
    effects = effects_of_tilt_degrees([0.0, *([60.0] * 9), *([0.0] * 90)], bodies, MIXED_IN_B, NEUTRALISATION)
    (event,), volume = effects["reaction"].events, effects["mixing"].series["b/volume"]
    assert event.time == volume.times[np.argmax(volume.values)] and event.values["from_ph"] == pytest.approx(3.0, 0.02)


def test_a_solid_without_precipitation_is_a_series():
    """AgCl of 143.32 g/mol from silver of 0.1 mol/L; little of it stays dissolved in ammonia."""
    bodies = (
        glass("a", volume_ml=60.0, solute="AgNO3", molar=0.1),
        glass("b", volume_ml=40.0, solutes={"NaCl": 0.1, "NH3": 0.01}),
    )
    effects = effects_of_tilt_degrees([0.0, 60.0, 60.0], bodies, MIXED_IN_B, SILVER)
    moved = 1e-4 * effects["pour"].events[0].values["volume_ml"]
    series = effects["reaction"].series
    assert series["b/AgCl"].values[-1] == pytest.approx(143.32 * moved, rel=0.01)
    assert 0.0 < series["b/NH3"].values[-1] < 0.01
