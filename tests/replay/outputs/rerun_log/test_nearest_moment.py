"""Moments of all detectors stand in one order, no two in one place, and their words are true."""

from replay.comparison.outcome import Episode
from replay.outputs.rerun_log.moments import CONTACT, Moment, nearest_moments


def at(*places):
    return [
        Moment(frame, later, (0.0, 0.0, 0.0), "slow", CONTACT, Episode(k, 9, 12, 0.1, 0.2))
        for k, (frame, later) in enumerate(places)
    ]


def test_the_nearest_moment_changes_half_way_and_leads_to_each_of_one_frame():
    rows = nearest_moments(at((4, 0), (10, 0), (10, 1), (11, 0)))
    assert [(frame, later, one.pair) for frame, later, one in rows] == [(0, 0, 0), (7, 0, 1), (10, 1, 2), (11, 0, 3)]
    assert nearest_moments([]) == []
