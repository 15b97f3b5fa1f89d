"""Files are written by the formats' own libraries; poses are read again with SciPy alone."""

import numpy as np
import pytest
from foxglove_schemas_protobuf import (
    FrameTransform_pb2,
    FrameTransforms_pb2,
    PoseInFrame_pb2,
    PosesInFrame_pb2,
)
from google.protobuf.struct_pb2 import Value
from mcap.writer import Writer as McapWriter
from scipy.spatial.transform import Rotation, Slerp
from support.import_mutants import MUTANTS, refused, survive
from support.true_poses import ROS, has_poses

from sessions.importers import import_session

protobuf_writer = pytest.importorskip("mcap_protobuf.writer").Writer

START = 1_700_000_000_123_456_789
STEP = 11_111_111
COUNT = 25
RNG = np.random.default_rng(4)
PLACES = {name: RNG.normal(size=(COUNT, 3)) for name in ("head", "hand", "cup")}
TURNS = {name: Rotation.random(COUNT, random_state=seed) for seed, name in enumerate(PLACES)}
STAMPS = START + STEP * np.arange(COUNT)


def stamped(message, stamp):
    message.timestamp.FromNanoseconds(int(stamp))
    return message


def put(place, turn, values, rotation):
    place.x, place.y, place.z = map(float, values)
    turn.x, turn.y, turn.z, turn.w = map(float, rotation.as_quat())


def transform(parent, child, stamp=1, place=(0, 0, 0), rotation=Rotation.identity()):  # noqa: B008
    message = stamped(FrameTransform_pb2.FrameTransform(parent_frame_id=parent, child_frame_id=child), stamp)
    put(message.translation, message.rotation, place, rotation)
    return message


def transforms():
    """(topic, message) for three frames: head and hand in the world, a cup in the hand."""
    for k, stamp in enumerate(STAMPS.tolist()):
        several = [transform("world", name, stamp, PLACES[name][k], TURNS[name][k]) for name in ("head", "hand")]
        yield "/tf", stamp, FrameTransforms_pb2.FrameTransforms(transforms=several)
        yield "/cup", stamp, transform("hand", "cup", stamp, PLACES["cup"][k], TURNS["cup"][k])


def as_protobuf(path, messages):
    with path.open("wb") as stream, protobuf_writer(stream) as writer:
        for topic, stamp, message in messages:
            writer.write_message(topic, message, log_time=stamp + 5)
    return path


def close(got, expected):
    return np.abs(np.asarray(got) - np.asarray(expected)).max() < 1e-9


def test_frames_arrive_composed_to_their_root_on_their_own_stamps(tmp_path):
    session = import_session("mcap", as_protobuf(tmp_path / "a.mcap", transforms()))
    assert set(session.names) == {"head", "hand", "cup"}
    for name in ("head", "hand"):
        assert has_poses(session.tracks[name], PLACES[name], TURNS[name], ROS, STAMPS)
    cup = PLACES["hand"] + TURNS["hand"].apply(PLACES["cup"])
    assert has_poses(session.tracks["cup"], cup, TURNS["hand"] * TURNS["cup"], ROS, STAMPS)
    facts = session.facts
    assert (facts["source_convention"], facts["handedness"], facts["source_units"]) == ("ros", "right", "m")
    assert facts["assumed"].startswith("axes ros") and "interpolated" not in facts["conversions"]


def test_poses_are_bodies_named_after_their_topics(tmp_path):
    def messages():
        for k, stamp in enumerate(STAMPS.tolist()):
            head = stamped(PoseInFrame_pb2.PoseInFrame(frame_id="truth"), stamp)
            put(head.pose.position, head.pose.orientation, PLACES["head"][k], TURNS["head"][k])
            yield "/truth", stamp, head
            several = stamped(PosesInFrame_pb2.PosesInFrame(frame_id="truth"), stamp)
            for name in ("hand", "cup"):
                pose = several.poses.add()
                put(pose.position, pose.orientation, PLACES[name][k], TURNS[name][k])
            yield "/hands", stamp, several

    session = import_session("mcap", as_protobuf(tmp_path / "a.mcap", messages()))
    assert "poses in the root frame 'truth'" in session.facts["conversions"]
    bodies = {"truth pose": "head", "hands/0": "hand", "hands/1": "cup"}  # a topic may be called as a frame is
    assert set(session.names) == {*bodies}
    for body, name in bodies.items():
        assert has_poses(session.tracks[body], PLACES[name], TURNS[name], ROS)


