import json
from dataclasses import replace

import numpy as np
import pytest
from support.planted_faults import BODIES, FAULTS, clean_draft, unknown_frame
from support.session_files import write_foreign
from support.small_worlds import cube

from sessions import GazeTrack, ScalarTrack, Scene, Session, Severity, Status, examine, write_session
from sessions.doctor.session_findings import scene_findings
from sessions.geometry.rotations import quaternion_product
from sessions.mcap.metadata import bodies_record
from sessions.meshes.glb import mesh_to_glb
from sessions.model.scene import Pose, SceneBody


def finding_codes(path):
    """Codes of what the doctor, which examines files for damage, reports of a file."""
    return [finding.code for finding in examine(path)]


@pytest.mark.parametrize(
    ("name", "data", "codes"),
    [
        pytest.param("empty.mcap", b"", ["not-mcap"], id="an empty session"),
        pytest.param("text.mcap", b"not an MCAP", ["not-mcap"], id="a text"),
        pytest.param("magic.mcap", b"\x89MCAP0\r\n", ["torn", "no-poses"], id="the first bytes of a session"),
        pytest.param("broken.glb", b"glTF????", ["mesh-unreadable"], id="half a mesh"),
        pytest.param("scene.toml", b"[[body]]\nid = 3\n", ["bad-scene"], id="a scene with a number for a name"),
        pytest.param("points.obj", b"v 0 0 0\n", ["mesh-empty"], id="a mesh without faces"),
        pytest.param("nothing.stl", b"", ["mesh-empty"], id="an empty mesh"),
    ],
)
def test_unreadable_files_give_findings_instead_of_errors(tmp_path, name, data, codes):
    """A session, a mesh or a scene that cannot be read is reported by a code of what is wrong."""
    (tmp_path / name).write_bytes(data)
    assert finding_codes(tmp_path / name) == codes


def test_torn_file_finding_counts_unreadable_bytes(tmp_path):
    """A file has the first eight bytes of a session file, and then 100 bytes that are no record."""
    (tmp_path / "torn.mcap").write_bytes(b"\x89MCAP0\r\n" + b"\xff" * 100)
    torn = next(finding for finding in examine(tmp_path / "torn.mcap") if finding.code == "torn")
    assert torn.count == 100


def test_a_mesh_and_a_scene_are_examined_by_themselves(tmp_path):
    """A cube of 10 cm and a scene that has it as a body: nothing is wrong with either."""
    (tmp_path / "cube.glb").write_bytes(mesh_to_glb(cube(edge=0.1), "cube"))
    (tmp_path / "scene.toml").write_text('[[body]]\nid = "cube"\nmesh = "cube.glb"\n')
    assert finding_codes(tmp_path / "cube.glb") == []
    assert finding_codes(tmp_path / "scene.toml") == []


def test_every_finding_of_a_session_full_of_faults(tmp_path, snapshot):
    """900 frames of three bodies have each fault of FAULTS, in the first two bodies in turn, 50 frames apart.

    More are planted in the third body and at the end. All findings equal the snapshot; their texts for readers, which
    have tests of their own, are left out.
    """
    draft = clean_draft()
    for number, (name, plant) in enumerate(FAULTS.items()):
        if name != "millimetres":  # jumps of such a body are not reported
            plant(draft, body=number % 2, frame=40 + 50 * number)
    rotations, status = draft.arrays["quaternion_xyzw"], draft.arrays["status"]
    draft.arrays["position"][1:700:7, 2] = np.inf
    draft.arrays["position"][850:880:4, 0] += 0.2
    rotations[820, 1] = quaternion_product(rotations[820, 1], (0.8, 0.0, 0.0, 0.6))
    rotations[:800, 1] = np.round(rotations[:800, 1], 5)
    status[830:840, 1], status[860:890, 2] = Status.LOST, Status.ABSENT
    path = draft.write(tmp_path / "a.mcap")
    reported = [{**item.as_json(), "meaning": item.code, "fix": ""} for item in examine(path)]
    assert list(map(json.dumps, reported)) == snapshot


def test_memory_and_file_give_the_same_findings(tmp_path):
    """A recording of 900 frames has one fault, a position that is no number, in memory and in its file."""
    draft = clean_draft()
    draft.arrays["position"][300, 1] = float("nan")
    findings = examine(draft.session())
    assert findings
    assert findings == examine(draft.write(tmp_path / "a.mcap"))


def scene_codes(scene, names, meshes):
    """Code, body and severity of the findings about a scene."""
    return {(item.code, item.body, item.severity) for item in scene_findings(scene, names, meshes)}


