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


def test_two_recordings_of_a_run_are_two_applications(demo, recording, tmp_path):
    """Otherwise a viewer would merge them."""
    write_recording(demo, tmp_path / "again.rrd")
    stores = [RrdReader(path).recordings() for path in (recording, tmp_path / "again.rrd")]
    assert [len(item) for item in stores] == [1, 1]
    assert stores[0][0].application_id != stores[1][0].application_id
    assert stores[0][0].recording_id != stores[1][0].recording_id


def test_failed_write_of_a_picture_keeps_the_old_file(demo, tmp_path, monkeypatch):
    """Drawing the times of detectors fails; no second file is left."""
    (tmp_path / "run.rrd").write_bytes(b"old")

    def fail(*args):
        raise RuntimeError("disk full")

    monkeypatch.setattr(module, "log_timing", fail)
    with pytest.raises(RuntimeError, match="disk full"):
        write_recording(demo, tmp_path / "run.rrd")
    assert [(path.name, path.read_bytes()) for path in tmp_path.iterdir()] == [("run.rrd", b"old")]


def test_run_without_audit_draws_the_room_and_its_contacts(demo, drawn):
    """Without a detection the room is drawn; with one, but no reference, the lanes of its contacts too."""
    document = structs.replace(demo.document, audit={}, oracle="")
    bare = replace(demo, comparisons={}, misses={}, oracle="", episodes={}, detections={}, document=document)
    room = drawn(bare)
    assert "/world/rod" in room.entities and "# taps" in recording_text(room.path)
    recorded = drawn(replace(bare, detections={ORACLE: demo.detections[ORACLE]}))
    assert {"/world/beaker/mesh", "/lanes/hybrid/2_beaker-rod"} <= set(recorded.entities)
    assert "CONTACT" in [state for _, state in recorded.lane("lanes/hybrid/2_beaker-rod")]


def test_body_absent_from_the_scene_is_drawn_if_queried(drawn):
    """The scene names a and b; the detector asks about c too."""
    effect = SceneEffect("breakage", {"between": ["a", "b"], "speed_m_s": 1.0})
    scene = Scene(bodies=(SceneBody("a", extra={"mass": 0.1}), SceneBody("b")), effects=(effect,))
    positions = {"a": [0.0] * 4, "b": [3.0, 2.0, 0.5, 0.5], "c": [9.0, 9.5, 9.8, 9.9]}
    read = drawn(compute(unit_cubes_on_x(positions, scene=scene), detectors="hybrid"))
    assert {"/world/a/mesh", "/world/b/mesh", "/world/c/mesh"} <= set(read.entities)


def test_above_an_hour_poses_are_strided_and_lanes_are_not(demo, drawn, monkeypatch):
    """The limit of drawn frames is lowered to 90, as if 270 frames lasted more than an hour."""
    monkeypatch.setattr(recording_file.RecordingClock.of.__func__, "__defaults__", ((), 90))
    few = replace(demo, misses={SUBJECT: demo.misses[SUBJECT][:1]})
    recorded = drawn(few)
    rows = recorded.column("world/rod", "Transform3D:translation")
    assert len(rows) < 200 and demo.misses[SUBJECT][0].frame in {row[1] for row in rows}
    changes = int((np.diff(demo.comparisons[SUBJECT].outcome[:, 0].astype(int)) != 0).sum())
    path = next(path for path in pair_lanes(demo, SUBJECT) if path.endswith("beaker-rod"))
    assert len([state for _, state in recorded.lane(path)]) >= changes
