"""Samples of a gaze that hold a ray, and gazes and hands that are refused."""

import numpy as np
import pytest

from sessions.errors import SessionError
from sessions.model.session import GazeTrack, HandTrack

FORWARD = (0.0, 0.0, -1.0)


def test_gaze_is_usable_where_valid_and_with_a_ray():
    """Five samples: a ray, closed eyes, no direction, a direction and an origin that are no numbers."""
    directions = np.array([FORWARD, FORWARD, (0.0, 0.0, 0.0), (np.nan, 0.0, 0.0), FORWARD])
    origins = np.zeros((5, 3))
    origins[4] = np.inf
    gaze = GazeTrack(np.arange(5), origins, directions, valid=[True, False, True, True, True])
    assert gaze.usable.tolist() == [True, False, False, False, False]


def test_gaze_needs_a_body_for_each_sample():
    """A gaze has two samples and a single name of a body that was looked at."""
    with pytest.raises(SessionError, match="1 bodies; 2 stamps need 2"):
        GazeTrack([0, 1], np.zeros((2, 3)), [FORWARD] * 2, bodies=["cup"])


def test_hand_with_two_buttons_of_a_name_is_refused():
    """The name that stands twice is in the message; two other names are accepted."""
    assert HandTrack([0], buttons=("a", "b")).buttons == ("a", "b")
    with pytest.raises(SessionError, match="button 'b' twice"):
        HandTrack([0], buttons=("a", "b", "b"))


def test_stamp_that_does_not_increase_is_named_with_its_sample():
    """Sample 2, counted from 0, repeats the stamp before."""
    with pytest.raises(SessionError, match="sample 2 of a hand at 10 ns does not come after 10 ns"):
        HandTrack([0, 10, 10, 20])
