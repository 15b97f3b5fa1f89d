import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from replay.effects.fitting import SETTLE_S, before, fitted, settled_runs, velocities

UNEVEN = np.cumsum(np.array([0.0, 0.011, 0.005, 0.02, 0.011, 0.003, 0.03, 0.011, 0.011, 0.009, 0.011, 0.014]))


@given(st.lists(st.floats(-50, 50), min_size=3, max_size=3), st.floats(0.0, 1e4))
def test_a_parabola_on_uneven_stamps_is_found_again(coefficients, zero):
    a, b, c = coefficients
    u = UNEVEN - UNEVEN[-1]
    fit = fitted(UNEVEN + zero, (a + b * u + c * u * u)[:, None])
    assert fit.misfit < 1e-9 and fit.place(fit.at)[0] == pytest.approx(a, abs=1e-7)
    assert fit.velocity(fit.at - 0.01)[0] == pytest.approx(b - 0.02 * c, abs=1e-4)


def test_velocities_of_a_parabola_are_exact_at_every_frame_of_the_stretch():
    places = np.stack([3.0 * UNEVEN - 4.9 * UNEVEN**2, np.ones(12)], axis=1)
    found = velocities(UNEVEN, places, np.zeros(12, dtype=np.int64), np.arange(12))
    assert np.allclose(found[:, 0], 3.0 - 9.8 * UNEVEN, atol=1e-9) and np.allclose(found[:, 1], 0.0, atol=1e-12)


def test_no_velocity_is_taken_across_a_gap_or_from_four_samples():
    runs = np.array([0] * 4 + [1] * 8)
    places = np.where(runs == 0, 0.0, 5.0)[:, None]
    found = velocities(UNEVEN, places, runs, np.arange(12))
    assert np.isnan(found[:4]).all() and np.allclose(found[4:], 0.0)


def test_frames_without_a_pose_or_soon_after_a_loss_belong_to_no_stretch():
    times = np.arange(100) / 100
    valid = np.ones(100, dtype=np.bool_)
    valid[20:25] = False
    linked = valid.copy()
    linked[[0, 25]] = False
    runs = settled_runs(times, valid, linked)
    drifting = 25 + round(SETTLE_S * 100)
    assert (runs[:20] == runs[0]).all() and (runs[20:drifting] == -1).all() and runs[0] >= 0
    assert (runs[drifting:] == runs[-1]).all() and runs[-1] != runs[0] and runs[-1] >= 0


def test_the_samples_before_a_frame_are_the_last_nine_of_its_stretch_or_none():
    runs = np.array([0] * 10 + [1] * 12 + [-1])
    assert before(runs, 9).tolist() == list(range(1, 10))
    assert before(runs, 15).tolist() == list(range(10, 16))
    assert len(before(runs, 13)) == 0 and len(before(runs, 22)) == 0
