from __future__ import annotations

import numpy as np
import pytest

from sessions.geometry.rotations import IDENTITY, quaternion_about
from sessions.synthetic.experiments.pouring import GRAVITY
from sessions.synthetic.experiments.things import Falling, Held, Standing, placed_by

TIMES = np.linspace(0.0, 10.0, 1001)
TURN = tuple(quaternion_about((0.0, 1.0, 0.0), 1.2).tolist())
HANDS = {"hand-left": (np.stack([TIMES, np.ones(1001), np.zeros(1001)], axis=1), np.tile(TURN, (1001, 1)))}


def test_each_phase_lasts_until_the_next_begins():
    held, falls = Held("hand-left", (0.0, -0.1, 0.0), IDENTITY), Falling(6.0, (6.0, 0.9, 0.0), TURN, 0.5)
    phases = [(0.0, Standing((0.0, 0.9, 0.0), IDENTITY)), (2.0, held), (6.0, falls)]
    position, quaternion = placed_by(phases, TIMES, HANDS)
    assert (position[TIMES < 2.0] == (0.0, 0.9, 0.0)).all()
    held = (TIMES >= 2.0) & (TIMES < 6.0)
    np.testing.assert_allclose(position[held, 0], TIMES[held])
    np.testing.assert_allclose(position[held, 1], 0.9)
    np.testing.assert_allclose(quaternion[held], np.tile(TURN, (held.sum(), 1)))
    assert (position[-1] == (6.0, 0.5, 0.0)).all()


def test_a_fall_is_free_and_ends_on_the_floor():
    fall = Falling(1.0, (0.0, 1.4, 0.0), IDENTITY, 0.9)
    position, _ = fall(TIMES, {})
    y = position[:, 1]
    flying = (TIMES > 1.0) & (fall.time_at(0.9) - 0.02 > TIMES)
    assert np.diff(y[flying], 2) == pytest.approx(-GRAVITY * 0.01**2, rel=1e-6)
    assert fall.speed_at(0.9) == pytest.approx(np.sqrt(2.0 * GRAVITY * 0.5))
    assert fall.time_at(0.9) == pytest.approx(1.0 + fall.speed_at(0.9) / GRAVITY)
    assert (y[fall.time_at(0.9) < TIMES] == 0.9).all()
