import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sessions.geometry.rotations import IDENTITY, quaternion_inverse, quaternion_product
from sessions.synthetic.paths import Dent, Tap
from sessions.synthetic.tracker import VIVE, disturbed

TIMES = np.arange(0.0, 120.0, 1.0 / 90.0)
REST = (np.tile([0.1, 1.2, -0.3], (len(TIMES), 1)), np.tile(IDENTITY, (len(TIMES), 1)))


def test_a_resting_tracker_errs_and_steps_as_real_ones_do():
    position, quaternion = disturbed(REST, TIMES, VIVE, np.random.default_rng(0))
    error = np.linalg.norm(position - REST[0], axis=1)
    assert np.sqrt((error**2).mean()) == pytest.approx(0.0003, rel=0.1)
    angle = 2.0 * np.degrees(np.arcsin(np.linalg.norm(quaternion[:, :3], axis=1)))
    assert np.sqrt((angle**2).mean()) == pytest.approx(0.02, rel=0.1)
    # A stationary VIVE tracker steps by 0.14 mm (median) from frame to frame.
    step = np.linalg.norm(np.diff(position, axis=0), axis=1)
    assert 0.00012 < np.median(step) < 0.00016


def test_the_margin_covers_what_noise_does_in_a_long_session():
    first = disturbed(REST, TIMES, VIVE, np.random.default_rng(1))
    second = disturbed(REST, TIMES, VIVE, np.random.default_rng(2))
    apart = (first[0] - second[0])[:, 1]
    lever = np.array([0.0, 0.15, 0.0])
    turned = (
        quaternion_product(quaternion_product(first[1], [*lever, 0.0]), quaternion_inverse(first[1]))[:, :3] - lever
    )
    assert np.abs(apart + turned[:, 0]).max() < VIVE.margin(0.15)
    assert VIVE.margin(0.15) < 0.0015


@given(st.floats(0.0005, 0.005), st.floats(0.01, 0.4), st.floats(0.01, 0.05))
def test_a_tap_is_in_contact_for_exactly_the_asked_time(depth, seconds, apart):
    dent = Dent(depth, seconds, apart + depth)
    tap = Tap(3.0, dent.period, (1.0, 0.0, 0.0), dent.amplitude)
    ((start, end),) = dent.intervals(tap, 0.0)
    assert end - start == pytest.approx(seconds, rel=1e-9)
    times = np.linspace(3.0, 3.0 + dent.period, 4001)
    beyond = tap(times)[:, 0] - dent.apart
    assert beyond.max() == pytest.approx(depth, rel=1e-4)
    inside = (times > start + 1e-7) & (times < end - 1e-7)
    assert (beyond[inside] > -1e-12).all()
    assert (beyond[(times < start - 1e-7) | (times > end + 1e-7)] < 1e-12).all()
