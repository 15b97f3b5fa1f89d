"""Planted faults are counted: contacts known in closed form, detectors with one known fault each."""

from io import StringIO

import numpy as np
import pytest
from rich.console import Console
from support import planted_detectors

from replay.auditing.wilson import wilson_interval
from replay.cli.run_tables import run_tables
from replay.engine import compute
from sessions.doctor.runs import runs
from sessions.synthetic.analytic import make_analytic
from sessions.synthetic.truth import OPEN, PRESENT


@pytest.fixture(scope="module")
def plate():
    """A ball on a plate for nine seconds and a half, and in which frames the formula says that they touch."""
    session, truth = make_analytic("ball-plate", seconds=9.5)
    expected = truth.expected("ball", "plate", session.frames.stamp_ns)
    assert not (expected == OPEN).any()
    return session, expected == PRESENT


def spans(mask):
    """First and last frame of each segment of a mask."""
    return [(first, last) for first, last in runs(mask).tolist()]


@pytest.mark.slow
@pytest.mark.parametrize("fault", ["Dropping", "Inventing", "Late", "Blind"])
def test_counts_of_misses_and_false_contacts_equal_planted_faults(plate, fault):
    """A planted detector drops, invents, is late or blind; segments of its mask and of the truth are counted here.

    Late is three frames late, at 90 Hz.
    """
    session, truth = plate
    reported = getattr(planted_detectors, fault).spoil(None, truth[:, None].copy())[:, 0]
    result = compute(session, detectors=f"it=support.planted_detectors:{fault}")
    figures = result.document.audit["it"]
    lost, extra, contacts, reports = (spans(mask) for mask in (truth & ~reported, reported & ~truth, truth, reported))
    assert len(contacts) > 5 and lost + extra
    for counted, wrong, of in (
        (figures.time_missed, truth & ~reported, truth),
        (figures.false_contact, reported & ~truth, reported),
    ):
        assert (counted.count, counted.of) == (wrong.sum(), of.sum())
    assert [(item.first, item.last) for item in result.misses["it"]] == lost
    assert [(item.first, item.last) for item in result.false["it"]] == extra
    pieces = [sum(first <= end and begin <= last for begin, end in reports) for first, last in contacts]
    alone = sum(not truth[first : last + 1].any() for first, last in reports)
    answer = figures.matching
    assert (answer.reported_contacts, answer.matched, answer.false_contacts) == (
        len(reports),
        np.count_nonzero(pieces),
        alone,
    )
    assert answer.missed == figures.contacts_missed == pieces.count(0)
    assert (answer.split, answer.pieces) == (sum(k > 1 for k in pieces), sum(max(0, k - 1) for k in pieces))
    for piece, count, of in (
        (answer.missed_proportion, pieces.count(0), len(contacts)),
        (answer.false_proportion, alone, len(reports)),
    ):
        assert not of or (piece.value, piece.lower, piece.upper) == (count / of, *wilson_interval(count, of))
    if fault == "Dropping":
        counts = int((truth & ~reported).sum()), int(truth.sum())
        assert (figures.time_missed.lower, figures.time_missed.upper) == wilson_interval(*counts)
    if fault == "Late":
        errors = np.array([(item.onset_error, item.duration_error) for item in result.matches["it"].matched])
        assert errors == pytest.approx(np.tile([3 / 90, 0.0], (len(contacts), 1)), abs=1e-7)
        assert {(item.kind, item.cause) for item in result.false["it"]} == {("ends late", "late")}


def test_contact_of_bounding_spheres_alone_is_unconfirmed(plate):
    """``sphere`` tests bounding spheres and nothing finer: false reports of it are called unconfirmed."""
    session, _ = plate
    ball = compute(session, detectors="ball=sphere")
    assert {item.cause for item in ball.false["ball"]} == {"only bounding volumes overlap"}
    console = Console(width=200, record=True, file=StringIO())
    console.print(run_tables(ball))
    printed = console.export_text()
    assert "unconfirmed frames" in printed and "unexplained" not in printed
    assert "false contacts of" not in printed and "false frames" not in printed
