import re
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.mutants import MUTANTS, assert_import_refused, ledger_text, round_trips, tried

from replay import guide
from sessions import MeshData
from sessions.importers import import_session
from sessions.importers.contacts_csv import read_contacts
from sessions.importers.ledger import Ledger
from sessions.meshes.glb import mesh_to_glb
from sessions.model.event import Event, LiveContact
from sessions.scene_files.scene_toml import parse_scene

HEADER = "kind,time,body,px,py,pz,qx,qy,qz,qw,tracked,other,value"


@pytest.fixture
def write_csv(tmp_path):
    """Writes lines as a CSV, and a mapping beside it."""

    def write(*lines, mapping=""):
        (tmp_path / "map.toml").write_text(mapping)
        (tmp_path / "take.csv").write_text("\n".join([*lines, ""]), encoding="utf-8")
        return tmp_path / "take.csv"

    return write


@pytest.fixture
def import_by_mapping(write_csv, tmp_path):
    """Imports lines by a mapping."""
    return lambda mapping, *lines: import_session(
        "csv", write_csv(*lines, mapping=mapping), mapping=tmp_path / "map.toml"
    )


def pose_line(time, body="cup", numbers=(0, 0, 0, 0, 0, 0, 1)):
    """A line of a session's CSV with the pose of a body."""
    return f"pose,{time:.6f},{body},{','.join(repr(float(np.float32(item))) for item in numbers)},1,,"


def event_line(kind, time, body, other="", value=""):
    """A line of a session's CSV with an event."""
    return f"{kind},{time},{body}{',' * 9}{other},{value}"


WIDE_MAPPING = """
convention = "z-up"
units = "mm"
delimiter = ";"
decimal = ","
skip_lines = 2
header_lines = 2
[time]
column = "t ms"
unit = "ms"
[bodies.flask]
position = ["f x", "f y", "f z"]
euler = {x = "f rx", y = "f ry", z = "f rz"}
order = "%s"
[scalars.heart]
column = "h r"
unit = "1/min"
"""


@pytest.mark.parametrize("order", ["zyx", "XYZ", "ZXY", "yzx"])
def test_wide_table_with_decimal_commas_and_named_angles_is_read(import_by_mapping, order):
    """Millimetres with Z up become metres with Y up: (1000, 2000, 3000) is (1, 3, -2). ``order``: of the angles."""
    head = ["a lab", "", "t;f;f;f;f;f;f;h", "ms;x;y;z;ry;rz;rx;r"]
    session = import_by_mapping(
        WIDE_MAPPING % order, *head, "0,5;1000;2000;3000;20;30;10;71,5", "11,5;1000;2000;;20;30;10;"
    )
    track, heart = session.tracks["flask"], session.scalars["heart"]
    assert track.times_ns.tolist() == heart.times_ns.tolist() == [500_000, 11_500_000]
    assert track.positions[0].tolist() == [1.0, 3.0, -2.0] and track.valid.tolist() == [True, False]
    angles = [{"x": 10, "y": 20, "z": 30}[axis] for axis in order.lower()]
    rotation = Rotation.from_euler(order, angles, degrees=True).as_matrix()
    axes = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])
    assert np.allclose(Rotation.from_quat(track.quaternions_xyzw[0]).as_matrix(), axes @ rotation @ axes.T, atol=1e-12)
    np.testing.assert_array_equal(heart.values, [71.5, np.nan])
    assert heart.unit == "1/min" and "lengths in mm" in session.facts["conversions"]


LONG_MAPPING = """
convention = "openvr"
[time]
column = "t"
unit = "%s"
[body]
name = "b"
position = ["x", "x", "x"]
"""


