"""Files are written by the formats' own libraries; poses are composed and interpolated again with SciPy alone.

Those in `composed` say one thing in three ways (`poses.txt`: places and quaternions of six frames). A robot moves on
a table in a map, its left too, a cup in there. Static, told last: the table, the robot's tool. Two poses are seen from
the map.
"""

import json
import struct
import sys
from contextlib import suppress
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from mcap.exceptions import McapError
from mcap.records import Chunk, Message
from mcap.stream_reader import CRCValidationError, StreamReader, breakup_chunk
from mcap.writer import CompressionType, Writer
from scipy.spatial.transform import Rotation, Slerp
from support.mutants import assert_import_refused, ledger_text
from support.second_opinions import ROS, has_poses

from sessions import examine, read_session
from sessions.errors import SessionFileError
from sessions.importers import import_session
from sessions.importers.frame_tree import FrameTree
from sessions.importers.ledger import Ledger, ledger_of
from sessions.importers.mcap_file import NAMED_TOPICS
from sessions.mcap.salvage import recover
from sessions.model.assumption import Confidence, Subject, assumptions_of

COMPOSED = Path(__file__).with_name("composed")
COUNT, STEP_NS = 25, 11_111_111
STAMPS = 1_700_000_000_123_456_789 + STEP_NS * np.arange(COUNT)
POSITIONS, ROTATIONS = np.split(np.loadtxt(COMPOSED / "poses.txt").reshape(6, COUNT, 7), [3], axis=2)
ROTATIONS = [Rotation.from_quat(rotations) for rotations in ROTATIONS]
FRAME, FRAMES = "foxglove.FrameTransform", "foxglove.FrameTransforms"


def pose_of_body(body, row, position="translation", rotation="rotation"):
    """Pose number ``row`` of those of a body."""
    values = POSITIONS[body][row].tolist(), ROTATIONS[body][row].as_quat().tolist()
    return {position: dict(zip("xyz", values[0], strict=True)), rotation: dict(zip("xyzw", values[1], strict=True))}


def transform(parent, child, stamp=1, body=0, row=0):
    """The message of a transform between two frames of ROS."""
    timestamp = dict(zip(("sec", "nsec"), divmod(int(stamp), 10**9), strict=True))
    return {"timestamp": timestamp, "parent_frame_id": parent, "child_frame_id": child, **pose_of_body(body, row)}


def write_json_mcap(path, messages, encoding="json", profile=""):
    """``messages``: topic, schema, log time, and what it says."""
    with path.open("wb") as stream:
        writer, channels = Writer(stream), {}
        writer.start(profile=profile)
        for topic, schema, stamp, rows in messages:
            if topic not in channels:
                number = writer.register_schema(schema, "jsonschema", b"{}")
                channels[topic] = writer.register_channel(topic, encoding, number)
            writer.add_message(channels[topic], int(stamp), json.dumps(rows).encode(), int(stamp))
        writer.finish()
    return path


def chained_poses(*chain):
    """Places and rotations in the root, of (body, row or all rows) from the root down."""
    position, rotation = np.zeros(3), Rotation.identity()
    for body, row in chain:
        position, rotation = position + rotation.apply(POSITIONS[body][row]), rotation * ROTATIONS[body][row]
    return np.tile(position, (COUNT, 1)) if position.ndim == 1 else position, rotation


ALL = slice(None)


@pytest.mark.parametrize("format", ["mcap", "auto", "ros2"])
def test_transforms_are_composed_to_the_root_frame(format):
    """``expected`` has for each frame its chain from the root: (number of poses, row), ALL rows where it moves."""
    session = import_session(format, COMPOSED / f"{format}.mcap")
    robot = ((0, 0), (1, ALL))
    expected = {
        "table": ((0, 0),), "robot": robot, "left": (*robot, (2, ALL)), "cup": (*robot, (2, ALL), (3, ALL)),
        "tool": (*robot, (0, 1)), "map pose": ((4, ALL),), "several/0": ((4, ALL),), "several/1": ((5, ALL),),
    }  # fmt: skip
    assert set(session.names) == {*expected} and not session.meshes  # no frame of a robot gets a stand-in
    for name, chain in expected.items():
        position, rotation = chained_poses(*chain)
        rotation = Rotation.concatenate([rotation] * COUNT) if rotation.single else rotation
        assert has_poses(session.tracks[name], position, rotation, ROS, STAMPS)
    facts = session.facts
    assert (facts["source_convention"], facts["handedness"], facts["source_units"]) == ("ros", "right", "m")
    assert facts["assumed"].startswith("axes ros") and "interpolated" not in facts["conversions"]
    assert "poses in the root frame 'map'" in facts["conversions"]


