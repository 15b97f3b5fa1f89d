"""Every sentence about what was not counted, and of gates, against counts worked out by hand, in every state."""

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from msgspec import convert
from support.report_states import detector_of, document_with
from support.shapes import beaker_mesh
from support.small_worlds import STEP_NS, session_of_frames, unit_cubes_on_x

import replay
from replay.document import headline
from replay.document.detector_labels import shape_label
from replay.document.gates import Gates
from replay.document.session import FindingRecord
from replay.engine import compute
from replay.show.report.sections import trust
from sessions import Finding, MeshData, Severity, Status

NO_FAULT_ALLOWED = Gates(max_missed=0.0, max_false=0.0)
STATES = tomllib.loads(Path(__file__).with_name("sentences.toml").read_text("utf-8"))
"""State -> what reference and detector say, a letter a frame (C: contact, -: no pose), and the sentences about it."""

SCRIPTED_VERDICTS = str.maketrans(".C-", "ncn")
"""Letters of sentences.toml -> letters of the scripted detector: c is contact, n none."""


def scripted(letters):
    """A detector that says what these letters say, one a frame."""
    return f"support.planted_detectors:Scripted[says={letters}]"


@pytest.mark.parametrize("state", STATES)
def test_every_sentence_holds_in_every_state(state):
    """A state is a row of sentences.toml: verdicts of reference and detector, a letter a frame, and the sentences.

    Gates allow no miss and no false contact.
    """
    row = STATES[state]
    status = [[Status.VALID, Status.LOST if letter == "-" else Status.VALID] for letter in row["oracle"]]
    oracle, subject = (row[name].translate(SCRIPTED_VERDICTS) for name in ("oracle", "subject"))
    session = session_of_frames(np.arange(len(status)) * STEP_NS, status)
    # A letter more than there are frames: a detector of equal settings would be the reference itself.
    run = compute(session, detectors="it=" + scripted(subject + "n"), oracle="exact=" + scripted(oracle))
    sentences = headline.undecided_lines(run) + NO_FAULT_ALLOWED.broken_limits(run.document.audit, session_times=[])
    assert sentences == row["sentences"]


def test_the_moment_of_a_false_contact_holds_its_gap():
    """A detector reports contact in frames 1 and 2 of four, in which bodies are metres apart, and exact none.

    The first answer of a run is about its worst fault, here the only one, and has the metres of its gap.
    """
    session = session_of_frames(np.arange(4) * STEP_NS, [[Status.VALID, Status.VALID]] * 4)
    # A letter more than there are frames: a detector of equal settings would be the reference itself.
    run = compute(session, detectors="it=" + scripted("nccnn"), oracle="exact=" + scripted("nnnn"))
    (false_contact,), (answer, *_) = run.false["it"], run.answers
    assert answer.moment.metres == false_contact.metres > 0.0


@pytest.mark.parametrize(
    ("severities", "text"),
    [
        pytest.param((), "Nothing suspicious found", id="no finding"),
        pytest.param((Severity.NOTE,), "Nothing suspicious found", id="a note"),
        pytest.param(
            (Severity.WARNING,),
            "1 warning about the recording: verdicts on these spans carry a flag",
            id="a warning",
        ),
        pytest.param(
            (Severity.ERROR, Severity.WARNING, Severity.WARNING),
            "1 error and 2 warnings about the recording: verdicts on these spans carry a flag",
            id="errors before warnings",
        ),
    ],
)
def test_report_states_the_severity_of_the_doctors_findings(severities, text):
    """``doctor`` examines the recording before a run; a finding of its is an error, a warning or a note."""
    findings = [Finding("frozen", "it stood still", own_severity=severity).as_json() for severity in severities]
    records = tuple(convert(finding, FindingRecord) for finding in findings)
    assert trust(document_with(findings=records, detectors={"it": detector_of("hybrid")})) == text


def doubts_about(*findings):
    """Sentences on what makes all contacts of a recording with these findings doubtful."""
    records = tuple(convert(finding.as_json(), FindingRecord) for finding in findings)
    return headline.doubts(document_with(findings=records))


FROZEN_POSE = Finding("frozen", "it stood still", "a")


def test_frozen_pose_is_no_doubt_about_a_recording():
    """Body a stood still: that concerns its moment alone."""
    assert doubts_about(FROZEN_POSE) == []


def test_doubts_are_errors_and_suspect_units_each_kind_once():
    """Left and right are swapped, an error; three bodies are 3 km away, one doubt: their unit may be another.

    A suspect unit makes all contacts doubtful though it is a warning; FROZEN_POSE is one that does not. So five
    findings are two sentences.
    """
    swapped = Finding("handedness", "left is right", own_severity=Severity.ERROR)
    units = [Finding("unit-suspect", "3000 m away", body) for body in ("a", "b", "c")]
    first, second = doubts_about(swapped, FROZEN_POSE, *units)
    assert first == (
        "Error, handedness: left and right seem to be swapped (left is right). "
        "To do: import with the source's handedness."
    )
    assert "(a: 3000 m away; 2 more like it)" in second


def test_pair_frames_an_engine_cannot_test_have_a_reason():
    """Two hollow beakers, whose boxes overlap in two of four frames; Bullet leaves them undecided in all four."""
    pytest.importorskip("pybullet")
    hollow = beaker_mesh()
    session = unit_cubes_on_x({"a": [0, 0, 0, 0], "b": [3, 0.1, 0.2, 3]})
    meshes = {name: MeshData(hollow.vertices, hollow.faces) for name in ("a", "b")}
    result = replay.run(replace(session, meshes=meshes), detectors="bullet[shape=mesh]")
    assert result.document.audit["bullet-mesh"].undecided_reasons == {
        "not supported: Bullet tests no triangle mesh against another": 4
    }
    assert any("Of them 4: not supported" in line for line in headline.undecided_lines(result))


@pytest.fixture
def session_600_mm_apart():
    """Boxes of 1 m, whose surfaces are 0.6 m apart in frames 1 and 2 of five, and 2 m in the others."""
    return unit_cubes_on_x({"a": [0, 0, 0, 0, 0], "b": [3, 1.6, 1.6, 3, 3]})


def test_contact_offset_explains_false_contact_of_distant_shapes(session_600_mm_apart):
    """Boxes are 0.6 m apart in frames 1 and 2; with a contact offset of 0.5 m each they report contact up to 1 m."""
    result = replay.run(session_600_mm_apart, detectors="skin=collider[skin_m=0.5]")
    (false_contact,) = result.false["skin"]
    assert (false_contact.first, false_contact.last) == (1, 2)
    (reason,) = (answer.why for answer in result.answers if answer.label == "skin")
    assert "600 mm apart" in reason and "from 1 m on" in reason and "meet" not in reason


def test_without_a_contact_offset_distant_shapes_are_no_contact(session_600_mm_apart):
    """Boxes are 0.6 m apart and farther; ``skin_m``: the contact offset of each in metres."""
    result = replay.run(session_600_mm_apart, detectors="skin=collider[skin_m=0.0]")
    assert not result.false["skin"]


@pytest.mark.parametrize(
    ("settings", "label"),
    [
        ({"shape": "hull"}, "convex hulls"),
        ({"shape": "compound", "pieces": 1}, "1 convex piece"),
        ({"shape": "compound", "pieces": 16}, "16 convex pieces"),
    ],
    ids=["hull", "one piece", "sixteen pieces"],
)
def test_colliders_are_named_by_shape_or_number_of_pieces(settings, label):
    """``settings``: of the detector ``collider``, of which ``compound`` splits each mesh into convex pieces."""
    assert shape_label(settings) == label
