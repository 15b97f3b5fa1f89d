import numpy as np
import pytest

from sessions.geometry.rotations import IDENTITY
from sessions.synthetic.analytic import make_analytic
from sessions.synthetic.tracker import VIVE, disturbed_poses

TIMES = np.arange(0.0, 120.0, 1.0 / 90.0)
REST = (np.tile([0.1, 1.2, -0.3], (len(TIMES), 1)), np.tile(IDENTITY, (len(TIMES), 1)))


def test_resting_tracker_errs_and_steps_as_real_trackers():
    """Errors of 0.3 mm and 0.02 degrees (root mean square) of a tracker that rests."""
    position, quaternion = disturbed_poses(REST, TIMES, VIVE, np.random.default_rng(0))
    error = np.linalg.norm(position - REST[0], axis=1)
    assert np.sqrt((error**2).mean()) == pytest.approx(0.0003, rel=0.1)
    angle = 2.0 * np.degrees(np.arcsin(np.linalg.norm(quaternion[:, :3], axis=1)))
    assert np.sqrt((angle**2).mean()) == pytest.approx(0.02, rel=0.1)
    # A stationary VIVE tracker steps by 0.14 mm (median) from frame to frame.
    step = np.linalg.norm(np.diff(position, axis=0), axis=1)
    assert 0.00012 < np.median(step) < 0.00016


def test_frame_steps_below_clock_jitter_are_refused():
    """Steps of 1 ms are below the 2.3 ms that a clock with jitter has at least; an even clock takes any."""
    assert len(make_analytic("ball-plate", rate_hz=1000.0, seconds=0.1)[0].frames) == 101
    with pytest.raises(ValueError, match="lower the rate or use clock 'even'"):
        make_analytic("ball-plate", rate_hz=1000.0, seconds=0.1, jitter="steady")
