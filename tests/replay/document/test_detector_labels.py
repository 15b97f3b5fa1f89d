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


@pytest.mark.parametrize("state", STATES)
def test_every_sentence_holds_in_every_state(state):
    """A state is a row of sentences.toml: verdicts of reference and detector, a letter a frame, and the sentences.

    Gates allow no miss and no false contact.
    """
    row = STATES[state]
    status = [[Status.VALID, Status.LOST if letter == "-" else Status.VALID] for letter in row["oracle"]]
    oracle, subject = (row[name].translate(SCRIPTED_VERDICTS) for name in ("oracle", "subject"))
    scripted = "support.planted_detectors:Scripted[says={}]".format
    session = session_of_frames(np.arange(len(status)) * STEP_NS, status)
    # A letter more than there are frames: a detector of equal settings would be the reference itself.
    run = compute(session, detectors="it=" + scripted(subject + "n"), oracle="exact=" + scripted(oracle))
    sentences = headline.undecided_lines(run) + NO_FAULT_ALLOWED.broken_limits(run.document.audit, [])
    assert sentences == row["sentences"]


def test_the_moment_of_a_false_contact_holds_its_gap():
    """A detector invents contact in frames 1 and 2 of four; the first answer of a run is about its worst fault."""
    scripted = "support.planted_detectors:Scripted[says={}]".format
    session = session_of_frames(np.arange(4) * STEP_NS, [[Status.VALID, Status.VALID]] * 4)
    # A letter more than there are frames: a detector of equal settings would be the reference itself.
    run = compute(session, detectors="it=" + scripted("nccnn"), oracle="exact=" + scripted("nnnn"))
    (false_contact,), (answer, *_) = run.false["it"], run.answers
    assert answer.moment.metres == false_contact.metres > 0.0


@pytest.mark.parametrize(
    ("severities", "text"),
    [
        ((), "Nothing suspicious found"),
        ((Severity.NOTE,), "Nothing suspicious found"),
        ((Severity.WARNING,), "1 warning about the recording: verdicts on these spans carry a flag"),
        (
            (Severity.ERROR, Severity.WARNING, Severity.WARNING),
            "1 error and 2 warnings about the recording: verdicts on these spans carry a flag",
        ),
    ],
)
def test_report_states_the_severity_of_the_doctors_findings(severities, text):
    """Notes are nothing suspicious; errors come before warnings."""
    findings = [Finding("frozen", "it stood still", own_severity=severity).as_json() for severity in severities]
    records = tuple(convert(finding, FindingRecord) for finding in findings)
    assert trust(document_with(findings=records, detectors={"it": detector_of("hybrid")})) == text


def doubted(*findings):
    """The sentence of doubt of a document with these findings."""
    records = tuple(convert(finding.as_json(), FindingRecord) for finding in findings)
    return headline.doubts(document_with(findings=records))


def test_doubts_are_errors_units_axes_and_handedness():
    """Not a frozen pose; three findings of one kind are one sentence."""
    units = [Finding("unit-suspect", "3000 m away", name) for name in "abc"]
    noted = Finding("frozen", "it stood still", "a")
    assert doubted(noted) == []
    first, second = doubted(Finding("handedness", "left is right", own_severity=Severity.ERROR), noted, *units)
    assert first == (
        "Error, handedness: left and right seem to be swapped (left is right). "
        "To do: import with the source's handedness."
    )
    assert "(a: 3000 m away; 2 more like it)" in second


def test_pair_frames_an_engine_cannot_test_have_a_reason():
    """Two hollow beakers, whose boxes overlap in two of four frames, are left undecided in all of them."""
    pytest.importorskip("pybullet")
    hollow = beaker_mesh()
    session = unit_cubes_on_x({"a": [0, 0, 0, 0], "b": [3, 0.1, 0.2, 3]})
    meshes = {name: MeshData(hollow.vertices, hollow.faces) for name in "ab"}
    result = replay.run(replace(session, meshes=meshes), detectors="bullet[shape=mesh]")
    assert result.document.audit["bullet-mesh"].undecided_reasons == {
        "not supported: Bullet tests no triangle mesh against another": 4
    }
    assert any("Of them 4: not supported" in line for line in headline.undecided_lines(result))


@pytest.mark.parametrize(("skin", "gap"), [(0.5, 0.6), (0.0, None)])
def test_contact_offset_explains_false_contact_of_distant_shapes(skin, gap):
    """Unit boxes 0.6 m apart report contact with an offset of 0.5 m each, and none without."""
    session = unit_cubes_on_x({"a": [0, 0, 0, 0, 0], "b": [3, 1 + (gap or 0), 1 + (gap or 0), 3, 3]})
    result = replay.run(session, detectors=f"skin=collider[skin_m={skin}]")
    reasons = [answer.why for answer in result.answers if answer.label == "skin"]
    assert bool(result.false["skin"]) == (gap is not None)
    if gap is not None:
        assert "600 mm apart" in reasons[0] and "from 1 m on" in reasons[0] and "meet" not in reasons[0]


@pytest.mark.parametrize(
    ("settings", "label"),
    [
        ({"shape": "hull"}, "convex hulls"),
        ({"shape": "compound", "pieces": 1}, "1 convex piece"),
        ({"shape": "compound", "pieces": 16}, "16 convex pieces"),
    ],
)
def test_colliders_are_named_by_shape_or_number_of_pieces(settings, label):
    """``settings``: of a collider."""
    assert shape_label(settings) == label
