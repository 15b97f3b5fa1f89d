import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sessions.geometry.rotations import IDENTITY, quaternion_inverse, quaternion_product
from sessions.synthetic.paths import Dent, Tap
from sessions.synthetic.tracker import VIVE, Loss, disturbed, planned_losses, with_losses

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


def test_losses_are_rare_short_and_keep_off_planted_windows():
    keep = [(10.0, 30.0), (60.0, 90.0)]
    counts = []
    for seed in range(60):
        losses = planned_losses(120.0, VIVE, np.random.default_rng(seed), keep)
        counts.append(len(losses))
        for loss in losses:
            assert 0.05 <= loss.end - loss.start <= 0.5
            size = np.linalg.norm(loss.step)
            assert 0.005 <= size <= 0.03
            left = size * np.exp(-(loss.settled - loss.end) / VIVE.settle_s)
            assert left == pytest.approx(VIVE.position_rms_m), "settled: the step has sunk into the noise"
            assert all(loss.settled < low or loss.start > high for low, high in keep)
        assert all(a.settled < b.start for a, b in itertools.pairwise(losses))
    assert min(counts) >= 0 and max(counts) <= 4
    assert 0.5 < np.mean(counts) < 3.0


def test_a_loss_is_flagged_and_its_return_is_a_step_that_settles():
    loss = Loss(5.0, 5.2, 5.5, np.array([0.01, 0.0, 0.0]))
    (position, _), valid = with_losses(REST, TIMES, [loss], VIVE)
    lost = (TIMES >= 5.0) & (TIMES < 5.2)
    np.testing.assert_array_equal(valid, ~lost)
    first = np.flatnonzero(TIMES >= 5.2)[0]
    assert position[first, 0] - 0.1 == pytest.approx(0.01, rel=0.2)
    assert abs(position[TIMES > 5.7, 0] - 0.1).max() < 0.0003
    assert (position[TIMES < 5.0] == REST[0][TIMES < 5.0]).all()


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
