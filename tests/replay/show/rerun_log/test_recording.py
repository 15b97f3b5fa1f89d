"""A recording appears whole or not at all, under an application of its own, whatever the run holds."""

from dataclasses import replace

import numpy as np
import pytest
from msgspec import structs
from rerun.chunk import RrdReader
from support.small_worlds import unit_cubes_on_x
from support.viewers import recording_text

from replay.engine import compute
from replay.show.rerun_log import recording as module
from replay.show.rerun_log import recording_file
from replay.show.rerun_log.lanes import pair_lanes
from replay.show.rerun_log.recording import write_recording
from sessions.model.scene import Scene, SceneBody, SceneEffect

SUBJECT, ORACLE = "22.5Hz", "hybrid"


def test_two_recordings_of_a_run_are_two_applications(passed, drawn, tmp_path):
    """A run is recorded twice, to two files with a recording each: a viewer would merge those of one application."""
    write_recording(passed, tmp_path / "again.rrd")
    (first,) = RrdReader(drawn(passed).path).recordings()
    (second,) = RrdReader(tmp_path / "again.rrd").recordings()
    assert first.application_id != second.application_id
    assert first.recording_id != second.recording_id


def test_failed_write_of_a_picture_keeps_the_old_file(passed, tmp_path, monkeypatch):
    """Drawing the times of detectors, a part of the picture, fails; no second file is left."""
    (tmp_path / "run.rrd").write_bytes(b"old")

    def fail(*arguments):
        raise RuntimeError("disk full")

    monkeypatch.setattr(module, "log_timing", fail)
    with pytest.raises(RuntimeError, match="disk full"):
        write_recording(passed, tmp_path / "run.rrd")
    assert [(path.name, path.read_bytes()) for path in tmp_path.iterdir()] == [("run.rrd", b"old")]


@pytest.fixture(scope="module")
def run_without_detection(demo):
    """The run of taps as if nothing had been computed but its effects: no detection, no reference, no fault."""
    document = structs.replace(demo.document, audit={}, oracle="")
    return replace(demo, comparisons={}, misses={}, oracle="", episodes={}, detections={}, document=document)


def test_run_without_detection_draws_the_room(run_without_detection, drawn):
    """A run as if nothing had been computed but its effects.

    The scene, called taps, is drawn with bodies such as the rod.
    """
    picture = drawn(run_without_detection)
    assert "/world/rod" in picture.entities
    assert "# taps" in recording_text(picture.path)


def test_run_without_reference_draws_lanes_of_its_contacts(run_without_detection, demo, drawn):
    """A run of one detector, ``hybrid``, without a reference.

    The lane of its second pair, beaker and rod, has contact.
    """
    run = replace(run_without_detection, detections={ORACLE: demo.detections[ORACLE]})
    picture = drawn(run)
    assert "/world/beaker/mesh" in picture.entities
    assert "CONTACT" in [state for _ns, state in picture.lane("lanes/hybrid/2_beaker-rod")]


def test_body_absent_from_the_scene_is_drawn_if_queried(drawn):
    """The scene names the bodies a and b, and an effect of both; the detector decides about all pairs, with c too."""
    effect = SceneEffect("breakage", {"between": ["a", "b"], "speed_m_s": 1.0})
    scene = Scene(bodies=(SceneBody("a", extra={"mass": 0.1}), SceneBody("b")), effects=(effect,))
    positions = {"a": [0.0] * 4, "b": [3.0, 2.0, 0.5, 0.5], "c": [9.0, 9.5, 9.8, 9.9]}
    picture = drawn(compute(unit_cubes_on_x(positions, scene=scene), detectors="hybrid"))
    assert {"/world/a/mesh", "/world/b/mesh", "/world/c/mesh"} <= set(picture.entities)


def test_above_an_hour_poses_are_strided_but_lanes_are_not(demo, drawn, monkeypatch):
    """The most frames that are drawn, those of an hour at 90 Hz, are lowered to 30; the run has 90, and a single miss.

    Every third frame has poses, and that of the miss, with a few rows more around it. The lane of beaker and rod
    changes wherever the outcome does.
    """
    no_moments, most_drawn_frames = (), 30
    monkeypatch.setattr(recording_file.RecordingClock.of.__func__, "__defaults__", (no_moments, most_drawn_frames))
    miss, *_ = demo.misses[SUBJECT]
    run = replace(demo, misses={SUBJECT: [miss]})
    picture = drawn(run)
    frames_with_a_pose = {frame for _ns, frame, _pose in picture.column("world/rod", "Transform3D:translation")}
    assert miss.frame in frames_with_a_pose
    assert 30 <= len(frames_with_a_pose) < 40
    outcome = run.comparisons[SUBJECT].outcome[:, 0].astype(int)
    changes = int(np.count_nonzero(np.diff(outcome)))
    (path,) = [path for path in pair_lanes(run, SUBJECT) if path.endswith("beaker-rod")]
    assert len(picture.lane(path)) >= changes > 0
