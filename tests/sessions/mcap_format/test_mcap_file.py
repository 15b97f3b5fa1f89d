import numpy as np
import pytest
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from support.mcap_samples import (
    assert_same_frames,
    random_frames,
    session_of,
    tetrahedron,
)

from sessions.mcap_format.mcap_file import McapFile, McapFrames
from sessions.mcap_format.scene_update import scene_update
from sessions.mcap_format.schemas import channel_spec, message_class
from sessions.mcap_format.writer import write_session
from sessions.model.event import Event, Interval
from sessions.model.frames import Frames, Status
from sessions.model.scene import Scene
from sessions.model.track import HandTrack


@pytest.fixture
def path(tmp_path):
    frames = random_frames(1, 3000, 6, odd=0.02)
    write_session(
        session_of(frames, events=(Event(1, "a"), Event(2, "b")), scene=Scene(name="bench")), tmp_path / "s.mcap"
    )
    return tmp_path / "s.mcap"


@pytest.mark.parametrize("length", [1, 7, 3000, 10_000])
def test_blocks_are_full_but_the_last(path, length):
    source = McapFrames(McapFile(path), tuple(f"body {k}" for k in range(6)))
    blocks = []
    for block in source.blocks(length):
        blocks.append(block)
        if length == 1 and len(blocks) == 5:
            break
    assert all(len(block) == length for block in blocks[:-1])
    if length > 1:
        assert_same_frames(Frames.join(blocks), random_frames(1, 3000, 6, odd=0.02))


TOPICS = ["/tf", "/tracking", "/events", "/intervals", "/scene", "/contacts/live", "/hands/anna/left", "/tracks/wand"]


@pytest.mark.parametrize("topic", TOPICS)
def test_a_stranger_can_decode_every_channel_from_its_descriptor_set_alone(topic):
    spec = channel_spec(topic)
    files = descriptor_pb2.FileDescriptorSet.FromString(spec.descriptor_set).file
    pool = descriptor_pool.DescriptorPool()
    for file in files:  # in this order: every dependency stands before what needs it
        pool.Add(file)
    stranger = message_factory.GetMessageClass(pool.FindMessageTypeByName(spec.schema))
    assert [field.name for field in stranger.DESCRIPTOR.fields] == [f.name for f in spec.message.DESCRIPTOR.fields]
    assert channel_spec(topic).descriptor_set == spec.descriptor_set


def test_field_numbers_of_files_that_exist_never_change():
    numbers = {f.name: f.number for f in message_class("Interval").DESCRIPTOR.fields}
    assert numbers == {"start": 1, "end": 2, "kind": 3, "name": 4, "data": 5}
    numbers = {f.name: f.number for f in message_class("TrackSamples").DESCRIPTOR.fields}
    assert numbers == {"sample_ns": 1, "position": 2, "quaternion_xyzw": 3, "valid": 4}


def entities(meshes, scene=None):
    update = SceneUpdate.FromString(scene_update(meshes, scene or Scene(), 5))
    return {entity.id: entity for entity in update.entities}


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


def test_a_body_is_drawn_with_its_own_triangles_unless_these_are_too_many(monkeypatch):
    mesh = tetrahedron(1 / 3).transformed(np.array([[1, 0, 0, 5], [0, 2, 0, 6], [0, 0, 3, 7], [0, 0, 0, 1.0]]))
    entity = entities({"cup": mesh})["cup"]
    (part,) = entity.triangles
    points = np.array([[p.x, p.y, p.z] for p in part.points])
    assert points.tobytes() == mesh.vertices.tobytes()
    assert np.array(part.indices).reshape(-1, 3).tolist() == mesh.faces.tolist()
    assert entity.frame_id == "cup" and entity.frame_locked and entity.timestamp.nanos == 5
    monkeypatch.setattr("sessions.mcap_format.scene_update.DRAWING_BYTES", 10)
    assert entities({"cup": mesh}) == {}
