import pytest
from support.liquid_worlds import RADIUS, poured

from replay.errors import EffectError

SPILL = ("spill", {"from": ["a"]})


def test_what_misses_is_spilled_where_it_lands_and_is_all_that_was_lost():
    effects = poured([0.0, 0.0, 60.0, 60.0, 60.0, 0.0], None, SPILL, place=(3 * RADIUS, -0.1, 0.0))
    (event,) = effects["spill"].events
    assert event.level == "warning" and event.bodies == ("a",) and event.time == pytest.approx(0.03)
    assert event.point[1] == pytest.approx(-0.1)
    left = effects["pour"].series["a/volume"].values[-1]
    assert event.values["volume_ml"] == pytest.approx(60.0 - left, rel=1e-9)
    lost = effects["spill"].series["spilled/volume"]
    assert lost.values[0] == 0.0 and lost.values[-1] == pytest.approx(60.0 - left, rel=1e-9)
    assert effects["pour"].events == () and effects["spill"].frames_run == 1


def test_what_is_caught_is_no_spill():
    effects = poured([0.0, 60.0, 60.0, 0.0], None, SPILL)
    assert effects["spill"].events == () and effects["spill"].frames_run == 0
    assert effects["spill"].series["spilled/volume"].values.tolist() == [0.0, 0.0]


def test_a_drop_is_booked_and_is_no_event():
    effects = poured([0.0, 52.0, 52.0], None, SPILL, place=(3 * RADIUS, 0.0, 0.0))
    lost = effects["spill"].series["spilled/volume"].values[-1]
    again = poured([0.0, 52.0, 52.0], None, ("spill", {"from": ["a"], "least_ml": lost + 1}), place=(3 * RADIUS, 0, 0))
    assert lost > 0.0 and again["spill"].events == () and again["spill"].series["spilled/volume"].values[-1] == lost


def test_a_vessel_that_no_pour_speaks_of_is_refused():
    with pytest.raises(EffectError, match="'b' is no vessel of an effect pour"):
        poured([0.0, 60.0], None, ("spill", {"from": ["b"]}), settings={"into": ["c"]}, third=True)
