"""Dots of accuracy against cost: who has one, where, and of which kind."""

from dataclasses import replace
from types import SimpleNamespace

import pytest
from support.report_states import audit_of, document_with

from replay.auditing.wilson import proportion
from replay.document.ranking import Rank
from replay.show.accuracy import accuracy_plot, run_dots
from replay.show.plots import Dot

REFERENCE = Rank("exact", "", "", contacts=10, mean=4e-5, p99=None)
MISSING = replace(REFERENCE, label="slow", missed=proportion(2, 10), time_missed=proportion(3, 10), mean=1e-5)
FALSE = replace(MISSING, label="hull", missed=proportion(0, 10), time_missed=proportion(0, 10), false=proportion(9, 10))
RIGHT = replace(FALSE, label="right", false=proportion(0, 10))


def dots_of_ranks(*ranks, undecided=(0, 10)):
    """Dots of these rows and of the reference; ``undecided`` of the pair-frames of the only audit."""
    audits = {"slow": audit_of(undecided=proportion(*undecided))}
    return run_dots(SimpleNamespace(document=document_with(audit=audits), ranking=(*ranks, REFERENCE)))


@pytest.mark.parametrize(
    ("ranks", "kinds"),
    [
        ((MISSING, FALSE), {"slow": "missed", "hull": "", "exact": "reference"}),
        ((FALSE, MISSING), {"hull": "false", "slow": "", "exact": "reference"}),
        ((RIGHT,), {"right": "", "exact": "reference"}),
        ((replace(MISSING, mean=None),), {"exact": "reference"}),
        ((replace(MISSING, undecided=1),), {"exact": "reference"}),
        ((replace(MISSING, mean=None, undecided=1),), {"exact": "reference"}),
    ],
)
def test_measured_and_decided_detectors_have_a_dot_by_fault(ranks, kinds):
    """The first rank is the worst, and its dot has the kind of its larger fault; others have none.

    Without a time, or with undecided contacts, there is no dot.
    """
    assert {dot.detector: dot.kind for dot in dots_of_ranks(*ranks)} == kinds


def test_dot_stands_at_milliseconds_and_loss():
    """2 of 10 contacts and 3 of 10 pair-frames missed are a loss of 0.5; 1e-5 s are 0.01 ms."""
    dot, reference = dots_of_ranks(MISSING)
    assert (dot.name, dot.x, dot.y) == ("slow: 0.5", pytest.approx(0.01), pytest.approx(0.5))
    assert (reference.x, reference.y) == (pytest.approx(0.04), 0.0)


def test_run_that_decided_nothing_has_no_dots():
    """All ten pair-frames of the only audit are undecided."""
    assert dots_of_ranks(MISSING, undecided=(10, 10)) == []


@pytest.mark.parametrize(("loss", "axis_end"), [(0.0, 0.1), (0.4, 0.4)])
def test_axis_of_losses_reaches_a_tenth_at_least(loss, axis_end):
    """``loss``: of the only dot, 0 or 0.4; the largest number beside the axes is at least so much."""
    plot = accuracy_plot([Dot("exact", 0.04, loss)], (300.0, 200.0))
    assert max(float(text.text) for text in plot.labels if text.text.replace(".", "").isdigit()) >= axis_end
