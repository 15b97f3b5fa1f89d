"""More than twenty hand-written recordings, of the kinds that people have, give the poses that were written.

A CSV that nobody has described gets a draft of its mapping first, and is imported with the draft completed.
"""

import json

import numpy as np
import pytest
from mcap.writer import Writer
from scipy.spatial.transform import Rotation
from support.true_poses import ROS, UNITY, has_poses
from support.xdf_files import TRANSFORM_OUTLET, samples, stream_header, xdf_file

from replay.cli.main import main
from sessions import read_session
from sessions.errors import ImportFileError
from sessions.importers import import_session
from sessions.importers.csv_draft import UnknownColumnsError

COUNT = 40
RNG = np.random.default_rng(3)
TIME = np.arange(COUNT) / 90
PLACE = RNG.normal(size=(2, COUNT, 3))
TURN = Rotation.random(2 * COUNT, rng=RNG).as_quat().reshape(2, COUNT, 4)
WXYZ = [3, 0, 1, 2]
MATRIX = Rotation.from_quat(TURN[0]).as_matrix()
VALUES = "xyzw"
TICKS = 636_045_168_000_000_000
"""Hundreds of nanoseconds from the year 1 to 2016-07-19."""


def head(pattern, axes):
    return [pattern.format(axis) for axis in axes]


def rows_of(*parts):
    return np.column_stack(parts).tolist()


def wall(form):
    moments = np.datetime64("2016-07-19T11:21:37.500") + np.round(TIME * 1000).astype("timedelta64[ms]")
    return [f"{moment:%m/%d/%Y %H:%M:%S}:{moment.microsecond // 1000:03d}" if form else f"{np.datetime64(moment)}Z"
            for moment in moments.astype("datetime64[us]").tolist()]  # fmt: skip


