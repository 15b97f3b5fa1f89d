from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from sessions.synthetic.experiments.outlet import GRAVITY, Outlet, Turn

TURNS = (Turn(2.0, 3.0, 0.0, 0.7), Turn(40.0, 41.5, 0.7, 0.12), Turn(80.0, 80.5, 0.12, 0.0))
OUTLET = Outlet(6e-7, 0.6, 9.5e-5, 0.67, TURNS)


def flow(times):
    """Delivered volume by adding up Torricelli's law in small steps."""
    head, delivered = OUTLET.head, [0.0]
    for a, b in itertools.pairwise(times):
        middle = 0.5 * (a + b)
        angle = next((turn.angle(middle) for turn in reversed(TURNS) if middle >= turn.start), 0.0)
        area = OUTLET.full_area * angle / (math.pi / 2.0)
        step = OUTLET.discharge * area * math.sqrt(2.0 * GRAVITY * head) * (b - a)
        head -= step / OUTLET.section
        delivered.append(delivered[-1] + step)
    return np.array(delivered)


def test_the_volume_is_what_torricelli_adds_up_to():
    times = np.linspace(0.0, 100.0, 100_001)
    summed = flow(times)
    for k in (0, 1500, 2500, 20_000, 40_700, 60_000, 80_200, 100_000):
        assert OUTLET.volume(float(times[k])) == pytest.approx(summed[k], rel=1e-4, abs=1e-12)


def test_nothing_runs_before_it_is_opened_and_after_it_is_closed():
    assert OUTLET.volume(2.0) == 0.0
    assert OUTLET.volume(80.5) == OUTLET.volume(500.0)
    assert (np.diff([OUTLET.volume(t) for t in np.linspace(2.01, 80.4, 500)]) > 0.0).all()


def test_the_time_of_a_volume_is_the_inverse():
    for volume in (1e-6, 2e-5, 2.3e-5):
        assert OUTLET.volume(OUTLET.time_of(volume, 90.0)) == pytest.approx(volume, rel=1e-12)
    with pytest.raises(ValueError, match="open it more"):
        OUTLET.time_of(1.0, 90.0)


def test_a_turn_sweeps_the_integral_of_its_angle():
    turn = TURNS[1]
    times = np.linspace(turn.start, turn.end, 20_001)
    angles = np.array([turn.angle(t) for t in times])
    summed = np.concatenate([[0.0], np.cumsum((angles[1:] + angles[:-1]) / 2.0 * np.diff(times))])
    assert [turn.swept(t) for t in times[::2500]] == pytest.approx(summed[::2500].tolist(), abs=1e-8)
    assert turn.swept(99.0) == pytest.approx(summed[-1], abs=1e-8)
