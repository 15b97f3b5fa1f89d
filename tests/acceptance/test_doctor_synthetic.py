"""On made-up sessions the doctor finds what was planted, with body and span, and nothing else."""

import numpy as np
import pytest
from support.planted_faults import BODIES, FAULTS, clean_draft, teleport
from support.small_worlds import ANALYTIC, make_analytic

from sessions import Session, Severity, Track, examine
from sessions.geometry.rotations import IDENTITY
from sessions.synthetic.scenes import SCENES, make_scene_session

QUICK = "flame-test"
"""The scene that is made in least time."""
SCENES_WITH_A_QUICK_CASE = [
    QUICK,
    *(pytest.param(name, marks=pytest.mark.slow) for name in SCENES if name != QUICK),
]
FACES_OF_JITTER = {"even": 600, "browser": 5000}
"""Faces of each mesh: few in the quick cases, as many as usual in the slow ones."""
LOSSES = ("tracking-lost", "identity-while-lost", "frozen")
"""Codes of the findings that say that tracking was lost."""


@pytest.mark.sampled(9)
@pytest.mark.parametrize("name", [*SCENES_WITH_A_QUICK_CASE, *ANALYTIC])
@pytest.mark.parametrize("jitter", ["even", pytest.param("browser", marks=pytest.mark.slow)])
def test_without_noise_nothing_is_above_a_note(name, jitter):
    """A made-up session without noise: poses are never lost or wrong; uneven frames, as of a browser, are a note."""
    if name in ANALYTIC:
        session, _ = make_analytic(name, noise="off", jitter=jitter)
    else:
        session, _ = make_scene_session(name, noise="off", jitter=jitter, faces=FACES_OF_JITTER[jitter])
    assert [item for item in examine(session) if item.severity > Severity.NOTE] == []


def as_identity(track):
    """The track as SteamVR writes it: while lost, an identity pose that calls itself valid."""
    lost = ~track.valid[:, None]
    return Track(track.times_ns, np.where(lost, 0.0, track.positions), np.where(lost, IDENTITY, track.quaternions_xyzw))


@pytest.mark.sampled(12)
@pytest.mark.parametrize("losses", [pytest.param("flagged", marks=pytest.mark.slow), "identity"])
@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", SCENES)
def test_noisy_losses_are_detected_and_nothing_else_exceeds_a_warning(name, seed, losses):
    """A tracker with noise is lost now and then: its poses are flagged, or are the identity and call themselves valid.

    A finding of LOSSES lies within each planted loss of a tracker, and each lies within a planted loss of a body. Only
    they are above a warning; above a note there are jumps too, as poses come back.
    """
    session, truth = make_scene_session(name, seed=seed, noise="vive", faces=600)
    if losses == "identity":
        tracks = {body: as_identity(track) for body, track in session.tracks.items()}
        session = Session.from_tracks(tracks, meshes=session.meshes, scene=session.scene)
    findings = examine(session)

    planted_losses = [fact for fact in truth.facts if fact.kind == "loss"]
    assert planted_losses
    loss_findings = [item for item in findings if item.code in LOSSES]

    def is_within(item, body, loss):
        return item.body == body and loss.start <= item.start <= item.end <= loss.end

    for loss in planted_losses:
        # The first body is the one whose tracker is lost; what it carries has no tracker of its own.
        tracked_body = loss.bodies[0]
        assert any(is_within(item, tracked_body, loss) for item in loss_findings), loss
    for item in loss_findings:
        assert any(is_within(item, body, loss) for loss in planted_losses for body in loss.bodies), item

    assert {item.code for item in findings if item.severity > Severity.WARNING} <= set(LOSSES)
    assert {item.code for item in findings if item.severity > Severity.NOTE} <= {*LOSSES, "teleport"}


@pytest.mark.sampled(3)
@pytest.mark.parametrize("name", FAULTS)
@pytest.mark.parametrize("body", [0, 1])
def test_planted_fault_is_reported_with_body_and_interval(name, body, tmp_path):
    """The named fault is planted at frame 300 in a body of a clean session, which is written to a file.

    A finding has its code, body and frames, is above a note, and says what it means and what to do. All that is above a
    note is about the same body; of a fault of no body, about any.
    """
    draft = clean_draft()
    planted = FAULTS[name](draft, body, frame=300)
    findings = examine(draft.write(tmp_path / "one.mcap"))
    assert planted.is_found(findings, draft), [(item.code, item.body, item.message) for item in findings]
    finding = next(item for item in findings if item.code == planted.code)
    assert finding.severity > Severity.NOTE and finding.meaning and finding.fix
    bodies = {planted.body, ""} if planted.body else set(BODIES) | {""}
    assert {item.body for item in findings if item.severity > Severity.NOTE} <= bodies


@pytest.mark.slow
@pytest.mark.parametrize(("metres", "least_reported"), [(0.05, 0.9), (0.1, 1.0), (3.0, 1.0)])
def test_teleports_are_reported_from_five_centimetres(metres, least_reported):
    """Each of three bodies jumps in one of seven frames of a clean session, 21 in all.

    Every jump of ten centimetres and more is reported; of five, a tenth may pass for a quick hand.
    """
    is_reported = []
    for body in (0, 1, 2):
        for frame in range(40, 880, 120):
            draft = clean_draft()
            planted = teleport(metres)(draft, body, frame)
            is_reported.append(planted.is_found(examine(draft.session()), draft))
    assert len(is_reported) == 3 * 7
    assert np.mean(is_reported) >= least_reported
