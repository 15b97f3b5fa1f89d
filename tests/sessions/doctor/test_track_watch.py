"""Steps of one body get the same marks in any blocks, also where a block ends beside a jump."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sessions.doctor.track_watch import SAMPLE, Mark, TrackWatch, is_marked

COUNT, STEP_S = 400, 1 / 90


def jerky_samples(seed):
    """400 samples at 90 Hz of a body that is 20 times as fast in a fifth of its steps, and flips by 60 degrees."""
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
    """Marks and lengths of all steps, where the watch is given blocks of ``size`` samples."""
    watch = TrackWatch(least_step=STEP_S / 2)
    marks, steps = np.zeros(COUNT, np.uint32), np.zeros(COUNT, np.float32)
    for start in range(0, COUNT, size):
        block = samples[start : start + size]
        watch.add(block, marks, steps, last=start + size >= COUNT)
    return marks, steps


@pytest.mark.parametrize("size", [1, 3, 64])
def test_marks_of_jerky_steps_do_not_depend_on_blocks(size):
    """400 samples of a body that moves by fits and starts come whole, and in blocks of ``size`` samples.

    Of 1,200 steps, with three seeds, more than 30 and fewer than half are marked as teleports: the marks say something.
    """
    teleports = 0
    for seed in range(3):
        samples = jerky_samples(seed)
        marks, steps = marks_and_steps(samples, size=COUNT)
        marks_of_blocks, steps_of_blocks = marks_and_steps(samples, size)
        np.testing.assert_array_equal(marks_of_blocks, marks)
        np.testing.assert_array_equal(steps_of_blocks, steps)
        teleports += is_marked(marks, Mark.TELEPORT).sum()
    assert 30 < teleports < 3 * COUNT / 2


@pytest.mark.parametrize(("excess_m_s", "teleports"), [(0.0, []), (2.4, []), (2.6, [10]), (-2.4, []), (-2.6, [10])])
def test_step_unlike_those_around_it_is_a_teleport(excess_m_s, teleports):
    """A body moves at 3 m/s, but for its step to sample 10, which is faster by ``excess_m_s``.

    A step that differs by more than 2.5 m/s from those around it is no motion.
    """
    speeds = np.full(COUNT, 3.0)
    speeds[10] += excess_m_s
    samples = np.zeros(COUNT, SAMPLE)
    samples["row"] = np.arange(COUNT)
    samples["time"] = samples["row"] * STEP_S
    samples["position"][:, 0] = np.cumsum(speeds * STEP_S)
    samples["quaternion"][:, 3] = 1.0
    marks, _steps = marks_and_steps(samples, size=COUNT)
    assert np.flatnonzero(is_marked(marks, Mark.TELEPORT)).tolist() == teleports
