"""Files are written by the formats' own libraries; poses are composed and interpolated again with SciPy alone.

Those in `composed` hold the same transforms in three forms: a robot moves on a table in a map, its left hand on the
robot, a cup in the hand; the table and the robot's tool are static. `poses.txt` has six sets of 25 poses, position and
quaternion, of which the transforms are made.
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
    """Pose number ``row`` of the set ``body`` of `poses.txt`, under these keys."""
    values = POSITIONS[body][row].tolist(), ROTATIONS[body][row].as_quat().tolist()
    return {position: dict(zip("xyz", values[0], strict=True)), rotation: dict(zip("xyzw", values[1], strict=True))}


def transform(parent, child, stamp=1, body=0, row=0):
    """The message that ``child`` has, in the frame ``parent``, the pose ``row`` of the set ``body``; stamp in ns."""
    timestamp = dict(zip(("sec", "nsec"), divmod(int(stamp), 10**9), strict=True))
    return {"timestamp": timestamp, "parent_frame_id": parent, "child_frame_id": child, **pose_of_body(body, row)}


def write_json_mcap(path, messages, encoding="json", profile=""):
    """Writes an MCAP file of ``messages`` (topic, schema, log time in ns, content) and returns its path."""
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
    """Positions and rotations in the root frame, of a chain of (set of poses, row or all rows) from the root down."""
    position, rotation = np.zeros(3), Rotation.identity()
    for body, row in chain:
        position, rotation = position + rotation.apply(POSITIONS[body][row]), rotation * ROTATIONS[body][row]
    return np.tile(position, (COUNT, 1)) if position.ndim == 1 else position, rotation


ALL = slice(None)


@pytest.mark.parametrize("format", ["mcap", "auto", "ros2"])
def test_transforms_are_composed_to_the_root_frame(format):
    """Each frame's pose is the product of the transforms on its chain from the map, here composed with SciPy.

    A chain is of (set of poses, row): ALL rows where the frame moves, a single row where it is static. Frames of a
    robot get no meshes in place of their own, and none is interpolated, as all have the same stamps.
    """
    session = import_session(format, COMPOSED / f"{format}.mcap")
    table, tool_on_robot = (0, 0), (0, 1)
    robot_on_table, left_on_robot, cup_in_left = (1, ALL), (2, ALL), (3, ALL)
    expected_chains = {
        "table": (table,),
        "robot": (table, robot_on_table),
        "left": (table, robot_on_table, left_on_robot),
        "cup": (table, robot_on_table, left_on_robot, cup_in_left),
        "tool": (table, robot_on_table, tool_on_robot),
        # Messages of one pose, and of several, in the frame of the map.
        "map pose": ((4, ALL),),
        "several/0": ((4, ALL),),
        "several/1": ((5, ALL),),
    }
    assert set(session.names) == {*expected_chains}
    assert not session.meshes
    for name, chain in expected_chains.items():
        positions, rotations = chained_poses(*chain)
        rotations = Rotation.concatenate([rotations] * COUNT) if rotations.single else rotations
        assert has_poses(session.tracks[name], positions, rotations, axes=ROS, stamps=STAMPS), name
    assert "interpolated" not in session.facts["conversions"]
    assert "poses in the root frame 'map'" in session.facts["conversions"]


@pytest.mark.parametrize("format", ["mcap", "auto", "ros2"])
def test_axes_of_ros_are_assumed_for_transforms(format):
    """Nothing in the file says its axes or its unit: ROS's, x forward and z up, and metres are assumed."""
    facts = import_session(format, COMPOSED / f"{format}.mcap").facts
    assert (facts["source_convention"], facts["handedness"], facts["source_units"]) == ("ros", "right", "m")
    assert facts["assumed"].startswith("axes ros")


def test_unstamped_poses_use_log_time_and_covariance_is_ignored(tmp_path):
    """Two messages without a stamp, logged at 5 and 8 ns, have the same pose (row 0 of set 0) and a covariance."""
    pose = {"pose": pose_of_body(body=0, row=0, position="position", rotation="orientation"), "covariance": []}
    messages = [("/a", "geometry_msgs/PoseWithCovarianceStamped", log_ns, {"pose": pose}) for log_ns in (5, 8)]
    session = import_session("mcap", write_json_mcap(tmp_path / "a.mcap", messages))
    twice = [0, 0]
    assert has_poses(session.tracks["a"], POSITIONS[0][twice], ROTATIONS[0][twice], axes=ROS, stamps=[5, 8])
    assert "2 poses without a stamp have the time they were logged at" in session.facts["conversions"]