G, H = [PLACE[0], TURN[0]], [PLACE[1], TURN[1]]
CASES = {
    "words before the axis": (
        ["Time", *head("Glass_{}", "XYZ"), *head("Glass_Q{}", "XYZW"), *head("Hand_{}", "XYZ"),
         *head("Hand_Q{}", "XYZW"), "Score"],
        rows_of(TIME, *G, *H, TIME), ",", ("Glass", "Hand"), TIME, "convention",
    ),
    "one body": (
        ["frame", "timestamp_ms", *head("pos_{}", "xyz"), *head("rot_{}", VALUES)],
        rows_of(np.arange(COUNT), 1000 * TIME, *G), ",", ("log",), TIME, "convention",
    ),
    "EuRoC": (
        ["#timestamp [ns]", *head("p_RS_R_{} [m]", "xyz"), *head("q_RS_{} []", "wxyz"), *head("v_R_{} [m/s]", "xyz")],
        [[1403636580838555648 + round(1e9 * TIME[k]), *PLACE[0][k], *TURN[0][k][WXYZ], *PLACE[1][k]]
         for k in range(COUNT)],
        ",", ("log",), TIME, "convention",
    ),
    "TUM": (["# timestamp tx ty tz qx qy qz qw"], rows_of(1.5e9 + TIME, *G), " ", ("log",), TIME, "convention"),
    "KITTI": (
        [], rows_of(np.concatenate([MATRIX, PLACE[0][:, :, None]], axis=2).reshape(COUNT, 12)), " ", ("log",), TIME,
        "rate_hz",
    ),
    "SteamVR, long, German": (
        ["time", "device", *"xyz", *head("q{}", "wxyz")],
        [[t, name, *PLACE[body][row], *TURN[body][row][WXYZ]]
         for row, t in enumerate(TIME) for body, name in enumerate(("hmd", "lhand"))],
        ";", ("hmd", "lhand"), TIME, "convention",
    ),
    "Unity": (
        ["Timestamp", *head("RightHand.position.{}", "xyz"), *head("RightHand.rotation.{}", VALUES)],
        [[stamp, *row] for stamp, row in zip(wall("%"), rows_of(*G), strict=True)], ",", ("RightHand",),
        np.round(TIME, 3), "convention",
    ),
    "angles by name": (
        ["time_s", *head("Wand_{}", "XYZ"), "Wand_pitch", "Wand_yaw", "Wand_roll"],
        rows_of(TIME, PLACE[0], Rotation.from_quat(TURN[0]).as_euler("ZXY", degrees=True)[:, [1, 2, 0]]),
        ",", ("Wand",), TIME, "order",
    ),
    "tabs and decimal commas": (
        ["t", *head("t{}", "xyz"), *head("q{}", VALUES)],
        [[f"{number:.17g}".replace(".", ",") for number in row] for row in rows_of(TIME, *G)], "\t", ("log",), TIME, "",
    ),
    "centimetres, slow": (
        ["t", *head("cup_{} [cm]", "xyz"), *head("cup_q{}", VALUES)], rows_of(20 * TIME, 100 * PLACE[0], TURN[0]), ",",
        ("cup",), 20 * TIME, "convention",
    ),
    ".NET ticks": (
        ["time", *head("pos_{}", "xyz"), *head("rot_{}", VALUES)],
        [[TICKS + round(1e7 * TIME[k]), *row] for k, row in enumerate(rows_of(*G))], ",", ("log",), TIME, "convention",
    ),
    "ISO 8601": (
        ["datetime", *head("p{}", "xyz"), *head("q{}", VALUES)],
        [[stamp, *row] for stamp, row in zip(wall(""), rows_of(*G), strict=True)], ",", ("log",), np.round(TIME, 3), "",
    ),
    "OpenVR, a matrix": (
        ["time", "device", *(f"m{row}{column}" for row in range(3) for column in range(4)), "valid"],
        [[TIME[k], "LHR-1", *np.column_stack([MATRIX[k], PLACE[0][k]]).ravel(), 1] for k in range(COUNT)],
        ",", ("LHR-1",), TIME, "convention",
    ),
    "triad_openvr": (
        ["time", *"xyz", "yaw", "pitch", "roll", *head("r_{}", "wxyz")],
        rows_of(TIME, PLACE[0], PLACE[1], TURN[0][:, WXYZ]), ",", ("log",), TIME, "convention",
    ),
    "a clock without a date": (
        ["Time", "Device", *"XYZ", *head("q{}", "WXYZ")],
        [[stamp.split("T")[1].rstrip("Z"), "H", *PLACE[0][k], *TURN[0][k][WXYZ]] for k, stamp in enumerate(wall(""))],
        ",", ("H",), np.round(TIME, 3), "convention",
    ),
    "before 0, in mm": (
        ["t (s)", *head("Cup pos {} (mm)", "xyz"), *head("Cup rot {}", VALUES)],
        rows_of(TIME - 0.25, 1000 * PLACE[0], TURN[0]), ",", ("Cup",), TIME, "convention",
    ),
}  # fmt: skip
"""Kind of log -> its header, rows and delimiter; the bodies, their seconds, and a word of what is unknown."""


def written(folder, case):
    header, rows, delimiter, *_ = case
    lines = [delimiter.join(header)] if header else []
    for row in rows:
        cells = [cell if isinstance(cell, str | int) else f"{cell:.12f}" for cell in row]
        lines.append(delimiter.join(str(cell).replace(".", ",") if delimiter == ";" else str(cell) for cell in cells))
    path = folder / "log.csv"
    path.write_text("\n".join([*lines, ""]))
    return path


@pytest.mark.parametrize("kind", CASES)
def test_a_draft_that_is_completed_gives_the_poses_that_were_written(tmp_path, capsys, kind):
    case = CASES[kind]
    path, out, draft = written(tmp_path, case), tmp_path / "s.mcap", tmp_path / "log.columns.toml"
    assert main(["import", "csv", str(path), "-o", str(out)]) == 1
    said = " ".join(capsys.readouterr().err.split())
    assert case[5] in said and "--mapping" in said and str(draft) in said and not out.exists()
    text = draft.read_text().replace('# convention = "unity"', 'convention = "openvr"').replace("# rate_hz", "rate_hz")
    text = text.replace('# order = "XYZ"', 'order = "ZXY"').replace('# unit = "s"', 'unit = "s"')
    draft.write_text(text)
    assert main(["import", "csv", str(path), "--mapping", str(draft), "-o", str(out)]) == 0, capsys.readouterr().err
    session = read_session(out)
    assert session.names == case[3]
    for body, name in enumerate(case[3]):
        track = session.tracks[name]
        assert has_poses(track, PLACE[body], Rotation.from_quat(TURN[body]))
        assert np.allclose((track.times_ns - track.times_ns[0]) / 1e9, case[4] - case[4][0], atol=2e-6)


