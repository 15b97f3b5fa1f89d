"""Moments of all detectors stand in one order, no two in one place, and their words are true."""

from dataclasses import replace

import pytest

from replay.comparison.outcome import Outcome
from replay.outputs.moments import FocusMoment, focus_rows
from replay.outputs.palette import FOUND, INVENTED, MISSED

ONE = FocusMoment(10, 0, 3, (0.0, 0.0, 0.0), "slow", 7, Outcome.MISSED, 9, 12, 0.012, "never found", "")


def at(*places):
    return [replace(ONE, frame=frame, later=later, pair=k) for k, (frame, later) in enumerate(places)]


def test_focus_changes_half_way_and_leads_to_each_of_one_frame():
    rows = focus_rows(at((4, 0), (10, 0), (10, 1), (11, 0)))
    assert [(frame, later, one.pair) for frame, later, one in rows] == [(0, 0, 0), (7, 0, 1), (10, 1, 2), (11, 0, 3)]
    assert focus_rows([]) == []


@pytest.mark.parametrize(
    ("outcome", "kind", "colour"),
    [
        (Outcome.MISSED, "never found", MISSED), (Outcome.MISSED, "found late", MISSED),
        (Outcome.INVENTED, "ends late", INVENTED), (Outcome.BOTH, "", FOUND),
    ],
)  # fmt: skip
def test_red_is_missed_and_nothing_else(outcome, kind, colour):
    assert replace(ONE, outcome=outcome, kind=kind).colour == colour
