import numpy as np
import pytest

from sessions.errors import SessionError
from sessions.model.hand import HandTrack


def test_what_is_not_given_is_released():
    hand = HandTrack([1, 2], buttons=("a",))
    assert hand.trigger.tolist() == hand.grip.tolist() == [0, 0] and hand.pressed.tolist() == [[False], [False]]
    assert len(hand) == 2


def test_arrays_are_read_only_copies():
    trigger = np.array([0.5])
    hand = HandTrack([1], trigger)
    trigger[0] = 9
    assert hand.trigger[0] == 0.5
    with pytest.raises(ValueError, match="read-only"):
        hand.trigger[0] = 1


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (([2, 1],), "does not come after"),
        (([1, 2], [0.0]), r"trigger of a hand has shape \(1,\); 2 stamps need \(2,\)"),
        (([1], None, None, ("a", "b"), [[True]]), r"pressed .* need \(1, 2\)"),
        (([1], None, None, ("a", "a")), "button 'a' twice"),
    ],
)
def test_what_is_no_hand_is_one_sentence(values, words):
    with pytest.raises(SessionError, match=words):
        HandTrack(*values)
