"""Files are written to OptiTrack's description of Motive's CSV, format versions 1.21 to 1.25."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.mutants import ledger_text
from support.second_opinions import has_poses

from sessions.errors import ImportFileError
from sessions.importers import import_session
from sessions.importers.ledger import ledger_of

FOLDER = Path(__file__).with_name("optitrack")
POSES = dict(zip(("Cup", "Left hand"), np.loadtxt(FOLDER / "poses.txt").reshape(2, 8, 7), strict=True))
STAMPS = [round(1e9 * round(k / 120, 6)) for k in range(8)]
UNITS = {
    "metres": "meters",
    "version-1.21": "meters",
    "millimetres-parents": "millimeters",
    "angles-xyz-centimetres": "centimeters",
    "angles-zyx-inches-timecode": "inches",
}
"""File of the folder -> the unit of its lengths."""


@pytest.mark.parametrize("file", UNITS)
def test_rigid_bodies_arrive_in_metres_at_take_times(file):
    """Five takes have the same eight poses of two bodies, at 120 Hz, in other units, rotations and versions.

    poses.txt has them in metres with quaternions; Motive's axes are glTF's, which sessions have too.
    """
    session = import_session("optitrack", FOLDER / f"{file}.csv")
    assert set(session.names) == set(POSES)
    for name, poses in POSES.items():
        assert has_poses(
            session.tracks[name],
            expected_positions=poses[:, :3],
            rotations=Rotation.from_quat(poses[:, 3:]),
            stamps=STAMPS,
        )


@pytest.mark.parametrize("file", UNITS)
def test_facts_of_a_take_come_from_its_header(file):
    """The header has the unit and the time of day; its axes are assumed, and said to be, as are those of angles."""
    facts = import_session("optitrack", FOLDER / f"{file}.csv").facts
    assert facts["source_units"] == UNITS[file]
    assert facts["handedness"] == "right"
    assert facts["clock"] == "seconds since the take began (2024-05-05 11.30.20.235 AM)"
    assert facts["assumed"].startswith("axes gltf (right-handed, +Y up)")
    assert ("Euler angles" in facts["assumed"]) == file.startswith("angles")


def test_frames_without_a_pose_are_lost(tmp_path):
    """Frames 3 and 4 of eight have a number and a time, and empty cells for both bodies."""
    lines = (FOLDER / "metres.csv").read_text("utf-8").splitlines()
    blank = [3, 4]
    for frame in blank:
        row = len(lines) - len(STAMPS) + frame
        number, time, *cells = lines[row].split(",")
        lines[row] = ",".join([number, time, *("" for _ in cells)])
    (tmp_path / "take.csv").write_text("\r\n".join([*lines, ""]), newline="")
    session = import_session("optitrack", tmp_path / "take.csv")
    assert np.flatnonzero(~session.tracks["Cup"].valid).tolist() == blank
    lost = f"Cup, Left hand: 2 of {len(STAMPS)} poses dropped: with a missing number"
    assert lost in ledger_of(session.facts).sentences()


def test_rows_that_are_too_short_are_dropped_and_counted(tmp_path):
    """Below eight whole rows a ninth ends after its time: it has too few cells."""
    take = (FOLDER / "metres.csv").read_text("utf-8").rstrip()
    too_short = "8,0.2"  # a frame and its time, without a pose
    (tmp_path / "take.csv").write_text(f"{take}\r\n{too_short}", newline="")
    session = import_session("optitrack", tmp_path / "take.csv")
    assert "1 of 9 rows dropped: with too few or too many cells" in ledger_text(session)


def write_take(path, bodies):
    """Writes four frames, 10 ms apart, of bodies (type, name, ID): the x of each is its number from 0, in metres."""
    columns_of_a_body = 7  # a quaternion and a position
    heads = [
        ["", heading, *(cell for body in bodies for cell in [body[row]] * columns_of_a_body)]
        for row, heading in enumerate(("Type", "Name", "ID"))
    ]
    heads += [["", "", *(["Rotation"] * 4 + ["Position"] * 3) * len(bodies)]]
    heads += [["Frame", "Time (Seconds)", *[*"XYZW", *"XYZ"] * len(bodies)]]
    rows = [[k, k / 100, *(cell for x in range(len(bodies)) for cell in (0, 0, 0, 1, x, 0, 0))] for k in range(4)]
    lines = ["Format Version,1.23,Rotation Type,Quaternion,Length Units,Meters,Coordinate Space,Global", ""]
    path.write_text("\n".join([*lines, *(",".join(map(str, row)) for row in (*heads, *rows)), ""]))
    return path


@pytest.mark.parametrize(
    ("bodies", "expected_names"),
    [
        pytest.param([("Rigid Body", "cup", "A"), ("Rigid Body", "cup", "B")], ["cup", "cup (2)"], id="two IDs"),
        pytest.param([("Rigid Body", "cup", "A"), ("Rigid Body", "cup", "A")], ["cup", "cup (2)"], id="one ID"),
        pytest.param(
            [("Rigid Body", "cup", "A"), ("Bone", "cup", "A"), ("Bone", "hand", "A")],
            ["cup", "cup (2)", "hand"],
            id="a bone",
        ),
        pytest.param(
            [("Bone", "cup", "A"), ("Bone", "cup", "B"), ("Bone", "cup", "C"), ("Bone", "cup (2)", "D")],
            ["cup", "cup (2)", "cup (3)", "cup (2) (2)"],
            id="a name that ends in a number",
        ),
    ],
)
def test_bodies_of_equal_name_are_numbered_and_kept(tmp_path, bodies, expected_names):
    """A take has ``bodies`` (type, name, ID), each at x = 0, 1, 2 ... m in the order of the file; none gets lost.

    The session's text on conversions says why a body has a number, and its ledger of losses is empty.
    """
    session = import_session("optitrack", write_take(tmp_path / "take.csv", bodies))
    assert list(session.names) == expected_names
    x_of_each_body = [track.positions[0, 0] for track in session.tracks.values()]
    assert x_of_each_body == list(range(len(bodies)))
    assert "another body of the name cup" in session.facts["conversions"]
    assert ledger_text(session) == ""


@pytest.mark.parametrize("line", [",Type", "Frame"])
def test_take_without_a_line_of_its_header_is_refused(tmp_path, line):
    """The line that names types of bodies is removed, or the line that names columns."""
    lines = (FOLDER / "metres.csv").read_text("utf-8").splitlines()
    (tmp_path / "take.csv").write_text("\n".join(text for text in lines if not text.startswith(line)))
    with pytest.raises(ImportFileError, match="no lines that begin with ',Type' and 'Frame' name the columns"):
        import_session("optitrack", tmp_path / "take.csv")


@pytest.mark.parametrize("line", [",,,", '""'])
def test_line_of_empty_cells_above_the_header_is_passed_over(tmp_path, line):
    """The second line is four empty cells, as a spreadsheet writes an empty line, or a quoted one, as Python does."""
    first, *others = (FOLDER / "metres.csv").read_text("utf-8").splitlines()
    (tmp_path / "take.csv").write_text("\n".join([first, line, *others]))
    assert {*import_session("optitrack", tmp_path / "take.csv").names} == {*POSES}
