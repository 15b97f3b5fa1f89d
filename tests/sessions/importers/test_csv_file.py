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
"""The columns that the product's Unity script writes: they are read without a mapping, in Unity's axes."""


@pytest.fixture
def write_csv(tmp_path):
    """Writes lines as a CSV, and beside it a mapping (TOML that says what its columns are); returns the CSV's path."""

    def write(*lines, mapping=""):
        (tmp_path / "map.toml").write_text(mapping)
        (tmp_path / "take.csv").write_text("\n".join([*lines, ""]), encoding="utf-8")
        return tmp_path / "take.csv"

    return write


@pytest.fixture
def import_by_mapping(write_csv, tmp_path):
    """Imports a CSV of these lines, its columns understood as the mapping says."""
    return lambda mapping, *lines: import_session(
        "csv", write_csv(*lines, mapping=mapping), mapping=tmp_path / "map.toml"
    )


def pose_line(time, body="cup", numbers=(0, 0, 0, 0, 0, 0, 1)):
    """A line below HEADER with the pose of a body: x, y, z in metres and its quaternion."""
    return f"pose,{time:.6f},{body},{','.join(repr(float(np.float32(item))) for item in numbers)},1,,"


def event_line(kind, time, body, other="", value=""):
    """A line below HEADER without a pose; ``kind`` says what it is."""
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
    """Two header lines name the columns ("f" above "x": "f x"); row 2 lacks z and the heart rate.

    The mapping says millimetres with Z up, so that x, y, z become metres with Y up as x, z, -y: (1000, 2000, 3000) is
    (1, 3, -2). Angles are 10, 20, 30 degrees about x, y, z, applied in ``order`` (capitals: about the turned axes).
    """
    above, blank, *header = "a lab", "", "t;f;f;f;f;f;f;h", "ms;x;y;z;ry;rz;rx;r"
    whole_row = "0,5;1000;2000;3000;20;30;10;71,5"
    row_with_gaps = "11,5;1000;2000;;20;30;10;"
    session = import_by_mapping(WIDE_MAPPING % order, above, blank, *header, whole_row, row_with_gaps)

    flask, heart = session.tracks["flask"], session.scalars["heart"]
    assert flask.times_ns.tolist() == heart.times_ns.tolist() == [500_000, 11_500_000]
    assert flask.positions[0].tolist() == [1.0, 3.0, -2.0]
    assert flask.valid.tolist() == [True, False]
    angles = [{"x": 10, "y": 20, "z": 30}[axis] for axis in order.lower()]
    rotation = Rotation.from_euler(order, angles, degrees=True).as_matrix()
    y_up_from_z_up = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])
    expected = y_up_from_z_up @ rotation @ y_up_from_z_up.T
    assert np.allclose(Rotation.from_quat(flask.quaternions_xyzw[0]).as_matrix(), expected, atol=1e-12)
    np.testing.assert_array_equal(heart.values, [71.5, np.nan])
    assert heart.unit == "1/min"
    assert "lengths in mm" in session.facts["conversions"]


def long_mapping(time, rotation='quaternion_xyzw = ["x", "x", "x", "w"]'):
    """A mapping of rows of any body, named in column "b": its [time] and rotation are as given; x, y and z are "x"."""
    return f'convention = "openvr"\n[time]\n{time}\n[body]\nname = "b"\nposition = ["x", "x", "x"]\n{rotation}\n'


@pytest.mark.parametrize(
    ("time", "cell", "expected_ns"),
    [
        pytest.param('unit = "s"', "1709283600.123456789", 1_709_283_600_123_456_789, id="s"),
        pytest.param('unit = "ms"', "1709283600123.456789", 1_709_283_600_123_456_789, id="ms"),
        pytest.param('unit = "us"', "12.5", 12_500, id="us"),
        pytest.param('unit = "ns"', "1709283600123456789", 1_709_283_600_123_456_789, id="ns"),
        # .NET's ticks are 100 ns since the year 1; 1970 began at 621,355,968,000,000,000 of them.
        pytest.param('unit = "ticks"', "638448804001234567", 1_709_283_600_123_456_700, id="ticks"),
        # An offset is added in the unit of the column: -500 + 600 ms.
        pytest.param('unit = "ms"\noffset = 600', "-500", 100_000_000, id="ms and offset"),
        # 1,709,283,601 is 09:00:01 on 1 March 2024; to a text the offset is added in seconds.
        pytest.param('unit = "text"\noffset = 2', "2024-03-01T09:00:01Z", 1_709_283_603_000_000_000, id="text"),
    ],
)
def test_a_clock_keeps_its_last_digit(import_by_mapping, time, cell, expected_ns):
    """A CSV of one row has ``cell`` in its column of time, which the mapping's table [time] explains."""
    mapping = long_mapping(f'column = "t"\n{time}')
    session = import_by_mapping(mapping, "t,b,x,w", f"{cell},left,0,1")
    assert session.frames.stamp_ns.tolist() == [expected_ns]


