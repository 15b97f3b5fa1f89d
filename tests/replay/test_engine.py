from contextlib import contextmanager
from dataclasses import fields, replace

import numpy as np
import pytest
from msgspec.structs import asdict
from support.small_worlds import MEET_IN_4_AND_8_TO_10, cube, unit_cubes_on_x

from cdcore.errors import CollisionCoreError
from replay.detection.detector_spec import TRUSTED_DETECTOR
from replay.engine import compute
from replay.errors import DetectorSpecError
from replay.settings import RunSettings, line_up
from sessions import Scene
from sessions.model.event import LiveContact
from sessions.model.scene import SceneBody, SceneEffect

TOUCHING = Scene(
    bodies=(SceneBody("a"), SceneBody("b")),
    effects=(SceneEffect("contact", {"between": ["a", "b"]}),),
)
"""A scene with an effect, which needs the contacts of a and b by the detector ``exact``."""


def line_up_of(detectors=None, oracle=None, session=None, **more):
    """The detectors (``specs``) and the label of the reference (``oracle``) that a run takes for these settings.

    Unless given, the session is two cubes without a scene.
    """
    settings = RunSettings(detectors=detectors, oracle=oracle, **more)
    return line_up(settings, unit_cubes_on_x(MEET_IN_4_AND_8_TO_10) if session is None else session)


def labels_of(lineup):
    """The labels of the detectors of a run, in order."""
    return [spec.label for spec in lineup.specs]


def test_exact_is_the_reference_where_anything_is_compared():
    """Without the option ``oracle`` the detector exact is added; where there is no detector, neither is a reference."""
    slow = line_up_of("slow=discrete[rate_hz=5]")
    assert labels_of(slow) == ["slow", TRUSTED_DETECTOR] and slow.oracle == TRUSTED_DETECTOR
    assert line_up_of(detectors=()).specs == ()
    assert line_up_of(detectors=(), oracle="hybrid").oracle == ""


@pytest.mark.parametrize(
    ("detectors", "oracle", "labels", "reference"),
    [
        pytest.param("a=sphere,b=hybrid", "b", ["a", "b"], "b", id="label of a detector"),
        pytest.param("a=sphere,b=hybrid", "hybrid", ["a", "b"], "b", id="detector under another label"),
        pytest.param("sphere", "best=hybrid", ["sphere", "best"], "best", id="detector to be added"),
        pytest.param("sphere,hybrid", "none", ["sphere", "hybrid"], "", id="none"),
        pytest.param("hybrid", "hybrid", ["hybrid"], "hybrid", id="the only detector"),
    ],
)
def test_oracle_option_accepts_label_detector_or_none(detectors, oracle, labels, reference):
    """``oracle``: the option; ``reference``: label of the detector that others are compared with, none if empty."""
    lineup = line_up_of(detectors, oracle)
    assert labels_of(lineup) == labels
    assert lineup.oracle == reference


def test_default_detectors_are_engine_colliders_meshes_paper_and_exact():
    """Hulls and meshes sample at 50 Hz by default, the step rate of an engine; "paper" is the detector hybrid-qaco.

    Their labels have the rate, another one too.
    """
    assert [str(spec) for spec in line_up_of().specs] == [
        "hull50=collider[shape=hull,rate_hz=50]",
        "mesh50=discrete[rate_hz=50]",
        "paper=hybrid-qaco",
        "exact=exact",
    ]
    assert labels_of(line_up_of(step_rate=22.5)) == ["hull22.5", "mesh22.5", "paper", "exact"]


def test_default_detectors_of_an_engines_recording_are_its_own():
    """Contacts that the engine recorded come first; the colliders that it recorded ("shipped") stand for hulls."""
    recorded = replace(
        unit_cubes_on_x(MEET_IN_4_AND_8_TO_10),
        colliders={"a": (cube(edge=0.5),)},
        live_contacts=(LiveContact(time_ns=0, body_a="a", body_b="b", phase="enter"),),
    )
    assert labels_of(line_up_of(session=recorded)) == ["recorded", "shipped50", "mesh50", "paper", "exact"]