def test_declared_but_unrecorded_and_undeclared_bodies_are_reported():
    """A scene declares the bodies a, b and c, and d in a pair; recorded are a and e; a and c have a mesh.

    The mesh of a stands in for its own (proxy); c is fixed to a body that is not there, which is an error.
    """
    scene = Scene(
        bodies=(SceneBody("a", proxy=True), SceneBody("b"), SceneBody("c", parent="gone", fixed=Pose())),
        pairs=(("a", "d"),),
    )
    assert scene_codes(scene, ["a", "e"], ["a", "c"]) == {
        ("proxy", "a", Severity.NOTE),
        ("unrecorded-body", "b", Severity.WARNING),
        ("unrecorded-body", "c", Severity.ERROR),
        ("unrecorded-body", "d", Severity.WARNING),
        ("undeclared-body", "e", Severity.NOTE),
        ("no-mesh", "e", Severity.NOTE),
    }


@pytest.mark.parametrize(
    ("topic", "message"),
    [
        pytest.param("/tf", "/tf holds tf2_msgs/msg/TFMessage as cdr", id="poses in ROS's own coding"),
        pytest.param("/vive", "it has no poses", id="no poses"),
    ],
)
def test_a_ros_2_bag_is_not_recovered_but_imported(tmp_path, topic, message):
    """The doctor examines a bag of ROS 2 in MCAP: the cure is the command that imports it, not that for recovery."""
    content = b"\x00\x01\x00\x00" + b"\x01" * 80  # of any message
    messages = [(10 * k, 10 * k, content) for k in range(20)]
    schema = {"topic": topic, "schema": "tf2_msgs/msg/TFMessage", "encoding": "cdr", "profile": "ros2"}
    (finding,) = examine(write_foreign(tmp_path / "second.mcap", messages, **schema))
    assert (finding.code, finding.message) == ("no-poses", message)
    assert "replay import" in finding.fix
    assert "recover" not in finding.fix


def test_a_ros_1_bag_is_not_recovered_but_imported(tmp_path):
    """A bag of ROS 1 is no MCAP file at all; it is known by its first line."""
    (tmp_path / "first.bag").write_bytes(b"#ROSBAG V2.0\n" + bytes(4096))
    (finding,) = examine(tmp_path / "first.bag")
    assert "replay import" in finding.fix
    assert "recover" not in finding.fix


def test_useless_or_misplaced_gaze_and_scalars_are_reported(tmp_path):
    """90 poses are 10 ms apart from second 1 on; the scalar "apart" lasts from second 6 to 8, "good" begins with them.

    Sample 3 of anna's gaze has no direction, which is reported; sample 7 has none and says so itself. All of ben's
    gaze says that it is of no use, and the only number of the scalar "empty" is nan. Session and file give the same.
    """
    position, rotation = np.linspace((0, 0, 0), (1, 0, 0), 90), np.tile([0.0, 0.0, 0.0, 1.0], (90, 1))
    stamps = 10**9 + 10_000_000 * np.arange(90)
    direction = np.tile([0.0, 0.0, -1.0], (90, 1))
    direction[3], direction[7] = 0.0, np.nan
    gaze = {
        "anna": GazeTrack(stamps, position, direction, valid=np.arange(90) != 7),
        "ben": GazeTrack(stamps, position, direction, valid=np.zeros(90, dtype=bool)),
    }
    scalars = {
        "good": ScalarTrack([10**9, 10**10], [1, 2]),
        "apart": ScalarTrack([6 * 10**9, 8 * 10**9], [1, 2]),
        "empty": ScalarTrack([10**9], [np.nan]),
    }
    session = replace(Session.from_arrays(stamps, {"a": (position, rotation)}), gaze=gaze, scalars=scalars)
    write_session(session, tmp_path / "s.mcap")
    codes = ("gaze-nowhere", "stream-apart", "stream-empty")
    for result in (examine(session), examine(tmp_path / "s.mcap")):
        assert [(item.code, item.message, item.count) for item in result if item.code in codes] == [
            ("gaze-nowhere", "gaze 'anna': samples that are seen and hold no direction: 1", 1),
            ("stream-apart", "scalar 'apart': it lasts from 5.0 s to 7.0 s after the first pose, the poses 0.9 s", 1),
            ("stream-empty", "gaze 'ben': no sample of 90 holds anything", 1),
            ("stream-empty", "scalar 'empty': no sample of 1 holds anything", 1),
        ]


def test_unlisted_bodies_and_foreign_frames_are_examined(tmp_path):
    """A file of 900 frames lists two of three bodies under other names; 50 samples of the hand are in frame "attic"."""
    draft = clean_draft()
    unknown_frame(draft, body=1, frame=300)
    path = draft.write(tmp_path / "a.mcap")
    names = bodies_record(BODIES)["names"].encode()
    listed = bodies_record(("flask", *(f"{name[:-1]}_" for name in BODIES[1:])))["names"].encode()
    path.write_bytes(path.read_bytes().replace(names, listed))
    result = [item for item in examine(path) if item.code == "unknown-frame"]
    assert {(item.body, item.count): item.message for item in result} == {
        ("hand-left", 50): "50 samples are given in frame 'attic', the others in 'world'",
        ("hand-left", 850): "850 samples of a body that the file does not list",
        ("tray", 900): "900 samples of a body that the file does not list",
    }
