"""Files are written to OptiTrack's description of Motive's CSV, format versions 1.21 to 1.25."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.import_mutants import MUTANTS, survive
from support.true_poses import has_poses

from sessions.importers import import_session

COUNT = 24
RNG = np.random.default_rng(9)
NAMES = ("Cup", "Left hand")
PLACES = {name: RNG.normal(size=(COUNT, 3)).round(6) for name in NAMES}
TURNS = {name: Rotation.random(COUNT, random_state=seed) for seed, name in enumerate(NAMES)}
TIMES = [round(k / 120, 6) for k in range(COUNT)]
METRES = {"Meters": 1.0, "Millimeters": 0.001, "Centimeters": 0.01, "Inches": 0.0254}


def export(rotation="Quaternion", units="Meters", *, parent=False, timecode=False, lost=(), old=False):
    """The text of an export: two rigid bodies with their error, a marker of each, and an unlabelled one twice.

    Motive 1.21 (``old``) leaves the words Type, Name and ID out, and the unit of the time.
    """
    head = {
        "Format Version": "1.21" if old else "1.25" if parent else "1.23",
        "Take Name": "Take 1, cups", "Capture Frame Rate": "120.000000",
        "Capture Start Time": "2024-05-05 11.30.20.235 AM", "Total Frames in Take": str(COUNT),
        "Rotation Type": rotation, "Length Units": units, "Coordinate Space": "Global",
    }  # fmt: skip
    turns = "XYZW" if rotation == "Quaternion" else "XYZ"
    first = ["Frame", "Time" if old else "Time (Seconds)"] + ["TimeCode"] * timecode
    columns = []  # kind, name, id, what, axis, values
    for name in NAMES:
        turn = TURNS[name].as_quat() if rotation == "Quaternion" else TURNS[name].as_euler(rotation, degrees=True)
        letters = "XYZW" if rotation == "Quaternion" else rotation
        for axis in turns:
            columns.append(("Rigid Body", name, "A1", "Rotation", axis, turn[:, letters.index(axis)]))
        for at, axis in enumerate("XYZ"):
            columns.append(("Rigid Body", name, "A1", "Position", axis, PLACES[name][:, at] / METRES[units]))
        columns.append(("Rigid Body", name, "A1", "Mean Marker Error", "", np.full(COUNT, 0.0001)))
        for axis in "XYZ":
            columns.append(("Rigid Body Marker", f"{name}:Marker1", "B2", "Position", axis, np.ones(COUNT)))
    columns += [("Marker", "Unlabeled 1", "", "Position", axis, np.full(COUNT, np.nan)) for axis in "XYZXYZ"]
    pad = [""] * (len(first) - 2)
    quoted = [f'"{one[1]}"' for one in columns]
    lines = [",".join(f'{key},"{value}"' if "," in value else f"{key},{value}" for key, value in head.items()), ""]
    lines.append(",".join(["", "" if old else "Type", *pad, *(one[0] for one in columns)]))
    lines.append(",".join(["", "" if old else "Name", *pad, *quoted]))
    lines.append(",".join(["", "" if old else "ID", *pad, *(one[2] for one in columns)]))
    lines += [",".join(["", "Parent", *pad, *("" for _ in columns)])] if parent else []
    lines.append(",".join(["", "", *pad, *(one[3] for one in columns)]))
    lines.append(",".join([*first, *(one[4] for one in columns)]))
    for k in range(COUNT):
        cells = ["" if k in lost or np.isnan(one[5][k]) else repr(float(one[5][k])) for one in columns]
        lines.append(",".join([str(k), f"{TIMES[k]:.6f}", *(["11:30:20:12.00"] * timecode), *cells]))
    return "\r\n".join(lines) + "\r\n"


def written(tmp_path, text):
    path = tmp_path / "take.csv"
    path.write_text(text, encoding="utf-8", newline="")
    return path


@pytest.mark.parametrize(
    "kind",
    [
        {}, {"old": True}, {"units": "Millimeters", "parent": True}, {"rotation": "XYZ", "units": "Centimeters"},
        {"rotation": "ZYX", "timecode": True, "units": "Inches"},
    ],
)  # fmt: skip
def test_rigid_bodies_arrive_in_metres_on_the_clock_of_the_take(tmp_path, kind):
    session = import_session("optitrack", written(tmp_path, export(**kind)))
    assert set(session.names) == set(NAMES)
    for name in NAMES:
        stamps = [round(1e9 * time) for time in TIMES]
        assert has_poses(session.tracks[name], PLACES[name], TURNS[name], stamps=stamps)
    facts = session.facts
    assert facts["source_units"] == kind.get("units", "Meters").lower() and facts["handedness"] == "right"
    assert facts["clock"] == "seconds since the take began (2024-05-05 11.30.20.235 AM)"
    assert facts["assumed"].startswith("axes gltf (right-handed, +Y up)")
    assert ("Euler angles" in facts["assumed"]) == ("rotation" in kind)


@pytest.mark.parametrize("count", MUTANTS)
def test_mutants_end_in_a_session_or_one_sentence(tmp_path, count):
    survive("optitrack", written(tmp_path, export()), count)


def test_frames_without_numbers_are_lost_and_a_row_cut_short_is_left_out_and_counted(tmp_path):
    session = import_session("optitrack", written(tmp_path, export(lost=(3, 4)) + "24,0.2"))
    assert np.flatnonzero(~session.tracks["Cup"].valid).tolist() == [3, 4]
    assert "Cup, Left hand: 2 rows flagged as lost that hold no pose" in session.facts["conversions"]
    assert "1 rows left out" in session.facts["conversions"]
