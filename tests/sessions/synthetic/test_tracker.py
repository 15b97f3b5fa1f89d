import numpy as np
import pytest

from sessions.geometry.rotations import IDENTITY
from sessions.synthetic.analytic import make_analytic
from sessions.synthetic.tracker import VIVE, disturbed_poses

TIMES = np.arange(0.0, 120.0, 1.0 / 90.0)
"""Two minutes at 90 Hz."""
REST_POSITION = np.array([0.1, 1.2, -0.3])


def test_resting_tracker_errs_and_steps_as_real_trackers():
    """A VIVE tracker rests for two minutes without rotation; its noise is added to the poses.

    They then err by 0.3 mm and 0.02 degrees (root mean square; published sizes of VIVE), within a tenth. From frame to
    frame they step by 0.12 to 0.16 mm in the median; a real tracker at rest steps by 0.14 mm.
    """
    rest = (np.tile(REST_POSITION, (len(TIMES), 1)), np.tile(IDENTITY, (len(TIMES), 1)))
    position, quaternion = disturbed_poses(rest, TIMES, VIVE, np.random.default_rng(0))
    errors_m = np.linalg.norm(position - REST_POSITION, axis=1)
    assert np.sqrt((errors_m**2).mean()) == pytest.approx(0.0003, rel=0.1)
    angles_deg = 2.0 * np.degrees(np.arcsin(np.linalg.norm(quaternion[:, :3], axis=1)))
    assert np.sqrt((angles_deg**2).mean()) == pytest.approx(0.02, rel=0.1)
    steps_m = np.linalg.norm(np.diff(position, axis=0), axis=1)
    assert 0.00012 < np.median(steps_m) < 0.00016


def test_even_clock_takes_frame_steps_of_any_length():
    """0.1 s at 1,000 Hz, by the clock ``even`` (the default), are 101 frames, the last at the end."""
    session, _truth = make_analytic("ball-plate", rate_hz=1000.0, seconds=0.1)
    assert len(session.frames) == 101


def test_frame_steps_below_clock_jitter_are_refused():
    """1,000 Hz needs steps of 1 ms; the clock ``steady``, whose stamps stray by 0.4 ms, takes none below 2.3 ms.

    That is the shortest step of three recordings by A-Frame. The clock ``even``, without jitter, takes any step.
    """
    with pytest.raises(ValueError, match="lower the rate or use clock 'even'"):
        make_analytic("ball-plate", rate_hz=1000.0, seconds=0.1, jitter="steady")
