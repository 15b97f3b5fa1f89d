import numpy as np
import pytest
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap.writer import Writer
from support.session_files import (
    assert_same_frames,
    random_frames,
    session_of,
    tetrahedron,
)

from sessions.mcap.reader import McapFile, McapFrames
from sessions.mcap.scene_update import scene_update
from sessions.mcap.schemas import channel_spec, message_class
from sessions.mcap.writer import write_session
from sessions.model.scene import Pose, Scene, SceneBody
from sessions.model.session import Frames


@pytest.mark.parametrize("length", [1, 7, 800, 10_000])
def test_blocks_are_full_but_the_last(tmp_path, length):
    """A file of 800 frames (30 for blocks of 1) is read in blocks of ``length``; joined they are the frames."""
    frames = random_frames(seed=1, count=30 if length == 1 else 800, bodies=6, odd=0.02)
    write_session(session_of(frames, scene=Scene(name="bench")), tmp_path / "s.mcap")
    blocks = [*McapFrames(McapFile(tmp_path / "s.mcap"), frames.names).blocks(length)]
    assert [len(block) for block in blocks[:-1]] == [length] * ((len(frames) - 1) // length)
    assert_same_frames(Frames.join(blocks), frames)


def test_channels_are_known_that_only_the_chunks_declare(tmp_path):
    """A file has three chunks of a message each, and no channel in the summary at its end."""
    with (tmp_path / "s.mcap").open("wb") as stream:
        writer = Writer(stream, chunk_size=1, repeat_channels=False)
        writer.start()
        for number, topic in enumerate(["/speech", "/heart", "/noise"]):
            writer.add_message(writer.register_channel(topic, "json", 0), number, b"{}", number)
        writer.finish()
    file = McapFile(tmp_path / "s.mcap")
    assert len(file.catalogue.regions) == 3
    assert {channel.topic for channel in file.catalogue.channels.values()} == {"/speech", "/heart", "/noise"}


TOPICS = ["/tf", "/tracking", "/events", "/intervals", "/scene", "/contacts/live", "/hands/anna/left", "/tracks/wand"]


@pytest.mark.parametrize("topic", TOPICS)
def test_descriptor_sets_alone_decode_every_channel(topic):
    """A program without ours makes a channel's message from the descriptors in the file: it has the same fields."""
    spec = channel_spec(topic)
    files = descriptor_pb2.FileDescriptorSet.FromString(spec.descriptor_set).file
    pool = descriptor_pool.DescriptorPool()
    for file in files:  # in this order: every dependency stands before what needs it
        pool.Add(file)
    stranger = message_factory.GetMessageClass(pool.FindMessageTypeByName(spec.schema))
    assert [field.name for field in stranger.DESCRIPTOR.fields] == [f.name for f in spec.message.DESCRIPTOR.fields]
    assert channel_spec(topic).descriptor_set == spec.descriptor_set


def test_field_numbers_of_files_that_exist_never_change():
    """Protobuf writes numbers in place of names, which therefore must mean the same field for ever."""
    of_interval = {field.name: field.number for field in message_class("Interval").DESCRIPTOR.fields}
    assert of_interval == {"start": 1, "end": 2, "kind": 3, "name": 4, "data": 5}
    of_track = {field.name: field.number for field in message_class("TrackSamples").DESCRIPTOR.fields}
    assert of_track == {"sample_ns": 1, "position": 2, "quaternion_xyzw": 3, "valid": 4}


def entities_by_id(meshes, scene=None):
    """Id -> entity of the scene of these meshes."""
    update = SceneUpdate.FromString(scene_update(meshes, scene or Scene(), 5))
    return {entity.id: entity for entity in update.entities}


def test_body_is_drawn_by_its_triangles():
    """A tetrahedron, stretched and moved: points and faces are those of the mesh, in its body's frame, at 5 ns."""
    mesh = tetrahedron(size=1 / 3).transformed(np.array([[1, 0, 0, 5], [0, 2, 0, 6], [0, 0, 3, 7], [0, 0, 0, 1.0]]))
    entity = entities_by_id({"cup": mesh})["cup"]
    (piece,) = entity.triangles
    points = np.array([[p.x, p.y, p.z] for p in piece.points])
    assert points.tobytes() == mesh.vertices.tobytes()
    assert np.array(piece.indices).reshape(-1, 3).tolist() == mesh.faces.tolist()
    assert entity.frame_id == "cup" and entity.frame_locked and entity.timestamp.nanos == 5


def test_bodies_are_drawn_up_to_a_limit_of_bytes(monkeypatch):
    """A tetrahedron takes 4 points of 29 bytes and 12 indices of 4 bytes, 164; two take 328."""
    meshes = {"cup": tetrahedron(), "lid": tetrahedron()}
    for limit, drawn in ((163, []), (164, ["cup"]), (327, ["cup"]), (328, ["cup", "lid"])):
        monkeypatch.setattr("sessions.mcap.scene_update.DRAWING_BYTES", limit)
        assert [*entities_by_id(meshes)] == drawn, limit


@pytest.mark.parametrize(("parent", "frame"), [("", "world"), ("tray", "tray")])
def test_fixed_body_is_drawn_at_its_pose(parent, frame):
    """A cup of glass is fixed at (1, 2, 3) of the tray that carries it, or of the world, and drawn transparent."""
    fixed = SceneBody("cup", parent=parent, fixed=Pose((1.0, 2.0, 3.0)), tags=("glass",))
    entity = entities_by_id({"cup": tetrahedron()}, Scene(bodies=(fixed,)))["cup"]
    assert entity.frame_id == frame
    (triangles,) = entity.triangles
    assert triangles.pose.position.z == 3.0
    assert triangles.pose.orientation.w == 1.0
    assert triangles.color.a < 1.0
