"""A live pair keeps its verdict for as long as its bodies may move within the margin that was measured."""

import numpy as np
import pytest
from support.processes import kernels_in_python

from cdcore.broad.live_skips import SKIPS, STEP_ULPS, LiveSkips, note_moves, pair_is_skipped
from cdcore.tolerances import EPS


def steps_of(position, last_position, centre=(0.0, 0.0, 0.0), valid=True):
    """How far a body with a ball of 0.5 m about ``centre`` may have moved between two positions, unrotated."""
    steps, no_rotation = np.zeros(1), np.eye(3)[None].copy()
    poses = no_rotation[None], np.array([[position]], dtype=float)
    spheres = np.array([centre], dtype=float), np.array([0.5]), np.array([0.5])
    last_poses = no_rotation.copy(), np.array([last_position], dtype=float)
    with kernels_in_python():
        note_moves(poses, np.array([[valid]]), spheres, last_poses, steps)
    return steps[0]


@pytest.mark.parametrize("centre", [(0.0, 0.0, 0.0), (1e6, -2e6, 3e6)])
@pytest.mark.parametrize("length", [1e-3, 5e6])
def test_step_is_the_move_and_its_rounding(length, centre):
    """Rounding grows with the radius, 0.5 m, the coordinates of the position, 3e6 + 4e6 + 1e6 m, and of the centre."""
    position = np.array([3e6, -4e6, 1e6])
    step = steps_of(position, position - np.array([length, 0.0, 0.0]), centre)
    exact = position[0] - (position[0] - length)
    rounding = STEP_ULPS * EPS * (0.5 + 8e6 + np.abs(centre).sum())
    assert step >= exact + 0.99 * rounding
    assert step == pytest.approx(exact + rounding, rel=1e-8)


def test_step_is_zero_at_rest_and_infinite_at_first():
    """A body without a pose takes no step; one without a last position (NaN) may come from anywhere."""
    assert steps_of([1.0, 2.0, 3.0], [1.0, 2.0, 3.0]) == 0.0
    assert steps_of([1.0, 2.0, 3.0], [9.0, 2.0, 3.0], valid=False) == 0.0
    assert steps_of([1.0, 2.0, 3.0], [np.nan] * 3) == np.inf


def test_steps_use_up_margin_and_clearance():
    """A step of 0.75 m is taken off the margin of 1 m and the clearance of 5 m of pair 1, then one of 0.25 m."""
    margins, clearances, pair = np.array([9.0, 1.0]), np.array([9.0, 5.0]), 1
    assert pair_is_skipped(0.75, pair, margins, clearances)
    assert (margins.tolist(), clearances.tolist()) == ([9.0, 0.25], [9.0, 4.25])
    assert not pair_is_skipped(0.25, pair, margins, clearances), "a margin of 0 m is none"
    assert pair_is_skipped(0.0, pair, margins, clearances), "nothing moved"


def skips_with_steps(*steps):
    """Live skips of two bodies, one pair, whose last steps were so long."""
    skips = LiveSkips(2, (np.array([0]), np.array([1])))
    skips.memory[2][:] = steps
    return skips


def test_margin_is_some_steps_of_both_bodies():
    """Their last steps are 0.25 and 0.5 m; after an endless one they may be anywhere: no margin is worth a test."""
    assert skips_with_steps(0.25, 0.5).margin(0) == 0.75 * SKIPS.first_reach
    assert skips_with_steps(np.inf, 0.5).margin(0) == 0.0


def test_reach_doubles_after_successes_and_falls_after_failures():
    """Both bodies move by 1 m a step in all, so that a margin in metres is a reach in steps.

    It begins at 4, doubles up to 16 and is quartered down to 1.5.
    """
    skips, reaches = skips_with_steps(0.25, 0.75), []
    for separated in (True, True, True, False, False, False):
        margin = skips.margin(0)
        reaches.append(margin)
        skips.keep_margin(0, margin, separated)
    assert reaches == [4.0, 8.0, 16.0, 16.0, 4.0, 1.5]
    # the test at the least reach failed: three samples pass without a test
    assert [skips.margin(0) for _ in range(4)] == [0.0, 0.0, 0.0, 1.5]


def test_kept_margin_is_a_little_less_than_the_measured_gap():
    """2 m, and for a mesh with holes no more than the clearance of 0.5 m."""
    skips = skips_with_steps(1.0, 1.0)
    _, _, _, margins, *_ = skips.memory
    skips.keep_margin(0, 2.0, True)
    assert 2.0 * (1 - 2e-6) < margins[0] < 2.0
    skips.keep_clearance(0, 0.5, holed=False)
    assert margins[0] > 1.9
    skips.keep_clearance(0, 0.5, holed=True)
    assert margins[0] == 0.5 and skips.clearances[0] == 0.5
