import re
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.import_mutants import MUTANTS, refused, round_trips, survive

from sessions import MeshData
from sessions.importers import import_session
from sessions.meshes.glb import mesh_to_glb
from sessions.scene_files.scene_toml import parse_scene

HEADER = "kind,time,body,px,py,pz,qx,qy,qz,qw,tracked,other,value"


def unity_row(time, body, position, quaternion, tracked=True):
    numbers = ",".join(repr(float(np.float32(one))) for one in (*position, *quaternion))
    return f"pose,{time:.6f},{body},{numbers},{int(tracked)},,"


def written(tmp_path, lines, name="take.csv"):
    path = tmp_path / name
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


WIDE = """
convention = "z-up"
units = "mm"
delimiter = ";"
decimal = ","
[time]
column = "t"
unit = "ms"
[bodies.flask]
position = ["x", "y", "z"]
euler = {x = "rx", y = "ry", z = "rz"}
order = "zyx"
"""


def test_a_wide_table_with_decimal_commas_millimetres_euler_angles_and_a_number(tmp_path):
    mapping = tmp_path / "map.toml"
    mapping.write_text(WIDE + '[scalars.heart]\ncolumn = "hr"\nunit = "1/min"\n')
    lines = ["t;x;y;z;rx;ry;rz;hr", "0,5;1000;2000;3000;10;20;30;71,5", "11,5;1000;2000;;10;20;30;"]
    session = import_session("csv", written(tmp_path, lines), mapping=mapping)
    track, heart = session.tracks["flask"], session.scalars["heart"]
    assert track.times_ns.tolist() == heart.times_ns.tolist() == [500_000, 11_500_000]
    assert track.positions[0].tolist() == [1.0, 3.0, -2.0] and track.valid.tolist() == [True, False]
    turn = Rotation.from_euler("zyx", [30, 20, 10], degrees=True).as_matrix()
    axes = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])
    assert np.allclose(Rotation.from_quat(track.quaternions_xyzw[0]).as_matrix(), axes @ turn @ axes.T, atol=1e-15)
    np.testing.assert_array_equal(heart.values, [71.5, np.nan])
    assert heart.unit == "1/min"


@pytest.mark.parametrize(
    ("unit", "cell", "expected"),
    [
        ("s", "1709283600.123456789", 1_709_283_600_123_456_789),
        ("ms", "1709283600123.456789", 1_709_283_600_123_456_789),
        ("us", "12.5", 12_500),
        ("ns", "1709283600123456789", 1_709_283_600_123_456_789),
        ("ticks", "638448804001234567", 1_709_283_600_123_456_700),
        ('ms"\noffset = 600 #"', "-500", 100_000_000),
    ],
)
def test_a_clock_keeps_its_last_digit(tmp_path, unit, cell, expected):
    mapping = tmp_path / "map.toml"
    mapping.write_text(
        f'convention = "openxr"\n[time]\ncolumn = "t"\nunit = "{unit}"\n[body]\nname = "b"\n'
        'position = ["x", "y", "z"]\nquaternion_xyzw = ["i", "j", "k", "w"]\n'
    )
    path = written(tmp_path, ["t,b,x,y,z,i,j,k,w", f"{cell},left,0,0,0,0,0,0,1"])
    assert import_session("csv", path, mapping=mapping).frames.stamp_ns.tolist() == [expected]


def test_meshes_of_a_gltf_of_unity_land_where_they_were_in_unity_and_shapes_of_a_scene_are_not_turned(tmp_path):
    """The glTF exporter flips X, the poses flip Z; both reverse the winding."""
    inside_unity = np.array([[1.0, 2.0, 3.0], [0.5, 0.0, 0.0], [0.0, 1.0, 0.0]])
    turn, place = Rotation.from_euler("zxy", [20, 130, -50], degrees=True), np.array([0.3, 1.1, -0.7])
    path = written(tmp_path, [HEADER, unity_row(0.0, "tool", place, turn.as_quat())])
    gltf = MeshData(inside_unity * [-1, 1, 1], [[0, 2, 1]])
    (tmp_path / "tool.glb").write_bytes(mesh_to_glb(gltf, "tool"))
    scene = parse_scene(
        '[[body]]\nid = "tool"\nmesh = "tool.glb"\nscale = 0.5\n[[body]]\nid = "box"\nshape = "box"\nsize = [1, 1, 1]\n'
    )
    box = import_session("csv", path, scene=scene, scene_folder=tmp_path).meshes["box"].vertices
    for scale, meshes in ((1.0, {"meshes": {"tool": gltf}}), (0.5, {"scene": scene, "scene_folder": tmp_path})):
        session = import_session("csv", path, mesh_axes="x-flipped", **meshes)
        pose, mesh = session.tracks["tool"], session.meshes["tool"]
        found = Rotation.from_quat(pose.quaternions_xyzw[0]).apply(mesh.vertices.copy()) + pose.positions[0]
        assert np.allclose(found, (turn.apply(scale * inside_unity) + place) * [1, 1, -1], atol=1e-6)
        assert mesh.faces.tolist() == [[0, 2, 1]] and "turned by 180 degrees" in session.facts["conversions"]
    assert np.array_equal(session.meshes["box"].vertices, box)


def test_a_column_of_numbers_taken_for_names_is_refused(tmp_path):
    rows = [unity_row(0.0, f"{k}", (0, 0, 0), (0, 0, 0, 1)) for k in range(1001)]
    path = written(tmp_path, [HEADER, *rows])
    refused("csv", path, r"column 'body' names 1,001 bodies; is it the column of names\?")