@pytest.mark.slow
def test_settings_in_the_summary_give_the_same_answers():
    """The document of a run has every setting; a run with these settings has the same ones, and the same answers.

    The three detectors, one of them the reference, have a digest of their answers each.
    """
    requested = RunSettings(detectors="slow=discrete[rate_hz=25],qaco", start=0.01, seed=3, policy={"frozen": "drop"})
    first = compute(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), requested)
    reported = first.document.settings
    assert set(reported.__struct_fields__) == {field.name for field in fields(RunSettings)}
    again = compute(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), RunSettings(**asdict(reported)))
    assert again.document.settings == reported
    first_digests, digests_again = (
        {label: detector.digest for label, detector in run.document.detectors.items()} for run in (first, again)
    )
    assert first_digests == digests_again and len(first_digests) == 3


@pytest.mark.slow
def test_a_named_oracle_runs_though_effects_need_no_contacts():
    """A scene with an empty list of effects needs no contacts: no detector runs, unless one or a reference is named.

    A named reference runs, a named detector gets ``exact`` as its reference, and an unknown name is refused.
    """
    session = unit_cubes_on_x(MEET_IN_4_AND_8_TO_10, scene=Scene(effects=()))
    assert compute(session).oracle == ""
    assert compute(session, oracle="none").oracle == ""
    assert "hybrid" in compute(session, oracle="hybrid").episodes
    assert compute(session, detectors="sphere").oracle == "exact"
    with pytest.raises(CollisionCoreError, match="no detector 'nobody'"):
        compute(session, oracle="nobody")


def test_an_oracle_with_the_label_of_another_is_refused():
    """The label "hybrid" is that of the detector sphere and of a reference, another detector."""
    with pytest.raises(DetectorSpecError, match="both called 'hybrid'"):
        line_up_of("hybrid=sphere", "hybrid=hybrid[containment=false]")


@pytest.mark.parametrize(
    ("settings", "labels"),
    [
        pytest.param({"detectors": ()}, [], id="no detector"),
        pytest.param({"detectors": "sphere,hybrid", "oracle": "none"}, ["sphere", "hybrid"], id="no reference"),
    ],
)
def test_without_an_oracle_nothing_is_compared(settings, labels):
    """Without a reference there are contacts of each detector of the run, and neither a comparison nor misses."""
    result = compute(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), **settings)
    assert result.oracle == ""
    assert [*result.episodes] == [*result.document.detectors] == labels
    assert not result.comparisons and not result.misses


def test_live_and_offline_detectors_answer_alike():
    """Live, a detector gets frame by frame; image-space and continuous need the whole motion, and are never live.

    A live detector has a time for each of 12 frames, any other a single one; offline none is live. The answers of all
    are the same.
    """
    settings = {
        "session": unit_cubes_on_x(MEET_IN_4_AND_8_TO_10, scene=TOUCHING),
        "detectors": "hybrid,sphere,image-space,continuous",
        "oracle": "static",
    }
    live, offline = compute(**settings), compute(**settings, offline=True)
    is_live = {label: detector.live for label, detector in live.document.detectors.items()}
    assert is_live == {"hybrid": True, "sphere": True, "image-space": False, "static": True, "continuous": False}
    assert not any(detector.live for detector in offline.document.detectors.values())
    a_time_for_each_frame, a_single_time = (12,), ()
    for label, detection in live.detections.items():
        assert detection.digest == offline.detections[label].digest
        expected = a_time_for_each_frame if is_live[label] else a_single_time
        assert {np.shape(seconds) for seconds in detection.seconds.values()} == {expected}


def test_a_detector_that_effects_name_runs_live_with_faces():
    """The effect of the scene needs the faces that ``exact`` finds where the cubes touch, as in frame 4.

    Still ``exact`` gets frame by frame (live): each stage has a time for each of the 12 frames; "rest" is what no stage
    took. A second pass lists the faces. It is not timed, so ``faces_queried``, faces within the time, is false.
    """
    result = compute(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10, scene=TOUCHING), detectors="exact", oracle="hybrid")
    exact, reported = result.detections["exact"], result.document.detectors["exact"]
    the_only_pair = 0
    assert exact.face_counts[4, the_only_pair] > 0
    assert reported.live and not reported.faces_queried
    assert exact.seconds["rest"].shape == (12,)
    assert reported.seconds.detect == pytest.approx(sum(stage.sum() for stage in exact.seconds.values()))


