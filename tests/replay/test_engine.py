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
"""Its effect asks ``exact`` for contacts."""


def line_up_of(detectors=None, oracle=None, session=None, **more):
    """The detectors and reference that a run takes for these settings."""
    settings = RunSettings(detectors=detectors, oracle=oracle, **more)
    return line_up(settings, unit_cubes_on_x(MEET_IN_4_AND_8_TO_10) if session is None else session)


def test_oracle_option_accepts_label_detector_or_none():
    """Without the option the reference is exact, where anything is to be compared.

    A detector that is there under another label is taken by that label, one that is not there is added.
    """
    lineup = line_up_of("slow=discrete[rate_hz=5]")
    assert [spec.label for spec in lineup.specs] == ["slow", TRUSTED_DETECTOR] and lineup.oracle == TRUSTED_DETECTOR
    assert line_up_of(()).specs == () and line_up_of((), "hybrid").oracle == ""
    assert line_up_of("a=sphere,b=hybrid", "b").oracle == "b"
    assert line_up_of("a=sphere,b=hybrid", "hybrid").oracle == "b"
    assert [spec.label for spec in line_up_of("sphere", "best=hybrid").specs] == ["sphere", "best"]
    assert line_up_of("sphere,hybrid", "none").oracle == ""
    assert line_up_of("hybrid", "hybrid").specs == line_up_of("hybrid", "none").specs


def test_default_detectors_are_engine_colliders_meshes_paper_and_exact():
    """Hulls and meshes have the engine's step rate; recorded contacts and colliders come first, where there are any."""
    assert [str(spec) for spec in line_up_of().specs] == [
        "hull50=collider[shape=hull,rate_hz=50]",
        "mesh50=discrete[rate_hz=50]",
        "paper=hybrid-qaco",
        "exact=exact",
    ]
    assert [spec.label for spec in line_up_of(step_rate=22.5).specs][:2] == ["hull22.5", "mesh22.5"]
    recorded = replace(
        unit_cubes_on_x(MEET_IN_4_AND_8_TO_10),
        colliders={"a": (cube(edge=0.5),)},
        live_contacts=(LiveContact(0, "a", "b", "enter"),),
    )
    assert [spec.label for spec in line_up_of(session=recorded).specs] == [
        "recorded",
        "shipped50",
        "mesh50",
        "paper",
        "exact",
    ]


@pytest.mark.slow
def test_settings_in_the_summary_give_the_same_answers():
    """The document has every setting of a run; three detectors, one the reference, have the same digests again."""
    requested = RunSettings(detectors="slow=discrete[rate_hz=25],qaco", start=0.01, seed=3, policy={"frozen": "drop"})
    first = compute(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), requested)
    reported = first.document.settings
    assert set(reported.__struct_fields__) == {field.name for field in fields(RunSettings)}
    again = compute(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), RunSettings(**asdict(reported)))
    assert again.document.settings == reported
    digests = [{label: made.digest for label, made in run.document.detectors.items()} for run in (first, again)]
    assert digests[0] == digests[1] and len(digests[0]) == 3


@pytest.mark.slow
def test_a_named_oracle_runs_though_effects_need_no_contacts():
    """A scene with an empty list of effects is not audited, unless a reference or a detector is named."""
    session = unit_cubes_on_x(MEET_IN_4_AND_8_TO_10, scene=Scene(effects=()))
    assert compute(session).oracle == compute(session, oracle="none").oracle == ""
    assert "hybrid" in compute(session, oracle="hybrid").episodes
    assert compute(session, detectors="sphere").oracle == "exact"
    with pytest.raises(CollisionCoreError, match="no detector 'nobody'"):
        compute(session, oracle="nobody")


def test_an_oracle_with_the_label_of_another_is_refused():
    """The label hybrid is that of a sphere and of the reference."""
    with pytest.raises(DetectorSpecError, match="both called 'hybrid'"):
        line_up_of("hybrid=sphere", "hybrid=hybrid[containment=false]")


@pytest.mark.parametrize("detectors", ["", "sphere,hybrid"])
def test_without_an_oracle_nothing_is_compared(detectors):
    """No detector at all, or two detectors and the option none: there are contacts of each, and no misses."""
    result = compute(
        unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), detectors=detectors or (), oracle="none" if detectors else None
    )
    assert not result.comparisons and not result.misses and result.oracle == ""
    assert ",".join(result.episodes) == ",".join(result.document.detectors) == detectors


