import json
from dataclasses import replace
from time import perf_counter

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
from sessions.model.scene import SceneBody, SceneEffect


@pytest.fixture(scope="module")
def document_of_short_run():
    """The document of a run of six frames with one contact, in frame 2, from 0 s on and with seed 5."""
    session = unit_cubes_on_x({"a": [0] * 6, "b": [3, 3, 0.9, 3, 3, 3]})
    return compute(session, detectors="slow=discrete[rate_hz=30]", oracle="hybrid", seed=5, start=0.0).document


def test_summary_json_is_read_back_as_the_same_document(document_of_short_run):
    """A run with seed 5 from 0 s on is read without problems; the JSON states schema, seed and window."""
    plain = json.loads(json_of(document_of_short_run))
    document, problems = document_of(plain)
    assert (document, problems) == (document_of_short_run, ())
    assert (plain["schema"], plain["seed"], plain["window"]) == (SCHEMA, 5, {"start": 0.0, "end": None})


def test_summary_holds_settings_digest_and_times_of_every_detector(document_of_short_run):
    """The audited detector, at 30 Hz, and the reference; a digest is 64 hexadecimal digits (SHA-256).

    The longest stage is that with the most seconds. Both ran frame by frame (``live``), so that samples have times.
    """
    assert document_of_short_run.detectors.keys() == {"slow", "hybrid"}
    for detector in document_of_short_run.detectors.values():
        assert detector.settings
        assert len(detector.digest) == 64
        stages = detector.seconds.stages
        assert stages[detector.seconds.longest_stage.stage] == max(stages.values())
        assert detector.online
        assert detector.live, "times of one table are taken alike"
        assert detector.seconds.sample_times.max >= detector.seconds.sample_times.median >= 0
    assert document_of_short_run.detectors["slow"].settings["rate_hz"] == 30


def test_summary_counts_the_verdicts_of_the_reference(document_of_short_run):
    """Two cubes in six frames have six verdicts by hybrid, and a digest of the faces in contact."""
    reference = document_of_short_run.detectors["hybrid"]
    assert sum(reference.verdicts.values()) == 6
    assert len(reference.faces_digest) == 64


def test_dropped_frames_are_counted_by_reason():
    """Stamps 0, 10, 10, 5, 30 ns: the second 10 repeats and 5 goes backwards, so three frames stay; a note on each."""
    session = session_of_frames([0, 10, 10, 5, 30], np.full((5, 2), int(Status.VALID)))
    recorded = compute(session, detectors="sphere", oracle="none").document.session
    assert recorded.dropped_frames == DroppedFrames(repeated=1, backwards=1)
    assert recorded.frames == 3
    assert len(recorded.notes) == 2


def test_effect_has_its_share_of_the_time_of_the_run():
    """The fraction of an effect is its seconds, of those of the run.

    The run took no longer than the call that computes it, so that the fraction is no smaller than that of the call.
    """
    scene = Scene(bodies=(SceneBody("a"), SceneBody("b")), effects=(SceneEffect("contact", {"between": ["a", "b"]}),))
    start = perf_counter()
    document = compute(
        unit_cubes_on_x({"a": [0] * 6, "b": [3, 3, 0.9, 3, 3, 3]}, scene=scene), detectors="hybrid", oracle="none"
    ).document
    effect = document.effects["contact"]
    assert effect.seconds / (perf_counter() - start) <= effect.fraction <= 1.0


def test_duration_is_that_of_the_replayed_frames():
    """Frames at 0 to 50 ms, of which those from 20 ms on are replayed."""
    session = unit_cubes_on_x({"a": [0] * 6, "b": [3, 3, 0.9, 3, 3, 3]})
    reported = compute(session, detectors="sphere", oracle="none", start=0.02).document.session
    assert (reported.frames, reported.duration) == (4, pytest.approx(0.03))


