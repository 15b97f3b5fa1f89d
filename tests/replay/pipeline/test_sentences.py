"""Every sentence about what was not counted, and of gates, against counts worked out by hand, in every state."""

from dataclasses import replace
from types import SimpleNamespace

import pytest
from support.shapes import beaker_mesh
from support.small_worlds import cubes, verdict_column

import replay
from replay.comparison.compare import compare
from replay.comparison.contact_counts import count_contacts
from replay.comparison.episodes import episodes
from replay.comparison.misses import stretches
from replay.outputs.report.sections import trust
from replay.pipeline import headline
from replay.pipeline.gates import Gates
from replay.pipeline.scores import score
from sessions import Finding, MeshData, Severity

LIMITS = Gates(max_missed=0.0, max_p99_ms=1.0, max_invented=0.0)

STATES = {
    # state: (oracle, subject, every sentence)
    "none": ("......", "......", [
        "--max-missed cannot be checked: there is no contact for it to miss",
    ]),
    "one": (".C....", "......", [
        "it missed 1 of 1 contacts (100 % (too few contacts to say)), more than --max-missed 0",
        "it missed 1 of 1 pair-frames in contact (100 % (too few contacts to say)), more than --max-missed 0",
    ]),
    "one found": (".C....", ".C....", []),
    "several": ("C.C.CC", "..C.C.", [
        "it missed 1 of 3 contacts (33 % (too few contacts to say)), more than --max-missed 0",
        "it missed 2 of 4 pair-frames in contact (50 % (too few contacts to say)), more than --max-missed 0",
    ]),
    "in part": ("CCCC..", "C.C...", [
        "it missed 2 of 4 pair-frames in contact (50 % (too few contacts to say)), more than --max-missed 0",
    ]),
    "undecided": (".C.CC.", ".u.uu.", [
        "Not counted: 3 of 6 pair-frames with a pose, which exact or it did not decide.",
        "--max-missed cannot be checked: it left 3 pair-frames in contact undecided, 2 of 2 contacts whole",
    ]),
    "undecided in part": (".C.CC.", ".C.uC.", [
        "Not counted: 1 of 6 pair-frames with a pose, which exact or it did not decide.",
        "--max-missed cannot be checked: it left 1 pair-frames in contact undecided, 0 of 2 contacts whole",
    ]),
    "not measured": ("uuuuuu", "......", [
        "Not counted: 6 of 6 pair-frames with a pose, which exact or it did not decide.",
        "--max-missed cannot be checked: there is no contact for it to miss",
        "--max-missed cannot be checked: the reference left 6 pair-frames undecided",
        "--max-invented cannot be checked: it was compared in no pair-frame",
        "--max-invented cannot be checked: the reference left 6 pair-frames undecided",
    ]),
    "no pose": ("------", "------", [
        "--max-missed cannot be checked: there is no contact for it to miss",
        "--max-invented cannot be checked: it was compared in no pair-frame",
    ]),
    "more invented than found": ("C.....", "C.CC.C", [
        "it invented 3 of the 4 pair-frames in contact that it reports (75 % (too few contacts to say)), "
        "more than --max-invented 0",
    ]),
}  # fmt: skip
UNTIMED = "--max-p99-ms cannot be checked: it was not timed frame by frame in s.mcap"


def audited(oracle, subject):
    """A run of one pair, a letter a frame, with its summary as far as sentences read it."""
    detections = {"exact": verdict_column(oracle), "it": verdict_column(subject)}
    comparison = compare(detections["it"], detections["exact"], ("it", "exact"))
    found = {label: episodes(one) for label, one in detections.items()}
    run = SimpleNamespace(
        noise=None,
        oracle="exact", detections=detections, comparisons={"it": comparison}, episodes=found, face_recall={},
        misses={"it": stretches(comparison, found["exact"])}, causes={}, matches={}, treatment=None, holdings=(),
        phases={}, false={}, counts={"it": count_contacts(comparison, found["exact"])}, loose=found["exact"],
    )  # fmt: skip
    took = {"name": "x", "live": True, "faces_asked": False, "seconds": {"per_frame_mean": 1e-3}, "contacts": 0}
    run.summary = {
        "audit": {"it": score(run, "it")}, "session": {"name": "s.mcap", "frames": 6}, "oracle": "exact",
        "detectors": {"exact": {**took, "live": False, "faces_asked": True}, "it": took},
    }  # fmt: skip
    return run


def said(run):
    """What was not counted, and what the gates say."""
    return headline.undecided(run) + LIMITS.broken(run.summary["audit"], [run.summary])


@pytest.mark.parametrize("state", STATES)
def test_every_sentence_holds_in_every_state(state):
    oracle, subject, sentences = STATES[state]
    run = audited(oracle, subject)
    assert said(run) == [*sentences, UNTIMED]


@pytest.mark.parametrize(
    ("severities", "words"),
    [
        ((), "Nothing suspicious found"),
        ((Severity.NOTE,), "Nothing suspicious found"),
        ((Severity.WARNING,), "1 warning about the recording: verdicts on these spans carry a flag"),
        (
            (Severity.ERROR, Severity.WARNING, Severity.WARNING),
            "1 error and 2 warnings about the recording: verdicts on these spans carry a flag",
        ),
    ],
)  # fmt: skip
def test_the_report_says_how_much_is_suspicious(severities, words):
    findings = [{"severity": one.name.lower()} for one in severities]
    assert trust({"findings": findings, "detectors": {"it": {}}}) == words
    assert trust({"detectors": {}}) == "The recording was not examined"


def doubted(*findings):
    return headline.doubts(SimpleNamespace(treatment=SimpleNamespace(findings=findings)))


def test_doubts_are_of_errors_and_of_units_axes_and_handedness_a_line_a_kind():
    units = [Finding("unit-suspect", "3000 m away", name) for name in "abc"]
    noted = Finding("frozen", "it stood still", "a")
    assert doubted(noted) == []
    first, second = doubted(Finding("handedness", "left is right", own_severity=Severity.ERROR), noted, *units)
    assert first == (
        "Error, handedness: left and right seem to be swapped (left is right). "
        "To do: import with the source's handedness."
    )
    assert "(a: 3000 m away; 2 more like it)" in second


def test_pair_frames_that_an_engine_cannot_test_are_counted_with_the_reason():
    pytest.importorskip("pybullet")
    hollow = beaker_mesh()
    session = cubes({"a": [0, 0, 0, 0], "b": [3, 0.1, 0.2, 3]})
    meshes = {name: MeshData(hollow.vertices, hollow.faces) for name in "ab"}
    found = replay.run(replace(session, meshes=meshes), detectors="bullet[shape=mesh]")
    assert found.summary["audit"]["bullet-mesh"]["undecided_reasons"] == {
        "not supported: Bullet tests no triangle mesh against another": 4
    }
    assert any("Of them 4: not supported" in words for words in headline.undecided(found))


@pytest.mark.parametrize(("skin", "apart"), [(0.5, 0.6), (0.0, None)])
def test_a_false_contact_within_a_contact_offset_is_not_called_a_meeting_of_shapes(skin, apart):
    session = cubes({"a": [0, 0, 0, 0, 0], "b": [3, 1 + (apart or 0), 1 + (apart or 0), 3, 3]})
    found = replay.run(session, detectors=f"skin=collider[skin_m={skin}]")
    told = [answer.why for answer in found.answers if answer.label == "skin"]
    assert bool(found.false["skin"]) == (apart is not None)
    if apart is not None:
        assert "600 mm apart" in told[0] and "1000 mm" in told[0] and "meet" not in told[0]
