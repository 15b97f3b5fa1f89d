import json
from dataclasses import replace

import numpy as np
import pytest
from support.small_worlds import session_of_frames, unit_cubes_on_x, verdicts

from cdcore import Detection
from replay.document import summary
from replay.document.coding import document_of, json_of
from replay.document.run_document import SCHEMA
from replay.document.session import DroppedFrames
from replay.document.summary import frame_seconds, sample_times, session_name
from replay.engine import compute
from replay.show.report.page import report_html
from sessions import Scene, Status


@pytest.fixture(scope="module")
def document_of_short_run():
    """The document of a run of six frames with one contact, in frame 2."""
    session = unit_cubes_on_x({"a": [0] * 6, "b": [3, 3, 0.9, 3, 3, 3]})
    return compute(session, detectors="slow=discrete[rate_hz=30]", oracle="hybrid", seed=5, start=0.0).document


def test_summary_json_is_read_back_as_the_same_document(document_of_short_run):
    """The run had seed 5 and began at 0 s."""
    plain = json.loads(json_of(document_of_short_run))
    assert document_of(plain) == (document_of_short_run, ())
    assert plain["schema"] == SCHEMA and plain["seed"] == 5 and plain["window"] == {"start": 0.0, "end": None}


def test_summary_holds_settings_digest_and_times_of_every_detector(document_of_short_run):
    """A digest is 64 hexadecimal digits (SHA-256); the six frames of the one pair have six verdicts."""
    for detector in document_of_short_run.detectors.values():
        assert len(detector.digest) == 64 and detector.settings and detector.seconds.stages
    slow, hybrid = document_of_short_run.detectors["slow"], document_of_short_run.detectors["hybrid"]
    assert slow.settings["rate_hz"] == 30 and slow.online and hybrid.online
    assert slow.live and hybrid.live, "times of one table are taken alike"
    assert slow.seconds.sample_times.max >= slow.seconds.sample_times.median >= 0
    assert hybrid.seconds.sample_times and len(hybrid.faces_digest) == 64
    assert sum(hybrid.verdicts.values()) == 6


def test_dropped_frames_are_counted_by_reason():
    """Stamps 0, 10, 10, 5, 30 ms: the second 10 repeats and 5 goes backwards, so three frames stay."""
    session = session_of_frames([0, 10, 10, 5, 30], np.full((5, 2), int(Status.VALID)))
    reported = compute(session, detectors="sphere", oracle="none").document.session
    assert reported.dropped_frames == DroppedFrames(repeated=1, backwards=1) and reported.frames == 3
    assert len(reported.notes) == 2


def test_duration_is_that_of_the_replayed_frames():
    """Frames at 0 to 50 ms, of which those from 20 ms on are replayed."""
    session = unit_cubes_on_x({"a": [0] * 6, "b": [3, 3, 0.9, 3, 3, 3]})
    reported = compute(session, detectors="sphere", oracle="none", start=0.02).document.session
    assert (reported.frames, reported.duration) == (4, pytest.approx(0.03))


def test_verdicts_that_rest_on_a_flagged_pose_are_counted(monkeypatch):
    """Six frames in blocks of four; body a has a quaternion of length 1.5 in frames 1, 3 and 4; it touches in 4."""
    monkeypatch.setattr(summary, "VERDICT_FRAMES", 4)
    positions, quaternions = np.zeros((6, 2, 3)), np.tile([0.0, 0.0, 0.0, 1.0], (6, 2, 1))
    positions[:, 1, 0] = [1.03, 1.02, 1.01, 1.01, 0.99, 1.01]
    quaternions[[1, 3, 4], 0] *= 1.5
    valid = np.full((6, 2), int(Status.VALID))
    session = session_of_frames(np.arange(6) * 10_000_000, valid, positions, quaternions)
    document = compute(session, detectors="hybrid", oracle="none", policy=["non-unit-quaternion=hold"]).document
    assert document.flagged_verdicts == {"hybrid": {"clear": 2, "contact": 1}}


def test_seconds_of_a_frame_are_the_sum_of_stages():
    """Stages x and y take 1 and 0.5 s in frame 0, 2 and 0.25 s in frame 1; without times by frame there is no sum."""
    head = verdicts(["..", ".."])
    online = Detection(**{**vars(head), "seconds": {"x": np.array([1.0, 2.0]), "y": np.array([0.5, 0.25])}})
    assert frame_seconds(online).tolist() == [1.5, 2.25]
    assert frame_seconds(head) is None
    assert frame_seconds(Detection(**{**vars(head), "seconds": {"x": 1.0}})) is None


def test_samples_over_the_frame_of_a_headset_are_a_fraction():
    """Stages of 6 ms add up to 12 ms in one frame of four; a frame of 90 Hz has 11.1 ms."""
    stages = {"broad": np.array([1e-3, 6e-3, 1e-3, 1e-3]), "narrow": np.array([1e-3, 6e-3, 9e-3, 1e-3])}
    head = verdicts(["."] * 4)
    times = sample_times(Detection(**{**vars(head), "seconds": stages}), rate_hz=None)
    assert (times.samples, times.over_budget, times.max) == (4, 0.25, pytest.approx(0.012))
    assert sample_times(Detection(**{**vars(head), "seconds": {"broad": 1.0}}), rate_hz=None) is None


def test_facts_about_a_person_stay_in_the_session_file():
    """Serial number, name and address are withheld; clock and pseudonym stay; a room that is not stated is nothing."""
    known = {"clock": "steady", "pseudonym": "S07"}
    private = {"devices": "LHR-8F0A0C11 -> left", "student_name": "Anna Muster", "email": "anna@example.org"}
    session = unit_cubes_on_x(
        {"a": [0] * 6, "b": [3, 3, 0.9, 0.9, 3, 3]}, facts={**known, **private, "room": "not stated"}
    )
    result = compute(replace(session, origin="anna.muster/s.mcap"), detectors="hybrid", oracle="none")
    reported = result.document.session
    assert reported.facts == known and reported.facts_withheld == 3 and "anna" not in str(reported)
    text = report_html(result)
    assert "3 facts withheld" in text
    for arguments in (str(result.document), text):
        assert not any(word in arguments.lower() for word in ("muster", "anna", "lhr"))


@pytest.mark.parametrize(
    ("scene", "pseudonym", "name"),
    [("Titration", "S07", "Titration"), ("", "S07", "S07"), ("", "not stated", "session 1f"), ("", None, "session 1f")],
)
def test_session_is_called_by_scene_then_pseudonym_then_id(scene, pseudonym, name):
    """``session 1f`` is made of the session's id."""
    facts = {} if pseudonym is None else {"pseudonym": pseudonym}
    session = unit_cubes_on_x({"a": [0.0], "b": [3.0]}, scene=Scene(name=scene), facts=facts)
    assert session_name(session, "1f") == name
