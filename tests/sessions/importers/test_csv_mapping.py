import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.import_mutants import refused

from sessions.importers import import_session


def test_empty_cells_are_lost_short_rows_are_counted_and_a_bad_cell_is_named_with_its_line(tmp_path):
    path = tmp_path / "t.csv"
    head = "kind,time,body,px,py,pz,qx,qy,qz,qw,tracked"
    lines = [head, "pose,0,cup,1,2,3,0,0,0,1,1", "", "pose,1,cup", "pose,2,cup,1,nan, 3 ,0,0,0,1,1"]
    path.write_text("\n".join([*lines, ""]))
    session = import_session("csv", path)
    assert session.tracks["cup"].valid.tolist() == [True, False] and session.tracks["cup"].positions[1, 2] == -3
    assert "1 rows left out" in session.facts["conversions"]
    path.write_text("\n".join([*lines, "pose,3,cup,1,2,x,0,0,0,1,1", ""]))
    refused("csv", path, "line 6, column 'pz': 'x' is no number")


EULER = """
convention = "openvr"
skip_lines = 2
header_lines = 2
[time]
column = "t s"
unit = "s"
[bodies.cup]
position = ["cup x", "cup y", "cup z"]
euler = {x = "cup rx", y = "cup ry", z = "cup rz"}
order = "%s"
"""


@pytest.mark.parametrize("order", ["XYZ", "ZXY", "yzx"])
def test_angles_are_bound_to_axes_by_name_whatever_their_order_in_the_file(tmp_path, order):
    (tmp_path / "m.toml").write_text(EULER % order)
    lines = ["a lab", "", "t,cup,cup,cup,cup,cup,cup", "s,x,y,z,ry,rz,rx", "0,1,2,3,20,30,10", "0.5,1,2,3,20,30,10"]
    (tmp_path / "take.csv").write_text("\n".join([*lines, ""]))
    session = import_session("csv", tmp_path / "take.csv", mapping=tmp_path / "m.toml")
    angles = {"x": 10, "y": 20, "z": 30}
    expected = Rotation.from_euler(order, [angles[axis] for axis in order.lower()], degrees=True).as_matrix()
    got = Rotation.from_quat(session.frames.quaternion_xyzw[:, 0]).as_matrix()
    assert np.abs(got - expected).max() < 1e-12
    assert session.frames.stamp_ns.tolist() == [0, 500_000_000]


def test_matrices_row_by_row_become_quaternions_and_what_is_no_rotation_is_lost(tmp_path):
    names = [f"m{row}{column}" for row in range(3) for column in range(3)]
    (tmp_path / "m.toml").write_text(
        'convention = "openvr"\n[time]\ncolumn = "t"\nunit = "s"\n[bodies.cup]\nposition = ["x", "x", "x"]\n'
        f"matrix = {names}\n"
    )
    turns = Rotation.random(20, random_state=4).as_matrix()
    turns[3] *= 1.01
    turns[5] = np.diag([1, 1, -1])
    lines = [f"{k},0," + ",".join(map(repr, turn.ravel().tolist())) for k, turn in enumerate(turns)]
    lines.append("20,0," + ",".join([""] * 9))
    (tmp_path / "take.csv").write_text("\n".join(["t,x," + ",".join(names), *lines, ""]))
    track = import_session("csv", tmp_path / "take.csv", mapping=tmp_path / "m.toml").tracks["cup"]
    assert np.flatnonzero(~track.valid).tolist() == [3, 5, 20]
    got = Rotation.from_quat(track.quaternions_xyzw[track.valid]).as_matrix()
    assert np.abs(got - turns[track.valid[:20]]).max() < 1e-9
