"""What was planted is what is counted: contacts known in closed form, detectors with one known fault each."""

from io import StringIO

import numpy as np
import pytest
from rich.console import Console
from support import planted_detectors

from replay.auditing.wilson import wilson
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
    return [(first, last) for first, last in runs(mask).tolist()]


@pytest.mark.parametrize("fault", ["Dropping", "Late", "Inventing", "Blind"])
def test_what_was_planted_is_what_is_counted(plate, fault):
    session, truth = plate
    said = getattr(planted_detectors, fault).spoil(None, truth[:, None].copy())[:, 0]
    result = compute(session, detectors=f"it=support.planted_detectors:{fault}")
    figures = result.document.audit["it"]
    lost, extra, contacts, reports = (spans(mask) for mask in (truth & ~said, said & ~truth, truth, said))
    assert len(contacts) > 5 and lost + extra
    for counted, wrong, of in (
        (figures.time_missed, truth & ~said, truth),
        (figures.false_contact, said & ~truth, said),
    ):
        assert (counted.count, counted.of) == (wrong.sum(), of.sum())
    assert [(one.first, one.last) for one in result.misses["it"]] == lost
    assert [(one.first, one.last) for one in result.false["it"]] == extra
    pieces = [sum(first <= end and begin <= last for begin, end in reports) for first, last in contacts]
    alone = sum(not truth[first : last + 1].any() for first, last in reports)
    told = figures.matching
    assert (told.reported_contacts, told.matched, told.false_contacts) == (
        len(reports),
        np.count_nonzero(pieces),
        alone,
    )
    assert told.missed == figures.contacts_missed == pieces.count(0)
    assert (told.split, told.pieces) == (sum(k > 1 for k in pieces), sum(max(0, k - 1) for k in pieces))
    for part, count, of in (
        (told.missed_proportion, pieces.count(0), len(contacts)),
        (told.false_proportion, alone, len(reports)),
    ):
        assert not of or (part.value, part.lower, part.upper) == (count / of, *wilson(count, of))
    if fault == "Dropping":
        counts = int((truth & ~said).sum()), int(truth.sum())
        assert (figures.time_missed.lower, figures.time_missed.upper) == wilson(*counts)
    if fault == "Late":
        errors = np.array([(one.onset_error, one.duration_error) for one in result.matches["it"].matched])
        assert errors == pytest.approx(np.tile([3 / 90, 0.0], (len(contacts), 1)), abs=1e-7)
        assert {(one.kind, one.cause) for one in result.false["it"]} == {("ends late", "late")}


def test_what_spheres_alone_say_is_unconfirmed(plate):
    ball = compute(plate[0], detectors="ball=sphere")
    assert {one.cause for one in ball.false["ball"]} == {"only bounding volumes overlap"}
    console = Console(width=200, record=True, file=StringIO())
    console.print(run_tables(ball))
    printed = console.export_text()
    assert "unconfirmed frames" in printed and "unexplained" not in printed
    assert "false contacts of" not in printed and "false frames" not in printed
