"""Moments of all detectors stand in one order, no two in one place, and their words are true."""

from dataclasses import replace

import pytest

from replay.comparison.outcome import Outcome
from replay.outputs.moments import FocusMoment, focus_rows, pair_in_focus
from replay.outputs.palette import FOUND, INVENTED, MISSED

ONE = FocusMoment(10, 0, 3, (0.0, 0.0, 0.0), "slow", 7, Outcome.MISSED, 9, 12, 0.012, "never found", "")


def at(*places):
    return [replace(ONE, frame=frame, later=later, pair=k) for k, (frame, later) in enumerate(places)]


def test_focus_changes_half_way_and_leads_to_each_of_one_frame():
    rows = focus_rows(at((4, 0), (10, 0), (10, 1), (11, 0)))
    assert [(frame, later, one.pair) for frame, later, one in rows] == [(0, 0, 0), (7, 0, 1), (10, 1, 2), (11, 0, 3)]
    assert focus_rows([]) == []


def test_the_pair_in_focus_is_that_of_the_nearest_moment():
    moments = at((4, 0), (10, 0))
    assert pair_in_focus(moments, 14).tolist() == [0] * 7 + [1] * 7
    nearest = [min(moments, key=lambda one: (abs(one.frame - frame), -one.frame)).pair for frame in range(14)]
    assert pair_in_focus(moments, 14).tolist() == nearest


@pytest.mark.parametrize(
    ("outcome", "kind", "colour"),
    [
        (Outcome.MISSED, "never found", MISSED), (Outcome.MISSED, "found late", MISSED),
        (Outcome.INVENTED, "ends late", INVENTED), (Outcome.BOTH, "", FOUND),
    ],
)  # fmt: skip
def test_red_is_missed_and_nothing_else(outcome, kind, colour):
    assert replace(ONE, outcome=outcome, kind=kind).colour == colour