def test_rows_without_a_clock_are_stamped_by_a_rate(import_by_mapping):
    """Two rows at 2 Hz with an offset of 3 s are at 3 and 3.5 s."""
    session = import_by_mapping(long_mapping("rate_hz = 2\noffset = 3"), "b,x,w", "left,0,1", "left,0,1")
    assert session.frames.stamp_ns.tolist() == [3_000_000_000, 3_500_000_000]


def test_matrices_become_quaternions_and_non_rotations_are_lost(import_by_mapping):
    """There are 21 rows, a second apart: row 3 has a stretched matrix, row 5 a reflection, row 20 empty cells."""
    names = [f"m{row}{column}" for row in range(3) for column in range(3)]
    matrices = Rotation.random(20, random_state=4).as_matrix()
    matrices[3] *= 1.01
    matrices[5] = np.diag([1, 1, -1])
    rows = [f"{k},cup,0," + ",".join(map(repr, matrix.ravel().tolist())) for k, matrix in enumerate(matrices)]
    empty_row = "20,cup,0" + "," * len(names)
    mapping = long_mapping('column = "t"\nunit = "s"', rotation=f"matrix = {names}")
    cup = import_by_mapping(mapping, "t,b,x," + ",".join(names), *rows, empty_row).tracks["cup"]
    assert np.flatnonzero(~cup.valid).tolist() == [3, 5, 20]
    actual = Rotation.from_quat(cup.quaternions_xyzw[cup.valid]).as_matrix()
    assert np.abs(actual - np.delete(matrices, [3, 5], axis=0)).max() < 1e-9


def test_unity_gltf_meshes_keep_their_pose_and_shapes_stay(write_csv, tmp_path):
    """A triangle in Unity's axes is exported as glTF, which turns the sign of x, and placed by a pose of Unity.

    The import turns the sign of z of poses and mesh, so that the placed corners are those in Unity with -z; two signs
    turned leave the winding as exported. The mesh is given by the caller or, half as large, by the scene; the scene's
    box is no exported mesh and stays as it is.
    """
    corners_in_unity = np.array([[1.0, 2.0, 3.0], [0.5, 0.0, 0.0], [0.0, 1.0, 0.0]])
    rotation, position = Rotation.from_euler("zxy", [20, 130, -50], degrees=True), np.array([0.3, 1.1, -0.7])
    path = write_csv(HEADER, pose_line(time=0.0, body="tool", numbers=(*position, *rotation.as_quat())))
    exported = MeshData(corners_in_unity * [-1, 1, 1], [[0, 2, 1]])
    (tmp_path / "tool.glb").write_bytes(mesh_to_glb(exported, "tool"))
    scene = parse_scene(
        '[[body]]\nid = "tool"\nmesh = "tool.glb"\nscale = 0.5\n[[body]]\nid = "box"\nshape = "box"\nsize = [1, 1, 1]\n'
    )
    by_caller = import_session("csv", path, mesh_axes="x-flipped", meshes={"tool": exported})
    by_scene = import_session("csv", path, mesh_axes="x-flipped", scene=scene, scene_folder=tmp_path)

    for scale, session in ((1.0, by_caller), (0.5, by_scene)):
        track, mesh = session.tracks["tool"], session.meshes["tool"]
        placed = Rotation.from_quat(track.quaternions_xyzw[0]).apply(mesh.vertices.copy()) + track.positions[0]
        placed_in_unity = rotation.apply(scale * corners_in_unity) + position
        assert np.allclose(placed, placed_in_unity * [1, 1, -1], atol=1e-6), scale
        assert mesh.faces.tolist() == exported.faces.tolist(), scale
        assert "x-flipped" in session.facts["assumptions"], scale
    without_mesh_axes = import_session("csv", path, scene=scene, scene_folder=tmp_path)
    assert np.array_equal(by_scene.meshes["box"].vertices, without_mesh_axes.meshes["box"].vertices)


def test_a_column_of_numbers_taken_for_names_is_refused(write_csv):
    """The column of names holds 0 to 1000: 1,001 bodies, one more than a recording may have."""
    path = write_csv(HEADER, *(pose_line(time=0.0, body=f"{k}") for k in range(1001)))
    assert_import_refused("csv", path, r"column 'body' names 1,001 bodies; is it the column of names\?")


@pytest.mark.parametrize(("delimiter", "decimal"), [(";", "."), (";", ","), ("\t", ",")])
def test_unity_script_output_is_read_in_any_locale(write_csv, delimiter, decimal):
    """Five rows 11 ms apart with the delimiter and the decimal sign of other countries give the same poses."""
    rows = [pose_line(0.011 * k, numbers=(0.25 * k, 1.5, 0, 0, 0, 0, 1)) for k in range(5)]
    lines = [line.replace(",", delimiter).replace(".", decimal) for line in (HEADER, *rows)]
    cup = import_session("csv", write_csv(*lines)).tracks["cup"]
    assert cup.times_ns.tolist() == [0, 11_000_000, 22_000_000, 33_000_000, 44_000_000]
    assert cup.positions.tolist() == [[0.25 * k, 1.5, 0.0] for k in range(5)]