def test_frames_with_clocks_of_their_own_are_interpolated_but_not_across_a_gap(tmp_path):
    hand, cup = STAMPS, STAMPS + STEP // 2
    heard = (np.arange(COUNT) < 3) | (np.arange(COUNT) >= 22)  # the hand is silent for 0.21 s
    messages = [("/tf", s, transform("world", "hand", s, PLACES["hand"][k], TURNS["hand"][k]))
                for k, s in enumerate(hand.tolist()) if heard[k]]  # fmt: skip
    messages += [("/tf", s, transform("hand", "cup", s, PLACES["cup"][k], TURNS["cup"][k]))
                 for k, s in enumerate(cup.tolist())]  # fmt: skip
    session = import_session("mcap", as_protobuf(tmp_path / "a.mcap", messages))
    assert "frames of other stamps interpolated, not across 0.2 s" in session.facts["conversions"]
    track = session.tracks["cup"]
    own = np.isin(track.times_ns, cup)
    at = track.times_ns[own][1]
    k = int(np.flatnonzero(cup == at)[0])
    turn = Slerp([hand[k] - START, hand[k + 1] - START], TURNS["hand"][[k, k + 1]])([at - START])[0]
    share = (at - hand[k]) / STEP
    place = (1 - share) * PLACES["hand"][k] + share * PLACES["hand"][k + 1] + turn.apply(PLACES["cup"][k])
    assert close(track.positions[own][1], ROS @ place)
    got = Rotation.from_quat(track.quaternions_xyzw[own][1]).as_matrix()
    assert close(got, ROS @ (turn * TURNS["cup"][k]).as_matrix() @ ROS.T)
    quiet = (track.times_ns > hand[2]) & (track.times_ns < hand[22])
    assert quiet.sum() == 20 and not track.valid[quiet].any()
    assert track.valid[~quiet].all()


def test_a_frame_that_never_meets_its_parent_in_time_is_left_out_and_named(tmp_path):
    messages = [("/tf", s, transform("world", "hand", s)) for s in (100, 200)]
    messages += [("/tf", s, transform("hand", "cup", s)) for s in (300, 400)]
    session = import_session("mcap", as_protobuf(tmp_path / "a.mcap", messages))
    assert session.names == ("hand",)
    words = "frames left out that never have stamps together with those above: 'cup'"
    assert words in session.facts["conversions"]


def half(path):
    as_protobuf(path, transforms())
    path.write_bytes(path.read_bytes()[:2000])
    return path


def of(*messages):
    return lambda path: as_protobuf(path, [("/t", 10, message) for message in messages])


def in_json(data, encoding="json"):
    def write(path):
        with path.open("wb") as stream:
            writer = McapWriter(stream)
            writer.start()
            schema = writer.register_schema("foxglove.FrameTransform", "jsonschema", b"{}")
            writer.add_message(writer.register_channel("/t", encoding, schema), 0, data, 0)
            writer.finish()
        return path

    return write


def own(path):
    with path.open("wb") as stream:
        writer = McapWriter(stream)
        writer.start(profile="vrlab/1")
        writer.finish()
    return path


BROKEN = {
    "a session": (own, "is a session already; run `replay run"),
    "two parents": (of(transform("world", "a"), transform("room", "a")),
                    "frame 'a' hangs from 'world' and from 'room'"),
    "two roots": (of(transform("world", "a"), transform("room", "b")),
                  r"2 roots .'room', 'world'.*--topic"),
    "a loop": (of(transform("b", "a"), transform("a", "b")), "hangs from itself"),
    "no name": (of(transform("world", "")), "a transform has no child frame"),
    "no poses": (of(FrameTransforms_pb2.FrameTransforms()), "there is no pose in it"),
    "another message": (of(Value(number_value=1)), r"no message of poses .*there are: /t \(google.protobuf.Value\)"),
    "half a file": (half, "is no whole MCAP file"),
    "no JSON": (in_json(b"{"), "/t: a foxglove.FrameTransform cannot be read"),
    "an encoding": (in_json(b"{}", "msgpack"), "messages are encoded as 'msgpack'; write protobuf"),
    "a far stamp": (in_json(b'{"timestamp": {"sec": 100000000000}, "child_frame_id": "a", "parent_frame_id": "b"}'),
                    "frame 'a' has a stamp of"),
}  # fmt: skip


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_file_is_refused_in_one_sentence(tmp_path, name):
    write, words = BROKEN[name]
    refused("mcap", write(tmp_path / "a.mcap"), words)


@pytest.mark.parametrize("count", MUTANTS)
def test_mutants_end_in_a_session_or_one_sentence(tmp_path, count):
    survive("mcap", as_protobuf(tmp_path / "a.mcap", transforms()), count)
