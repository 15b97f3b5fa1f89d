import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from replay.effects.fitting import SETTLE_S, fit_parabola, rows_before, settled_runs, velocities

# Seconds of frames at 90 Hz, some of which come early, late or not at all.
UNEVEN = np.cumsum(np.array([0.0, 0.011, 0.005, 0.02, 0.011, 0.003, 0.03, 0.011, 0.011, 0.009, 0.011, 0.014]))
EVERY_FRAME = np.arange(len(UNEVEN))


@given(st.lists(st.floats(-50, 50), min_size=3, max_size=3), st.floats(0.0, 1e4))
def test_parabola_fit_recovers_position_and_velocity(coefficients, zero):
    """Points lie on a + b u + c u^2, seconds u from the last; the fit is that, the velocity b + 2 c u."""
    a, b, c = coefficients
    u = UNEVEN - UNEVEN[-1]
    points = (a + b * u + c * u * u)[:, None]
    fit, before = fit_parabola(UNEVEN + zero, points), -0.01
    assert fit.misfit < 1e-9 and fit.position(fit.at)[0] == pytest.approx(a, abs=1e-7)
    assert fit.velocity(fit.at + before)[0] == pytest.approx(b + 2.0 * c * before, abs=1e-4)
    single_run = np.zeros(len(UNEVEN), dtype=np.int64)
    fitted_velocities = velocities(UNEVEN, points, single_run, EVERY_FRAME)
    assert np.allclose(fitted_velocities[:, 0], b + 2.0 * c * u, atol=1e-6)


def test_no_velocity_is_fitted_across_a_gap():
    """A body rests at 0 for four frames, too few for a fit, and at 5 m after the gap, where its velocity is 0.

    A fit takes at most nine frames of a run, and none where it has fewer than five so far, or has no pose (-1).
    """
    runs = np.array([0] * 4 + [1] * 8)
    fitted_velocities = velocities(UNEVEN, np.where(runs == 0, 0.0, 5.0)[:, None], runs, EVERY_FRAME)
    assert np.isnan(fitted_velocities[:4]).all() and np.allclose(fitted_velocities[4:], 0.0)
    runs = np.array([0] * 10 + [1] * 12 + [-1])
    samples = [rows_before(runs, frame).tolist() for frame in (9, 15, 13, 22)]
    assert samples == [[*range(1, 10)], [*range(10, 16)], [], []]


def test_after_a_loss_the_fit_drifts_at_first():
    """Frames are ``SETTLE_S`` apart: of the run after the loss only the first is left out, as still drifting."""
    linked = np.array([False, True, True, False, True, True])
    assert settled_runs(np.arange(6) * SETTLE_S, linked | True, linked).tolist() == [1, 1, 1, -1, 2, 2]
