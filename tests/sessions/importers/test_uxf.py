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
    """The rows of an object over both trials: time in s, x, y, z in m, and angles about x, y, z in degrees, (16, 7)."""
    files = (WRITTEN / "trackers" / f"{name}_movement_T00{trial}.csv" for trial in (1, 2))
    return np.concatenate([np.loadtxt(file, delimiter=",", skiprows=1) for file in files])


@pytest.fixture
def uxf_folder(tmp_path):
    """A copy of a folder that UXF wrote: head, controller and mouse, in eight rows of each of two trials."""
    return Path(shutil.copytree(WRITTEN, tmp_path / "S001"))


def test_objects_arrive_from_unitys_euler_angles_over_all_trials(uxf_folder):
    """UXF writes positions and angles as Unity has them: z the other way, angles applied about z, then x, then y.

    All rows of both trials are read.
    """
    session = import_session("uxf", uxf_folder)
    assert set(session.names) == {"controller", "head"}
    for name in session.names:
        seconds, x, y, z, about_x, about_y, about_z = movement_rows(name).T
        rotations = Rotation.from_euler("zxy", np.column_stack([about_z, about_x, about_y]), degrees=True)
        track = session.tracks[name]
        assert has_poses(track, np.column_stack([x, y, z]), rotations, axes=UNITY, stamps=np.rint(1e9 * seconds)), name


def test_facts_of_a_uxf_session_name_folder_axes_and_clock(uxf_folder):
    """Axes are Unity's, times are Unity's Time.time; that lengths are in metres is an assumption, and said to be."""
    facts = import_session("uxf", uxf_folder).facts
    assert facts["source_file"] == "S001"
    assert facts["source_convention"] == "unity"
    assert facts["handedness"] == "left"
    assert "Time.time" in facts["clock"]
    assert "lengths in m" in facts["assumed"]


def test_trials_that_ended_are_intervals_with_their_results(uxf_folder):
    """Trial 1 of trial_results.csv lasts from 4.1 to 5.25 s and has a score of 7, trial 2 has none.

    Trial 3 has no times, trial 4 ends before it starts: both are dropped.
    """
    session = import_session("uxf", uxf_folder)
    first, second = session.intervals
    assert (first.start_ns, first.end_ns) == (4_100_000_000, 5_250_000_000)
    assert (first.kind, first.name) == ("task", "trial 1")
    assert first.data["score"] == "7"
    assert first.data["ppid"] == "p01"
    assert second.name == "trial 2"
    assert "score" not in second.data
    assert "2 of 4 trials dropped: that did not end" in ledger_text(session)


def test_trials_without_numbers_are_counted_in_their_order(uxf_folder):
    """trial_results.csv has no column trial_num: its first two trials, those that ended, are numbered as they stand."""
    path = uxf_folder / "trial_results.csv"
    path.write_text(path.read_text().replace("trial_num", "attempt"))
    assert [interval.name for interval in import_session("uxf", uxf_folder).intervals] == ["trial 1", "trial 2"]


def test_other_columns_of_trackers_are_scalars_over_all_trials(uxf_folder):
    """The head's files of both trials have two more columns, "pupil" of numbers and "state" of words.

    Numbers are a scalar, words are none. The folder's mouse has two numbers and no pose.
    """
    for trial in (1, 2):
        path = uxf_folder / "trackers" / f"head_movement_T00{trial}.csv"
        header, *lines = path.read_text().splitlines()
        rows = [f"{line},{trial}.{k:02d},word" for k, line in enumerate(lines)]
        path.write_text("\n".join([f"{header},pupil,state", *rows, ""]))
    session = import_session("uxf", uxf_folder)
    assert set(session.names) == {"controller", "head"}
    assert set(session.scalars) == {"head/pupil", "mouse_screen/x", "mouse_screen/y"}
    pupil = session.scalars["head/pupil"]
    assert pupil.values.tolist() == [float(f"{trial}.{k:02d}") for trial in (1, 2) for k in range(COUNT)]
    assert pupil.times_ns.tolist() == session.tracks["head"].times_ns.tolist()


def test_scalar_sample_that_goes_back_in_time_is_dropped(uxf_folder):
    """A heart belt, a tracker without a pose, has 71 at 4.2 s, then 70 at 4.1 s, and an empty cell at 4.3 s.

    Either of the first two may stay; the first is dropped. An empty cell is nan.
    """
    (uxf_folder / "trackers" / "heart_belt_T001.csv").write_text("time,bpm\n4.2,71\n4.1,70\n4.3,\n")
    session = import_session("uxf", uxf_folder)
    belt = session.scalars["heart_belt/bpm"]
    assert belt.times_ns.tolist() == [4_100_000_000, 4_300_000_000]
    np.testing.assert_array_equal(belt.values, [70, np.nan])
    assert "scalar heart_belt/bpm: 1 of 3 samples dropped: with a stamp out of order" in ledger_text(session)


HEAD = "trackers/head_movement_T001.csv"
NO_TRACKER = "no file OBJECT_movement_T001.csv with columns pos_x, pos_y, pos_z; name the session's folder"


def remove_poses(folder):
    """Take all poses out of a folder."""
    for path in folder.glob("trackers/*_movement_*.csv"):
        path.unlink()


