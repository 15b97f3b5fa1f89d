import numpy as np
import pytest

from sessions.synthetic.choreography import GRASP_LEVEL, RELEASE_LEVEL, controllers


def test_trigger_passes_its_levels_at_the_ends_of_a_press():
    """A made-up left hand holds something from 1 to 2 s and from 3 to 4 s, with a stamp a millisecond for 5 s.

    Its trigger, from 0 to 1, rises above the level of a grasp at the start of each and falls below that of a release at
    its end, within 3 stamps; the grip is always 0.9 of the trigger.
    """
    presses = [(1.0, 2.0), (3.0, 4.0)]
    seconds = np.arange(5000) / 1000
    stamps = 10**18 + 1_000_000 * np.arange(5000)
    hand = controllers({"left": presses}, stamps)["student/left"]
    for start, end in presses:
        near_this_press = np.abs(seconds - (start + end) / 2) < 0.9  # the middles of the presses are 2 s apart
        grasped = seconds[near_this_press & (hand.trigger > GRASP_LEVEL)]
        not_released = seconds[near_this_press & (hand.trigger >= RELEASE_LEVEL)]
        assert grasped[0] == pytest.approx(start, abs=0.003)
        assert not_released[-1] == pytest.approx(end, abs=0.003)
    assert hand.trigger.max() == 1.0
    assert np.abs(hand.grip - 0.9 * hand.trigger).max() < 1e-6
