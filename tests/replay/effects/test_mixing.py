import numpy as np
import pytest
from support.liquid_worlds import MIX, NEUTRAL, glass, poured, run_in

from replay.effects.mixing import WATER_MOLAR, contents_of
from replay.effects.models.colours import COLOURS
from replay.effects.vessels import Vessel
from replay.errors import EffectError, PlanError
from sessions.model.scene import SceneBody


def test_concentrations_follow_what_is_poured():
    bodies = (glass("a", 60.0, solute="HCl", molar=0.2), glass("b", 40.0, solute="NaCl", molar=0.1))
    effects = poured([0.0, 60.0, 60.0, 0.0], bodies, ("mixing", {"in": ["b"]}))
    series, moved = effects["mixing"].series, effects["pour"].events[0].values["volume_ml"]
    assert series["b/volume"].values[-1] == pytest.approx(40.0 + moved, rel=1e-9)
    assert series["b/HCl as brought"].values[-1] == pytest.approx(0.2 * moved / (40.0 + moved), rel=1e-9)
    assert series["b/NaCl as brought"].values[[0, -1]] == pytest.approx([0.1, 4.0 / (40.0 + moved)], rel=1e-9)
    assert effects["mixing"].frames_run == 1 and "a/volume" not in series


def test_without_anything_that_moves_liquid_it_tells_what_stands_there():
    run = run_in([0.0, 0.0], MIX)["mixing"]
    assert run.frames_run == 0 and run.series["flask/volume"].values.tolist() == [0.5, 0.5]


def test_an_empty_vessel_has_no_concentration():
    bodies = (glass("a", 60.0, solute="HCl", molar=0.2), glass("b", 0.0))
    brought = poured([0.0, 0.0, 60.0], bodies, ("mixing", {"in": ["b"]}))["mixing"].series["b/HCl as brought"].values
    assert np.isnan(brought[0]) and brought[-1] == pytest.approx(0.2, rel=1e-12)


def test_water_is_counted_where_it_is_pure_or_told():
    assert contents_of(Vessel(glass("a", 100.0))).amounts == {"H2O": pytest.approx(0.1 * WATER_MOLAR)}
    assert contents_of(Vessel(glass("a", 100.0, solute="HCl", molar=1.0))).amounts == {"HCl": pytest.approx(0.1)}
    told = glass("a", 100.0, solute="H2SO4", molar=18.0, water_molar=4.0)
    assert contents_of(Vessel(told)).amounts == {"H2SO4": pytest.approx(1.8), "H2O": pytest.approx(0.4)}


def test_a_solid_is_its_mass_over_its_molar_mass():
    body = glass("a")
    body.extra["properties"]["solid"] = {"formula": "Zn", "mass_g": 0.5, "molar_mass": 65.38}
    assert contents_of(Vessel(body)).solids == {"Zn": pytest.approx(0.5 / 65.38)}
    body.extra["properties"]["solid"]["molar_mass"] = 0.0
    with pytest.raises(EffectError, match="molar_mass = 0"):
        contents_of(Vessel(body))


@pytest.mark.parametrize("molar", [-1.0, None, "strong", float("nan")])
def test_a_concentration_that_cannot_be_is_named(molar):
    with pytest.raises(EffectError, match=r"'a' has liquid\.molar"):
        contents_of(Vessel(glass("a", 1.0, solute="HCl", molar=molar)))


def test_a_body_that_holds_nothing_may_have_no_properties():
    cavity = glass("a").extra["cavity"]
    assert contents_of(Vessel(SceneBody("a", extra={"cavity": cavity}))).volume_ml == 0.0


def test_a_titration_says_the_same_to_the_byte_with_every_other_effect_removed(monkeypatch):
    from support.liquid_worlds import NEUTRAL

    from replay.effects import EFFECTS

    def digests():
        return {kind: run.output.digest for kind, run in run_in([0.0, *([90.0] * 60), 0.0], MIX, NEUTRAL).items()}

    whole = digests()
    assert set(whole) == {"burette", "mixing", "reaction"}
    for kind in set(EFFECTS) - set(whole):
        monkeypatch.delitem(EFFECTS, kind)
    assert digests() == whole


PINK = {
    "in": "flask", "indicator": "phenolphthalein", "from_ph": 8.2, "to_ph": 10.0, "acid_colour": "colourless",
    "base_colour": "pink",
}  # fmt: skip
OPEN = [0.0, 0.0, *([90.0] * 100), 0.0, 0.0]


def run(degrees=OPEN, acid=None, **more):
    return run_in(degrees, MIX, NEUTRAL, ("colour", {**PINK, **more}), acid=acid)["colour"]


def test_it_turns_once_from_acid_to_base_and_so_does_the_glass():
    run_ = run()
    (event,) = run_.events
    assert event.name == "colour-change" and event.values["to"] == "pink" and event.end >= event.time
    shade = run_.output.liquids["flask"].rgba
    assert tuple(shade[0]) == COLOURS["colourless"] and tuple(shade[-1]) == COLOURS["pink"]
    assert [span.word for span in run_.output.lanes["flask"]][::2][0] == "colourless"
    assert run_.series["flask/phenolphthalein"].values[[0, -1]].tolist() == [0.0, 1.0]


