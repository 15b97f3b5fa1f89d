"""Every importer has a sample here: it is recognised, it survives a session file, and so does each mutant of it."""

import shutil
from pathlib import Path

import pytest
from support.mutants import MUTANTS, survive

from sessions.errors import ImportFileError
from sessions.importers import IMPORTERS, import_session
from sessions.importers.hands.joint_names import JOINTS
from sessions.importers.recognition import joints_in, recognised_format

HERE = Path(__file__).parent
SAMPLES = {
    "aframe": ["samples/take.json"],
    "csv": ["samples/take.csv"],
    "mcap": ["samples/frames.mcap"],
    "hands": ["samples/joints.csv"],
    "mjcf": ["samples/lid.xml"],
    "optitrack": ["optitrack/metres.csv"],
    "ros2": ["samples/bag.mcap"],
    "usd": ["samples/lid.usda"],
    "uxf": ["uxf/S001/trial_results.csv", "uxf/S001/trackers/head_movement_T001.csv"],
    "xdf": ["samples/take.xdf"],
}


@pytest.mark.parametrize("count", MUTANTS)
@pytest.mark.parametrize(("name", "file"), [(name, file) for name in IMPORTERS for file in SAMPLES[name]])
def test_samples_are_recognised_and_mutants_end_in_session_or_sentence(tmp_path, name, file, count):
    """``survive`` imports so many mutants of the sample; each must become a session or one clear error."""
    source = tmp_path / file.split("/")[1]
    sample = HERE / file.split("/")[0] / source.name
    (shutil.copytree if sample.is_dir() else shutil.copy)(sample, source)
    if name == "mjcf":
        pytest.importorskip("mujoco")
        source.with_suffix(".csv").write_text("time,hinge\n0,0\n0.1,1\n")
    if name == "usd":
        pytest.importorskip("pxr")
    assert recognised_format(source)[0] == ("mcap" if name == "ros2" else name)
    survive(name, source if source.is_file() else source / file.split("/", 2)[2], count, source)


@pytest.mark.slow
def test_binary_mutants_of_usd_end_in_session_or_sentence(tmp_path):
    """20 mutants of a binary USD file; each is tried in a process of its own, which may die."""
    pytest.importorskip("pxr")
    source = tmp_path / "lid.usdc"
    shutil.copy(HERE / "samples/lid.usdc", source)
    # Each starts a process of its own, which may die of the mutant.
    survive("usd", source, count=20, source=source)


@pytest.mark.parametrize(
    ("file", "data", "known"),
    [("take.txt", b"\xef\xbb\xbftime;x;y\r\n", "csv"), ("trial_results.csv", b"experiment,ppid\n", "uxf")],
)
def test_some_are_known_by_their_first_line_or_name(tmp_path, file, data, known):
    """A text of three cells in its first line is a CSV, whatever its name; UXF's files have names of their own."""
    (tmp_path / file).write_bytes(data)
    name, why = recognised_format(tmp_path / file)
    assert name == known and ("3 cells" in why or known != "csv")


def test_uxf_folder_is_recognised_by_tracker_and_trial_files(tmp_path):
    """A folder with another CSV is none of UXF's.

    With files of a tracker and of trials it is, and so are their folders.
    """
    (tmp_path / "notes.csv").write_text("time,pos_x\n")
    with pytest.raises(ImportFileError, match="is a folder, but not one of UXF; name a file"):
        import_session("auto", tmp_path)
    with pytest.raises(ImportFileError, match="does not exist or is no file"):
        import_session("csv", tmp_path)
    (tmp_path / "trackers").mkdir()
    (tmp_path / "trackers" / "hand_movement_T001.csv").write_text("time,pos_x\n")
    (tmp_path / "trials").mkdir()
    (tmp_path / "trials" / "trial_results.csv").write_text("experiment,ppid\n")
    assert {recognised_format(folder)[0] for folder in (tmp_path, tmp_path / "trackers", tmp_path / "trials")} == {
        "uxf"
    }
    with pytest.raises(ImportFileError, match="is one file of a UXF session; name the session's folder"):
        import_session("auto", tmp_path / "trackers" / "hand_movement_T001.csv")


@pytest.mark.parametrize("start", [b"#ROSBAG V2.0\n", b"SQLite format 3\x00"])
def test_other_bags_are_refused_with_the_converting_command(tmp_path, start):
    """Bags of ROS 1 and of ROS 2 in SQLite, and then the folder of a bag of ROS 2."""
    (tmp_path / "x.bag").write_bytes(start + bytes(100))
    with pytest.raises(ImportFileError, match=r"bags? of ROS .*rosbags-convert --src BAG .* --dst-storage mcap"):
        recognised_format(tmp_path / "x.bag")
    (tmp_path / "metadata.yaml").write_text("rosbag2_bagfile_information:\n")
    with pytest.raises(ImportFileError, match=r"bag of ROS 2: name the .mcap file in it"):
        recognised_format(tmp_path)


@pytest.mark.parametrize("kind", ["csv", "auto"])
@pytest.mark.parametrize(
    ("start", "text"),
    [
        (
            b"PK\x03\x04" + bytes(200),
            "a workbook of a spreadsheet, or another archive; unpack it",
        ),
        (b"PAR1" + bytes(200), "a Parquet file; write its table as CSV"),
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:0\n", "git lfs pull"),
    ],
)
def test_files_that_are_no_text_are_named(tmp_path, kind, start, text):
    """``start``: the first bytes of a file that is called log.csv."""
    (tmp_path / "log.csv").write_bytes(start)
    with pytest.raises(ImportFileError, match=text):
        import_session(kind, tmp_path / "log.csv")


@pytest.mark.parametrize(("kind", "expected"), [("", True), ("pos", True), ("q", False), ("v", False)])
def test_joints_make_hands_by_their_positions_alone(tmp_path, kind, expected):
    """``kind`` stands before the axis: of a position, a quaternion, a velocity."""
    columns = [f"left_{joint.replace(' ', '_')}_{kind}{axis}" for joint in JOINTS for axis in "xyz"]
    (tmp_path / "take.csv").write_text("\n".join([",".join(["time", *columns]), ",".join(["0"] * (len(columns) + 1))]))
    assert (joints_in(tmp_path / "take.csv") != "") == expected