def replace_in_file(old, new, file=HEAD):
    """A change of a folder: other bytes in a file, by default the head's of the first trial."""
    return lambda folder: (folder / file).write_bytes((folder / file).read_bytes().replace(old, new, 1))


def add_second_session(folder):
    """Write a second session into a folder."""
    (folder / "S002").mkdir()
    (folder / "S002" / "head_movement_T001.csv").write_bytes((folder / HEAD).read_bytes())


@pytest.mark.parametrize(
    ("change", "text"),
    [
        pytest.param(add_second_session, "several sessions are in it; name the folder of one", id="a second session"),
        pytest.param(remove_poses, NO_TRACKER, id="no poses"),
        pytest.param(
            replace_in_file(b"rot_z", b"rz"), r"head_movement_T001.csv: line 1: no column 'rot_z'", id="no angle z"
        ),
        pytest.param(
            replace_in_file(b"end_time", b"end", file="trial_results.csv"),
            "trial_results.csv: line 1: no column 'end_time'",
            id="no ends of trials",
        ),
    ],
)
def test_broken_folder_is_refused_in_a_sentence(uxf_folder, change, text):
    """``change`` breaks a good folder; the error names the folder, or the file and its line."""
    change(uxf_folder)
    assert_import_refused("uxf", uxf_folder, text)


@pytest.mark.parametrize(
    "data", [pytest.param(b"", id="empty"), pytest.param("time,pos_x\n".encode("utf-16"), id="UTF-16")]
)
def test_uxf_tracker_file_without_known_columns_is_reported(uxf_folder, data):
    """The head's file of trial 1 is of no use; its poses in trial 2 are read, eight rows."""
    (uxf_folder / HEAD).write_bytes(data)
    session = import_session("uxf", uxf_folder)
    text = "head_movement_T001.csv: 1 of 1 files dropped: whose first line does not name time"
    assert text in ledger_text(session)
    assert len(session.tracks["head"]) == COUNT


def test_row_that_ends_without_line_break_is_lost_pose(uxf_folder):
    """The head's second file lacks its last character, which may be a digit: the last of 16 poses is lost."""
    path = uxf_folder / "trackers" / "head_movement_T002.csv"
    text = path.read_text().rstrip("\n")
    path.write_text(text[:-1])
    session = import_session("uxf", uxf_folder)
    assert session.tracks["head"].valid.tolist() == [True] * (2 * COUNT - 1) + [False]
    assert (
        f"{path.name}: the last line has no line break and may be cut short: its pose is flagged as lost"
        in session.facts["conversions"]
    )


def test_row_that_lacks_its_last_cell_is_dropped(uxf_folder):
    """The head's second file ends before the last comma of its eighth row: that row has too few cells."""
    path = uxf_folder / "trackers" / "head_movement_T002.csv"
    text = path.read_text()
    path.write_text(text[: text.rindex(",")])
    session = import_session("uxf", uxf_folder)
    assert "head_movement_T002.csv: 1 of 8 rows dropped: with too few" in ledger_text(session)
    assert len(session.tracks["head"]) == 2 * COUNT - 1


def test_tracker_with_four_rotations_writes_quaternions(uxf_folder):
    """The head's files have quaternions in columns rot_x to rot_w, of the rotations that the angles describe.

    They are poses, and rot_w is no scalar.
    """
    _seconds, x, y, z, about_x, about_y, about_z = movement_rows("head").T
    rotations = Rotation.from_euler("zxy", np.column_stack([about_z, about_x, about_y]), degrees=True)
    for trial in (1, 2):
        path = uxf_folder / "trackers" / f"head_movement_T00{trial}.csv"
        time_and_position = np.loadtxt(path, delimiter=",", skiprows=1)[:, :4]
        quaternions = rotations[(trial - 1) * COUNT : trial * COUNT].as_quat()
        header = "time,pos_x,pos_y,pos_z,rot_x,rot_y,rot_z,rot_w"
        rows = np.column_stack([time_and_position, quaternions])
        np.savetxt(path, rows, delimiter=",", header=header, comments="", fmt="%.17g")
    session = import_session("uxf", uxf_folder)
    assert has_poses(session.tracks["head"], np.column_stack([x, y, z]), rotations, axes=UNITY)
    assert not [name for name in session.scalars if "rot_w" in name]


def write_angles_in_radians(folder):
    """Writes the angles of all trackers, columns 4 to 6, in radians."""
    for path in folder.glob("trackers/*_movement_*.csv"):
        header, *lines = path.read_text().splitlines()
        rows = [line.split(",") for line in lines]
        for row in rows:
            row[4:7] = [str(np.radians(float(angle))) for angle in row[4:7]]
        path.write_text("\n".join([header, *map(",".join, rows), ""]))


@pytest.mark.parametrize(("in_radians", "origin"), [(False, "the format"), (True, "guessed, not sure")])
def test_angles_of_trackers_that_would_fit_radians_are_a_doubt(uxf_folder, in_radians, origin):
    """UXF's format says degrees, of which some angles here are too large for radians.

    Written in radians no angle is too large to be either: that they are degrees is then a guess.
    """
    if in_radians:
        write_angles_in_radians(uxf_folder)
    session = import_session("uxf", uxf_folder)
    (unit,) = (row for row in assumptions_of(session.facts) if row.subject is Subject.ANGLE_UNIT)
    assert unit.sentence.startswith(f"deg; {origin}")
