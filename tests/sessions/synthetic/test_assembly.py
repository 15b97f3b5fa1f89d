import numpy as np
import pytest

from sessions.errors import SessionError
from sessions.geometry.rotations import quaternion_about
from sessions.synthetic.assembly import CLOCKS, START_NS, Recording, recorded, stamps
from sessions.synthetic.choreography import REACH_SPEED, Buttons, Script
from sessions.synthetic.paths import Key, KeyPath, still

PATHS = {
    "a": still((0.0, 1.0, 0.0)),
    "b": KeyPath([Key(0.0, (0.0, 0.0, 0.0)), Key(5.0, (1.0, 0.0, 0.0), ease="linear")]),
}


def test_without_noise_the_recorded_poses_are_the_path():
    seen = recorded(PATHS, Recording(seconds=5.0))
    position, _ = seen.poses["b"]
    np.testing.assert_allclose(position[:, 0], seen.stamps * 1e-9 / 5.0, atol=1e-12)
    assert seen.valid["b"].all() and seen.facts == ()


def test_noise_comes_late_and_a_bodys_noise_does_not_depend_on_others():
    how = Recording(seconds=5.0, noise="vive", losses="off", seed=4)
    both, alone = recorded(PATHS, how), recorded({"b": PATHS["b"]}, how)
    np.testing.assert_array_equal(both.poses["b"][0], alone.poses["b"][0])
    lag = both.poses["b"][0][20:, 0] - (both.stamps[20:] * 1e-9 - 0.022) / 5.0
    assert np.abs(lag).max() < 0.001


def test_losses_become_facts_and_spare_what_is_kept():
    hows = [Recording(seconds=60.0, noise="vive", seed=seed) for seed in range(20)]
    facts = [fact for how in hows for fact in recorded(PATHS, how, keep={"a": [(0.0, 60.0)]}).facts]
    assert facts and all(fact.kind == "loss" and fact.bodies == ("b",) for fact in facts)


def test_tracks_carry_absolute_stamps():
    seen = recorded(PATHS, Recording(seconds=1.0))
    tracks = seen.tracks({"prop": seen.poses["a"]})
    assert list(tracks) == ["a", "b", "prop"]
    assert tracks["prop"].times_ns[0] == START_NS


@pytest.mark.parametrize("wrong", [{"noise": "loud"}, {"jitter": "odd"}, {"losses": "many"}, {"rate_hz": -1.0}])
def test_what_cannot_be_is_refused_by_name(wrong):
    with pytest.raises(SessionError, match=str(next(iter(wrong)))):
        Recording(**wrong)


def make(name, seconds=30.0, seed=0):
    return stamps(seconds, 90.0, CLOCKS[name], np.random.default_rng(seed))


def test_even_stamps_lie_on_the_rate_to_a_nanosecond():
    times = make("even", 2.0)
    assert len(times) == 181
    np.testing.assert_array_equal(times, np.rint(np.arange(181) * 1e9 / 90.0))


@pytest.mark.parametrize("name", CLOCKS)
@pytest.mark.parametrize("seed", range(5))
def test_stamps_start_at_zero_increase_and_end_in_time(name, seed):
    times = make(name, seed=seed)
    steps = np.diff(times) * 1e-9
    assert times[0] == 0
    assert times[-1] <= 30e9
    assert steps.min() >= 0.0023 - 1e-9
    assert steps.max() <= 0.128 + 1e-9


def test_browser_stamps_have_the_gaps_of_real_recordings():
    # Three A-Frame recordings: 59 of 1,126, 114 of 2,567 and 121 of 1,435 steps above 1.5 medians; median 11.2-11.3 ms;
    # standard deviation 2.9-4.9 ms.
    for seed in range(5):
        steps = np.diff(make("browser", seed=seed)) * 1e-6
        gaps = (steps > 1.5 * np.median(steps)).mean()
        assert 0.03 < gaps < 0.10
        assert 10.9 < np.median(steps) < 11.5
        assert 2.5 < steps.std() < 5.5


def test_impossible_rates_are_refused():
    with pytest.raises(ValueError, match="positive"):
        stamps(0.0, 90.0, CLOCKS["even"], np.random.default_rng(0))
    with pytest.raises(ValueError, match="lower the rate"):
        stamps(1.0, 1000.0, CLOCKS["steady"], np.random.default_rng(0))


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
