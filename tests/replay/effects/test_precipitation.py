import pytest
from support.liquid_worlds import glass, poured

from replay.effects.models.colours import COLOURS
from replay.errors import EffectError, PlanError

MIX = ("mixing", {"in": ["b"]})
SILVER = ("reaction", {"equation": "AgNO3 + NaCl -> AgCl + NaNO3"})
FALLS = {"solid": "AgCl", "ksp": 1.77e-10, "molar_mass": 143.32, "colour": "white"}


def run(silver=0.1, salt=0.1, degrees=(0.0, 60.0, 60.0), reaction=SILVER, **more):
    bodies = (glass("a", 60.0, solute="AgNO3", molar=silver), glass("b", 40.0, solute="NaCl", molar=salt))
    return poured(degrees, bodies, MIX, reaction, ("precipitation", {**FALLS, **more}))


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
        poured((0.0, 60.0), bodies, MIX, half, ("precipitation", FALLS))
    told = poured((0.0, 60.0), bodies, MIX, half, ("precipitation", {**FALLS, "ions": {"BaCl2": 2}}))
    moles = 0.1e-3 * told["pour"].events[0].values["volume_ml"]
    assert told["precipitation"].events[0].values["moles"] == pytest.approx(moles, rel=1e-4)


def test_a_colour_nobody_knows_is_refused():
    with pytest.raises(PlanError, match="colour is 'whitish'"):
        run(colour="whitish")