@pytest.mark.parametrize(
    ("unit", "cell", "expected"),
    [
        ("s", "1709283600.123456789", 1_709_283_600_123_456_789),
        ("ms", "1709283600123.456789", 1_709_283_600_123_456_789),
        ("us", "12.5", 12_500),
        ("ns", "1709283600123456789", 1_709_283_600_123_456_789),
        ("ticks", "638448804001234567", 1_709_283_600_123_456_700),
        ('ms"\noffset = 600 #"', "-500", 100_000_000),
        ('text"\noffset = 2 #"', "2024-03-01T09:00:01Z", 1_709_283_603_000_000_000),
    ],
)
def test_a_clock_keeps_its_last_digit(import_by_mapping, unit, cell, expected):
    """``cell``: what stands in the column of time, in ``unit``; ``expected``: nanoseconds."""
    rotation = 'quaternion_xyzw = ["x", "x", "x", "w"]\n'
    session = import_by_mapping(LONG_MAPPING % unit + rotation, "t,b,x,w", f"{cell},left,0,1")
    assert session.frames.stamp_ns.tolist() == [expected]
    rated = (LONG_MAPPING % "s").replace('column = "t"\nunit = ', "rate_hz = 2\noffset = 3 #")
    assert import_by_mapping(rated + rotation, "b,x,w", *["left,0,1"] * 2).frames.stamp_ns.tolist() == [
        3 * 10**9,
        35 * 10**8,
    ]


def test_matrices_become_quaternions_and_non_rotations_are_lost(import_by_mapping):
    """Matrix 3 is stretched, 5 is a reflection, 20 is empty."""
    names = [f"m{row}{column}" for row in range(3) for column in range(3)]
    rotations = Rotation.random(20, random_state=4).as_matrix()
    rotations[3] *= 1.01
    rotations[5] = np.diag([1, 1, -1])
    lines = [f"{k},cup,0," + ",".join(map(repr, rotation.ravel().tolist())) for k, rotation in enumerate(rotations)]
    mapping = f"{LONG_MAPPING % 's'}matrix = {names}\n"
    track = import_by_mapping(mapping, "t,b,x," + ",".join(names), *lines, "20,cup,0" + "," * 9).tracks["cup"]
    assert np.flatnonzero(~track.valid).tolist() == [3, 5, 20]
    actual = Rotation.from_quat(track.quaternions_xyzw[track.valid]).as_matrix()
    assert np.abs(actual - rotations[track.valid[:20]]).max() < 1e-9


def test_unity_gltf_meshes_keep_their_pose_and_shapes_stay(write_csv, tmp_path):
    """The glTF exporter flips X, the poses flip Z; both reverse the winding.

    The tool's mesh is named by the caller or, half as large, by the scene; the box is a shape, which no exporter turns.
    """
    inside_unity = np.array([[1.0, 2.0, 3.0], [0.5, 0.0, 0.0], [0.0, 1.0, 0.0]])
    rotation, position = Rotation.from_euler("zxy", [20, 130, -50], degrees=True), np.array([0.3, 1.1, -0.7])
    path = write_csv(HEADER, pose_line(time=0.0, body="tool", numbers=(*position, *rotation.as_quat())))
    gltf = MeshData(inside_unity * [-1, 1, 1], [[0, 2, 1]])
    (tmp_path / "tool.glb").write_bytes(mesh_to_glb(gltf, "tool"))
    scene = parse_scene(
        '[[body]]\nid = "tool"\nmesh = "tool.glb"\nscale = 0.5\n[[body]]\nid = "box"\nshape = "box"\nsize = [1, 1, 1]\n'
    )
    box = import_session("csv", path, scene=scene, scene_folder=tmp_path).meshes["box"].vertices
    for scale, meshes in ((1.0, {"meshes": {"tool": gltf}}), (0.5, {"scene": scene, "scene_folder": tmp_path})):
        session = import_session("csv", path, mesh_axes="x-flipped", **meshes)
        track, mesh = session.tracks["tool"], session.meshes["tool"]
        result = Rotation.from_quat(track.quaternions_xyzw[0]).apply(mesh.vertices.copy()) + track.positions[0]
        assert np.allclose(result, (rotation.apply(scale * inside_unity) + position) * [1, 1, -1], atol=1e-6)
        assert mesh.faces.tolist() == [[0, 2, 1]] and "x-flipped" in session.facts["assumptions"]
    assert np.array_equal(session.meshes["box"].vertices, box)


def test_a_column_of_numbers_taken_for_names_is_refused(write_csv):
    """1,001 rows name 1,001 bodies, 0 to 1000."""
    path = write_csv(HEADER, *(pose_line(time=0.0, body=f"{k}") for k in range(1001)))
    assert_import_refused("csv", path, r"column 'body' names 1,001 bodies; is it the column of names\?")


