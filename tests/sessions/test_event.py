from dataclasses import FrozenInstanceError

import pytest

from sessions.event import Event, Interval


def test_events_and_intervals_are_values():
    assert Event(5, "drop") == Event(5, "drop", "", "", "info") != Event(6, "drop")
    assert Interval(1, 2, "task", "pour") == Interval(1, 2, "task", "pour", {})
    with pytest.raises(FrozenInstanceError):
        Event(5, "drop").time_ns = 3


def test_intervals_do_not_share_their_data():
    first, second = Interval(1, 2, "task", "a"), Interval(1, 2, "task", "b")
    assert first.data is not second.data