def test_faces_listed_by_the_reference_are_not_queried_again(monkeypatch):
    """Samples at 20 Hz miss both contacts; their faces are there, though the engine can make no detector for them."""
    monkeypatch.setattr("replay.engine.make_detector", None)
    result = compute(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), detectors="slow=discrete[rate_hz=20,sampling_offset_s=0]")
    first, second = result.misses["slow"]
    assert first.evidence.face_pairs > 0 and second.evidence.face_pairs > 0


DETECTORS_BESIDE_HYBRID = {"detectors": "slow=discrete[rate_hz=20],hybrid-qaco,static", "oracle": "hybrid"}


@pytest.fixture
def session_of_hours_has_6_frames(monkeypatch):
    """A recording of more than 5 frames counts as one of hours: it is read in blocks of 3 frames."""
    monkeypatch.setattr("replay.engine.MOST_FRAMES_IN_MEMORY", 5)
    monkeypatch.setattr("replay.detection.run_detector.MOST_FRAMES_IN_MEMORY", 5)
    monkeypatch.setattr("replay.detection.run_detector.MOST_FRAMES_PER_CALL", 3)


def answers(result):
    """Answers of a run, by kind."""
    detections = result.detections.items()
    return {
        "digests": {label: detection.digest for label, detection in detections},
        "lists faces": {label: detection.face_sets is not None for label, detection in detections},
        "misses": result.misses,
        "contacts": result.episodes,
    }


@pytest.fixture(scope="module")
def run_in_memory():
    """A run of 12 frames of two cubes that meet twice, all of them in memory."""
    return compute(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), **DETECTORS_BESIDE_HYBRID)


def test_a_session_of_hours_gives_the_same_answers(run_in_memory, session_of_hours_has_6_frames):
    """12 frames, more than a session in memory may have: read in blocks, they have the same answers."""
    in_blocks = compute(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), **DETECTORS_BESIDE_HYBRID)
    assert answers(in_blocks) == answers(run_in_memory)


@pytest.mark.parametrize("is_long", [False, True], ids=["in memory", "of hours"])
def test_only_a_session_of_hours_gives_memory_back_between_stages(monkeypatch, request, is_long):
    """12 frames of two cubes; giving memory back takes time, which a short session does not spend."""
    if is_long:
        request.getfixturevalue("session_of_hours_has_6_frames")
    calls = []
    monkeypatch.setattr("replay.engine.give_back_memory", lambda: calls.append("give back"))
    compute(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), detectors="hybrid", oracle="none")
    assert bool(calls) == is_long


def test_of_too_many_face_pairs_only_the_verdicts_stay(monkeypatch, run_in_memory, session_of_hours_has_6_frames):
    """In a session of hours more than three pairs of faces are too many to list: the misses are the same without."""
    monkeypatch.setattr("replay.detection.run_detector.MOST_FACE_PAIRS", 3)
    without_faces = compute(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), **DETECTORS_BESIDE_HYBRID)
    assert run_in_memory.detections["hybrid"].face_sets is not None
    assert without_faces.detections["hybrid"].face_sets is None
    expected, actual = (
        [(miss.first, miss.last) for miss in run.misses["slow"]] for run in (run_in_memory, without_faces)
    )
    assert actual == expected != []


def test_every_stage_of_a_run_advances_to_its_end():
    """Four stages: the recording is examined, detectors are replayed, an effect is simulated, answers are compared.

    Each reports steps, whose sum is the total that it announced, if it announced one.
    """
    stages = []

    class Recording:
        @contextmanager
        def stage(self, name, total=None, unit="frames"):
            steps = []
            yield steps.append
            stages.append((name, total, sum(steps)))

    compute(
        unit_cubes_on_x(MEET_IN_4_AND_8_TO_10, scene=TOUCHING),
        detectors="slow=discrete[rate_hz=20],sphere",
        progress=Recording(),
    )
    assert len(stages) == 4
    assert all(total in (None, steps) for _, total, steps in stages), stages
