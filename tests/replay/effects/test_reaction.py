import numpy as np
import pytest
from support.liquid_worlds import MIX, NEUTRAL, glass, poured, run_in, still, world

from replay.effects.models.colours import COLOURS
from replay.errors import EffectError, PlanError
from replay.pipeline.engine import compute
from sessions.model.scene import SceneBody

OPEN = [0.0, 0.0, *([90.0] * 100), 0.0, 0.0]


def test_the_end_point_is_where_the_acid_is_used_up():
    run = run_in(OPEN, MIX, NEUTRAL)["reaction"]
    (event,) = run.events
    assert event.name == "end-point" and event.values["volume_ml"] == pytest.approx(0.5, rel=1e-9)
    ph = run.series["flask/pH"]
    assert np.interp(event.time, ph.times, ph.values) == pytest.approx(7.0, abs=2.0)
    assert ph.values[0] == pytest.approx(1.0, abs=1e-6) and (np.diff(ph.values) >= 0.0).all() and ph.values[-1] > 11.0


def test_the_ph_halfway_to_the_end_point_of_a_weak_acid_is_its_pka():
    acid = glass("flask", 0.5, solute="HAc", molar=0.1)
    weak = ("reaction", {"equation": "C2H4O2 + NaOH -> C2H3NaO2 + H2O", "acids": {"C2H4O2": [4.756]}, "pkw": 14.0})
    acid.extra["properties"]["liquid"]["solute"] = "C2H4O2"
    effects = run_in(OPEN, MIX, weak, acid=acid)
    ph, volume = effects["reaction"].series["flask/pH"], effects["mixing"].series["flask/volume"]
    half = np.interp(0.75, volume.values, volume.times)
    assert np.interp(half, ph.times, ph.values) == pytest.approx(4.756, abs=0.01)


def test_before_the_end_point_there_is_none_and_alone_nothing_reacts():
    assert run_in([0.0, 10.0, 0.0], MIX, NEUTRAL)["reaction"].events == ()
    run = run_in([0.0, 0.0], MIX, NEUTRAL)["reaction"]
    assert run.events == () and run.series == {} and run.frames_run == 0


def test_a_reaction_with_a_rate_nears_the_end_of_its_limiting_reagent():
    zinc = glass("b", 0.0)
    zinc.extra["properties"]["solid"] = {"formula": "Zn", "mass_g": 0.05, "molar_mass": 65.38}
    slow = ("reaction", {"equation": "Zn + 2 HCl -> ZnCl2 + H2", "rate_per_s": 2.0})
    acid = glass("a", 60.0, solute="HCl", molar=2.0)
    run = poured([0.0, *([60.0] * 100)], (acid, zinc), ("mixing", {"in": ["b"]}), slow)["reaction"]
    extent = run.series["b/extent"]
    assert extent.values[0] == 0.0 and len(extent.times) == run.frames_run == 101
    assert extent.values[-1] == pytest.approx(-0.05 / 65.38 * np.expm1(-2.0 * 0.99), rel=1e-9)
    assert run.series["b/pH"].values[-1] < 0.0 and run.events == ()


@pytest.mark.parametrize(
    ("settings", "words"),
    [({"equation": "HCl + NaOH -> NaCl"}, "not balanced"), ({"equation": "salt"}, "has no ->"),
     ({"acids": {"HF": 3.2}}, "rising list"), ({"acids": {"HF": [5.0, 3.0]}}, "rising list"),
     ({"bases": {"NH3": [9.25]}}, "conjugate acid")],
)  # fmt: skip
def test_chemistry_that_cannot_be_is_refused_when_planned(settings, words):
    with pytest.raises(PlanError, match=words):
        run_in([0.0, 0.0], MIX, ("reaction", {**NEUTRAL[1], **settings}))


MIX_precipitation = ("mixing", {"in": ["b"]})
SILVER = ("reaction", {"equation": "AgNO3 + NaCl -> AgCl + NaNO3"})
FALLS = {"solid": "AgCl", "ksp": 1.77e-10, "molar_mass": 143.32, "colour": "white"}


def run(silver=0.1, salt=0.1, degrees=(0.0, 60.0, 60.0), reaction=SILVER, **more):
    bodies = (glass("a", 60.0, solute="AgNO3", molar=silver), glass("b", 40.0, solute="NaCl", molar=salt))
    return poured(degrees, bodies, MIX_precipitation, reaction, ("precipitation", {**FALLS, **more}))


def test_the_scarcer_ion_falls_out_almost_all_at_once():
    effects = run()
    (event,) = effects["precipitation"].events
    moles = 0.1e-3 * effects["pour"].events[0].values["volume_ml"]
    assert event.time == pytest.approx(0.01) and event.values["moles"] == pytest.approx(moles, rel=1e-4)
    assert event.values["mass_g"] == pytest.approx(moles * 143.32, rel=1e-4)
    assert effects["precipitation"].series["b/AgCl"].values[0] == 0.0
    drawn = effects["precipitation"].output.liquids["b"].rgba
    assert tuple(drawn[0]) == COLOURS["colourless"] and tuple(drawn[-1]) == COLOURS["white"]


def test_below_the_product_everything_stays_dissolved():
    effects = run(silver=1e-6, salt=1e-6)
    assert effects["precipitation"].events == () and effects["precipitation"].series["b/AgCl"].values[-1] == 0.0


