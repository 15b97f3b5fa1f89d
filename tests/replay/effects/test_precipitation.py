import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.liquid_worlds import glass, poured

from replay.effects.precipitation import amount_fallen
from replay.effects.vessels import COLOURS
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


KSP = 1.77e-10


def fallen(first, second, litres=1.0, ksp=KSP, powers=(1, 1)):
    arrays = [np.atleast_1d(np.asarray(one, dtype=float)) for one in (first, second, litres)]
    return amount_fallen({"A": arrays[0], "B": arrays[1]}, {"A": powers[0], "B": powers[1]}, arrays[2], ksp)


@given(st.floats(1e-6, 1.0), st.floats(1e-6, 1.0))
def test_one_to_one_solves_its_quadratic(first, second):
    x = fallen(first, second)[0]
    if first * second <= KSP:
        assert x == 0.0
    else:
        # The smaller root of (a - x)(b - x) = K in the form that adds.
        total = first + second
        root = np.sqrt((first - second) ** 2 + 4 * KSP)
        assert x == pytest.approx(2 * (first * second - KSP) / (total + root), rel=1e-9, abs=1e-18)


@given(st.floats(1e-9, 1.0), st.floats(1e-9, 1.0), st.floats(1e-3, 10.0))
def test_two_to_one_ends_at_its_product_and_dissolves_nothing_that_was_not_there(first, second, litres):
    x = fallen(first, second, litres, 1e-12, (2, 1))[0]
    assert 0.0 <= x <= min(first / 2, second)
    left = ((first - 2 * x) / litres) ** 2 * (second - x) / litres
    scarce = min(first - 2 * x, second - x)
    if x > 0.0 and scarce > 1e-9 * max(first, second):
        assert left == pytest.approx(1e-12, rel=1e-5)
    elif x == 0.0:
        assert left <= 1e-12 * (1 + 1e-9)


def test_just_below_the_product_nothing_falls_and_just_above_something():
    edge = np.sqrt(KSP)
    assert fallen(edge * (1 - 1e-9), edge)[0] == 0.0 and fallen(edge * (1 + 1e-6), edge)[0] > 0.0


def test_equal_amounts_leave_the_root_of_the_product():
    assert 1.0 - fallen(1.0, 1.0)[0] == pytest.approx(np.sqrt(KSP), rel=1e-9)


def test_without_one_ion_or_without_liquid_nothing_falls():
    assert fallen([0.0, 1.0, 1.0], [1.0, 0.0, 1.0], [1.0, 1.0, 0.0]).tolist() == [0.0, 0.0, 0.0]


def test_more_of_either_ion_never_makes_less_solid():
    more = fallen(np.linspace(0.0, 0.1, 200), np.full(200, 0.05), np.full(200, 1.0))
    assert (np.diff(more) >= 0.0).all() and more[-1] == pytest.approx(0.05, rel=1e-6)