@pytest.mark.parametrize(("delimiter", "decimal"), [(";", "."), (";", ","), ("\t", ",")])
def test_the_script_of_unity_is_read_whatever_the_language_of_its_computer(tmp_path, delimiter, decimal):
    rows = [HEADER, *(unity_row(0.011 * k, "left", (0.25 * k, 1.5, 0), (0, 0, 0, 1)) for k in range(5))]
    expected = import_session("csv", written(tmp_path, rows)).tracks["left"]
    other = [row.replace(",", delimiter).replace(".", decimal) for row in rows]
    found = import_session("csv", written(tmp_path, other)).tracks["left"]
    assert found.times_ns.tolist() == expected.times_ns.tolist()
    np.testing.assert_array_equal(found.positions, expected.positions)


@pytest.mark.filterwarnings("error::pytest.PytestUnraisableExceptionWarning")
def test_a_ragged_row_that_is_no_utf_8_is_one_sentence_and_prints_no_traceback(tmp_path):
    rows = [unity_row(0.01 * k, "left", (0, 0, 0), (0, 0, 0, 1)) for k in range(500)]  # beyond a block of the header
    (tmp_path / "take.csv").write_bytes("\n".join([HEADER, *rows, "pose,\xff", rows[0], ""]).encode("latin-1"))
    refused("csv", tmp_path / "take.csv", r"no CSV text in UTF-8 .*; save it as UTF-8")


ROOT = Path(__file__).resolve().parents[3]

SCRIPT = (ROOT / "replay/guide/VrLabRecorder.cs").read_text("utf-8")


def templates():
    """The header and the kinds of lines as the script writes them."""
    kinds = ("pose,", "trigger,", "{kind},", "scalar,")
    (header,) = re.findall(r'WriteLine\("(kind,[^"]*)"\)', SCRIPT)
    lines = re.findall(r'Invariant\(\$"([^"]*)"\)', SCRIPT)
    return header, *(next(line for line in lines if line.startswith(start)) for start in kinds)


def filled(template, values):
    """One line: ``F6`` is six decimals, ``R`` of a float the shortest text that reads back the same."""

    def cell(match):
        expression, _, form = match.group(1).partition(":")
        value = values[expression]
        return f"{value:.6f}" if form == "F6" else str(np.float32(value)) if form == "R" else str(value)

    return re.sub(r"\{([^{}]*)\}", cell, template)


def pose_values(time, name, position, quaternion, tracked=1):
    parts = {f"p.{axis}": value for axis, value in zip("xyz", position, strict=True)}
    parts |= {f"q.{axis}": value for axis, value in zip("xyzw", quaternion, strict=True)}
    return {"Time.timeAsDouble": time, "Cell(body.name)": name, "Tracked(body)": tracked, **parts}


def test_a_session_that_the_script_writes_is_imported_as_it_was(tmp_path):
    header, pose, trigger, contact, scalar = templates()
    rng = np.random.default_rng(8)
    count = 40
    turns, places = Rotation.random(count, random_state=8), rng.normal(size=(count, 3)) * [1, 1, 1e-5]
    lines = [header]
    for k in range(count):
        time = k / 90
        lines.append(filled(pose, pose_values(time, "LeftHand", places[k], turns[k].as_quat(), int(k != 3))))
        lines.append(filled(trigger, {"Time.timeAsDouble": time, "hand": "left", "value": k / count}))
        lines.append(filled(scalar, {"Time.timeAsDouble": time, "Cell(name)": "heart rate", "value": 70 + k}))
        if k in (10, 20):
            kind = {10: "enter", 20: "exit"}[k]
            both = (("LeftHand", "Beaker"), ("Beaker", "LeftHand"))
            lines += [
                filled(contact, {"kind": kind, "Time.timeAsDouble": time, "Cell(body)": a, "Cell(other)": b})
                for a, b in both
            ]
    path = tmp_path / "session.csv"
    path.write_text("\r\n".join(lines) + "\r\n", encoding="utf-8")

    session = import_session("csv", path)
    assert session.names == ("LeftHand",) and session.facts["handedness"] == "left"
    assert "axes unity" in session.facts["conversions"]
    assert session.frames.stamp_ns.tolist() == [round(round(k / 90, 6) * 1e9) for k in range(count)]
    mirror = np.diag([1.0, 1.0, -1.0])
    assert np.allclose(session.frames.position[:, 0], places @ mirror, rtol=1e-7, atol=1e-12)
    got = Rotation.from_quat(session.frames.quaternion_xyzw[:, 0]).as_matrix()
    assert np.allclose(got, mirror @ turns.as_matrix() @ mirror, atol=1e-6)
    assert np.flatnonzero(~session.tracks["LeftHand"].valid).tolist() == [3]
    assert np.allclose(session.hands["student/left"].trigger, np.arange(count) / count)
    assert [(one.body_a, one.body_b, one.phase) for one in session.live_contacts] == [
        ("LeftHand", "Beaker", "enter"),
        ("LeftHand", "Beaker", "exit"),
    ]
    assert "left out" not in session.facts["conversions"]
    assert session.scalars["heart rate"].values.tolist() == [70.0 + k for k in range(count)]
    round_trips(session, tmp_path)


TAKE = [HEADER, *(f"pose,{0.011 * k:.6f},Cup{k % 2},{0.01 * k},1,0,0,0,0,1,1,," for k in range(60))]


@pytest.mark.parametrize("count", MUTANTS)
def test_mutants_end_in_a_session_or_one_sentence(tmp_path, count):
    (tmp_path / "take").mkdir()
    survive("csv", written(tmp_path / "take", TAKE), count, convention="unity")
