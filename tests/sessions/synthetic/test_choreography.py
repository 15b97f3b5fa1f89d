from __future__ import annotations

import numpy as np
import pytest

from sessions.synthetic.choreography import REACH_SPEED, Script
from sessions.synthetic.rotations import quaternion_about


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
