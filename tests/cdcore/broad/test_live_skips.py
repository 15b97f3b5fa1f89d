"""A live pair keeps its verdict for as long as its bodies may move within the margin that was measured."""

import numpy as np
import pytest
from support.processes import kernels_in_python

from cdcore.broad.live_skips import SKIPS, STEP_ULPS, LiveSkips, note_moves, pair_is_skipped
from cdcore.tolerances import EPS


def step_of(position, last_position, centre=(0.0, 0.0, 0.0), valid=True):
    """How far a point of a body may have moved between two positions, unrotated: a ball of 0.5 m about ``centre``."""
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
    """A ball of radius 0.5 m moves by ``length`` along x; its step is that way and what rounding may add.

    Rounding is STEP_ULPS eps of a size: the body's radius and the coordinates of its position and of its centre.
    """
    position = np.array([3e6, -4e6, 1e6])
    last_position = position - np.array([length, 0.0, 0.0])
    step = step_of(position, last_position, centre)
    move = position[0] - last_position[0]  # not quite ``length``: at 3e6 m doubles are 0.5 nm apart
    radius = 0.5
    rounding = STEP_ULPS * EPS * (radius + np.abs(position).sum() + np.abs(centre).sum())
    assert step >= move + 0.99 * rounding
    assert step == pytest.approx(move + rounding, rel=1e-8)


def test_step_is_zero_at_rest_and_infinite_at_first():
    """A body at rest or without a pose takes no step; without a last position (NaN) it may come from anywhere."""
    position, elsewhere, no_last_position = [1.0, 2.0, 3.0], [9.0, 2.0, 3.0], [np.nan] * 3
    assert step_of(position, last_position=position) == 0.0
    assert step_of(position, last_position=elsewhere, valid=False) == 0.0
    assert step_of(position, last_position=no_last_position) == np.inf


def test_steps_use_up_margin_and_clearance():
    """Pair 1 is skipped until steps of its bodies use up its margin of 1 m: first 0.75 m of it, then the other 0.25 m.

    Its clearance of 5 m loses as much; pair 0 loses nothing.
    """
    margins, clearances, pair = np.array([9.0, 1.0]), np.array([9.0, 5.0]), 1
    assert pair_is_skipped(0.75, pair, margins, clearances)
    assert margins.tolist() == [9.0, 0.25]
    assert clearances.tolist() == [9.0, 4.25]
    assert not pair_is_skipped(0.25, pair, margins, clearances), "a margin of 0 m is none"
    assert pair_is_skipped(0.0, pair, margins, clearances), "nothing moved"


def skips_with_steps(*steps_m):
    """Live skips of two bodies, which are one pair, and which moved by so many metres in the last frame."""
    skips = LiveSkips(bodies=2, ends=(np.array([0]), np.array([1])))
    _, _, last_steps, *_ = skips.memory
    last_steps[:] = steps_m
    return skips


def test_margin_is_some_steps_of_both_bodies():
    """Steps of 0.25 and 0.5 m: a gap of 0.75 m lasts a frame, and the first test looks ``first_reach`` frames ahead.

    After an endless step the bodies may be anywhere: no margin is worth a test.
    """
    assert skips_with_steps(0.25, 0.5).margin(pair=0) == (0.25 + 0.5) * SKIPS.first_reach
    assert skips_with_steps(np.inf, 0.5).margin(pair=0) == 0.0


def test_reach_doubles_after_successes_and_falls_after_failures():
    """Two bodies together move by 1 m a frame, so that the margin in metres is how many frames a test looks ahead.

    That begins at 4, doubles up to 16 where surfaces were as far apart, and else is quartered, down to 1.5.
    """
    skips, margins = skips_with_steps(0.25, 0.75), []
    for separated in (True, True, True, False, False, False):
        margin = skips.margin(pair=0)
        margins.append(margin)
        skips.keep_margin(0, margin, separated)
    assert margins == [4.0, 8.0, 16.0, 16.0, 4.0, 1.5]


def test_pair_waits_after_a_failure_at_the_least_reach():
    """Two bodies together move by 1 m a frame; tests fail at 4 m and at the least, 1.5 m.

    Then three frames (``SKIPS.wait``) go without a test, which a margin of 0 m says, and the fourth has one again.
    """
    skips = skips_with_steps(0.25, 0.75)
    for _ in range(2):
        skips.keep_margin(0, skips.margin(pair=0), separated=False)
    assert [skips.margin(pair=0) for _ in range(4)] == [0.0, 0.0, 0.0, 1.5]


def test_kept_margin_is_a_little_less_than_the_measured_gap():
    """A gap of 2 m, of which a millionth is left out for the rounding of many steps.

    With a mesh that has holes the margin is at most the clearance, 0.5 m to where these could matter.
    """
    skips = skips_with_steps(1.0, 1.0)
    _, _, _, margins, *_ = skips.memory
    skips.keep_margin(pair=0, margin=2.0, separated=True)
    margin_of_the_gap = margins[0]
    assert 2.0 * (1 - 2e-6) < margin_of_the_gap < 2.0
    skips.keep_clearance(0, 0.5, holed=False)
    assert margins[0] == margin_of_the_gap
    skips.keep_clearance(0, 0.5, holed=True)
    assert margins[0] == skips.clearances[0] == 0.5