def test_live_and_offline_detectors_answer_alike():
    """Not live are detectors that answer only whole motions, in images or between frames, and offline none is.

    A live detector has a time for each of 12 frames, any other one time; the answers are the same.
    """
    requested = {
        "session": unit_cubes_on_x(MEET_IN_4_AND_8_TO_10, scene=TOUCHING),
        "detectors": "hybrid,sphere,image-space,continuous",
        "oracle": "static",
    }
    live, offline = compute(**requested), compute(**requested, offline=True)
    reported = {label: made.live for label, made in live.document.detectors.items()}
    assert reported == {"hybrid": True, "sphere": True, "image-space": False, "static": True, "continuous": False}
    assert not any(made.live for made in offline.document.detectors.values())
    for label, result in live.detections.items():
        assert result.digest == offline.detections[label].digest
        assert {np.shape(spent) for spent in result.seconds.values()} == {(12,) if reported[label] else ()}


def test_a_detector_that_effects_name_runs_live_with_faces():
    """Its faces come from a pass of its own, without time; the time is the sum of all stages and frames."""
    result = compute(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10, scene=TOUCHING), detectors="exact", oracle="hybrid")
    exact, reported = result.detections["exact"], result.document.detectors["exact"]
    assert reported.live and not reported.faces_queried
    assert exact.face_counts[4, 0] > 0 and exact.seconds["rest"].shape == (12,)
    assert reported.seconds.detect == pytest.approx(sum(spent.sum() for spent in exact.seconds.values()))


def test_faces_listed_by_the_reference_are_not_queried_again(monkeypatch):
    """The engine cannot make a detector once more; at 20 Hz both contacts are missed."""
    monkeypatch.setattr("replay.engine.make_detector", None)
    result = compute(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), detectors="slow=discrete[rate_hz=20,sampling_offset_s=0]")
    assert len(result.misses["slow"]) == 2


DETECTORS_BESIDE_HYBRID = {"detectors": "slow=discrete[rate_hz=20],hybrid-qaco,static", "oracle": "hybrid"}


def test_a_session_of_hours_gives_the_same_answers(monkeypatch):
    """Its 12 frames are too many for limits of 5 in memory and 3 a call, so that memory is given back."""

    def answers(result):
        detections = result.detections.items()
        return {
            "digests": {label: detection.digest for label, detection in detections},
            "lists faces": {label: detection.face_sets is not None for label, detection in detections},
            "misses": result.misses,
            "contacts": result.episodes,
        }

    requested = DETECTORS_BESIDE_HYBRID
    freed = []
    monkeypatch.setattr("replay.engine.give_back_memory", lambda: freed.append(1))
    in_memory = answers(compute(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), **requested))
    assert not freed
    monkeypatch.setattr("replay.engine.MOST_FRAMES_IN_MEMORY", 5)
    monkeypatch.setattr("replay.detection.run_detector.MOST_FRAMES_IN_MEMORY", 5)
    monkeypatch.setattr("replay.detection.run_detector.MOST_FRAMES_PER_CALL", 3)
    assert answers(compute(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), **requested)) == in_memory and freed


def test_of_too_many_face_pairs_only_the_verdicts_stay(monkeypatch):
    """A session of hours, by limits as above, in which 3 pairs of faces are too many: the misses are the same."""
    session = unit_cubes_on_x(MEET_IN_4_AND_8_TO_10)
    with_faces = compute(session, **DETECTORS_BESIDE_HYBRID)
    monkeypatch.setattr("replay.engine.MOST_FRAMES_IN_MEMORY", 5)
    monkeypatch.setattr("replay.detection.run_detector.MOST_FRAMES_IN_MEMORY", 5)
    monkeypatch.setattr("replay.detection.run_detector.MOST_FRAMES_PER_CALL", 3)
    monkeypatch.setattr("replay.detection.run_detector.MOST_FACE_PAIRS", 3)
    without_faces = compute(session, **DETECTORS_BESIDE_HYBRID)
    assert with_faces.detections["hybrid"].face_sets is not None
    assert without_faces.detections["hybrid"].face_sets is None
    numbers = [[miss.number for miss in run.misses["slow"]] for run in (with_faces, without_faces)]
    assert numbers[0] == numbers[1] != []


def test_every_stage_of_a_run_advances_to_its_end():
    """A stage reports its steps, whose sum is the total that it announced, if it did."""
    stages = []

    class Counting:
        @contextmanager
        def stage(self, name, total=None, unit="frames"):
            done = []
            yield done.append
            stages.append((name, total, sum(done)))

    compute(
        unit_cubes_on_x(MEET_IN_4_AND_8_TO_10, scene=TOUCHING),
        detectors="slow=discrete[rate_hz=20],sphere",
        progress=Counting(),
    )
    assert len(stages) == 4 and all(total in (None, done) for _, total, done in stages), stages
