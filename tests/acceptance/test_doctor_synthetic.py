"""On made-up sessions the doctor finds what was planted, with body and span, and nothing else."""

import numpy as np
import pytest
from support.planted_faults import BODIES, FAULTS, clean_draft, teleport
from support.small_worlds import ANALYTIC, make_analytic

from sessions import Session, Severity, Track, examine
from sessions.geometry.rotations import IDENTITY
from sessions.synthetic.scenes import SCENES, make_scene_session

FIRST, *rest = SCENES
SCENES_WITH_A_QUICK_CASE = [FIRST, *(pytest.param(name, marks=pytest.mark.slow) for name in rest)]
FACES_OF_JITTER = {"even": 600, "browser": 5000}
"""Of each mesh: few in the quick cases, as many as usual in the slow ones."""
LOSSES = ("tracking-lost", "identity-while-lost", "frozen")


@pytest.mark.sampled(9)
@pytest.mark.parametrize("name", [*SCENES_WITH_A_QUICK_CASE, *ANALYTIC])
@pytest.mark.parametrize("jitter", ["even", pytest.param("browser", marks=pytest.mark.slow)])
def test_without_noise_nothing_is_above_a_note(name, jitter):
    """Poses without noise are never lost or wrong; late stamps, as of a browser, are no more than a note."""
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
    """Planted losses of tracking, with poses left out or of the origin; each finding lies within a loss."""
    session, truth = make_scene_session(name, seed=seed, noise="vive", faces=600)
    if losses == "identity":
        tracks = {body: as_identity(track) for body, track in session.tracks.items()}
        session = Session.from_tracks(tracks, meshes=session.meshes, scene=session.scene)
    findings = examine(session)
    # The first body is the one whose tracker is lost; what it carries is where it says, and has no tracker to be lost.
    lost = [fact for fact in truth.facts if fact.kind == "loss"]
    tracked = [(fact.bodies[0], fact.start, fact.end) for fact in lost]
    planted = [(body, fact.start, fact.end) for fact in lost for body in fact.bodies]
    assert planted
    spans = [(item.body, item.start, item.end) for item in findings if item.code in LOSSES]
    for body, start, end in tracked:
        assert any(who == body and start <= lower <= upper <= end for who, lower, upper in spans), (body, start, end)
    for who, lower, upper in spans:
        assert any(who == body and start <= lower <= upper <= end for body, start, end in planted), (who, lower, upper)
    assert {item.code for item in findings if item.severity > Severity.WARNING} <= set(LOSSES)
    strange = [item for item in findings if item.severity > Severity.NOTE and item.code not in (*LOSSES, "teleport")]
    assert strange == []


@pytest.mark.sampled(3)
@pytest.mark.parametrize("name", FAULTS)
@pytest.mark.parametrize("body", [0, 1])
def test_planted_fault_is_reported_with_body_and_interval(name, body, tmp_path):
    """Planted at frame 300 of a clean session; whatever else is above a note is about the same body."""
    draft = clean_draft()
    planted = FAULTS[name](draft, body, frame=300)
    findings = examine(draft.write(tmp_path / "one.mcap"))
    assert planted.is_found(findings, draft), [(item.code, item.body, item.message) for item in findings]
    result = next(item for item in findings if item.code == planted.code)
    assert result.severity > Severity.NOTE and result.meaning and result.fix
    about = {planted.body, ""} if planted.body else set(BODIES) | {""}
    assert {item.body for item in findings if item.severity > Severity.NOTE} <= about


@pytest.mark.slow
@pytest.mark.parametrize("size", [0.05, 0.1, 3.0])
def test_teleports_are_reported_from_five_centimetres(size):
    """Every one of ten centimetres and more is found; of five, a tenth may pass for a quick hand."""
    is_found = []
    for body in (0, 1, 2):
        for at in range(40, 880, 120):
            draft = clean_draft()
            planted = teleport(size)(draft, body, at)
            is_found.append(planted.is_found(examine(draft.session()), draft))
    assert np.mean(is_found) >= (0.9 if size < 0.1 else 1.0)