def test_a_draft_is_never_written_over_and_what_is_unknown_is_a_comment(tmp_path, capsys):
    path = written(tmp_path, (["t", *"xyz", "yaw", "pitch", "roll"], rows_of(TIME, PLACE[0], PLACE[1]), ","))
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


STAMPS = {
    "a cell that is no date": (["2016-07-19T11:21:37", "yesterday"], 'unit = "text"', r"line 3.*'yesterday'.*ISO 8601"),
    "another format": (["07/19/2016"] * 2, 'unit = "text"\nformat = "%d.%m.%Y"', r"line 2.*'07/19/2016'.*%d\.%m\.%Y"),
    "an offset of ages": (["1", "2"], 'unit = "s"\noffset = 1e300', r"\[time\]: offset is beyond the years"),
    "before 0": (["-0.5", "1"], 'unit = "s"', r"line 2, column 't': -0\.5 is before 0; .*offset = 0\.5"),
}


@pytest.mark.parametrize("kind", STAMPS)
def test_a_stamp_that_cannot_be_is_named_by_file_and_line(tmp_path, kind):
    stamps, clock, words = STAMPS[kind]
    log, mapping = tmp_path / "log.csv", tmp_path / "m.toml"
    log.write_text("\n".join(["t,x,y,z,a,b,c,d", *(f"{stamp},0,0,0,0,0,0,1" for stamp in stamps), ""]))
    mapping.write_text(
        f'convention = "unity"\n[time]\ncolumn = "t"\n{clock}\n[bodies.cup]\n'
        'position = ["x", "y", "z"]\nquaternion_xyzw = ["a", "b", "c", "d"]\n'
    )
    with pytest.raises(ImportFileError, match=words) as refusal:
        import_session("csv", log, mapping=mapping)
    assert "log.csv" in str(refusal.value) or "m.toml" in str(refusal.value)


def test_all_faults_of_a_mapping_and_all_columns_that_are_missing_are_named_at_once(tmp_path):
    log, mapping = tmp_path / "log.csv", tmp_path / "m.toml"
    log.write_text("t,x,y\n0,1,2\n")
    mapping.write_text('units = "feet"\n[time]\ncolumn = "t"\nunit = "h"\n[bodies.cup]\npositon = ["x"]\n')
    with pytest.raises(ImportFileError) as refusal:
        import_session("csv", log, mapping=mapping)
    assert [
        word for word in ("'feet'", "unit is 'h'", "'positon'", "quaternion_xyzw") if word not in str(refusal.value)
    ] == []
    mapping.write_text(
        'convention = "unity"\n[time]\ncolumn = "time"\nunit = "s"\n[bodies.cup]\n'
        'position = ["x", "y", "z"]\nquaternion_xyzw = ["a", "b", "c", "d"]\n'
    )
    with pytest.raises(ImportFileError, match="no columns 'time', 'z', 'a', 'b', 'c', 'd'; there are: t, x, y"):
        import_session("csv", log, mapping=mapping)


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


def mapped_streams(folder):
    """Channels that say nothing, in millimetres and Unity's axes, with Euler angles."""
    labels = [{"label": one} for one in ("px", "py", "pz", "ez", "ex", "ey")]
    angles = Rotation.from_quat(TURN[0]).as_euler("zxy", degrees=True)
    path, *_ = streams(("Controllers", "VR", labels, np.column_stack([1000 * PLACE[0], angles])))(folder)
    (folder / "m.toml").write_text(
        'convention = "unity"\nunits = "mm"\n[bodies.left]\nstream = "Controllers"\nposition = ["px", "py", "pz"]\n'
        'euler = {x = "ex", y = "ey", z = "ez"}\norder = "zxy"\n'
    )
    return path, "xdf", {"mapping": folder / "m.toml"}


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
        streams(("lhand", "Controller", PLAIN, np.column_stack(G))), ("lhand",), np.eye(3),
    ),
    "XDF of LSL4Unity": (
        streams(("rhand", "VR", TRANSFORM_OUTLET, np.column_stack([TURN[0], 0 * PLACE[0], PLACE[0]]))),
        ("rhand",), UNITY,
    ),
    "XDF with a mapping": (mapped_streams, ("left",), UNITY),
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