@pytest.mark.parametrize(("delimiter", "decimal"), [(";", "."), (";", ","), ("\t", ",")])
def test_unity_script_output_is_read_in_any_locale(write_csv, delimiter, decimal):
    """The same rows with other delimiters and decimal commas."""
    rows = [HEADER, *(pose_line(0.011 * k, numbers=(0.25 * k, 1.5, 0, 0, 0, 0, 1)) for k in range(5))]
    expected = import_session("csv", write_csv(*rows)).tracks["cup"]
    other = [row.replace(",", delimiter).replace(".", decimal) for row in rows]
    result = import_session("csv", write_csv(*other)).tracks["cup"]
    assert result.times_ns.tolist() == expected.times_ns.tolist()
    np.testing.assert_array_equal(result.positions, expected.positions)


@pytest.mark.filterwarnings("error::pytest.PytestUnraisableExceptionWarning")
def test_ragged_non_utf_8_row_is_refused_in_a_sentence(tmp_path):
    """The 502nd line is two cells, the second a byte of Latin-1."""
    rows = [pose_line(0.01 * k) for k in range(500)]  # beyond a block of the header
    (tmp_path / "take.csv").write_bytes("\n".join([HEADER, *rows, "pose,\xff", rows[0], ""]).encode("latin-1"))
    assert_import_refused("csv", tmp_path / "take.csv", r"no CSV text in UTF-8 .*; save it as UTF-8")


def test_empty_short_and_bad_cells_are_accounted_for(write_csv):
    """Three rows: a whole one, one of three cells, which is dropped, and one whose y is nan, which is a lost pose.

    A fourth with a letter for a number is refused. Poses are in Unity's axes, so that z changes its sign.
    """
    head = "kind,time,body,px,py,pz,qx,qy,qz,qw,tracked"
    lines = [head, "pose,0,cup,1,2,3,0,0,0,1,1", "", "pose,1,cup", "pose,2,cup,1,nan, 3 ,0,0,0,1,1"]
    session = import_session("csv", write_csv(*lines))
    assert session.tracks["cup"].valid.tolist() == [True, False] and session.tracks["cup"].positions[1, 2] == -3
    assert "1 of 3 rows dropped: with too few or too many cells" in ledger_text(session)
    assert_import_refused(
        "csv", write_csv(*lines, "pose,3,cup,1,2,x,0,0,0,1,1"), "line 6, column 'pz': 'x' is no number"
    )


SCRIPT = Path(guide.__file__).with_name("VrLabRecorder.cs").read_text("utf-8")


def filled_line(start, values):
    """A line as the script writes it: ``F6`` is six decimals, ``R`` of a float the shortest text that reads back."""

    def cell(match):
        expression, _, form = match.group(1).partition(":")
        value = values[expression]
        return f"{value:.6f}" if form == "F6" else str(np.float32(value)) if form == "R" else str(value)

    templates = re.findall(r'Invariant\(\$"([^"]*)"\)', SCRIPT)
    return re.sub(r"\{([^{}]*)\}", cell, next(line for line in templates if line.startswith(start)))