def test_verdicts_that_rest_on_a_flagged_pose_are_counted(monkeypatch):
    """Body a has a quaternion of length 1.5, which is flagged, in frames 1, 3 and 4 of six; it touches b in frame 4.

    So three verdicts are flagged, two clear and one contact; they are counted in blocks of four frames.
    """
    monkeypatch.setattr(summary, "VERDICT_FRAMES", 4)
    positions, quaternions = np.zeros((6, 2, 3)), np.tile([0.0, 0.0, 0.0, 1.0], (6, 2, 1))
    positions[:, 1, 0] = [1.03, 1.02, 1.01, 1.01, 0.99, 1.01]  # of b, a cube of 1 m as a
    quaternions[[1, 3, 4], 0] *= 1.5
    valid = np.full((6, 2), int(Status.VALID))
    session = session_of_frames(np.arange(6) * 10_000_000, valid, positions, quaternions)
    document = compute(session, detectors="hybrid", oracle="none", policy=["non-unit-quaternion=hold"]).document
    assert document.flagged_verdicts == {"hybrid": {"clear": 2, "contact": 1}}


def detection_with(seconds):
    """A detection of frames without contact, and the seconds of its stages: an array by frame, or a number of all."""
    frames = max((len(own) for own in seconds.values() if isinstance(own, np.ndarray)), default=2)
    return Detection(**{**vars(verdicts(["."] * frames)), "seconds": seconds})


def test_seconds_of_a_frame_are_the_sum_of_stages():
    """Stages x and y take 1 and 0.5 s in frame 0, 2 and 0.25 s in frame 1."""
    detection = detection_with({"x": np.array([1.0, 2.0]), "y": np.array([0.5, 0.25])})
    assert frame_seconds(detection).tolist() == [1.5, 2.25]


@pytest.mark.parametrize("seconds", [{}, {"x": 1.0}], ids=["no stages", "a stage timed as a whole"])
def test_without_times_by_frame_a_frame_has_no_seconds(seconds):
    """A detection without stages, or with a number for all frames: neither a sum of stages, nor times of samples."""
    assert frame_seconds(detection_with(seconds)) is None
    assert sample_times(detection_with(seconds), rate_hz=None) is None


def test_samples_over_the_frame_of_a_headset_are_a_fraction():
    """Stages of 6 ms add up to 12 ms in one frame of four; a frame of 90 Hz has 11.1 ms."""
    stages = {"broad": np.array([1e-3, 6e-3, 1e-3, 1e-3]), "narrow": np.array([1e-3, 6e-3, 9e-3, 1e-3])}
    times = sample_times(detection_with(stages), rate_hz=None)
    assert times.samples == 4
    assert times.over_budget == 1 / 4
    assert times.max == pytest.approx(0.012)


def test_facts_about_a_person_stay_in_the_session_file():
    """Serial number, name and address are withheld from document and report; clock and pseudonym stay.

    A room that is "not stated" is no fact; the name of the session's file has the person's name too.
    """
    public = {"clock": "steady", "pseudonym": "S07"}
    private = {"devices": "LHR-8F0A0C11 -> left", "student_name": "Anna Muster", "email": "anna@example.org"}
    facts = {**public, **private, "room": "not stated"}
    session = unit_cubes_on_x({"a": [0] * 6, "b": [3, 3, 0.9, 0.9, 3, 3]}, facts=facts)
    result = compute(replace(session, origin="anna.muster/s.mcap"), detectors="hybrid", oracle="none")
    assert result.document.session.facts == public
    assert result.document.session.facts_withheld == len(private)
    report = report_html(result)
    assert "3 facts withheld" in report
    for text in (str(result.document), report):
        assert [word for word in ("muster", "anna", "lhr") if word in text.lower()] == []


@pytest.mark.parametrize(
    ("scene", "pseudonym", "name"),
    [("Titration", "S07", "Titration"), ("", "S07", "S07"), ("", "not stated", "session 1f"), ("", None, "session 1f")],
)
def test_session_is_called_by_scene_then_pseudonym_then_id(scene, pseudonym, name):
    """The id of the session is 1f; ``None``: the recording has no such fact."""
    facts = {} if pseudonym is None else {"pseudonym": pseudonym}
    session = unit_cubes_on_x({"a": [0.0], "b": [3.0]}, scene=Scene(name=scene), facts=facts)
    assert session_name(session, "1f") == name
