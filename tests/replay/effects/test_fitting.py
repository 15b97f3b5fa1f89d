import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from replay.effects.fitting import SETTLE_S, fit_parabola, rows_before, settled_runs, velocities

# Seconds of frames at 90 Hz, some of which come early, late or not at all.
UNEVEN = np.cumsum(np.array([0.0, 0.011, 0.005, 0.02, 0.011, 0.003, 0.03, 0.011, 0.011, 0.009, 0.011, 0.014]))
EVERY_FRAME = np.arange(len(UNEVEN))


COEFFICIENTS = st.lists(st.floats(-50, 50), min_size=3, max_size=3)


@given(coefficients=COEFFICIENTS, first_s=st.floats(0.0, 1e4))
def test_parabola_fit_recovers_position_and_velocity(coefficients, first_s):
    """Points of 12 uneven frames from ``first_s`` on lie on a + b u + c u^2, u being seconds from the last frame.

    The fit is that parabola: position a at the last frame, velocity b + 2 c u.
    """
    a, b, c = coefficients
    u = UNEVEN - UNEVEN[-1]
    fit = fit_parabola(UNEVEN + first_s, (a + b * u + c * u * u)[:, None])
    earlier_s = -0.01
    assert fit.misfit < 1e-9 and fit.position(fit.at)[0] == pytest.approx(a, abs=1e-7)
    assert fit.velocity(fit.at + earlier_s)[0] == pytest.approx(b + 2.0 * c * earlier_s, abs=1e-4)


@given(coefficients=COEFFICIENTS)
def test_velocities_of_every_frame_follow_a_parabola(coefficients):
    """Positions are a + b u + c u u over time u, in a single run of frames: each frame's velocity is b + 2 c u."""
    a, b, c = coefficients
    u = UNEVEN - UNEVEN[-1]
    single_run = np.zeros(len(UNEVEN), dtype=np.int64)
    fitted_velocities = velocities(UNEVEN, (a + b * u + c * u * u)[:, None], single_run, EVERY_FRAME)
    assert np.allclose(fitted_velocities[:, 0], b + 2.0 * c * u, atol=1e-6)


def test_no_velocity_is_fitted_across_a_gap():
    """A body rests at 0 for four frames, too few for a fit, and at 5 m for eight after the gap, with a speed of 0."""
    run_of_frame = np.array([0] * 4 + [1] * 8)
    metres = np.where(run_of_frame == 0, 0.0, 5.0)[:, None]
    fitted_velocities = velocities(UNEVEN, metres, run_of_frame, EVERY_FRAME)
    assert np.isnan(fitted_velocities[:4]).all() and np.allclose(fitted_velocities[4:], 0.0)


def test_a_fit_takes_five_to_nine_frames_of_a_run():
    """Frames 0 to 9 are a run without a gap in the poses, 10 to 21 another, and frame 22 has no pose (-1).

    ``rows``: frames of the fit for ``frame``: itself and at most eight before it in its run; none if these are fewer
    than five in all.
    """
    for case, (frame, rows) in {
        "last nine": (9, range(1, 10)),
        "six of its run": (15, range(10, 16)),
        "only four of its run": (13, ()),
        "no pose": (22, ()),
    }.items():
        run_of_frame = np.array([0] * 10 + [1] * 12 + [-1])
        assert rows_before(run_of_frame, frame).tolist() == list(rows), case


def test_after_a_loss_the_fit_drifts_at_first():
    """Six frames, ``SETTLE_S`` apart, all with a pose; frames 0 and 3 do not follow the frame before (a loss).

    They are runs 1 and 2; of the run after the loss the first frame is left out (-1), as its pose still drifts.
    """
    follows_previous = np.array([False, True, True, False, True, True])
    has_pose = np.ones(6, dtype=bool)
    assert settled_runs(np.arange(6) * SETTLE_S, has_pose, follows_previous).tolist() == [1, 1, 1, -1, 2, 2]