@pytest.mark.filterwarnings("error::pytest.PytestUnraisableExceptionWarning")
def test_ragged_non_utf_8_row_is_refused_in_a_sentence(tmp_path):
    """After a header and 500 good rows a line has two cells, the second a byte that is not UTF-8."""
    rows = [pose_line(0.01 * k) for k in range(500)]  # more than is read to find the header
    (tmp_path / "take.csv").write_bytes("\n".join([HEADER, *rows, "pose,\xff", rows[0], ""]).encode("latin-1"))
    assert_import_refused("csv", tmp_path / "take.csv", r"no CSV text in UTF-8 .*; save it as UTF-8")


def test_empty_short_and_bad_cells_are_accounted_for(write_csv):
    """One of three rows has three cells and is dropped, another has y = nan and is a lost pose; blank lines are none.

    Poses are in Unity's axes, so that z changes its sign.
    """
    head = "kind,time,body,px,py,pz,qx,qy,qz,qw,tracked"
    rows = ["pose,0,cup,1,2,3,0,0,0,1,1", "", "pose,1,cup", "pose,2,cup,1,nan, 3 ,0,0,0,1,1"]
    session = import_session("csv", write_csv(head, *rows))
    cup = session.tracks["cup"]
    assert cup.valid.tolist() == [True, False]
    assert cup.positions[:, 2].tolist() == [-3.0, -3.0]
    assert "1 of 3 rows dropped: with too few or too many cells" in ledger_text(session)


def test_letter_for_a_number_is_refused_with_its_line(write_csv):
    """Line 1 is the header, line 2 blank, line 3 has x for a coordinate z."""
    path = write_csv(HEADER, "", "pose,3,cup,1,2,x,0,0,0,1,1,,")
    assert_import_refused("csv", path, "line 3, column 'pz': 'x' is no number")


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
    script must not round away. Each contact is reported by both bodies and counts once, as the first of them says it.
    Trigger, heart rate and the session's own file are as written.
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
    """A trigger is cut to 0 to 1, an empty one is 0; an event's name is in "other", its message in "value".

    An event whose message has a comma without quotes has a cell too many; eight rows are of kinds a to g, a twice.
    """
    pressed = ("0.25", "", "inf", "-1", "7")
    lines = [
        pose_line(time=0),
        *(event_line("trigger", time=k, body="LeftWheel", value=value) for k, value in enumerate(pressed)),
        event_line("event", time=2, body="", other="act", value="pouring"),
        event_line("event", time=1, body="Beaker", value='"a, b"'),
        event_line("event", time=3, body="Beaker", value="fell, hard"),
        *(event_line(kind, time=1, body="x") for kind in "aabcdefg"),
    ]
    session = import_session("csv", write_csv(HEADER, *lines))
    assert session.hands["student/left"].trigger.tolist() == [0.25, 0.0, 1.0, 0.0, 1.0]
    assert list(session.events) == [
        Event(time_ns=1_000_000_000, name="event", message="a, b", body="Beaker"),
        Event(time_ns=2_000_000_000, name="act", message="pouring"),
    ]
    why = "1 with too few or too many cells; 8 of 7 unknown kinds such as 'a', 'b', 'c', 'd', 'e'"
    assert ledger_text(session).endswith(f"9 of {len(lines)} rows dropped: {why}")


def test_contact_rows_become_reports_sorted_to_the_nanosecond(write_csv):
    """The later report, at nine decimals of a second, stands first; begin is stored as enter, end as exit."""
    path = write_csv("time,a,b,what", "1700000000.123456789,rod,beaker,end", "", " 0.5 , rod, beaker, Begin")
    begin, end = read_contacts(path, Ledger(path))
    assert begin == LiveContact(time_ns=500_000_000, body_a="rod", body_b="beaker", phase="enter")
    assert end == LiveContact(time_ns=1_700_000_000_123_456_789, body_a="rod", body_b="beaker", phase="exit")


@pytest.mark.parametrize("mutants", MUTANTS)
def test_mutants_of_contacts_end_in_reports_or_a_sentence(write_csv, mutants):
    """A file has twenty reports; so many damaged copies of it are read, each into reports or one error.

    ``tried`` fails where the error names no file, where anything is written, or where a copy takes 10 s.
    """
    path = write_csv("time,a,b,what", *(f"{k / 8},rod,beaker,begin" for k in range(20)))
    tried(path, mutants, lambda: read_contacts(path, Ledger(path)))
