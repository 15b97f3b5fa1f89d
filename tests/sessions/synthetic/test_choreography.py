import numpy as np
import pytest

from sessions.geometry.rotations import quaternion_about
from sessions.synthetic.choreography import REACH_SPEED, Buttons, Script

TIMES = np.linspace(0.0, 5.0, 5001)


def test_steps_follow_each_other_in_time_and_place():
    script = Script((0.0, 1.0, 0.0))
    script.wait(0.5)
    script.go((0.3, 1.0, 0.0), 1.0)
    script.wait_until(1.0)
    assert script.now == 1.5
    script.wait_until(3.0)
    assert (script.now, script.position) == (3.0, (0.3, 1.0, 0.0))
    position, _ = script.path()(np.array([0.2, 1.0, 2.0, 9.0]))
    np.testing.assert_allclose(position[:, 0], [0.0, 0.15, 0.3, 0.3])


def test_a_reach_without_a_duration_takes_an_unhurried_persons_time():
    script = Script((0.0, 1.0, 0.0), pace=2.0)
    script.go((0.9, 1.0, 0.0))
    assert script.now == pytest.approx(2.0 * 0.9 / REACH_SPEED)


def test_over_stays_above_what_stands_between():
    script = Script((0.0, 1.0, 0.2))
    script.over((0.5, 1.05, -0.1), 1.3)
    position, _ = script.path()(np.linspace(0.0, script.now, 500))
    moving = (position[:, 0] > 0.001) & (position[:, 0] < 0.499)
    assert moving.any() and position[moving, 1].min() > 1.3 - 1e-9
    assert script.position == (0.5, 1.05, -0.1)


def test_a_tap_goes_deepest_at_its_centre_without_tremor():
    script = Script((0.0, 1.0, 0.0))
    script.wait(1.0)
    script.tap(2.0, 0.4, (0.0, 0.0, -1.0), 0.03)
    assert script.now == pytest.approx(2.2)
    times = np.linspace(1.81, 2.19, 2001)
    position, _ = script.path(np.random.default_rng(0))(times)
    assert times[position[:, 2].argmin()] == pytest.approx(2.0, abs=1e-3)
    assert position[:, 2].min() == pytest.approx(-0.03, abs=1e-9)
    assert (position[:, 0] == 0.0).all()
    with pytest.raises(ValueError, match="plant it later"):
        script.tap(2.3, 0.4, (1.0, 0.0, 0.0), 0.01)


def test_turning_is_blended_with_the_reach():
    script = Script((0.0, 1.0, 0.0))
    script.go((0.1, 1.0, 0.0), 1.0, quaternion=quaternion_about((0.0, 0.0, 1.0), 1.2))
    _, quaternion = script.path()(np.array([0.5]))
    np.testing.assert_allclose(quaternion[0], quaternion_about((0.0, 0.0, 1.0), 0.6), atol=1e-12)


def test_the_trigger_passes_the_grasp_level_at_the_grasp_and_the_release_level_at_the_release():
    buttons = Buttons()
    buttons.hold("left", 1.0, 3.0)
    value = buttons.trigger("left", TIMES)
    assert TIMES[np.argmax(value > 0.6)] == pytest.approx(1.0, abs=2e-3)
    after = TIMES > 2.0
    assert TIMES[after][np.argmax(value[after] < 0.4)] == pytest.approx(3.0, abs=2e-3)
    assert value.max() == 1.0 and value[0] == value[-1] == 0.0
    assert np.abs(np.diff(value)).max() < 0.02
    assert (buttons.trigger("right", TIMES) == 0.0).all()


def test_two_holds_are_two_presses():
    buttons = Buttons()
    buttons.hold("right", 1.0, 2.0)
    buttons.hold("right", 3.0, 4.0)
    value = buttons.trigger("right", TIMES)
    assert ((value[1:] > 0.6) & (value[:-1] <= 0.6)).sum() == 2


def test_controllers_report_eight_bits_on_the_sessions_stamps():
    buttons = Buttons()
    buttons.hold("right", 0.5, 1.0)
    stamps = 10**18 + np.arange(200) * 11_111_111
    hands = buttons.tracks(stamps)
    assert set(hands) == {"student/left", "student/right"}
    scaled = hands["student/right"].trigger * 255.0
    np.testing.assert_allclose(scaled, np.round(scaled), atol=1e-9)
    assert (hands["student/right"].grip <= hands["student/right"].trigger).all()