LAST_BEFORE_GAP, FIRST_AFTER_GAP = 2, 22
"""Between these two of its 25 messages, 11 ms apart, the hand is silent: 20 steps, 0.22 s."""


@pytest.fixture
def cup_in_silent_hand(tmp_path):
    """A cup in a hand (poses of sets 1 and 0); each of its 25 messages is half a step, 6 ms, after the hand's."""
    hand_rows = [*range(LAST_BEFORE_GAP + 1), *range(FIRST_AFTER_GAP, COUNT)]
    hand = [(row, STAMPS[row]) for row in hand_rows]
    cup = [(row, STAMPS[row] + STEP_NS // 2) for row in range(COUNT)]
    messages = [("/tf", FRAME, ns, transform("world", "hand", stamp=ns, body=0, row=row)) for row, ns in hand]
    messages += [("/tf", FRAME, ns, transform("hand", "cup", stamp=ns, body=1, row=row)) for row, ns in cup]
    return import_session("mcap", write_json_mcap(tmp_path / "a.mcap", messages))


def test_parent_frames_are_interpolated(cup_in_silent_hand):
    """At the time of the cup's message 1 the hand (set 0) is half-way from its pose 1 to its pose 2, by SciPy's slerp.

    The cup's pose (set 1) is composed with that; the hand is silent only later. The import notes that frames were
    interpolated, and that gaps of more than 0.2 s were not, as in the next test.
    """
    row = 1
    track = cup_in_silent_hand.tracks["cup"]
    (sample,) = np.flatnonzero(track.times_ns == STAMPS[row] + STEP_NS // 2)
    fraction = (STEP_NS // 2) / STEP_NS
    hand_rotation = Slerp([0, 1], ROTATIONS[0][[row, row + 1]])([fraction])[0]
    hand_position = (1 - fraction) * POSITIONS[0][row] + fraction * POSITIONS[0][row + 1]
    cup_position = hand_position + hand_rotation.apply(POSITIONS[1][row])
    cup_rotation = hand_rotation * ROTATIONS[1][row]
    assert np.allclose(track.positions[sample], ROS @ cup_position, atol=1e-9)
    actual = Rotation.from_quat(track.quaternions_xyzw[sample]).as_matrix()
    assert np.allclose(actual, ROS @ cup_rotation.as_matrix() @ ROS.T, atol=1e-9)
    assert "frames of other stamps interpolated, not across 0.2 s" in cup_in_silent_hand.facts["conversions"]


def test_poses_in_a_gap_of_the_parent_are_lost(cup_in_silent_hand):
    """The cup has 20 messages while the hand is silent for 0.22 s, longer than the 0.2 s that are interpolated."""
    track = cup_in_silent_hand.tracks["cup"]
    in_gap = (track.times_ns > STAMPS[LAST_BEFORE_GAP]) & (track.times_ns < STAMPS[FIRST_AFTER_GAP])
    assert in_gap.sum() == FIRST_AFTER_GAP - LAST_BEFORE_GAP
    assert track.valid.tolist() == (~in_gap).tolist()


@pytest.mark.parametrize(
    ("transforms_sent", "names", "loss"),
    [
        pytest.param(
            [("world", "hand", 1), ("world", "hand", 2), ("hand", "cup", 3), ("hand", "cup", 4)],
            ["hand"],
            "1 of 2 names dropped: that never have stamps together with those above: 'cup'",
            id="the cup moves when the hand is gone",
        ),
        pytest.param(
            [("map", "robot", 1), ("room", "lamp", 1), ("lamp", "bulb", 1), ("map", "robot", 2)],
            ["robot"],
            "2 of 3 names dropped: that stand still and that no transform joins to it: 'lamp', 'bulb'",
            id="the lamp stands in another root",
        ),
    ],
)
def test_unconnected_frames_are_left_out_and_listed(tmp_path, transforms_sent, names, loss):
    """Each transform is (parent, child, stamp in ns). A frame whose pose in the root nobody can compute is no body."""
    messages = [
        ("/tf", FRAME, stamp, transform(parent, child, stamp=stamp)) for parent, child, stamp in transforms_sent
    ]
    session = import_session("mcap", write_json_mcap(tmp_path / "a.mcap", messages))
    assert [*session.names] == names
    assert loss in ledger_text(session)


def test_requested_roots_form_a_single_world(tmp_path):
    """The topic /a moves "a" in the frame "map", /b moves "b" in "room", and the user requests both topics."""
    messages = [
        (topic, FRAME, k, transform(parent, child, stamp=k, body=k, row=k))
        for k in (1, 2)
        for topic, parent, child in (("/a", "map", "a"), ("/b", "room", "b"))
    ]
    session = import_session("mcap", write_json_mcap(tmp_path / "a.mcap", messages), topics=["/a", "/b"])
    assert {*session.names} == {"a", "b"}
    assert "frames 'map', 'room' taken for one world" in session.facts["assumed"]


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
    """180 stamps at 60 Hz have a second field that counts micro- or milliseconds, not the nanoseconds of its name.

    In nanoseconds all would be within a millisecond of a whole second.
    """
    stamps = np.arange(180) * 16_666_667 + 5_000_000_000
    coarse = [stamp // 10**9 * 10**9 + stamp % 10**9 // fraction for stamp in stamps.tolist()]
    rows = [
        ("/tf", FRAME, stamp, transform("world", "cup", stamp=stamp, row=k % COUNT)) for k, stamp in enumerate(coarse)
    ]
    assert_import_refused(
        "mcap", write_json_mcap(tmp_path / "a.mcap", rows), "nanoseconds of its 180 stamps are all below 1,000,000"
    )


def test_a_clock_that_pulses_on_the_second_is_read(tmp_path):
    """A message a second, each within 6 us of the whole second: small nanoseconds alone are no error."""
    stamps = [k * 10**9 + 1_000 * (k % 7) for k in range(1, 21)]
    rows = [("/tf", FRAME, stamp, transform("world", "cup", stamp=stamp, row=k)) for k, stamp in enumerate(stamps)]
    assert import_session("mcap", write_json_mcap(tmp_path / "a.mcap", rows)).tracks["cup"].times_ns.tolist() == stamps


def arrays_of_poses(lengths):
    """Messages of the topic /seen, a second apart: arrays of so many poses, the last of two bodies."""
    messages = []
    for row, length in enumerate(lengths):
        bodies = (0, 1)[2 - length :]
        poses = [pose_of_body(body, row, position="position", rotation="orientation") for body in bodies]
        content = {"timestamp": {"sec": 1 + row, "nsec": 0}, "frame_id": "map", "poses": poses}
        messages.append(("/seen", "foxglove.PosesInFrame", row, content))
    return messages


def test_arrays_that_get_shorter_name_no_body(tmp_path):
    """A pose of an array is a body by its index; an array that loses one of two no longer says whose the other is.

    Another topic of the same file is read, once the user requests it alone.
    """
    messages = [*arrays_of_poses(lengths=[2, 2, 1, 2]), ("/tf", FRAME, 1, transform("map", "cup"))]
    path = write_json_mcap(tmp_path / "short.mcap", messages)
    assert_import_refused("mcap", path, "/seen: its arrays get shorter, from 2 poses to 1, so that nobody knows")
    assert import_session("mcap", path, topics=["/tf"]).names == ("cup",)


def test_poses_of_arrays_are_bodies_by_their_index(tmp_path):
    """Two bodies are seen, then none, then two again: nobody asks whose a pose is, but it is said to be assumed."""
    path = write_json_mcap(tmp_path / "none.mcap", arrays_of_poses(lengths=[2, 2, 0, 2]))
    session = import_session("mcap", path)
    assert session.names == ("seen/0", "seen/1")
    assert "a pose of /seen taken to be of the body of its index in the array" in session.facts["assumed"]


@pytest.mark.parametrize(("frame", "is_assumed"), [("", True), ("map", False)])
def test_poses_that_name_no_frame_are_an_assumption(tmp_path, frame, is_assumed):
    """A pen's pose names its frame or none; without one it is taken to be in the root of the transforms, "map"."""
    pose = {
        "timestamp": {"sec": 0, "nsec": 1},
        "frame_id": frame,
        "pose": pose_of_body(body=1, row=1, position="position", rotation="orientation"),
    }
    messages = [("/tf", FRAME, k, transform("map", "cup", stamp=k, row=k)) for k in (1, 2)]
    messages += [("/pen", "foxglove.PoseInFrame", 1, pose)]
    assumed = import_session("mcap", write_json_mcap(tmp_path / "a.mcap", messages)).facts["assumed"]
    assert ("poses of 'pen', which name no frame, taken to be in 'map'" in assumed) == is_assumed
    assert ("name no frame" in assumed) == is_assumed


def cup_on_a_table(path, last_row_of_table):
    """The track of a cup, of 25 messages, on a table that is sent at the first and the last of their stamps only.

    The table first has row 0 of its poses, and last the row ``last_row_of_table``.
    """
    stamps = STAMPS.tolist()
    cup = [("/tf", FRAME, ns, transform("table", "cup", stamp=ns, body=0, row=row)) for row, ns in enumerate(stamps)]
    table = [
        ("/slow", FRAME, ns, transform("map", "table", stamp=ns, body=1, row=row))
        for ns, row in ((stamps[0], 0), (stamps[-1], last_row_of_table))
    ]
    return import_session("mcap", write_json_mcap(path, [*cup, *table])).tracks["cup"]


def test_child_of_a_rarely_sent_frame_stays_valid_at_rest(tmp_path):
    """A table is sent twice in 0.27 s, at the same place: it rested between, and the cup on it has all its poses."""
    cup = cup_on_a_table(tmp_path / "rests.mcap", last_row_of_table=0)
    assert cup.valid.all()
    table_at_rest, cup_on_table = (1, 0), (0, ALL)
    expected_positions, _rotations = chained_poses(table_at_rest, cup_on_table)
    assert np.abs(cup.positions - expected_positions @ ROS.T).max() <= 1e-9


def test_child_of_rarely_sent_frame_is_lost_where_it_moved(tmp_path):
    """The table is at another place at the end: where it, and the cup on it, was between, nobody knows."""
    cup = cup_on_a_table(tmp_path / "moves.mcap", last_row_of_table=1)
    assert np.flatnonzero(cup.valid).tolist() == [0, COUNT - 1]


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
    """The cup is in 20 messages of one topic, and in one or 20 of another, at the same times or later.

    Once the user names one of the topics, here the second, the file is read.
    """
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
    """A cup has 20 messages; ``stamp`` is that of message k, from 0, in nanoseconds.

    Swapped stamps are 1, 3, 2, 4, 6, 5 ...: of each whole three one is out of order, six in 20.
    """
    session = import_session("mcap", write_json_mcap(tmp_path / "a.mcap", transforms("/tf", stamp=stamp)))
    assert len(session.tracks["cup"]) == kept
    assert ledger_text(session) == text


def test_unordered_messages_lose_no_pose(tmp_path):
    """The second half of 20 messages stands first in the file; log times say the true order."""
    messages = transforms("/tf", count=20)
    session = import_session("mcap", write_json_mcap(tmp_path / "a.mcap", [*messages[10:], *messages[:10]]))
    assert len(session.tracks["cup"]) == 20
    assert ledger_text(session) == ""


def damaged_file(path, *, chunked, cut=0, broken=0, crc=True):
    """The path of a file of 60 messages, logged at 0 to 59 ns and stamped 1 ns later.

    ``chunked``: whether they stand in chunks of 2,000 bytes; ``cut``: so many bytes are missing at the end; ``broken``:
    the byte at this place is changed; ``crc``: whether chunks have checksums.
    """
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


@pytest.fixture(
    params=[
        pytest.param({"chunked": False, "cut": 9000}, id="no chunks, cut"),
        pytest.param({"chunked": True, "cut": 9000}, id="chunks, cut"),
        pytest.param({"chunked": True, "broken": 9000}, id="a bad chunk"),
        pytest.param({"chunked": True, "cut": 9}, id="no index"),
        pytest.param({"chunked": False, "cut": 9000, "crc": False}, id="no checksums"),
    ]
)
def torn_file(request, tmp_path):
    """The path of a file of 60 transforms of another program, cut short or damaged."""
    return damaged_file(tmp_path / "a.mcap", **request.param)


def test_torn_foreign_file_is_recovered_by_the_import(torn_file):
    """Imported are the messages that the format's own library reads before the damage; the others are a large loss."""
    log_times = {message.log_time for message in whole_messages(torn_file)}
    session = import_session("mcap", torn_file)
    stamps = {log_time + 1 for log_time in log_times}
    assert {*session.tracks["cup"].times_ns.tolist()} == stamps
    assert ledger_of(session.facts).large_losses()


def test_readers_of_sessions_send_torn_foreign_file_to_import(torn_file, tmp_path):
    """`replay recover` and reading as a session refuse it and name the command that imports it, not that for recovery.

    The doctor, which examines any file, does not offer recovery either, but for a damaged chunk.
    """
    for read in (partial(recover, torn_file, tmp_path / "r.mcap"), partial(read_session, torn_file)):
        with pytest.raises(SessionFileError) as refusal:
            read()
        assert f"replay import mcap {torn_file} -o" in str(refusal.value)
        assert "recover" not in str(refusal.value)
    findings = examine(torn_file)
    assert findings
    assert not [finding for finding in findings if "recover" in finding.fix and finding.code != "damaged-chunk"]


def whole_messages(path):
    """The messages of a file by the library's reader that needs no index, up to the first byte that it cannot read."""
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
    """A function that writes a file of ``moves``: (parent, child) of transforms, or contents of messages."""
    rows = [transform(*move) if isinstance(move, tuple) else move for move in moves]
    return lambda path: write_json_mcap(path, [("/t", schema, 10, content) for content in rows], **how)


def write_half_a_file(path):
    """The path of a file that ends after 2000 bytes."""
    path.write_bytes((COMPOSED / "mcap.mcap").read_bytes()[:2000])
    return path


def bag_of_a_message(data=b"\0\1\0\0", kind="ros2msg", text="float64 x\n"):
    """A function that writes a bag of ROS 2 with one message of these bytes and this description."""

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
    """A row of BROKEN: a function that writes the file, and words of the refusal. Nothing is printed."""
    write, sentence = BROKEN[name]
    assert_import_refused("mcap", write(tmp_path / "a.mcap"), sentence)
    assert capfd.readouterr() == ("", "")


def test_ros_without_its_library_is_refused_in_a_sentence(tmp_path, monkeypatch):
    """``None`` in sys.modules makes the import of mcap_ros2 fail: the error says what to install for bags of ROS 2."""
    monkeypatch.setitem(sys.modules, "mcap_ros2.decoder", None)
    assert_import_refused(
        "ros2",
        bag_of_a_message()(tmp_path / "a.mcap"),
        r'need mcap-ros2-support; install it: pip install "vrlab-replay\[forma',
    )


def frame_messages_at(*stamps, logged=None, child="cup"):
    """Messages of one frame at these stamps in ns, logged at those times or at others."""
    logged = stamps if logged is None else logged
    return [
        ("/tf", FRAME, log, transform("map", child, stamp=stamp, row=row % COUNT))
        for row, (stamp, log) in enumerate(zip(stamps, logged, strict=True))
    ]


def test_topics_that_are_not_read_are_named(tmp_path):
    """Beside the poses of /tf are a scene and an IMU, of schemas without poses: the facts of the session name both."""
    others = [("/scene", "foxglove.SceneUpdate", 1, {"entities": []}), ("/imu", "sensor_msgs/msg/Imu", 2, {})]
    session = import_session("mcap", write_json_mcap(tmp_path / "m.mcap", [*frame_messages_at(*STAMPS), *others]))
    unread = "topics that are not read: /scene (foxglove.SceneUpdate), /imu (sensor_msgs/msg/Imu)"
    assert unread in session.facts["conversions"].split("; ")


def test_many_topics_that_are_not_read_end_in_a_number(tmp_path):
    """Two cameras more than are named have topics without poses; where the user chooses /tf, none is named."""
    cameras = [(f"/camera_{number}", "Image", number, {}) for number in range(NAMED_TOPICS + 2)]
    path = write_json_mcap(tmp_path / "m.mcap", [*frame_messages_at(*STAMPS), *cameras])
    last_named = f"/camera_{NAMED_TOPICS - 1} (Image)"
    assert f"{last_named} and 2 more" in import_session("mcap", path).facts["conversions"]
    assert "not read" not in import_session("mcap", path, topics=["/tf"]).facts["conversions"]


@pytest.fixture
def cup_before_a_camera(tmp_path):
    """The path of a file with one transform: a cup at (1, 2, 3) in a camera's "depth_optical_frame"."""
    moved = transform("depth_optical_frame", "cup", stamp=1)
    moved["translation"] = {"x": 1.0, "y": 2.0, "z": 3.0}
    return write_json_mcap(tmp_path / "m.mcap", [("/tf", FRAME, 1, moved)])


def test_poses_in_an_optical_frame_have_y_down(cup_before_a_camera):
    """ROS's REP 103 gives frames of this name x right, y down, z forward; sessions have x right, y up, z back.

    That the frame is one of them is a guess, and an open question.
    """
    session = import_session("mcap", cup_before_a_camera)
    assert session.tracks["cup"].positions[0] == pytest.approx([1.0, -2.0, -3.0])
    axes = next(row for row in assumptions_of(session.facts) if row.subject is Subject.POSE_AXES)
    assert axes.confidence is Confidence.OPEN


def test_axes_that_the_user_names_win_over_an_optical_frame(cup_before_a_camera):
    """The user says that (1, 2, 3) is in ROS's usual axes, x forward, y left, z up, and not in those of a camera.

    Sessions have x right, y up, z back: 2 to the left is x = -2, 3 up is y = 3, 1 forward is z = -1.
    """
    session = import_session("mcap", cup_before_a_camera, convention="ros")
    assert session.tracks["cup"].positions[0] == pytest.approx([-2.0, 3.0, -1.0])


def odometry(topic="/base/odom", body=0, parent="map", child="base", stamps=STAMPS):
    """Messages of ROS's Odometry: a header with a stamp, and a pose with covariance."""
    return [
        (topic, "nav_msgs/msg/Odometry", stamp, {
            "header": {"stamp": {"sec": int(stamp) // 10**9, "nanosec": int(stamp) % 10**9}, "frame_id": parent},
            "child_frame_id": child,
            "pose": {
                "pose": pose_of_body(body=body, row=row, position="position", rotation="orientation"),
                "covariance": [0.0] * 36,
            },
        })
        for row, stamp in enumerate(stamps)
    ]  # fmt: skip


def moving_frame(parent, child, body):
    """Transforms of a frame at all 25 stamps, with the poses of the set ``body``."""
    return [
        ("/tf", FRAME, s, transform(parent, child, stamp=s, body=body, row=k)) for k, s in enumerate(STAMPS.tolist())
    ]


REPEATED = "/base/odom: 25 of 25 transforms merged: that repeat those of 'base' on /tf"
CONTRADICTED = "/base/odom: 25 of 25 transforms dropped: of 'base', which /tf places too, elsewhere or at other times"
ODOMETRY = {
    "alone": (odometry(), "base", 0, ""),
    "of no frame": (odometry(child=""), "base/odom", 0, ""),
    "of its own parent": (odometry(child="/map"), "base/odom", 0, ""),
    "as /tf": (odometry() + moving_frame("map", "base", body=0), "base", 0, REPEATED),
    "elsewhere": (odometry() + moving_frame("map", "base", body=1), "base", 1, CONTRADICTED),
    "as /tf, a little later": (odometry(stamps=STAMPS + 7) + moving_frame("map", "base", body=0), "base", 0, REPEATED),
    "below a frame of /tf": (odometry(parent="hand") + moving_frame("map", "hand", body=0), "base", (0, 0), ""),
}
"""Messages, the name of the body, the pose that it has (of several: a chain from the root), and the ledger's words."""


@pytest.mark.parametrize("name", ODOMETRY)
def test_odometry_and_its_transform_are_a_single_body(tmp_path, name):
    """A row of ODOMETRY, ROS's messages of a robot's pose: the body is the frame that they place (child_frame_id).

    Where transforms of /tf place it too, those count, and the messages are booked as merged, or dropped if they differ.
    """
    messages, body, pose, text = ODOMETRY[name]
    session = import_session("mcap", write_json_mcap(tmp_path / "m.mcap", messages))
    chain = [(at, ALL) for at in (pose if isinstance(pose, tuple) else (pose,))]
    assert {*session.names} - {"hand"} == {body}
    assert has_poses(session.tracks[body], *chained_poses(*chain), ROS, STAMPS)
    assert ledger_text(session).startswith(text) and bool(ledger_text(session)) == bool(text)


def test_two_odometries_of_a_frame_need_a_chosen_topic(tmp_path):
    """Two topics have odometry of the frame "base", estimates of one pose: the user has to choose one by --topic.

    Where /tf has a transform of "base", that counts, and nothing is asked.
    """
    both = odometry("/wheels") + odometry("/filtered", body=1)
    path = write_json_mcap(tmp_path / "m.mcap", both)
    assert_import_refused("mcap", path, "'base' comes on the topics '/wheels' and '/filtered'; choose one by --topic")
    assert import_session("mcap", path, topics=["/wheels"]).names == ("base",)
    placed = write_json_mcap(tmp_path / "t.mcap", both + moving_frame("map", "base", body=0))
    assert import_session("mcap", placed).names == ("base",)


def test_late_logging_costs_no_transform_whose_stamps_increase(tmp_path):
    """A frame is stamped every 11 ms; log times are up to 30 ms off, and so out of order, which its stamps are not."""
    logged = STAMPS + (30_000_000 * np.sin(np.arange(COUNT))).astype(np.int64)
    session = import_session("mcap", write_json_mcap(tmp_path / "m.mcap", frame_messages_at(*STAMPS, logged=logged)))
    assert session.tracks["cup"].times_ns.tolist() == STAMPS.tolist()


@pytest.mark.parametrize(
    ("stamps", "log_times", "samples_read"),
    [
        pytest.param([10, 20, 30], [20, 10, 30], 3, id="stamps increase in the file"),
        pytest.param([20, 10, 30], [20, 10, 30], 3, id="stamps increase in the log"),
        pytest.param([30, 20, 10], [30, 20, 10], 3, id="the file is the log backwards"),
        pytest.param([20, 10, 30], [10, 20, 30], 2, id="a stamp goes back in both"),
    ],
)
def test_transforms_follow_their_log_unless_stamps_increase(stamps, log_times, samples_read):
    """Three transforms of a cup stand in a file in this order; in ns. The order of the file counts, or else the log's.

    Only a stamp that goes back in both orders is dropped.
    """
    tree = FrameTree(Ledger("log"))
    pose = [0, 0, 0, 0, 0, 0, 1]
    for stamp, log_time in zip(stamps, log_times, strict=True):
        tree.add("map", "cup", stamp, log_time, pose, topic="/tf")
    tables, *_rest = tree.tables()
    stamps_read = tables["cup"].times_ns.tolist()
    assert len(stamps_read) == samples_read
    assert stamps_read == sorted(stamps_read)


def test_stamps_of_zero_among_others_are_dropped(tmp_path):
    """Every fifth of 25 stamps is 0, which stands for none: five are lost."""
    stamps = STAMPS.copy()
    stamps[::5] = 0
    session = import_session("mcap", write_json_mcap(tmp_path / "m.mcap", frame_messages_at(*stamps, logged=STAMPS)))
    assert session.tracks["cup"].times_ns.tolist() == stamps[stamps > 0].tolist()
    (account,) = [row for row in ledger_of(session.facts) if row.kind == "transforms"]
    assert (account.read, account.kept, account.lost) == (COUNT, COUNT - 5, 5)


def test_simulation_that_begins_at_zero_keeps_its_first_transform(tmp_path):
    """The first stamp is 0 and the others follow in steps of 11 ms: here 0 is a time, and no stamp that is missing."""
    stamps = STAMPS - STAMPS[0]
    session = import_session("mcap", write_json_mcap(tmp_path / "m.mcap", frame_messages_at(*stamps)))
    assert session.tracks["cup"].times_ns.tolist() == stamps.tolist()