def test_unstamped_poses_use_log_time_and_covariance_is_ignored(tmp_path):
    """Two messages logged at 5 and 8 ns, with the pose of row 0."""
    pose = {"pose": pose_of_body(body=0, row=0, position="position", rotation="orientation"), "covariance": []}
    rows = [("/a", "geometry_msgs/PoseWithCovarianceStamped", k, {"pose": pose}) for k in (5, 8)]
    session = import_session("mcap", write_json_mcap(tmp_path / "a.mcap", rows))
    assert has_poses(session.tracks["a"], POSITIONS[0][[0, 0]], ROTATIONS[0][[0, 0]], ROS, [5, 8])
    assert "2 poses without a stamp have the time they were logged at" in session.facts["conversions"]


def test_parent_frames_are_interpolated_except_across_gaps(tmp_path):
    """The cup hangs from the hand and is stamped half a step later; expected poses by SciPy's slerp."""
    hand, cup = STAMPS, STAMPS + STEP_NS // 2
    heard = (np.arange(COUNT) < 3) | (np.arange(COUNT) >= 22)  # the hand is silent for 0.21 s
    messages = [
        ("/tf", FRAME, s, transform("world", "hand", stamp=s, body=0, row=k)) for k, s in enumerate(hand) if heard[k]
    ]
    messages += [("/tf", FRAME, s, transform("hand", "cup", stamp=s, body=1, row=k)) for k, s in enumerate(cup)]
    session = import_session("mcap", write_json_mcap(tmp_path / "a.mcap", messages))
    assert "frames of other stamps interpolated, not across 0.2 s" in session.facts["conversions"]
    track = session.tracks["cup"]
    row = np.flatnonzero(np.isin(track.times_ns, cup))[1]
    k = int(np.flatnonzero(cup == track.times_ns[row])[0])
    fraction = (track.times_ns[row] - hand[k]) / STEP_NS
    rotation = Slerp([0, 1], ROTATIONS[0][[k, k + 1]])([fraction])[0]
    position = (1 - fraction) * POSITIONS[0][k] + fraction * POSITIONS[0][k + 1] + rotation.apply(POSITIONS[1][k])
    assert np.allclose(track.positions[row], ROS @ position, atol=1e-9)
    actual = Rotation.from_quat(track.quaternions_xyzw[row]).as_matrix()
    assert np.allclose(actual, ROS @ (rotation * ROTATIONS[1][k]).as_matrix() @ ROS.T, atol=1e-9)
    quiet = (track.times_ns > hand[2]) & (track.times_ns < hand[22])
    assert quiet.sum() == 20 and (track.valid == ~quiet).all()


SEPARATE = "1 of 2 names dropped: that never have stamps together with those above: 'cup'"
STILL = "2 of 3 names dropped: that stand still and that no transform joins to it: 'lamp', 'bulb'"


@pytest.mark.parametrize(
    ("moves", "names", "text"),
    [
        ([("world", "hand", 1), ("world", "hand", 2), ("hand", "cup", 3), ("hand", "cup", 4)], ["hand"], SEPARATE),
        ([("map", "a", 1), ("room", "lamp", 1), ("lamp", "bulb", 1), ("map", "a", 2)], ["a"], STILL),
    ],
)
def test_unconnected_frames_are_left_out_and_listed(tmp_path, moves, names, text):
    """A frame (parent, child, stamp) never has a stamp of its parent, or has another root and stands still."""
    rows = [("/tf", FRAME, stamp, transform(parent, child, stamp=stamp)) for parent, child, stamp in moves]
    session = import_session("mcap", write_json_mcap(tmp_path / "a.mcap", rows))
    assert [*session.names] == names and text in ledger_text(session)


