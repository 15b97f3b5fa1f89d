"""A recording appears whole or not at all, with every contact at its frame, whatever the run holds."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rerun.chunk import RrdReader

from cdcore import Verdict
from replay.comparison.outcome import Outcome
from replay.outputs.palette import FOUND, MISSED
from replay.outputs.rerun_log import columns, contacts
from replay.outputs.rerun_log import recording as module
from replay.outputs.rerun_log.columns import Clock, packed
from replay.outputs.rerun_log.contacts import collect_contacts, contact_point
from replay.outputs.rerun_log.recording import write_recording
from replay.pipeline.run_result import RunResult

SUBJECT, ORACLE = "22.5Hz", "hybrid"


def test_two_recordings_of_one_run_are_two_applications(demo: RunResult, recording: Path, tmp_path: Path) -> None:
    write_recording(demo, tmp_path / "again.rrd")
    stores = [RrdReader(path).recordings() for path in (recording, tmp_path / "again.rrd")]
    assert [len(one) for one in stores] == [1, 1]
    assert stores[0][0].application_id != stores[1][0].application_id
    assert stores[0][0].recording_id != stores[1][0].recording_id


def test_the_layout_belongs_to_the_application_of_its_recording(recording: Path) -> None:
    reader = RrdReader(recording)
    assert reader.blueprints()[0].application_id == reader.recordings()[0].application_id


def test_a_failed_write_leaves_the_old_file_and_no_other(
    demo: RunResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "run.rrd").write_bytes(b"old")

    def fail(*args: object) -> None:
        raise RuntimeError("disk full")

    monkeypatch.setattr(module, "log_report", fail)
    with pytest.raises(RuntimeError, match="disk full"):
        write_recording(demo, tmp_path / "run.rrd")
    assert [(path.name, path.read_bytes()) for path in tmp_path.iterdir()] == [("run.rrd", b"old")]


def test_an_old_file_is_replaced(demo: RunResult, tmp_path: Path) -> None:
    (tmp_path / "run.rrd").write_bytes(b"old")
    write_recording(demo, tmp_path / "run.rrd")
    assert [path.name for path in tmp_path.iterdir()] == ["run.rrd"]
    assert len(RrdReader(tmp_path / "run.rrd").recordings()) == 1


def test_two_audited_detectors_share_one_recording(demo: RunResult, write: Any) -> None:
    second = replace(demo.comparisons[SUBJECT], subject="15Hz")
    seen = write(
        replace(
            demo,
            detections={**demo.detections, "15Hz": demo.detections[SUBJECT]},
            comparisons={**demo.comparisons, "15Hz": second},
            episodes={**demo.episodes, "15Hz": demo.episodes[SUBJECT]},
            misses={**demo.misses, "15Hz": demo.misses[SUBJECT]},
        )
    )
    assert seen.lane("audit/15Hz/lanes/2_beaker-rod") == seen.lane("lanes/2_beaker-rod")
    for first, other in (
        ("report/missed", "audit/15Hz/missed"),
        ("world/missed/pins", "world/missed_by_15Hz/pins"),
        ("world/beaker/missed_faces", "world/beaker/missed_faces_by_15Hz"),
    ):
        assert "/" + first in seen.entities
        assert "/" + other in seen.entities


def test_a_run_without_an_audit_shows_the_session(demo: RunResult, write: Any) -> None:
    seen = write(
        replace(demo, detections={ORACLE: demo.detections[ORACLE]}, comparisons={}, misses={}, oracle="", episodes={})
    )
    assert "/world/beaker/mesh" in seen.entities
    assert "/detectors/1_beaker-rod/hybrid" in seen.entities
    assert not [path for path in seen.entities if path.startswith("/lanes")]


def test_a_run_without_detectors_shows_the_bodies(demo: RunResult, write: Any) -> None:
    seen = write(replace(demo, detections={}, comparisons={}, misses={}, oracle="", episodes={}))
    assert "/world/rod" in seen.entities


def test_bodies_without_a_pose_give_no_pose_lanes_and_no_contact(demo: RunResult, read: Any) -> None:
    lost = np.flatnonzero(~demo.assembly.motion.valid[:, demo.assembly.names.index("hand")])
    assert (demo.comparisons[SUBJECT].outcome[lost, 1] == Outcome.LEFT_OUT).all()
    words = [state for _, state in read.lane("lanes/4_rod-hand_held")]
    assert "left out" in words
    path = next(path for path in read.entities if path.startswith("/detectors/") and "rod-hand" in path)
    assert Verdict.NO_POSE.name in [state for _, state in read.lane(path[1:])]


def test_above_an_hour_poses_are_strided_and_lanes_are_not(
    demo: RunResult, write: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(columns.Clock.of.__func__, "__defaults__", ((), 90))
    few = replace(demo, misses={SUBJECT: demo.misses[SUBJECT][:1]})
    seen = write(few)
    rows = seen.column("world/rod", "Transform3D:translation")
    assert len(rows) < 200
    first = demo.misses[SUBJECT][0]
    assert {row[1] for row in rows} >= set(range(first.first, first.last + 1))
    changes = int((np.diff(demo.comparisons[SUBJECT].outcome[:, 0].astype(int)) != 0).sum())
    assert len([state for _, state in seen.lane("lanes/2_beaker-rod")]) >= changes


ORACLE_contacts, SUBJECT_contacts = "hybrid", "22.5Hz"


def test_each_frame_shows_a_point_per_contact_and_none_where_there_is_none(demo: RunResult, read: Any) -> None:
    expected = (demo.detections[ORACLE_contacts].verdict == Verdict.CONTACT).sum(axis=1)
    shown = [len(read.at("world/contacts/hybrid", "Points3D:positions", frame)) for frame in range(len(expected))]
    assert shown == expected.tolist()
    assert 0 < sum(expected > 0) < len(expected)


def test_curves_are_the_sections_of_the_detection(demo: RunResult, read: Any) -> None:
    detection = demo.detections[ORACLE_contacts]
    for frame, pair in np.argwhere(detection.verdict == Verdict.CONTACT)[::7].tolist():
        strips = np.array(read.at("world/contacts/hybrid/section", "LineStrips3D:strips", frame))
        wanted = np.concatenate(
            [detection.section(frame, p) for p in range(len(detection.pairs)) if len(detection.faces(frame, p))]
        )
        assert strips.shape == wanted.shape
        assert np.allclose(strips, wanted, atol=1e-6), pair


def test_missed_contacts_are_red_and_found_ones_blue(demo: RunResult, read: Any) -> None:
    outcome, verdict = demo.comparisons[SUBJECT_contacts].outcome, demo.detections[ORACLE_contacts].verdict
    colours = {Outcome.MISSED: packed([MISSED])[0], Outcome.BOTH: packed([FOUND])[0]}
    seen = set()
    for frame in range(len(verdict)):
        wanted = [colours[Outcome(code)] for code in outcome[frame, verdict[frame] == Verdict.CONTACT].tolist()]
        assert read.at("world/contacts/hybrid", "Points3D:colors", frame) == wanted
        seen.update(wanted)
    assert len(seen) == 2


def test_points_lie_on_the_curve(demo: RunResult, read: Any) -> None:
    frame, pair = np.argwhere(demo.detections[ORACLE_contacts].verdict == Verdict.CONTACT)[0].tolist()
    middles = demo.detections[ORACLE_contacts].section(frame, pair).mean(axis=1)
    point = np.array(read.at("world/contacts/hybrid", "Points3D:positions", frame)[0])
    assert np.linalg.norm(middles - point, axis=1).min() < 1e-6


def test_a_ring_has_its_point_on_the_ring() -> None:
    angle = np.linspace(0, 2 * np.pi, 33)
    ring = np.stack([np.cos(angle), 0 * angle, np.sin(angle)], axis=1)
    assert np.linalg.norm(contact_point(np.stack([ring[:-1], ring[1:]], axis=1))) > 0.9


def test_normals_are_unit_or_nothing(read: Any) -> None:
    rows = read.column("world/contacts/hybrid/normals", "Arrows3D:vectors")
    lengths = np.array([np.linalg.norm(vector) for row in rows for vector in row[2]])
    assert np.all((lengths < 1e-9) | (np.abs(lengths - contacts.NORMAL_LENGTH) < 1e-6))
    assert (lengths > 0).any()


def test_a_normal_points_from_the_first_body_to_the_second(demo: RunResult) -> None:
    found = collect_contacts(Clock.of(demo.assembly), demo.assembly, demo.detections[ORACLE_contacts], None)
    dips = [k for k in range(len(found.frame)) if demo.assembly.pair_name(int(found.pair[k])) == "bench-rod"]
    assert dips
    assert np.allclose(found.normal[dips], [0, 1, 0], atol=1e-6)


def test_a_detection_without_faces_draws_nothing_and_breaks_nothing(
    demo: RunResult, write: Callable[[RunResult], Any]
) -> None:
    bare = replace(demo.detections[ORACLE_contacts], face_sets=None)
    seen = write(replace(demo, detections={**demo.detections, ORACLE_contacts: bare}))
    assert all(not row[2] for row in seen.column("world/contacts/hybrid", "Points3D:positions"))


def test_beyond_the_budget_frames_are_strided_but_misses_stay(demo: RunResult, monkeypatch: pytest.MonkeyPatch) -> None:
    detection, comparison = demo.detections[ORACLE_contacts], demo.comparisons[SUBJECT_contacts]
    clock = Clock.of(demo.assembly)
    whole = collect_contacts(clock, demo.assembly, detection, comparison)
    missed = int((comparison.outcome[whole.frame, whole.pair] == Outcome.MISSED).sum())
    wrong = np.isin(comparison.outcome, (Outcome.MISSED, Outcome.INVENTED)).any(axis=1)
    monkeypatch.setattr(contacts, "DRAWN_CONTACTS", int(wrong[whole.frame].sum()) + 1)
    monkeypatch.setattr(contacts, "DRAWN_FACES", 10**9)
    part = collect_contacts(clock, demo.assembly, detection, comparison)
    assert len(part.frame) < len(whole.frame)
    assert int((comparison.outcome[part.frame, part.pair] == Outcome.MISSED).sum()) == missed