def test_session_written_by_the_script_is_imported_unchanged(tmp_path):
    """40 rows at 90 Hz are written by the C# script's own templates; row 3 is not tracked, contact is in rows 10 to 20.

    Unity's left-handed axes become the session's by turning the sign of z. Positions along z are of 0.01 mm, which the
    script must not round away, and each contact is told by both bodies and counts once.
    """
    rng, count = np.random.default_rng(8), 40
    rotations, positions = Rotation.random(count, random_state=8), rng.normal(size=(count, 3)) * [1, 1, 1e-5]
    lines = re.findall(r'WriteLine\("(kind,[^"]*)"\)', SCRIPT)
    for k in range(count):
        now = {"Time.timeAsDouble": k / 90}
        pieces = {f"p.{axis}": value for axis, value in zip("xyz", positions[k], strict=True)}
        pieces |= {f"q.{axis}": value for axis, value in zip("xyzw", rotations[k].as_quat(), strict=True)}
        body = {"Cell(body.name)": "LeftWheel", "Tracked(body)": int(k != 3)}
        lines.append(filled_line("pose,", now | pieces | body))
        lines.append(filled_line("trigger,", now | {"hand": "left", "value": k / count}))
        lines.append(filled_line("scalar,", now | {"Cell(name)": "heart rate", "value": 70 + k}))
        for kind in {10: ["enter"], 20: ["exit"]}.get(k, []):
            for a, b in (("LeftWheel", "Beaker"), ("Beaker", "LeftWheel")):
                lines.append(filled_line("{kind},", now | {"kind": kind, "Cell(body)": a, "Cell(other)": b}))
    path = tmp_path / "session.csv"
    path.write_text("\r\n".join(lines) + "\r\n", encoding="utf-8")

    session = import_session("csv", path)
    assert session.names == ("LeftWheel",) and session.facts["handedness"] == "left"
    assert "axes unity" in session.facts["conversions"]
    assert session.frames.stamp_ns.tolist() == [round(round(k / 90, 6) * 1e9) for k in range(count)]
    mirror = np.diag([1.0, 1.0, -1.0])
    assert np.allclose(session.frames.position[:, 0], positions @ mirror, rtol=1e-7, atol=1e-12)
    actual = Rotation.from_quat(session.frames.quaternion_xyzw[:, 0]).as_matrix()
    assert np.allclose(actual, mirror @ rotations.as_matrix() @ mirror, atol=1e-6)
    assert np.flatnonzero(~session.tracks["LeftWheel"].valid).tolist() == [3]
    assert np.allclose(session.hands["student/left"].trigger, np.arange(count) / count)
    contacts = [(item.body_a, item.body_b, item.phase) for item in session.live_contacts]
    assert contacts == [("LeftWheel", "Beaker", "enter"), ("LeftWheel", "Beaker", "exit")]
    assert ledger_text(session).endswith("; LeftWheel: 1 of 40 poses dropped: flagged as lost")
    assert session.scalars["heart rate"].values.tolist() == [70.0 + k for k in range(count)]
    round_trips(session, tmp_path)


def test_non_pose_rows_become_triggers_events_or_unknown_kinds(write_csv):
    """Triggers are held to 0 to 1; an event's name is in "other", its message in "value"."""
    session = import_session(
        "csv",
        write_csv(
            HEADER,
            pose_line(time=0),
            *(event_line("trigger", k, "LeftWheel", "", v) for k, v in enumerate(("0.25", "", "inf", "-1", "7"))),
            event_line("event", time=2, body="", other="act", value="pouring"),
            event_line("event", time=1, body="Beaker", other="", value='"a, b"'),
            event_line("event", time=3, body="Beaker", other="", value="fell, hard"),  # a cell too many
            *(event_line(kind, time=1, body="x") for kind in "aabcdefg"),
        ),
    )
    assert session.hands["student/left"].trigger.tolist() == [0.25, 0.0, 1.0, 0.0, 1.0]
    assert list(session.events) == [
        Event(1_000_000_000, "event", "a, b", "Beaker"),
        Event(2_000_000_000, "act", "pouring"),
    ]
    why = "1 with too few or too many cells; 8 of 7 unknown kinds such as 'a', 'b', 'c', 'd', 'e'"
    assert ledger_text(session).endswith(f"9 of 17 rows dropped: {why}")


def test_contact_rows_become_reports_sorted_to_the_nanosecond(write_csv):
    """The later report, at nine decimals, stands first."""
    path = write_csv("time,a,b,what", "1700000000.123456789,rod,beaker,end", "", " 0.5 , rod, beaker, Begin")
    assert read_contacts(path, Ledger(path)) == (
        LiveContact(500_000_000, "rod", "beaker", "enter"),
        LiveContact(1_700_000_000_123_456_789, "rod", "beaker", "exit"),
    )


@pytest.mark.parametrize("count", MUTANTS)
def test_mutants_of_contacts_end_in_reports_or_a_sentence(write_csv, count):
    """Twenty reports; ``count`` random changes of the file's bytes are tried one after another."""
    path = write_csv("time,a,b,what", *(f"{k / 8},rod,beaker,begin" for k in range(20)))
    tried(path, count, lambda: read_contacts(path, Ledger(path)))
