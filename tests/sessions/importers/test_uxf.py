"""Folders are written as UXF 2 lays them out; Unity's Euler angles are read again with SciPy."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.mutants import assert_import_refused, ledger_text
from support.second_opinions import UNITY, has_poses

from sessions.importers import import_session
from sessions.model.assumption import Subject, assumptions_of

WRITTEN = Path(__file__).with_name("uxf") / "S001"
COUNT = 8


def movement_rows(name):
    """Time, place and angles of an object, over both trials."""
    files = (WRITTEN / "trackers" / f"{name}_movement_T00{trial}.csv" for trial in (1, 2))
    return np.concatenate([np.loadtxt(file, delimiter=",", skiprows=1) for file in files])


@pytest.fixture
def uxf_folder(tmp_path):
    """A copy of a folder that UXF wrote."""
    return Path(shutil.copytree(WRITTEN, tmp_path / "S001"))


def test_objects_arrive_from_unitys_euler_angles_over_all_trials(uxf_folder):
    """Columns: time, three of position, three angles, applied as z, x, y."""
    session = import_session("uxf", uxf_folder)
    assert set(session.names) == {"controller", "head"}
    for name in session.names:
        table = movement_rows(name)
        rotations, stamps = Rotation.from_euler("zxy", table[:, [6, 4, 5]], degrees=True), np.rint(1e9 * table[:, 0])
        assert has_poses(session.tracks[name], table[:, 1:4], rotations, UNITY, stamps)
    facts = session.facts
    assert (facts["source_convention"], facts["handedness"], facts["source_file"]) == ("unity", "left", "S001")
    assert "Time.time" in facts["clock"] and "lengths in m" in facts["assumed"]


def test_trials_that_ended_are_intervals_with_their_results(uxf_folder):
    """The first trial lasts from 4.1 to 5.25 s and has a score of 7, the second has none; others did not end."""
    first, second = import_session("uxf", uxf_folder).intervals
    assert (first.start_ns, first.end_ns, first.kind, first.name) == (4_100_000_000, 5_250_000_000, "task", "trial 1")
    assert first.data["score"] == "7" and first.data["ppid"] == "p01"
    assert "score" not in second.data and second.name == "trial 2"
    assert "trials dropped: that did not end" in ledger_text(import_session("uxf", uxf_folder))


def test_trials_without_numbers_are_counted_in_their_order(uxf_folder):
    """The column trial_num is renamed."""
    path = uxf_folder / "trial_results.csv"
    path.write_text(path.read_text().replace("trial_num", "attempt"))
    assert [interval.name for interval in import_session("uxf", uxf_folder).intervals] == ["trial 1", "trial 2"]


def test_other_columns_of_trackers_are_scalars_over_all_trials(uxf_folder):
    """Columns "pupil" of numbers and "state" of words are added to the head's; a heart belt has a file without a pose.

    The belt's second sample goes back in time, so that one of its three is dropped; an empty cell is nan.
    """
    for trial in (1, 2):
        path = uxf_folder / "trackers" / f"head_movement_T00{trial}.csv"
        lines = path.read_text().splitlines()
        rows = [f"{line},{trial}.{k:02d},word" for k, line in enumerate(lines[1:])]
        path.write_text("\n".join([f"{lines[0]},pupil,state", *rows, ""]))
    (uxf_folder / "trackers" / "heart_belt_T001.csv").write_text("time,bpm\n4.2,71\n4.1,70\n4.3,\n")
    session = import_session("uxf", uxf_folder)
    assert set(session.names) == {"controller", "head"}
    assert {"head/pupil", "heart_belt/bpm", "mouse_screen/x", "mouse_screen/y"} == set(session.scalars)
    pupil = session.scalars["head/pupil"]
    assert pupil.values.tolist() == [float(f"{trial}.{k:02d}") for trial in (1, 2) for k in range(COUNT)]
    assert pupil.times_ns.tolist() == session.tracks["head"].times_ns.tolist()
    np.testing.assert_array_equal(session.scalars["heart_belt/bpm"].values, [70, np.nan])
    assert "scalar heart_belt/bpm: 1 of 3 samples dropped: with a stamp out of order" in ledger_text(session)


HEAD = "trackers/head_movement_T001.csv"
NO_TRACKER = "no file OBJECT_movement_T001.csv with columns pos_x, pos_y, pos_z; name the session's folder"


def without_poses(folder):
    """Take all poses out of a folder."""
    for path in folder.glob("trackers/*_movement_*.csv"):
        path.unlink()


def replace_in_file(old, new, file=HEAD):
    """A change of a folder: other bytes in a file."""
    return lambda folder: (folder / file).write_bytes((folder / file).read_bytes().replace(old, new, 1))


def add_second_session(folder):
    """Write a second session into a folder."""
    (folder / "S002").mkdir()
    (folder / "S002" / "head_movement_T001.csv").write_bytes((folder / HEAD).read_bytes())


BROKEN = [
    (add_second_session, "several sessions are in it; name the folder of one"),
    (without_poses, NO_TRACKER),
    (replace_in_file(b"rot_z", b"rz"), r"head_movement_T001.csv: line 1: no column 'rot_z'"),
    (replace_in_file(b"end_time", b"end", "trial_results.csv"), "trial_results.csv: line 1: no column 'end_time'"),
]


@pytest.mark.parametrize(("change", "text"), BROKEN, ids=map(str, range(len(BROKEN))))
def test_broken_folder_is_refused_in_a_sentence(uxf_folder, change, text):
    """A row of BROKEN: a change of the folder, and words of the refusal."""
    change(uxf_folder)
    assert_import_refused("uxf", uxf_folder, text)


@pytest.mark.parametrize("data", [b"", "time,pos_x\n".encode("utf-16")])
def test_uxf_tracker_file_without_known_columns_is_reported(uxf_folder, data):
    """The head's file of the first trial is empty, or in UTF-16; the poses of the second trial, COUNT, are read."""
    (uxf_folder / HEAD).write_bytes(data)
    session = import_session("uxf", uxf_folder)
    text = "head_movement_T001.csv: 1 of 1 files dropped: whose first line does not name time"
    assert text in ledger_text(session) and len(session.tracks["head"]) == COUNT


