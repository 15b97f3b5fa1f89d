"""What `test_mcap_file` does not reach: ROS 2 through the library of its format, static frames above moving ones."""

import sys

import numpy as np
import pytest
from mcap.writer import Writer
from scipy.spatial.transform import Rotation
from support.import_mutants import MUTANTS, refused, survive
from support.true_poses import ROS, has_poses

from sessions.importers import import_session

TRANSFORM = """geometry_msgs/TransformStamped[] transforms
================
MSG: geometry_msgs/TransformStamped
std_msgs/Header header
string child_frame_id
geometry_msgs/Transform transform
================
MSG: geometry_msgs/Transform
geometry_msgs/Vector3 translation
geometry_msgs/Quaternion rotation
================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
================
"""
POSE = """std_msgs/Header header
geometry_msgs/Pose pose
================
MSG: geometry_msgs/Pose
geometry_msgs/Point position
geometry_msgs/Quaternion orientation
================
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
================
"""
SHARED = """MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
COUNT = 20
STAMPS = 1_700_000_000_000_000_003 + 10_000_000 * np.arange(COUNT)


def header(stamp, frame):
    return {"stamp": {"sec": int(stamp // 10**9), "nanosec": int(stamp % 10**9)}, "frame_id": frame}


def xyz(values):
    return dict(zip("xyz", map(float, values), strict=True))


def xyzw(rotation):
    return dict(zip("xyzw", map(float, rotation.as_quat()), strict=True))


def transform(parent, child, stamp, place, rotation):
    moved = {"translation": xyz(place), "rotation": xyzw(rotation)}
    return {"transforms": [{"header": header(stamp, parent), "child_frame_id": child, "transform": moved}]}


@pytest.fixture
def bag(tmp_path):
    """A map, a table in it (static), a robot on the table (moving), its tool (static, published last), a marker."""
    writer_class = pytest.importorskip("mcap_ros2.writer").Writer
    rng = np.random.default_rng(2)
    places, turns = rng.normal(size=(3, COUNT, 3)), [Rotation.random(COUNT, random_state=seed) for seed in range(3)]
    path = tmp_path / "bag.mcap"
    with path.open("wb") as stream:
        writer = writer_class(stream)
        tf = writer.register_msgdef("tf2_msgs/msg/TFMessage", TRANSFORM + SHARED)
        pose = writer.register_msgdef("geometry_msgs/msg/PoseStamped", POSE + SHARED)
        for k, stamp in enumerate(STAMPS.tolist()):
            writer.write_message("/tf", tf, transform("table", "robot", stamp, places[1][k], turns[1][k]), stamp)
            seen = {"position": xyz(places[2][k]), "orientation": xyzw(turns[2][k])}
            writer.write_message("/marker", pose, {"header": header(stamp, "/map"), "pose": seen}, stamp)
        for parent, child, row in (("map", "table", 0), ("robot", "tool", 1)):
            latched = transform(parent, child, int(STAMPS[-1]), places[0][row], turns[0][row])
            writer.write_message("/tf_static", tf, latched, int(STAMPS[-1]))
        writer.finish()
    return path, places, turns


def test_static_frames_and_moving_ones_are_composed_as_tf2_does(bag):
    path, places, turns = bag
    session = import_session("ros2", path)
    assert set(session.names) == {"robot", "marker", "table", "tool"}
    table_place, table_turn = places[0][0], turns[0][0]
    robot_place = table_place + table_turn.apply(places[1])
    robot_turn = table_turn * turns[1]
    expected = {
        "table": (np.tile(table_place, (COUNT, 1)), Rotation.from_quat(np.tile(table_turn.as_quat(), (COUNT, 1)))),
        "robot": (robot_place, robot_turn),
        "tool": (robot_place + robot_turn.apply(places[0][1]), robot_turn * turns[0][1]),
        "marker": (places[2], turns[2]),
    }
    for name, (place, turn) in expected.items():
        assert has_poses(session.tracks[name], place, turn, ROS, STAMPS)
    assert "poses in the root frame 'map'" in session.facts["conversions"]


def test_ros_without_its_library_is_one_sentence(bag, monkeypatch):
    monkeypatch.setitem(sys.modules, "mcap_ros2.decoder", None)
    refused("ros2", bag[0], r'need mcap-ros2-support; install it: pip install "vrlab-replay\[formats\]"')


def tf(*moves):
    """A bag of these transforms."""

    def write(path):
        with path.open("wb") as stream:
            writer = pytest.importorskip("mcap_ros2.writer").Writer(stream)
            kind = writer.register_msgdef("tf2_msgs/msg/TFMessage", TRANSFORM + SHARED)
            for message in moves:
                writer.write_message("/tf", kind, message, 10)
            writer.finish()

    return write


def at(parent, child, stamp=1):
    return transform(parent, child, stamp, (0, 0, 0), Rotation.identity())


def raw(data=b"\0\1\0\0", kind="ros2msg", text=TRANSFORM + SHARED):
    """A bag with one message of these bytes and this description."""

    def write(path):
        with path.open("wb") as stream:
            writer = Writer(stream)
            writer.start(profile="ros2")
            schema = writer.register_schema("tf2_msgs/msg/TFMessage", kind, text.encode())
            channel = writer.register_channel("/tf", "cdr", schema)
            writer.add_message(channel, 10, data, 10)
            writer.finish()

    return write


@pytest.mark.parametrize("text", ("float64[ x\n", "no_such/Type x\n", TRANSFORM[:60]))
def test_a_schema_that_cannot_be_read_is_one_sentence_and_nothing_is_printed(tmp_path, capfd, text):
    pytest.importorskip("mcap_ros2")
    raw(text=text)(tmp_path / "bag.mcap")
    refused("ros2", tmp_path / "bag.mcap", "cannot be read")
    assert capfd.readouterr() == ("", "")


def test_a_tree_that_stands_still_and_hangs_from_nothing_else_is_left_out(tmp_path):
    path = tmp_path / "bag.mcap"
    tf(at("map", "a"), at("room", "lamp"), at("lamp", "bulb"), at("map", "a", 2))(path)
    session = import_session("ros2", path)
    assert session.names == ("a",)
    said = "frames left out that stand still and that no transform joins to it: 'lamp', 'bulb'"
    assert f"poses in the root frame 'map'; {said}" in session.facts["conversions"]


UNREAD = "/tf: a tf2_msgs/msg/TFMessage cannot be read"
BROKEN = {
    "two that move": (
        tf(at("map", "a"), at("odom", "b"), at("map", "a", 2), at("odom", "b", 2)), "frames hang from 2 roots",
    ),
    "half a message": (raw(b"\0\1\0\0\5\0"), UNREAD),
    "another language": (raw(kind="ros2idl"), "a schema in 'ros2idl' is not known; record with schemas in ros2msg"),
}  # fmt: skip


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_bag_is_refused_in_one_sentence(tmp_path, name):
    write, words = BROKEN[name]
    path = tmp_path / "bag.mcap"
    write(path)
    refused("ros2", path, words)


@pytest.mark.parametrize("count", MUTANTS)
def test_mutants_end_in_a_session_or_one_sentence(bag, count):
    survive("ros2", bag[0], count)
