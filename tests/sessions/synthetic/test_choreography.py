import numpy as np
import pytest

from sessions.synthetic.choreography import GRASP_LEVEL, RELEASE_LEVEL, controllers


def test_trigger_passes_its_levels_at_the_ends_of_a_press():
    """Presses from 1 to 2 s and 3 to 4 s, a stamp a millisecond; the grip follows at 0.9 of the trigger."""
    stamps = 10**18 + 1_000_000 * np.arange(5000)
    hand = controllers({"left": [(1.0, 2.0), (3.0, 4.0)]}, stamps)["student/left"]
    for start, end in ((1.0, 2.0), (3.0, 4.0)):
        near = np.abs(np.arange(5000) / 1000 - (start + end) / 2) < 0.9
        grasped, pressed = np.flatnonzero(near & (hand.trigger > GRASP_LEVEL)), hand.trigger >= RELEASE_LEVEL
        assert (grasped[0] / 1000, np.flatnonzero(near & pressed)[-1] / 1000) == pytest.approx((start, end), abs=0.003)
    assert hand.trigger.max() == 1.0 and np.abs(hand.grip - 0.9 * hand.trigger).max() < 1e-6
