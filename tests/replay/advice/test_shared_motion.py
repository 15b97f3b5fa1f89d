import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cdcore import Motion
from replay.advice.shared_motion import shared_motion

TIMES = np.arange(180) / 90
PAIRS = np.array([[0, 1], [0, 2], [1, 2]])


def motion(*tracks):
    """A motion of bodies by their places (n, 3) and yaws (n,)."""
    places = np.stack([place for place, _ in tracks], axis=1)
    turns = np.stack([Rotation.from_euler("y", yaw[:, None]).as_matrix() for _, yaw in tracks], axis=1)
    return Motion(TIMES, places, turns, np.ones(places.shape[:2], dtype=bool))


def scene():
    """A hand that turns and carries a cup 8 cm beside it, and a bench that rests."""
    yaw = np.linspace(0, 2, len(TIMES))
    hand = np.stack([0.5 * TIMES, 0.1 * TIMES, 0 * TIMES], axis=1)
    cup = hand + Rotation.from_euler("y", yaw[:, None]).apply([0.08, 0.0, 0.0])
    still = np.zeros((len(TIMES), 3))
    return motion((hand, yaw), (cup, yaw), (still, 0 * yaw))


def test_only_hand_and_its_cup_share_motion():
    shared = shared_motion(scene(), PAIRS)
    assert shared.carried[:-9, 0].all() and not shared.carried[:, 1:].any() and not shared.at_rest.any()


@pytest.mark.parametrize(("frames", "fraction"), [(0, 0.0), (171, 1.0), (57, 1 / 3)])
def test_contact_counts_while_a_body_is_carried(frames, fraction):
    contact = np.zeros((len(TIMES), 3), dtype=bool)
    contact[:frames, 0] = True
    assert shared_motion(scene(), PAIRS).carried_contact(contact) == pytest.approx(fraction)


def test_bodies_that_rest_and_touch_are_supported():
    still = np.zeros((len(TIMES), 3))
    moving = np.stack([0.5 * TIMES, 0 * TIMES, 0 * TIMES], axis=1)
    shared = shared_motion(motion((still, 0 * TIMES), (still, 0 * TIMES), (moving, 0 * TIMES)), PAIRS)
    assert shared.supported(np.ones((len(TIMES), 3), dtype=bool), PAIRS) == 2
    assert shared.supported(np.zeros((len(TIMES), 3), dtype=bool), PAIRS) == 0
