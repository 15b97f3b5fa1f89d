import pytest
from support.liquid_worlds import glass, poured

from replay.effects.contents import WATER_MOLAR, contents_of
from replay.effects.vessels import Vessel


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
