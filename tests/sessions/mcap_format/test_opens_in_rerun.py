import numpy as np
import pytest
from support.mcap_samples import random_frames, session_of, tetrahedron

from sessions.mcap_format.recorder import Recorder
from sessions.mcap_format.writer import write_session
from sessions.model.event import Event, Interval
from sessions.model.frames import Status
from sessions.model.hand import HandTrack

chunk = pytest.importorskip("rerun.chunk")


@pytest.fixture(scope="module")
def opened(tmp_path_factory):
    """The frames written, and the chunks Rerun's own MCAP importer makes of them, by entity."""
    path = tmp_path_factory.mktemp("rerun") / "s.mcap"
    frames = random_frames(3, 400, 3, absent=0.2, odd=0.2)
    session = session_of(
        frames,
        meshes={"body 0": tetrahedron()},
        events=(Event(5, "drop", "the glass fell", level="warning"),),
        intervals=(Interval(1, 5, "task", "pour"),),
        hands={"anna/left": HandTrack([1, 2], [0.0, 1.0])},
    )
    write_session(session, path)
    batches = {}
    for part in chunk.McapReader(str(path)).stream():
        if not part.is_static:
            batches.setdefault(part.entity_path, []).append(part.to_record_batch())
    return frames, batches


def column(batches, name):
    return [row for batch in batches for row in batch.column(name).to_pylist()]


def stamps(batches, name):
    return np.concatenate([batch.column(name).cast("int64").to_numpy() for batch in batches])


def test_rerun_reads_every_pose_as_a_transform_with_its_device_stamp(opened):
    frames, batches = opened
    tf = batches["/tf"]
    names = np.array([row[0] for row in column(tf, "Transform3D:child_frame")])
    assert {row[0] for row in column(tf, "Transform3D:parent_frame")} == {"world"}
    translation = np.array([row[0] for row in column(tf, "Transform3D:translation")])
    quaternion = np.array([row[0] for row in column(tf, "Transform3D:quaternion")])
    sample, publish = stamps(tf, "timestamp"), stamps(tf, "message_publish_time")
    assert len(names) == (frames.status != Status.ABSENT).sum() > 500
    for number, name in enumerate(frames.names):
        rows = np.flatnonzero(frames.status[:, number] != Status.ABSENT)
        mine = np.flatnonzero(names == name)
        mine = mine[np.argsort(publish[mine], kind="stable")]
        assert np.array_equal(publish[mine], frames.stamp_ns[rows])
        assert np.array_equal(sample[mine], frames.sample_ns[rows, number])
        assert np.array_equal(translation[mine].astype(np.float32), frames.position[rows, number].astype(np.float32))
        assert np.array_equal(
            quaternion[mine].astype(np.float32), frames.quaternion_xyzw[rows, number].astype(np.float32)
        )


def test_rerun_reads_events_as_text_and_our_own_messages_by_their_fields(opened):
    _, batches = opened
    assert column(batches["/events"], "TextLog:text") == [["drop: the glass fell"]]
    assert [row["name"] for rows in column(batches["/intervals"], "vrlab.Interval:message") for row in rows] == ["pour"]
    hands = [row for rows in column(batches["/hands/anna/left"], "vrlab.Hand:message") for row in rows]
    assert [row["trigger"] for row in hands] == [0.0, 1.0]
    tracked = [row for rows in column(batches["/tracking"], "vrlab.Tracking:message") for row in rows]
    assert {body["status"]["name"] for row in tracked for body in row["bodies"] or ()} == {
        "LOST",
        "HELD",
        "INTERPOLATED",
    }
    assert any(row["frame_without_samples"] for row in tracked)


def test_rerun_reads_what_a_recorder_wrote_in_many_small_chunks(tmp_path):
    with Recorder(tmp_path / "s.mcap", meshes={"cup": tetrahedron()}) as recorder:
        for number in range(1200):
            recorder.poses(number, {"cup": ((number, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))} if number % 100 else {})
            recorder.hand(number, "anna", "left", trigger=1.0)
    parts = [part for part in chunk.McapReader(str(tmp_path / "s.mcap")).stream() if not part.is_static]
    tf = [part.to_record_batch() for part in parts if part.entity_path == "/tf"]
    x = [row[0][0] for row in column(tf, "Transform3D:translation")]
    assert sorted(x) == [number for number in range(1200) if number % 100]