def test_requested_roots_form_a_single_world(tmp_path):
    """a is in the frame map, b in the frame room; the user requests both topics."""
    rows = [
        (topic, FRAME, k, transform(parent, topic[1:], stamp=k, body=k, row=k))
        for k in (1, 2)
        for topic, parent in (("/a", "map"), ("/b", "room"))
    ]
    session = import_session("mcap", write_json_mcap(tmp_path / "a.mcap", rows), topics=["/a", "/b"])
    assert {*session.names} == {"a", "b"} and "frames 'map', 'room' taken for one world" in session.facts["assumed"]


STAMPED = {
    "text, as 64-bit numbers of JSON": (lambda k: {"sec": str(k), "nsec": 5}, [1_000_000_005, 2_000_000_005]),
    "nanoseconds as text": (lambda k: {"seconds": k, "nanos": "7"}, [1_000_000_007, 2_000_000_007]),
    "whole floats": (lambda k: {"sec": float(k), "nsec": 0.0}, [1_000_000_000, 2_000_000_000]),
    "seconds alone": (lambda k: {"sec": k}, [1_000_000_000, 2_000_000_000]),
    "ISO 8601, as protobuf's JSON": (lambda k: f"1970-01-01T00:00:0{k}.000000009Z", [1_000_000_009, 2_000_000_009]),
    "a clock that begins at 0": (lambda k: {"sec": k - 1, "nsec": 0}, [0, 1_000_000_000]),
    "0 throughout is none": (lambda k: {"sec": 0, "nsec": 0}, [101, 102]),
    "none": (lambda k: None, [101, 102]),
    "a fraction": (lambda k: {"sec": k + 0.5}, r"/t: 1.5 in a timestamp is no whole number"),
    "a word": (lambda k: {"sec": "now"}, "'now' in a timestamp is no whole number"),
    "true": (lambda k: {"sec": True}, "True in a timestamp is no whole number"),
    "a bare number": (lambda k: 1_700_000_000 + k, "a timestamp is 1700000001; write it as sec and nsec"),
    "other names": (lambda k: {"s": k}, "write it as sec and nsec"),
    "before 0": (lambda k: {"sec": -k}, "before 0; correct the stamps"),
    "nanoseconds of the whole stamp": (
        lambda k: {"sec": k, "nsec": k * 10**9 + 7},
        "1000000007 nanoseconds beside its 1",
    ),
    "nanoseconds before the second": (lambda k: {"sec": k, "nsec": -1}, "-1 nanoseconds beside its 1 seconds"),
    "nanoseconds alone": (lambda k: {"nsec": k * 10**9 + 7}, [1_000_000_007, 2_000_000_007]),
    "no date": (lambda k: "yesterday", "Invalid isoformat string"),
}


@pytest.mark.parametrize("kind", STAMPED)
def test_stamps_of_any_form_are_read_or_refused(tmp_path, kind):
    """A row of STAMPED: the timestamp of message k, 1 or 2, and stamps in ns or words of the refusal.

    Messages are logged at 101 and 102 ns, which counts where they have no stamp.
    """
    stamp, expected = STAMPED[kind]
    rows = [("/t", FRAME, 100 + k, {**transform("world", "cup", row=k), "timestamp": stamp(k)}) for k in (1, 2)]
    path = write_json_mcap(tmp_path / "a.mcap", rows)
    if isinstance(expected, str):
        assert_import_refused("mcap", path, expected)
        return
    assert import_session("mcap", path).tracks["cup"].times_ns.tolist() == expected