def test_a_range_that_the_ph_passes_backwards_turns_backwards():
    backwards = run_in(
        OPEN, MIX, NEUTRAL, ("colour", PINK),
        base=glass("burette", 50.0, solute="HCl", molar=0.1, cavity={"capacity_ml": 50.0, "floor": 0.15, "mark": 0.65}),
        acid=glass("flask", 0.5, solute="NaOH", molar=0.1),
    )["colour"]  # fmt: skip
    assert [event.values["to"] for event in backwards.events] == ["colourless"]


def test_stopping_inside_the_range_is_a_change_that_does_not_end():
    run_ = run(from_ph=2.0, to_ph=14.0)
    assert [(event.end, event.values["to"]) for event in run_.events] == [(None, "pink")]


def test_short_of_the_range_nothing_changes():
    run_ = run([0.0, 10.0, 0.0])
    assert run_.events == () and np.all(run_.series["flask/phenolphthalein"].values == 0.0)


def test_a_vessel_without_a_ph_and_a_range_that_falls_are_refused():
    with pytest.raises(EffectError, match="gives 'flask' a pH"):
        run(acid=glass("flask", 0.5, solute="NaCl", molar=0.1))
    with pytest.raises(PlanError, match="from_ph is not below to_ph"):
        run(from_ph=10.0, to_ph=8.2)


MIX_dilution = ("mixing", {"in": ["b"]})
HEAT = {
    "of": "dilution", "solute": "H2SO4", "ambient_c": 20.0, "loss_w_per_k": 0.0, "heat_j_mol": 74000.0,
    "half_water": 1.8, "heat_capacity_j_per_ml_k": 4.0,
}  # fmt: skip
TILT = [0.0, 60.0, 60.0, 0.0]


def acid(name, volume):
    return glass(name, volume, solute="H2SO4", molar=18.0, water_molar=4.1)


def run_dilution(bodies, degrees=TILT, **more):
    return poured(degrees, bodies, MIX_dilution, ("heat", {**HEAT, **more}))


def test_acid_into_water_gives_off_what_the_formula_says_and_is_the_right_order():
    effects = run_dilution((acid("a", 60.0), glass("b", 60.0)))
    moved = effects["pour"].events[0].values["volume_ml"]
    h2so4, water = 0.018 * moved, 0.0041 * moved + 0.060 * WATER_MOLAR
    given = 74000.0 * h2so4 * (water / (water + 1.8 * h2so4) - 4.1 / (4.1 + 1.8 * 18.0))
    told = effects["heat"].series["b/temperature"].values
    assert told[-1] == pytest.approx(20.0 + given / (4.0 * (60.0 + moved)), rel=1e-9)
    assert effects["heat"].events == () and effects["heat"].frames_run == 3


def test_water_into_acid_is_the_wrong_order_and_just_as_warm():
    effects = run_dilution((glass("a", 60.0), acid("b", 60.0)))
    (event,) = effects["heat"].events
    assert event.name == "wrong-order" and event.level == "error" and event.bodies == ("a", "b")
    assert event.time == pytest.approx(0.01)
    assert event.values["volume_ml"] == pytest.approx(effects["pour"].events[0].values["volume_ml"], rel=1e-9)
    assert effects["heat"].series["b/temperature"].values[-1] > 25.0


def test_water_into_water_and_acid_into_the_same_acid_stay_as_warm_as_the_room():
    for bodies in ((glass("a", 60.0), glass("b", 60.0)), (acid("a", 60.0), acid("b", 60.0))):
        effects = run_dilution(bodies)
        assert effects["heat"].series["b/temperature"].values == pytest.approx(20.0, abs=1e-9)
        assert effects["heat"].events == ()


def test_into_an_empty_glass_it_brings_its_own_warmth_and_loses_it_to_the_room():
    effects = run_dilution((acid("a", 60.0), glass("b", 0.0)), loss_w_per_k=0.2)
    assert effects["heat"].series["b/temperature"].values == pytest.approx(20.0, abs=1e-9)
    warm = run_dilution((acid("a", 60.0), glass("b", 60.0)), [0.0, 60.0, *([0.0] * 500)], loss_w_per_k=20.0)
    told = warm["heat"].series["b/temperature"].values
    assert told[0] == told.max() and told[-1] < 0.8 * (told[0] - 20.0) + 20.0


def test_upright_nothing_is_computed():
    effects = run_dilution((acid("a", 60.0), glass("b", 60.0)), [0.0, 0.0])
    assert effects["heat"].frames_run == 0 and effects["heat"].series == {}


def test_boiling_is_named():
    events = run_dilution((glass("a", 60.0), acid("b", 60.0)), boils_c=25.0)["heat"].events
    assert sorted(event.name for event in events) == ["boil", "wrong-order"]


def test_an_acid_whose_water_nobody_tells_is_refused():
    with pytest.raises(EffectError, match="how much water is with the H2SO4"):
        run_dilution((glass("a", 60.0, solute="H2SO4", molar=18.0), glass("b", 0.0, solute="H2SO4", molar=1.0)))
