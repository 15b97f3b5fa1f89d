"""Twenty recordings of the kinds that people have give the poses that were written.

A CSV that nobody has described gets a draft of its mapping first, and is imported with the draft completed.
"""

import json
import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import Writer
from scipy.spatial.transform import Rotation
from support.true_poses import ROS, UNITY, has_poses
from support.xdf_files import TRANSFORM_OUTLET, samples, stream_header, xdf_file

from replay.cli.main import main
from sessions import read_session
from sessions.importers import import_session
from sessions.importers.csv_draft import UnknownColumnsError

COUNT = 12
TIME = np.arange(COUNT) / 90
LOGS = Path(__file__).with_name("logs")
PLACE, TURN = np.split(np.loadtxt(LOGS / "poses.txt").reshape(2, COUNT, 7), [3], axis=2)
KINDS = tomllib.loads((LOGS / "logs.toml").read_text("utf-8"))


@pytest.mark.parametrize("kind", KINDS)
def test_a_draft_that_is_completed_gives_the_poses_that_were_written(tmp_path, capsys, kind):
    case, path = KINDS[kind], Path(shutil.copy(LOGS / f"{kind}.csv", tmp_path / "log.csv"))
    out, draft = tmp_path / "s.mcap", tmp_path / "log.columns.toml"
    assert main(["import", "csv", str(path), "-o", str(out)]) == 1
    said = " ".join(capsys.readouterr().err.split())
    assert case["unknown"] in said and "--mapping" in said and str(draft) in said and not out.exists()
    text = draft.read_text().replace('# convention = "unity"', 'convention = "openvr"').replace("# rate_hz", "rate_hz")
    text = text.replace('# order = "XYZ"', 'order = "ZXY"').replace('# unit = "s"', 'unit = "s"')
    draft.write_text(text)
    assert main(["import", "csv", str(path), "--mapping", str(draft), "-o", str(out)]) == 0, capsys.readouterr().err
    session = read_session(out)
    assert session.names == tuple(case["bodies"])
    for body, name in enumerate(session.names):
        track = session.tracks[name]
        assert has_poses(track, PLACE[body], Rotation.from_quat(TURN[body]))
        seconds = (track.times_ns - track.times_ns[0]) / 1e9
        assert np.allclose(seconds, TIME * case.get("slower", 1), atol=case.get("rounded_s", 2e-6))


def test_a_draft_is_never_written_over_and_what_is_unknown_is_a_comment(tmp_path, capsys):
    path = tmp_path / "log.csv"
    path.write_text("t,x,y,z,yaw,pitch,roll\n" + "".join(f"{k / 90},1,2,3,0,0,0\n" for k in range(9)))
    draft = tmp_path / "log.columns.toml"
    draft.write_text("mine")
    assert main(["import", "csv", str(path), "-o", str(tmp_path / "s.mcap")]) == 1
    assert draft.read_text() == "mine" and "is there already" in capsys.readouterr().err
    with pytest.raises(UnknownColumnsError) as refusal:
        import_session("csv", path)
    assert {"# order", "# units", "# convention"} <= {line.split(" =")[0] for line in refusal.value.draft.splitlines()}


@pytest.mark.parametrize(
    ("header", "row", "words"),
    [
        ("t,x,y,z,yaw,pitch,roll", "{},1,2,3,0,0,0", "the order of the angles"),
        ("x,y,z,qx,qy,qz,qw", "{},2,3,0,0,0,1", "the rate (rate_hz)"),
        ("t,speed,load", "{},1,2", "which columns are a pose"),
        ("t,x,y,z,qx,qy,qz,qw", "1{}000000000,1,2,3,0,0,0,1", "the unit of time"),
    ],
)
def test_each_thing_that_a_header_cannot_say_is_asked_for(tmp_path, header, row, words):
    (tmp_path / "log.csv").write_text("\n".join([header, *(row.format(k) for k in range(5)), ""]))
    with pytest.raises(UnknownColumnsError, match="describe them with --mapping FILE") as refusal:
        import_session("csv", tmp_path / "log.csv")
    assert any(words in one for one in refusal.value.unknown), refusal.value.unknown


# --- Other formats: each writes its file, and gives the format and the options to import it with ---


def streams(*described):
    """An XDF file of streams: name, type, channels and rows of each."""

    def write(folder):
        parts = [
            stream_header(number, *head) + samples(number, 100.0 + TIME, rows)
            for number, (*head, rows) in enumerate(described, start=1)
        ]
        return xdf_file(folder, *parts), "xdf", {}

    return write


def frames(format, options, *moves):
    """An MCAP file of frames: topic, parent and child of each body."""

    def write(folder):
        with (folder / "frames.mcap").open("wb") as stream:
            writer = Writer(stream)
            writer.start()
            schema = writer.register_schema("foxglove.FrameTransform", "jsonschema", b"{}")
            channels = {topic: writer.register_channel(topic, "json", schema) for topic, _, _ in moves}
            for k, stamp in enumerate((1e9 * TIME).round().astype(int).tolist()):
                for body, (topic, parent, child) in enumerate(moves):
                    pose = {"translation": dict(zip("xyz", PLACE[body % 2][k], strict=True)),
                            "rotation": dict(zip("xyzw", TURN[body % 2][k], strict=True))}  # fmt: skip
                    message = {
                        "timestamp": {"sec": 1, "nsec": stamp},
                        "parent_frame_id": parent,
                        "child_frame_id": child,
                    }
                    writer.add_message(channels[topic], stamp, json.dumps(message | pose).encode(), stamp)
            writer.finish()
        return folder / "frames.mcap", format, options

    return write


PLAIN = [{"label": one, "type": "position"} for one in "xyz"] + [{"label": one, "type": "quaternion"} for one in "xyzw"]
ROBOT = ("left_wheel", "oakd_left_camera_frame", "left", "hand_link", "head_pan_link")
RECORDINGS = {
    "XDF of a controller": (
        streams(("lhand", "Controller", PLAIN, np.column_stack([PLACE[0], TURN[0]]))), ("lhand",), np.eye(3),
    ),
    "XDF of LSL4Unity": (
        streams(("rhand", "VR", TRANSFORM_OUTLET, np.column_stack([TURN[0], 0 * PLACE[0], PLACE[0]]))),
        ("rhand",), UNITY,
    ),
    "frames of a robot": (frames("auto", {}, *(("/tf", "odom", name) for name in ROBOT)), ROBOT, ROS),
    "two roots, named": (
        frames("mcap", {"topics": ["/a", "/b"]}, ("/a", "map", "cup"), ("/b", "room", "rod")), ("cup", "rod"), ROS,
    ),
}  # fmt: skip
"""Recordings of other kinds: what writes one, its bodies, and the axes that they come in."""


@pytest.mark.parametrize("kind", RECORDINGS)
def test_a_recording_gives_the_poses_that_were_written(tmp_path, kind):
    write, names, axes = RECORDINGS[kind]
    path, format, options = write(tmp_path)
    session = import_session(format, path, **options)
    assert set(session.names) == {*names}
    # A hand or controller gets a stand-in, a frame of a robot never does.
    assert bool(session.meshes) == (format == "xdf")
    for body, name in enumerate(names):
        track = session.tracks[name]
        assert has_poses(track, PLACE[body % 2], Rotation.from_quat(TURN[body % 2]), axes)
        assert np.allclose((track.times_ns - track.times_ns[0]) / 1e9, TIME, atol=2e-6)