@pytest.mark.parametrize("fraction", [10**3, 10**6], ids=["microseconds", "milliseconds"])
def test_nanoseconds_in_a_larger_unit_are_refused(tmp_path, fraction):
    """180 stamps at 60 Hz whose part below the second counts micro- or milliseconds."""
    stamps = np.arange(180) * 16_666_667 + 5_000_000_000
    coarse = [stamp // 10**9 * 10**9 + stamp % 10**9 // fraction for stamp in stamps.tolist()]
    rows = [
        ("/tf", FRAME, stamp, transform("world", "cup", stamp=stamp, row=k % COUNT)) for k, stamp in enumerate(coarse)
    ]
    assert_import_refused(
        "mcap", write_json_mcap(tmp_path / "a.mcap", rows), "nanoseconds of its 180 stamps are all below 1,000,000"
    )


def test_a_clock_that_pulses_on_the_second_is_read(tmp_path):
    """Stamps within 6 us of whole seconds."""
    stamps = [k * 10**9 + 1_000 * (k % 7) for k in range(1, 21)]
    rows = [("/tf", FRAME, stamp, transform("world", "cup", stamp=stamp, row=k)) for k, stamp in enumerate(stamps)]
    assert import_session("mcap", write_json_mcap(tmp_path / "a.mcap", rows)).tracks["cup"].times_ns.tolist() == stamps


def pose_array(rows):
    """A message with poses of these bodies, as (body, row)."""
    poses = [pose_of_body(body=body, row=row, position="position", rotation="orientation") for body, row in rows]
    return {"timestamp": {"sec": 1 + rows[0][1] if rows else 1, "nsec": 0}, "frame_id": "map", "poses": poses}


def test_arrays_that_get_shorter_name_no_body(tmp_path):
    """A pose of an array is a body by its index; an array that loses one no longer says whose."""
    schema = "foxglove.PosesInFrame"
    lengths = [2, 2, 1, 2]
    rows = [
        ("/seen", schema, k, pose_array([(body, k) for body in range(2)][-count:])) for k, count in enumerate(lengths)
    ]
    path = write_json_mcap(tmp_path / "short.mcap", [*rows, ("/tf", FRAME, 1, transform("map", "cup"))])
    assert_import_refused("mcap", path, "/seen: its arrays get shorter, from 2 poses to 1, so that nobody knows")
    assert import_session("mcap", path, topics=["/tf"]).names == ("cup",)
    unseen = [*rows[:2], ("/seen", schema, 2, pose_array([])), rows[3]]
    assert import_session("mcap", write_json_mcap(tmp_path / "none.mcap", unseen)).names == ("seen/0", "seen/1")
    assumed = import_session("mcap", tmp_path / "none.mcap").facts["assumed"]
    assert "a pose of /seen taken to be of the body of its index in the array" in assumed


def test_poses_that_name_no_frame_are_an_assumption(tmp_path):
    """They are taken to be in the root of /tf, which is named."""
    schema = "foxglove.PoseInFrame"
    rows = [("/tf", FRAME, k, transform("map", "cup", stamp=k, row=k)) for k in (1, 2)]
    for frame, text in (("", "poses of 'pen', which name no frame, taken to be in 'map'"), ("map", "")):
        pose = {
            "timestamp": {"sec": 0, "nsec": 1},
            "frame_id": frame,
            "pose": pose_of_body(body=1, row=1, position="position", rotation="orientation"),
        }
        session = import_session(
            "mcap", write_json_mcap(tmp_path / f"{frame}.mcap", [*rows, ("/pen", schema, 1, pose)])
        )
        assert text in session.facts["assumed"] and ("name no frame" in session.facts["assumed"]) == bool(text)


def test_child_of_a_rarely_sent_frame_stays_valid_at_rest(tmp_path):
    """The table is sent in the first and the last frame: between them its cup is lost only if the table moved."""
    rows = [("/tf", FRAME, s, transform("table", "cup", stamp=s, body=0, row=k)) for k, s in enumerate(STAMPS.tolist())]
    for row, is_lost in ((0, False), (1, True)):
        ends = [
            ("/slow", FRAME, s, transform("map", "table", stamp=s, body=1, row=at))
            for s, at in ((STAMPS[0], 0), (STAMPS[-1], row))
        ]
        track = import_session("mcap", write_json_mcap(tmp_path / f"{row}.mcap", [*rows, *ends])).tracks["cup"]
        assert track.valid[[0, -1]].all() and (~track.valid[1:-1] == is_lost).all()
    pose_positions, _ = chained_poses((1, 0), (0, ALL))
    calm = import_session("mcap", tmp_path / "0.mcap").tracks["cup"]
    assert np.abs(calm.positions - pose_positions @ ROS.T).max() <= 1e-9


def transforms(topic, count=20, stamp=lambda k: k + 1, name="cup", body=0):
    """Messages of a topic that moves a body from row to row."""
    return [(topic, FRAME, k, transform("world", name, stamp=stamp(k), body=body, row=k)) for k in range(count)]


@pytest.mark.parametrize(
    ("messages", "text"),
    [
        (
            transforms("/a/tf") + transforms("/b/tf", body=1),
            "'cup' comes on the topics '/a/tf' and '/b/tf'; choose one by --topic",
        ),
        (transforms("/a/tf") + transforms("/b/tf", 1), "'cup' comes on the topics '/a/tf' and '/b/tf'"),
        (transforms("/tf") + transforms("/tf2", stamp=lambda k: 900 + k), "'cup' comes on the topics '/tf' and '/tf2'"),
        (transforms("/tf") + transforms("/robot/tf_static", 1), "'cup' comes on the topics '/tf' and '/robot/tf'"),
    ],
    ids=["apart", "once", "later", "static"],
)
def test_frame_on_two_topics_needs_a_chosen_topic(tmp_path, messages, text):
    """The cup is in messages of two topics, once or often, at the same times or later. One topic alone is read."""
    path = write_json_mcap(tmp_path / "a.mcap", messages)
    assert_import_refused("mcap", path, text)
    assert import_session("mcap", path, topics=[messages[-1][0]]).names == ("cup",)


@pytest.mark.parametrize(
    ("stamp", "kept", "text"),
    [
        (lambda k: 7, 1, "cup: 19 of 20 transforms dropped: with the stamp of another sample"),
        (lambda k: 1 + k // 2, 10, "cup: 10 of 20 transforms dropped: with the stamp of another sample"),
        (lambda k: 10**18 if k == 9 else k + 1, 19, "cup: 1 of 20 transforms dropped: with a stamp out of order"),
        (lambda k: [1, 3, 2][k % 3] + 3 * (k // 3), 14, "cup: 6 of 20 transforms dropped: with a stamp out of order"),
    ],
    ids=["all alike", "pairs", "one late", "swapped"],
)
def test_transforms_dropped_for_bad_stamps_are_counted(tmp_path, stamp, kept, text):
    """``stamp``: of message k of 20, in nanoseconds."""
    session = import_session("mcap", write_json_mcap(tmp_path / "a.mcap", transforms("/tf", stamp=stamp)))
    assert len(session.tracks["cup"]) == kept and ledger_text(session) == text


def test_unordered_messages_lose_no_pose(tmp_path):
    """The second half of 20 messages stands first in the file; their log times are in order."""
    messages = transforms("/tf")
    session = import_session("mcap", write_json_mcap(tmp_path / "a.mcap", [*messages[10:], *messages[:10]]))
    assert len(session.tracks["cup"]) == 20 and ledger_text(session) == ""


def damaged_file(path, *, chunked, cut=0, broken=0, crc=True):
    """A file of 60 messages, cut short or with a byte changed, and how many messages of it are whole."""
    with path.open("wb") as stream:
        writer = Writer(
            stream, chunk_size=2000, use_chunking=chunked, compression=CompressionType.NONE, enable_crcs=crc
        )
        writer.start()
        channel = writer.register_channel("/tf", "json", writer.register_schema(FRAME, "jsonschema", b"{}"))
        for k in range(60):
            writer.add_message(
                channel, k, json.dumps(transform("world", "cup", stamp=k + 1, body=0, row=k % COUNT)).encode(), k
            )
        writer.finish()
    data = bytearray(path.read_bytes())
    if broken:
        data[broken] ^= 1
    path.write_bytes(data[: len(data) - cut] if cut else data)
    return path


@pytest.mark.parametrize(
    "how",
    [
        {"chunked": False, "cut": 9000},
        {"chunked": True, "cut": 9000},
        {"chunked": True, "broken": 9000},
        {"chunked": True, "cut": 9},
        {"chunked": False, "cut": 9000, "crc": False},
    ],
    ids=["no chunks, cut", "chunks, cut", "a bad chunk", "no index", "no checksums"],
)
def test_torn_foreign_file_is_recovered_by_the_import(tmp_path, how):
    """60 messages, cut or damaged (``how``); imported are those that the format's own library reads before the damage.

    ``replay recover`` and reading as a session refuse the file and name the import; the doctor does not offer recovery.
    """
    path = damaged_file(tmp_path / "a.mcap", **how)
    whole = {message.log_time for message in whole_messages(path)}
    session = import_session("mcap", path)
    assert {stamp - 1 for stamp in session.tracks["cup"].times_ns.tolist()} == whole
    assert ledger_of(session.facts).large_losses()
    # Whatever else reads it sends to the import.
    for read in (partial(recover, path, tmp_path / "r.mcap"), partial(read_session, path)):
        with pytest.raises(SessionFileError) as refusal:
            read()
        assert f"replay import mcap {path} -o" in str(refusal.value) and "recover" not in str(refusal.value)
    assert all("recover" not in finding.fix for finding in examine(path) if finding.code != "damaged-chunk")


def whole_messages(path):
    """By the library's reader that needs no index, up to the first byte that it cannot read."""
    messages = []
    with path.open("rb") as stream, suppress(McapError, struct.error, EOFError):
        for record in StreamReader(stream, emit_chunks=True).records:
            if isinstance(record, Chunk):
                with suppress(CRCValidationError):
                    messages += [item for item in breakup_chunk(record, True) if isinstance(item, Message)]
            elif isinstance(record, Message):
                messages.append(record)
    return messages


def file_of_transforms(*moves, schema=FRAME, **how):
    """A writer of a file of these transforms, or of what they say."""
    rows = [transform(*move) if isinstance(move, tuple) else move for move in moves]
    return lambda path: write_json_mcap(path, [("/t", schema, 10, content) for content in rows], **how)


def write_half_a_file(path):
    """The path of a file that ends after 2000 bytes."""
    path.write_bytes((COMPOSED / "mcap.mcap").read_bytes()[:2000])
    return path


def bag_of_a_message(data=b"\0\1\0\0", kind="ros2msg", text="float64 x\n"):
    """A writer of a bag with one message of these bytes and this description."""

    def write(path):
        pytest.importorskip("mcap_ros2")
        with path.open("wb") as stream:
            writer = Writer(stream)
            writer.start(profile="ros2")
            schema = writer.register_schema("tf2_msgs/msg/TFMessage", kind, text.encode())
            writer.add_message(writer.register_channel("/tf", "cdr", schema), 10, data, 10)
            writer.finish()
        return path

    return write


UNREAD = "/tf: a tf2_msgs/msg/TFMessage cannot be read"
TWICE = [("map", "a"), ("odom", "b"), ("map", "a", 2), ("odom", "b", 2)]
BROKEN = {
    "a session": (file_of_transforms(profile="vrlab/1"), "is a session already; run `replay run"),
    "two parents": (
        file_of_transforms(("world", "a"), ("room", "a")),
        "frame 'a' hangs from 'world' and from 'room'; record its poses in one of them",
    ),
    "two roots": (file_of_transforms(("world", "a"), ("room", "b")), r"2 roots .'room', 'world'.*--topic"),
    "two that move": (file_of_transforms(*TWICE), "frames hang from 2 roots"),
    "a loop": (file_of_transforms(("b", "a"), ("a", "b")), "hangs from itself by 'a'; correct the names"),
    "no name": (file_of_transforms(("world", "")), "a transform has no child frame"),
    "no poses": (file_of_transforms({}, schema=FRAMES), "a transform has no child frame"),
    "none of several": (file_of_transforms({"transforms": []}, schema=FRAMES), "there is no pose in it"),
    "another message": (file_of_transforms({}, schema="a.Value"), r"no message of poses .*there are: /t \(a.Value\)"),
    "half a file": (write_half_a_file, "cut short at byte [0-9,]+; record it again"),
    "an encoding": (file_of_transforms({}, encoding="msgpack"), "messages are encoded as 'msgpack'; write protobuf"),
    "no CDR": (file_of_transforms({}, encoding="protobuf"), "/t: a foxglove.FrameTransform cannot be read"),
    "a far stamp": (file_of_transforms(("b", "a", 10**20)), "frame 'a' has a stamp of"),
    "half a message": (bag_of_a_message(b"\0\1\0\0\5\0"), UNREAD),
    "another language": (
        bag_of_a_message(kind="ros2idl"),
        "a schema in 'ros2idl' is not known; record with schemas in ros2msg",
    ),
    "a bad type": (bag_of_a_message(text="float64[ x\n"), UNREAD),
    "an unknown type": (bag_of_a_message(text="no_such/Type x\n"), UNREAD),
}


@pytest.mark.parametrize("name", BROKEN)
def test_broken_file_is_refused_in_a_sentence_without_output(tmp_path, name, capfd):
    """A row of BROKEN: a function that writes the file, and words of the refusal."""
    write, sentence = BROKEN[name]
    assert_import_refused("mcap", write(tmp_path / "a.mcap"), sentence)
    assert capfd.readouterr() == ("", "")


def test_ros_without_its_library_is_refused_in_a_sentence(tmp_path, monkeypatch):
    """``None`` in sys.modules makes the import of mcap_ros2 fail."""
    monkeypatch.setitem(sys.modules, "mcap_ros2.decoder", None)
    assert_import_refused(
        "ros2",
        bag_of_a_message()(tmp_path / "a.mcap"),
        r'need mcap-ros2-support; install it: pip install "vrlab-replay\[forma',
    )


def frame_messages_at(*stamps, logged=None, child="cup"):
    """Messages of one frame at these stamps, logged at those times or at others."""
    logged = stamps if logged is None else logged
    return [
        ("/tf", FRAME, log, transform("map", child, stamp=stamp, row=row % COUNT))
        for row, (stamp, log) in enumerate(zip(stamps, logged, strict=True))
    ]


def test_topics_that_are_not_read_are_named(tmp_path):
    """Beside /tf are a scene and an IMU; of more than NAMED_TOPICS the rest is a number.

    A chosen topic asks for no others.
    """
    others = [("/scene", "foxglove.SceneUpdate", 1, {"entities": []}), ("/imu", "sensor_msgs/msg/Imu", 2, {})]
    session = import_session("mcap", write_json_mcap(tmp_path / "m.mcap", [*frame_messages_at(*STAMPS), *others]))
    unread = "topics that are not read: /scene (foxglove.SceneUpdate), /imu (sensor_msgs/msg/Imu)"
    assert unread in session.facts["conversions"].split("; ")
    many = [(f"/camera_{number}", "Image", number, {}) for number in range(NAMED_TOPICS + 2)]
    session = import_session("mcap", write_json_mcap(tmp_path / "m.mcap", [*frame_messages_at(*STAMPS), *many]))
    last_named = f"/camera_{NAMED_TOPICS - 1} (Image)"
    assert f"{last_named} and 2 more" in session.facts["conversions"]
    chosen = import_session("mcap", tmp_path / "m.mcap", topics=["/tf"])
    assert "not read" not in chosen.facts["conversions"]


def test_poses_in_an_optical_frame_have_y_down(tmp_path):
    """REP 103: x right, y down, z forward; a point at (1, 2, 3) is 2 m below and 3 m in front of the camera."""
    moved = transform("depth_optical_frame", "cup", stamp=1)
    moved["translation"] = {"x": 1.0, "y": 2.0, "z": 3.0}
    session = import_session("mcap", write_json_mcap(tmp_path / "m.mcap", [("/tf", FRAME, 1, moved)]))
    assert session.tracks["cup"].positions[0] == pytest.approx([1.0, -2.0, -3.0])
    axes = next(row for row in assumptions_of(session.facts) if row.subject is Subject.POSE_AXES)
    assert axes.confidence is Confidence.OPEN
    named = import_session("mcap", tmp_path / "m.mcap", convention="ros")
    assert named.tracks["cup"].positions[0] == pytest.approx([-2.0, 3.0, -1.0])


def test_odometry_is_a_pose_of_its_topic(tmp_path):
    """ROS's message: a header with a stamp, a pose with covariance."""
    messages = [
        ("/base/odom", "nav_msgs/msg/Odometry", stamp, {
            "header": {"stamp": {"sec": int(stamp) // 10**9, "nanosec": int(stamp) % 10**9}, "frame_id": "map"},
            "child_frame_id": "base",
            "pose": {
                "pose": pose_of_body(body=0, row=row, position="position", rotation="orientation"),
                "covariance": [0.0] * 36,
            },
        })
        for row, stamp in enumerate(STAMPS)
    ]  # fmt: skip
    session = import_session("mcap", write_json_mcap(tmp_path / "m.mcap", messages))
    assert has_poses(session.tracks["base/odom"], POSITIONS[0], ROTATIONS[0], ROS, STAMPS)


def test_late_logging_costs_no_transform_whose_stamps_increase(tmp_path):
    """Log times are up to 30 ms off, so out of order at steps of 11 ms; stamps are not."""
    logged = STAMPS + (30_000_000 * np.sin(np.arange(COUNT))).astype(np.int64)
    session = import_session("mcap", write_json_mcap(tmp_path / "m.mcap", frame_messages_at(*STAMPS, logged=logged)))
    assert session.tracks["cup"].times_ns.tolist() == STAMPS.tolist()


def table_of_transforms(stamps, logged):
    """Stamps of the table of one frame whose transforms stand in a file in this order."""
    tree = FrameTree(Ledger("log"))
    for stamp, log in zip(stamps, logged, strict=True):
        tree.add("map", "cup", stamp, log, [0, 0, 0, 0, 0, 0, 1], topic="/tf")
    return tree.tables()[0]["cup"].times_ns.tolist()


def test_transforms_follow_their_log_unless_stamps_increase():
    """Stamps and log times, in the order of the file: that counts where stamps increase in it, else that of the log."""
    increasing, swapped, falling = [10, 20, 30], [20, 10, 30], [30, 20, 10]
    assert table_of_transforms(increasing, swapped) == increasing
    assert table_of_transforms(swapped, swapped) == increasing
    assert table_of_transforms(falling, falling) == increasing
    assert len(table_of_transforms(swapped, increasing)) == 2, "in the order of the log a stamp goes back"


def test_stamps_of_zero_among_others_are_dropped(tmp_path):
    """Every fifth of 25 stamps is 0, which stands for none."""
    stamps = STAMPS.copy()
    stamps[::5] = 0
    session = import_session("mcap", write_json_mcap(tmp_path / "m.mcap", frame_messages_at(*stamps, logged=STAMPS)))
    assert session.tracks["cup"].times_ns.tolist() == stamps[stamps > 0].tolist()
    (account,) = [row for row in ledger_of(session.facts) if row.kind == "transforms"]
    assert (account.read, account.kept, account.lost) == (COUNT, COUNT - 5, 5)


def test_simulation_that_begins_at_zero_keeps_its_first_transform(tmp_path):
    """The first stamp is 0 and the others follow in steps of 11 ms."""
    stamps = STAMPS - STAMPS[0]
    session = import_session("mcap", write_json_mcap(tmp_path / "m.mcap", frame_messages_at(*stamps)))
    assert session.tracks["cup"].times_ns.tolist() == stamps.tolist()
