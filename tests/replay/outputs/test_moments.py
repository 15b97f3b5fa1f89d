"""Moments of all detectors stand in one order, no two in one place, and their words are true."""

from replay.comparison.outcome import Episode, Outcome
from replay.outputs.moments import FocusMoment, focus_rows


def at(*places):
    return [
        FocusMoment(frame, later, (0.0, 0.0, 0.0), "slow", Outcome.BOTH, Episode(k, 9, 12, 0.1, 0.2))
        for k, (frame, later) in enumerate(places)
    ]


def test_focus_changes_half_way_and_leads_to_each_of_one_frame():
    rows = focus_rows(at((4, 0), (10, 0), (10, 1), (11, 0)))
    assert [(frame, later, one.pair) for frame, later, one in rows] == [(0, 0, 0), (7, 0, 1), (10, 1, 2), (11, 0, 3)]
    assert focus_rows([]) == []