def test_torn_last_line_costs_a_single_row(uxf_folder):
    """The head's second file loses its last letter, which may be a digit, and then its last cell."""
    path = uxf_folder / "trackers" / "head_movement_T002.csv"
    text = path.read_text().rstrip("\n")
    path.write_text(text[:-1])
    session = import_session("uxf", uxf_folder)
    assert session.tracks["head"].valid.tolist() == [True] * (2 * COUNT - 1) + [False]
    assert (
        f"{path.name}: the last line has no line break and may be cut short: its pose is flagged as lost"
        in session.facts["conversions"]
    )
    path.write_text(text[: text.rindex(",")])
    assert "head_movement_T002.csv: 1 of 8 rows dropped: with too few" in ledger_text(import_session("uxf", uxf_folder))


def test_tracker_with_four_rotations_writes_quaternions(uxf_folder):
    """The same rotations written as rot_x to rot_w: they are poses and no scalars."""
    expected = {}
    for trial in (1, 2):
        path = uxf_folder / "trackers" / f"head_movement_T00{trial}.csv"
        table = np.loadtxt(path, delimiter=",", skiprows=1)
        rotations = Rotation.from_euler("zxy", table[:, [6, 4, 5]], degrees=True)
        expected[trial] = rotations
        header = "time,pos_x,pos_y,pos_z,rot_x,rot_y,rot_z,rot_w"
        written = np.column_stack([table[:, :4], rotations.as_quat()])
        np.savetxt(path, written, delimiter=",", header=header, comments="", fmt="%.17g")
    session = import_session("uxf", uxf_folder)
    assert has_poses(
        session.tracks["head"], movement_rows("head")[:, 1:4], Rotation.concatenate([*expected.values()]), UNITY
    )
    assert not any("rot_w" in name for name in session.scalars)


def test_angles_of_trackers_that_would_fit_radians_are_a_doubt(uxf_folder):
    """All angles are written in radians, and then none is too large to be either."""
    whole = import_session("uxf", uxf_folder)
    for path in (uxf_folder / "trackers").glob("*_movement_*.csv"):
        head, *lines = path.read_text().splitlines()
        cells = [line.split(",") for line in lines]
        small = [
            ",".join([*row[:4], *(str(np.radians(float(angle))) for angle in row[4:7]), *row[7:]]) for row in cells
        ]
        path.write_text("\n".join([head, *small, ""]))
    for session, text in ((whole, "deg; the format"), (import_session("uxf", uxf_folder), "deg; guessed, not sure")):
        (unit,) = (row for row in assumptions_of(session.facts) if row.subject is Subject.ANGLE_UNIT)
        assert unit.sentence.startswith(text)
