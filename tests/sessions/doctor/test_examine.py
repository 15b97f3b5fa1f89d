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
    """Codes of what the doctor finds in a file."""
    return [item.code for item in examine(path)]


def test_unreadable_files_give_findings_instead_of_errors(tmp_path):
    """An empty file, another text, the first eight bytes of a session, and meshes and a scene that cannot be read."""
    (tmp_path / "empty.mcap").write_bytes(b"")
    (tmp_path / "text.mcap").write_bytes(b"not an MCAP")
    (tmp_path / "magic.mcap").write_bytes(b"\x89MCAP0\r\n")
    (tmp_path / "broken.glb").write_bytes(b"glTF????")
    (tmp_path / "scene.toml").write_text("[[body]]\nid = 3\n")
    (tmp_path / "points.obj").write_text("v 0 0 0\n")
    (tmp_path / "nothing.stl").write_bytes(b"")
    assert finding_codes(tmp_path / "empty.mcap") == finding_codes(tmp_path / "text.mcap") == ["not-mcap"]
    assert finding_codes(tmp_path / "magic.mcap") == ["torn", "no-poses"]
    assert finding_codes(tmp_path / "broken.glb") == ["mesh-unreadable"]
    assert finding_codes(tmp_path / "scene.toml") == ["bad-scene"]
    assert finding_codes(tmp_path / "points.obj") == finding_codes(tmp_path / "nothing.stl") == ["mesh-empty"]


def test_torn_file_finding_counts_unreadable_bytes(tmp_path):
    """The first eight bytes of a session file, then 100 bytes that are no record."""
    (tmp_path / "torn.mcap").write_bytes(b"\x89MCAP0\r\n" + b"\xff" * 100)
    torn = next(finding for finding in examine(tmp_path / "torn.mcap") if finding.code == "torn")
    assert torn.count == 100


def test_a_mesh_and_a_scene_are_examined_by_themselves(tmp_path):
    """A cube and a scene with it: nothing is wrong."""
    (tmp_path / "cube.glb").write_bytes(mesh_to_glb(cube(edge=0.1), "cube"))
    (tmp_path / "scene.toml").write_text('[[body]]\nid = "cube"\nmesh = "cube.glb"\n')
    assert finding_codes(tmp_path / "cube.glb") == [] == finding_codes(tmp_path / "scene.toml")


def test_every_finding_of_a_session_full_of_faults(tmp_path, snapshot):
    """Each fault is planted in one of two bodies, 50 frames after the one before."""
    draft = clean_draft()
    for number, (name, plant) in enumerate(FAULTS.items()):
        if name != "millimetres":  # of such a body no jump is told
            plant(draft, number % 2, 40 + 50 * number)
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
    """A position in frame 300 is no number."""
    draft = clean_draft()
    draft.arrays["position"][300, 1] = float("nan")
    assert examine(draft.session()) == examine(draft.write(tmp_path / "a.mcap"))


def scene_codes(scene, names, meshes):
    """Code, body and severity of the findings about a scene."""
    return {(item.code, item.body, item.severity) for item in scene_findings(scene, names, meshes)}


def test_declared_but_unrecorded_and_undeclared_bodies_are_reported():
    """Declared are a, b and c, and d in a pair; recorded are a and e; a and c have a mesh.

    Fixed c is carried by a lost body.
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
    ("topic", "text"),
    [("/tf", "/tf holds tf2_msgs/msg/TFMessage as cdr"), ("/vive", "it has no poses")],
)
def test_a_ros_bag_is_not_recovered_but_imported(tmp_path, topic, text):
    """A ROS 2 bag in MCAP, with poses (/tf) in ROS's own coding or without, and a bag of ROS 1."""
    body = b"\x00\x01\x00\x00" + b"\x01" * 80
    messages = [(10 * k, 10 * k, body) for k in range(20)]
    reported = {"topic": topic, "schema": "tf2_msgs/msg/TFMessage", "encoding": "cdr", "profile": "ros2"}
    (tmp_path / "first.bag").write_bytes(b"#ROSBAG V2.0\n" + bytes(4096))
    (result,) = examine(write_foreign(tmp_path / "second.mcap", messages, **reported))
    assert (result.code, result.message) == ("no-poses", text)
    (older,) = examine(tmp_path / "first.bag")
    for item in (result, older):
        assert "recover" not in item.fix and "replay import" in item.fix


def test_useless_or_misplaced_gaze_and_scalars_are_reported(tmp_path):
    """90 poses of 10 ms from second 1 on; scalar "apart" begins at second 6, "good" within them.

    Of anna's gaze, sample 3 has no direction and 7 is not seen, so that one is reported; none of ben's is seen.
    """
    position, rotation = np.linspace((0, 0, 0), (1, 0, 0), 90), np.tile([0.0, 0.0, 0.0, 1.0], (90, 1))
    stamps = 10**9 + 10_000_000 * np.arange(90)
    nowhere = np.tile([0.0, 0.0, -1.0], (90, 1))
    nowhere[3], nowhere[7], valid = 0, np.nan, np.arange(90) != 7
    gaze = {
        "anna": GazeTrack(stamps, position, nowhere, valid),
        "ben": GazeTrack(stamps, position, nowhere, ~(stamps > 0)),
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
    """The list of bodies in the file is replaced by other names; 50 samples of the hand are in another frame."""
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
