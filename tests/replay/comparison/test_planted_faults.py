"""What was planted is what is counted: contacts known in closed form, detectors with one known fault each."""

from io import StringIO

import numpy as np
import pytest
from rich.console import Console

from replay.base.wilson import wilson
from replay.cli.run_tables import run_tables
from replay.pipeline.engine import compute
from sessions.doctor.runs import runs
from sessions.synthetic.analytic import make_analytic
from sessions.synthetic.truth import OPEN, PRESENT

STEP = 1 / 90


@pytest.fixture(scope="module")
def plate():
    """A ball on a plate for nine seconds and a half, and in which frames the formula says that they touch."""
    session, truth = make_analytic("ball-plate", seconds=9.5)
    expected = truth.expected("ball", "plate", session.frames.stamp_ns)
    assert not (expected == OPEN).any()
    spans = [(first, last) for first, last in runs(expected == PRESENT).tolist()]
    assert len(spans) > 5 and min(last - first for first, last in spans) > 20
    return session, spans


def audited(session, fault):
    result = compute(session, detectors=f"it=support.planted_detectors:{fault}")
    return result, result.summary["audit"]["it"]


def terminal_text(result):
    console = Console(width=200, record=True, file=StringIO())
    console.print(run_tables(result))
    return console.export_text()


def test_every_seventh_frame_dropped_is_counted_and_splits_every_contact(plate):
    session, spans = plate
    _, figures = audited(session, "Dropping")
    frames = [frame for first, last in spans for frame in range(first, last + 1)]
    kept = np.isin(np.arange(len(session.frames.stamp_ns)), frames)
    kept[frames[6::7]] = False
    assert (figures["missed"]["count"], figures["missed"]["of"]) == (len(frames[6::7]), len(frames))
    assert (figures["missed"]["low"], figures["missed"]["high"]) == wilson(len(frames[6::7]), len(frames))
    told, pieces = figures["episodes"], len(runs(kept))
    assert (told["found"], told["pieces"], told["missed"]) == (pieces, pieces - len(spans), 0)
    assert told["matched"] == told["split"] == len(spans)


def test_a_delay_of_three_frames_is_the_onset_error_and_no_duration_error(plate):
    session, spans = plate
    result, figures = audited(session, "Late")
    assert figures["missed"]["count"] == figures["invented"]["count"] == 3 * len(spans)
    assert [figures["episodes"][key] for key in ("matched", "missed", "invented", "split")] == [len(spans), 0, 0, 0]
    matched = result.matches["it"].matched
    assert [one.overlap for one in matched] == [last - first - 2 for first, last in spans]
    errors = np.array([(one.onset_error, one.duration_error) for one in matched])
    assert errors == pytest.approx(np.tile([3 * STEP, 0.0], (len(spans), 1)), abs=1e-7)


def test_the_false_tail_of_a_late_detector_is_late_and_what_spheres_alone_say_is_unconfirmed(plate):
    session, spans = plate
    result, _ = audited(session, "Late")
    false = result.false["it"]
    assert len(false) == len(spans) and {(one.kind, one.cause) for one in false} == {("ends late", "late")}
    ball = compute(session, detectors="ball=sphere")
    assert {one.cause for one in ball.false["ball"]} == {"only bounding volumes overlap"}
    printed = terminal_text(ball)
    assert "unconfirmed frames" in printed and "unexplained" not in printed
    assert "false contacts of" not in printed and "false frames" not in printed


def test_invented_contacts_are_counted_and_match_nothing(plate):
    session, spans = plate
    _, figures = audited(session, "Inventing")
    touching = {frame for first, last in spans for frame in range(first, last + 1)}
    total = len(session.frames.stamp_ns)
    planted = [f for f in range(100, total - 3, 100) if not touching & set(range(f - 1, f + 3))]
    assert planted
    assert figures["invented"]["count"] == 2 * len(planted) and figures["missed"]["count"] == 0
    told = figures["episodes"]
    assert (told["matched"], told["invented"], told["found"]) == (len(spans), len(planted), len(spans) + len(planted))
    part = told["invented_share"]
    assert (part["low"], part["high"]) == wilson(len(planted), told["found"])


def test_a_detector_blind_to_one_pair_misses_all_of_it_and_nothing_else(plate):
    session, spans = plate
    result, figures = audited(session, "Blind")
    assert figures["episodes"]["missed"] == figures["contacts_missed"] == len(spans)
    assert figures["episodes"]["missed_share"]["share"] == 1.0 and figures["episodes"]["matched"] == 0
    assert figures["episodes"]["missed_share"]["low"] == wilson(len(spans), len(spans))[0]
    assert [(m.first, m.last) for m in result.misses["it"]] == spans
    assert figures["episodes"]["onset_error"] is None