def test_upright_nothing_is_solved():
    run_ = run(degrees=(0.0, 0.0))["precipitation"]
    assert run_.frames_run == 0 and run_.counters == {} and run_.events == ()


def test_ions_that_do_not_go_into_the_formula_have_to_be_told():
    half = ("reaction", {"equation": "BaCl2 + 2 AgNO3 -> 2 AgCl + BaN2O6"})
    bodies = (glass("a", 60.0, solute="AgNO3", molar=0.1), glass("b", 40.0, solute="BaCl2", molar=0.05))
    with pytest.raises(EffectError, match=r"gives 0\.5 ions per formula; say under ions"):
        poured((0.0, 60.0), bodies, MIX_precipitation, half, ("precipitation", FALLS))
    told = poured((0.0, 60.0), bodies, MIX_precipitation, half, ("precipitation", {**FALLS, "ions": {"BaCl2": 2}}))
    moles = 0.1e-3 * told["pour"].events[0].values["volume_ml"]
    assert told["precipitation"].events[0].values["moles"] == pytest.approx(moles, rel=1e-4)


def test_a_colour_nobody_knows_is_refused():
    with pytest.raises(PlanError, match="colour is 'whitish'"):
        run(colour="whitish")


TEST = {
    "flame": "lamp", "base": [0.0, 0.1, 0.0], "flame_radius": 0.01, "flame_height": 0.05, "wire": "wire",
    "tip": [0.0, -0.1, 0.0], "seconds": 1.0, "colours": {"NaCl": "yellow"}, "vessels": ["b"], "dips": {"b": "NaCl"},
}  # fmt: skip
AWAY, DIP, FLAME = (1.0, 1.0, 0.0), (0.5, 0.005, 0.0), (0.0, 0.11, 0.0)


def run_flame_test(places, valid=None, **more):
    """The wire's tip is at these places, 50 ms each."""
    wire = np.asarray(places, dtype=np.float64) + np.array([0.0, 0.1, 0.0])
    count = len(wire)
    poses = {"wire": (wire, still(count)[1]), "lamp": still(count), "b": still(count, (0.5, 0.0, 0.0))}
    bodies = (SceneBody("wire"), SceneBody("lamp"), glass("b", 20.0, solute="NaCl", molar=1.0))
    seen = None if valid is None else {"wire": np.asarray(valid, dtype=bool)}
    return compute(world(poses, bodies, ("flame-test", {**TEST, **more}), valid=seen, step_ns=50_000_000)).effects[
        "flame-test"
    ]


def visit(frames, before=DIP):
    return [AWAY] * 3 + [before] * 4 + [AWAY] * 3 + [FLAME] * frames + [AWAY] * 3


def test_a_salt_that_stays_shows_its_colour():
    run_ = run_flame_test(visit(20))
    dip, flame = run_.events
    assert (dip.name, dip.time, dip.end, dip.values["salt"]) == (
        "dip",
        pytest.approx(0.15),
        pytest.approx(0.35),
        "NaCl",
    )
    assert flame.values["seen"] == "yellow" and flame.values["seconds"] == pytest.approx(1.0)
    assert flame.message == "NaCl in the flame for 1.0 s: yellow"
    assert flame.bodies == ("wire", "lamp") and run_.frames_run == 24
    assert [span.word for span in run_.output.lanes["wire"]] == ["in b", "yellow"]


def test_too_short_a_visit_shows_none_and_neither_does_a_clean_wire():
    assert run_flame_test(visit(19)).events[-1].values["seen"] == ""
    (flame,) = run_flame_test(visit(30, AWAY)).events
    assert flame.values["salt"] == "" and flame.values["seen"] == ""


def test_one_frame_in_the_flame_is_noise_and_a_loss_inside_does_not_end_the_visit():
    assert [event.name for event in run_flame_test(visit(1)).events] == ["dip"]
    valid = np.ones(len(visit(30)), dtype=bool)
    valid[15:20] = False
    assert run_flame_test(visit(30), valid).events[-1].values["seconds"] == pytest.approx(1.5)


@pytest.mark.parametrize(
    ("place", "inside"),
    [((0.0099, 0.1, 0.0), True), ((0.0101, 0.1, 0.0), False), ((0.0, 0.149, 0.0), True), ((0.0, 0.151, 0.0), False),
     ((0.0051, 0.125, 0.0), False), ((0.0049, 0.125, 0.0), True), ((0.0, 0.0999, 0.0), False)],
)  # fmt: skip
def test_the_flame_is_a_cone_on_its_foot(place, inside):
    assert bool(run_flame_test([AWAY] * 3 + [place] * 5 + [AWAY] * 3).events) == inside


def test_over_the_level_or_beside_the_glass_the_wire_stays_dry():
    level = 20e-6 / (np.pi * 0.02**2)
    for place in ((0.5, level + 1e-4, 0.0), (0.53, 0.005, 0.0)):
        assert run_flame_test([AWAY] * 3 + [place] * 5).events == ()
    assert len(run_flame_test([AWAY] * 3 + [(0.5, level - 1e-4, 0.0)] * 5).events) == 1


def test_far_from_both_nothing_runs():
    assert run_flame_test([AWAY] * 10).frames_run == 0


def test_salts_and_vessels_go_together():
    with pytest.raises(PlanError, match="dips: 'c' is none of the vessels"):
        run_flame_test([AWAY] * 3, dips={"c": "NaCl"})
    with pytest.raises(PlanError, match="which salt is in 'b'"):
        run_flame_test([AWAY] * 3, dips={})
