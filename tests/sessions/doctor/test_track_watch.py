"""Steps of one body get the same marks in any blocks, also where a block ends beside a jump."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sessions.doctor.track_watch import SAMPLE, Mark, TrackWatch, is_marked

COUNT, STEP_S = 400, 1 / 90


def jerky_samples(seed):
    """A body whose velocity is near the bound of a teleport in every few steps, and that flips back and forth."""
    rng = np.random.default_rng(seed)
    samples = np.zeros(COUNT, SAMPLE)
    samples["row"] = np.arange(COUNT)
    samples["time"] = samples["row"] * STEP_S
    speeds = np.where(rng.random((COUNT, 1)) < 0.2, 6.0, 0.3)
    samples["position"] = np.cumsum(rng.normal(size=(COUNT, 3)) * speeds * STEP_S, axis=0)
    degrees = np.where(rng.random(COUNT) < 0.1, 60.0, 0.0)
    samples["quaternion"] = Rotation.from_rotvec(degrees[:, None] * [0.0, 0.0, 1.0], degrees=True).as_quat()
    return samples


def marks_and_steps(samples, size):
    """Marks and lengths of all steps, from blocks of ``size`` samples."""
    watch = TrackWatch(least_step=STEP_S / 2)
    marks, steps = np.zeros(COUNT, np.uint32), np.zeros(COUNT, np.float32)
    for start in range(0, COUNT, size):
        block = samples[start : start + size]
        watch.add(block, marks, steps, last=start + size >= COUNT)
    return marks, steps


@pytest.mark.parametrize("size", [1, 3, 64])
def test_marks_of_jerky_steps_do_not_depend_on_blocks(size):
    """``size``: samples in a block, of 400."""
    teleports = 0
    for seed in range(3):
        samples = jerky_samples(seed)
        whole, in_blocks = marks_and_steps(samples, COUNT), marks_and_steps(samples, size)
        np.testing.assert_array_equal(in_blocks[0], whole[0])
        np.testing.assert_array_equal(in_blocks[1], whole[1])
        teleports += is_marked(whole[0], Mark.TELEPORT).sum()
    assert 30 < teleports < 3 * COUNT / 2


@pytest.mark.parametrize(("excess", "expected"), [(0.0, []), (2.4, []), (2.6, [10]), (-2.4, []), (-2.6, [10])])
def test_step_unlike_those_around_it_is_a_teleport(excess, expected):
    """A body at 3 m/s whose step to frame 10 differs by ``excess`` m/s; 2.5 m/s is the least that is no motion."""
    speeds = np.full(COUNT, 3.0)
    speeds[10] += excess
    samples = np.zeros(COUNT, SAMPLE)
    samples["row"] = np.arange(COUNT)
    samples["time"] = samples["row"] * STEP_S
    samples["position"][:, 0] = np.cumsum(speeds * STEP_S)
    samples["quaternion"][:, 3] = 1.0
    marks, _ = marks_and_steps(samples, COUNT)
    assert np.flatnonzero(is_marked(marks, Mark.TELEPORT)).tolist() == expected
