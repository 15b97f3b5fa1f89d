"""Dots of accuracy against cost: who has one, where, and of which kind."""

from dataclasses import replace
from types import SimpleNamespace

import pytest
from support.report_states import audit_of, document_with

from replay.auditing.wilson import proportion
from replay.document.ranking import Rank
from replay.show.accuracy import accuracy_plot, run_dots
from replay.show.plots import Dot

REFERENCE = Rank(label="exact", what="", setting="", contacts=10, mean=4e-5, p99=None)
MISSING = replace(REFERENCE, label="slow", missed=proportion(2, 10), time_missed=proportion(3, 10), mean=1e-5)
FALSE = replace(MISSING, label="hull", missed=proportion(0, 10), time_missed=proportion(0, 10), false=proportion(9, 10))
RIGHT = replace(FALSE, label="right", false=proportion(0, 10))


def dots_of_ranks(*ranks, undecided_of_ten=0):
    """Dots of these rows and of the reference; ``undecided_of_ten``: of ten pair-frames of the only audit."""
    audits = {"slow": audit_of(undecided=proportion(undecided_of_ten, 10))}
    return run_dots(SimpleNamespace(document=document_with(audit=audits), ranking=(*ranks, REFERENCE)))


def test_measured_and_decided_detectors_have_a_dot_by_fault():
    """``MISSING`` ("slow") misses 2 of 10 contacts, 90 % of what ``FALSE`` ("hull") reports is false.

    ``ranks`` are worst first: the dot of the first has the kind of its larger fault, "" where it has none; dots of
    later ranks have no kind. A detector without a time, or with a contact left undecided, has no dot.
    """
    rows = {
        "worst misses": ((MISSING, FALSE), {"slow": "missed", "hull": "", "exact": "reference"}),
        "worst is false": ((FALSE, MISSING), {"hull": "false", "slow": "", "exact": "reference"}),
        "worst has no fault": ((RIGHT,), {"right": "", "exact": "reference"}),
        "not timed": ((replace(MISSING, mean=None),), {"exact": "reference"}),
        "a contact undecided": ((replace(MISSING, undecided=1),), {"exact": "reference"}),
    }
    for row, (ranks, kind_of_dot) in rows.items():
        assert {dot.detector: dot.kind for dot in dots_of_ranks(*ranks)} == kind_of_dot, row


def test_dot_stands_at_milliseconds_and_loss():
    """``MISSING`` takes 1e-5 s a frame, the reference 4e-5 s: 0.01 and 0.04 ms.

    ``MISSING`` misses 2 of 10 contacts and 3 of 10 pair-frames in contact: a loss of 0.2 + 0.3.
    """
    dot, reference = dots_of_ranks(MISSING)
    assert (dot.name, dot.x, dot.y) == ("slow: 0.5", pytest.approx(0.01), pytest.approx(0.5))
    assert (reference.x, reference.y) == (pytest.approx(0.04), 0.0)


def test_run_that_decided_nothing_has_no_dots():
    """The only detector left all ten pair-frames undecided; the reference has no dot either."""
    assert dots_of_ranks(MISSING, undecided_of_ten=10) == []


@pytest.mark.parametrize(
    ("loss", "least_end"), [pytest.param(0.0, 0.1, id="no loss"), pytest.param(0.4, 0.4, id="a loss of 0.4")]
)
def test_axis_of_losses_reaches_the_dot_and_a_tenth(loss, least_end):
    """The only dot is at 0.04 ms a frame and this loss; the axis of times ends at 0.04, so the largest is of losses."""
    plot = accuracy_plot([Dot("exact", x=0.04, y=loss)], size=(300.0, 200.0))
    ticks = [float(label.text) for label in plot.labels if label.text.replace(".", "").isdigit()]
    assert max(ticks) >= least_end
