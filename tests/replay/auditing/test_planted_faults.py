"""Planted faults are counted: contacts known in closed form, detectors with one known fault each."""

from io import StringIO
from types import SimpleNamespace

import pytest
from rich.console import Console
from support import planted_detectors

from replay.auditing.wilson import wilson_interval
from replay.cli.run_tables import run_tables
from replay.engine import compute
from sessions.doctor.runs import runs
from sessions.synthetic.analytic import make_analytic
from sessions.synthetic.truth import OPEN, PRESENT

FRAME_S = 1 / 90
"""Seconds from frame to frame."""


@pytest.fixture(scope="module")
def ball_on_plate():
    """A ball that comes down on a plate again and again for 9.5 s at 90 Hz, and the frames in which they touch, (T,).

    The frames are those of the formula of its path; at none of them the formula leaves the contact open.
    """
    session, truth = make_analytic("ball-plate", seconds=9.5)
    expected = truth.expected("ball", "plate", session.frames.stamp_ns)
    assert not (expected == OPEN).any()
    return session, expected == PRESENT


@pytest.fixture(scope="module", params=["Dropping", "Inventing", "Late", "Blind"])
def planted(request, ball_on_plate):
    """The audit of a detector that drops every 7th contact frame, invents contacts, is late, or blind.

    ``truth`` and ``reported``: contact in each frame, of the formula and of the detector by its planted fault.
    """
    session, truth = ball_on_plate
    detector = getattr(planted_detectors, request.param)
    reported = detector.spoil(truth[:, None].copy())[:, 0]
    result = compute(session, detectors=f"faulty=support.planted_detectors:{request.param}")
    return SimpleNamespace(truth=truth, reported=reported, result=result, audit=result.document.audit["faulty"])


def segments(mask):
    """First and last frame of each segment of a mask (T,)."""
    return [(first, last) for first, last in runs(mask).tolist()]


@pytest.mark.slow
def test_missed_and_false_frames_equal_planted_frames(planted):
    """A detector drops every 7th contact frame of a ball on a plate, invents some, is late, or blind.

    Missed are frames of contact that are not reported, of those in contact; false are frames reported wrongly, of those
    reported.
    """
    missed, false = planted.truth & ~planted.reported, planted.reported & ~planted.truth
    assert missed.any() or false.any(), "a fault is planted"
    time_missed, false_contact = planted.audit.time_missed, planted.audit.false_contact
    assert (time_missed.count, time_missed.of) == (missed.sum(), planted.truth.sum())
    assert (false_contact.count, false_contact.of) == (false.sum(), planted.reported.sum())


@pytest.mark.slow
def test_misses_and_false_contacts_are_the_planted_segments(planted):
    """A detector drops every 7th contact frame of a ball on a plate, invents some, is late, or blind.

    Each segment of frames that are missed is a miss, each segment of false frames a false contact.
    """
    misses = [(item.first, item.last) for item in planted.result.misses["faulty"]]
    false_contacts = [(item.first, item.last) for item in planted.result.false["faulty"]]
    assert misses == segments(planted.truth & ~planted.reported)
    assert false_contacts == segments(planted.reported & ~planted.truth)


@pytest.mark.slow
def test_contacts_are_matched_missed_or_split_as_planted(planted):
    """A detector with a planted fault: true contacts and reports that share a frame are counted here by a plain loop.

    A true contact that shares frames with k reports is missed where k is 0, else matched with one of them; where k > 1
    it is split, and the other k - 1 are pieces. A report that shares no frame with a true contact is false.
    """
    contacts, reports = segments(planted.truth), segments(planted.reported)
    assert len(contacts) > 5, "enough for counts of several"
    reports_of_contact = [sum(first <= end and start <= last for start, end in reports) for first, last in contacts]
    missed = reports_of_contact.count(0)
    false = sum(not planted.truth[first : last + 1].any() for first, last in reports)

    matching = planted.audit.matching
    assert matching.reported_contacts == len(reports)
    assert matching.matched == len(contacts) - missed
    assert matching.missed == planted.audit.contacts_missed == missed
    assert matching.false_contacts == false
    assert matching.split == sum(k > 1 for k in reports_of_contact)
    assert matching.pieces == sum(max(0, k - 1) for k in reports_of_contact)
    for proportion, count, of in (
        (matching.missed_proportion, missed, len(contacts)),
        (matching.false_proportion, false, len(reports)),
    ):
        # The blind detector has no report of which a part could be false.
        value = count / of if of else None
        assert (proportion.value, proportion.lower, proportion.upper) == (value, *wilson_interval(count, of))


@pytest.mark.slow
@pytest.mark.parametrize("planted", ["Dropping"], indirect=True)
def test_frames_dropped_evenly_have_wilsons_interval(planted):
    """A detector drops every 7th contact frame, so every contact loses about as much: frames are independent draws."""
    missed = int((planted.truth & ~planted.reported).sum())
    time_missed = planted.audit.time_missed
    assert (time_missed.lower, time_missed.upper) == wilson_interval(missed, int(planted.truth.sum()))


@pytest.mark.slow
@pytest.mark.parametrize("planted", ["Late"], indirect=True)
def test_contacts_reported_late_begin_and_end_late(planted):
    """A detector is three frames of 90 Hz late: each contact begins 1/30 s late, lasts as long, and ends late."""
    matched = planted.result.matches["faulty"].matched
    assert len(matched) == len(segments(planted.truth))
    assert [item.onset_error for item in matched] == pytest.approx([3 * FRAME_S] * len(matched), abs=1e-7)
    assert [item.duration_error for item in matched] == pytest.approx([0.0] * len(matched), abs=1e-7)
    assert {(item.kind, item.cause) for item in planted.result.false["faulty"]} == {("ends late", "late")}


def test_contact_of_bounding_spheres_alone_is_unconfirmed():
    """The detector ``sphere`` tests bounding spheres and nothing finer: the tables call its false reports unconfirmed.

    Their cause says so, and no table calls them false or unexplained. A ball comes down on a plate for 2 s.
    """
    session, _ = make_analytic("ball-plate", seconds=2.0)
    result = compute(session, detectors="spheres=sphere")
    assert {item.cause for item in result.false["spheres"]} == {"only bounding volumes overlap"}
    console = Console(width=200, record=True, file=StringIO())
    console.print(run_tables(result))
    printed = " ".join(console.export_text().split())
    assert "unconfirmed frames" in printed
    for absent in ("unexplained", "false contacts of", "false frames"):
        assert absent not in printed
