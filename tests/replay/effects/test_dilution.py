import pytest
from support.liquid_worlds import glass, poured

from replay.effects.mixing import WATER_MOLAR
from replay.errors import EffectError

MIX = ("mixing", {"in": ["b"]})
HEAT = {
    "of": "dilution", "solute": "H2SO4", "ambient_c": 20.0, "loss_w_per_k": 0.0, "heat_j_mol": 74000.0,
    "half_water": 1.8, "heat_capacity_j_per_ml_k": 4.0,
}  # fmt: skip
TILT = [0.0, 60.0, 60.0, 0.0]


def acid(name, volume):
    return glass(name, volume, solute="H2SO4", molar=18.0, water_molar=4.1)


def run(bodies, degrees=TILT, **more):
    return poured(degrees, bodies, MIX, ("heat", {**HEAT, **more}))


def test_acid_into_water_gives_off_what_the_formula_says_and_is_the_right_order():
    effects = run((acid("a", 60.0), glass("b", 60.0)))
    moved = effects["pour"].events[0].values["volume_ml"]
    h2so4, water = 0.018 * moved, 0.0041 * moved + 0.060 * WATER_MOLAR
    given = 74000.0 * h2so4 * (water / (water + 1.8 * h2so4) - 4.1 / (4.1 + 1.8 * 18.0))
    told = effects["heat"].series["b/temperature"].values
    assert told[-1] == pytest.approx(20.0 + given / (4.0 * (60.0 + moved)), rel=1e-9)
    assert effects["heat"].events == () and effects["heat"].frames_run == 3


def test_water_into_acid_is_the_wrong_order_and_just_as_warm():
    effects = run((glass("a", 60.0), acid("b", 60.0)))
    (event,) = effects["heat"].events
    assert event.name == "wrong-order" and event.level == "error" and event.bodies == ("a", "b")
    assert event.time == pytest.approx(0.01)
    assert event.values["volume_ml"] == pytest.approx(effects["pour"].events[0].values["volume_ml"], rel=1e-9)
    assert effects["heat"].series["b/temperature"].values[-1] > 25.0


def test_water_into_water_and_acid_into_the_same_acid_stay_as_warm_as_the_room():
    for bodies in ((glass("a", 60.0), glass("b", 60.0)), (acid("a", 60.0), acid("b", 60.0))):
        effects = run(bodies)
        assert effects["heat"].series["b/temperature"].values == pytest.approx(20.0, abs=1e-9)
        assert effects["heat"].events == ()


def test_into_an_empty_glass_it_brings_its_own_warmth_and_loses_it_to_the_room():
    effects = run((acid("a", 60.0), glass("b", 0.0)), loss_w_per_k=0.2)
    assert effects["heat"].series["b/temperature"].values == pytest.approx(20.0, abs=1e-9)
    warm = run((acid("a", 60.0), glass("b", 60.0)), [0.0, 60.0, *([0.0] * 500)], loss_w_per_k=20.0)
    told = warm["heat"].series["b/temperature"].values
    assert told[0] == told.max() and told[-1] < 0.8 * (told[0] - 20.0) + 20.0


def test_upright_nothing_is_computed():
    effects = run((acid("a", 60.0), glass("b", 60.0)), [0.0, 0.0])
    assert effects["heat"].frames_run == 0 and effects["heat"].series == {}


def test_boiling_is_named():
    events = run((glass("a", 60.0), acid("b", 60.0)), boils_c=25.0)["heat"].events
    assert sorted(event.name for event in events) == ["boil", "wrong-order"]


def test_an_acid_whose_water_nobody_tells_is_refused():
    with pytest.raises(EffectError, match="how much water is with the H2SO4"):
        run((glass("a", 60.0, solute="H2SO4", molar=18.0), glass("b", 0.0, solute="H2SO4", molar=1.0)))
