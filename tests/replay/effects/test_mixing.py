import pytest
from support.liquid_worlds import MIX, glass, poured, run_in

from replay.effects.contents import WATER_MOLAR, contents_of
from replay.effects.vessels import Vessel
from replay.errors import EffectError, PlanError


def test_concentrations_follow_what_is_poured():
    bodies = (glass("a", 60.0, solute="HCl", molar=0.2), glass("b", 40.0, solute="NaCl", molar=0.1))
    effects = poured([0.0, 60.0, 60.0, 0.0], bodies, ("mixing", {"in": ["b"]}))
    series, moved = effects["mixing"].series, effects["pour"].events[0].values["volume_ml"]
    assert series["b/volume"].values[-1] == pytest.approx(40.0 + moved, rel=1e-9)
    assert series["b/HCl as brought"].values[-1] == pytest.approx(0.2 * moved / (40.0 + moved), rel=1e-9)
    assert series["b/NaCl as brought"].values[[0, -1]] == pytest.approx([0.1, 4.0 / (40.0 + moved)], rel=1e-9)
    assert effects["mixing"].frames_run == 2 and set(series) == {"b/volume", "b/HCl as brought", "b/NaCl as brought"}


def test_water_is_counted_where_it_is_pure_or_told():
    assert contents_of(Vessel(glass("a", 100.0))).amounts == {"H2O": pytest.approx(0.1 * WATER_MOLAR)}
    assert contents_of(Vessel(glass("a", 100.0, solute="HCl", molar=1.0))).amounts == {"HCl": pytest.approx(0.1)}
    told = glass("a", 100.0, solute="H2SO4", molar=18.0, water_molar=4.0)
    assert contents_of(Vessel(told)).amounts == {"H2SO4": pytest.approx(1.8), "H2O": pytest.approx(0.4)}


@pytest.mark.parametrize("molar", [-1.0, None, "strong", float("nan")])
def test_a_concentration_that_cannot_be_is_named(molar):
    with pytest.raises(EffectError, match=r"'a' has liquid\.molar"):
        contents_of(Vessel(glass("a", 1.0, solute="HCl", molar=molar)))


def test_what_is_no_vessel_and_a_liquid_without_a_volume_are_refused_before_the_run():
    with pytest.raises(PlanError, match="body 'tap' has no cavity"):
        run_in([0.0, 0.0], ("mixing", {"in": ["tap"]}))
    acid = glass("flask", solute="HCl", molar=0.1)
    del acid.extra["properties"]["liquid"]["volume_ml"]
    with pytest.raises(PlanError, match=r"body 'flask' has liquid\.volume_ml = None; give a finite number"):
        run_in([0.0, 0.0], MIX, acid=acid)
