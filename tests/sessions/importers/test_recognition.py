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
    "aframe": "samples/take.json",
    "csv": "samples/take.csv",
    "mcap": "samples/frames.mcap",
    "hands": "samples/joints.csv",
    "mjcf": "samples/lid.xml",
    "optitrack": "optitrack/metres.csv",
    "ros2": "samples/bag.mcap",
    "usd": "samples/lid.usda",
    "uxf": "uxf/S001",
    "xdf": "samples/take.xdf",
}
"""Importer -> a recording that it reads: a file, or UXF's folder."""
FILES_OF_FOLDER = {"uxf": ("trial_results.csv", "trackers/head_movement_T001.csv")}
"""Importer of a folder -> its files that are damaged, one in each case."""


@pytest.mark.parametrize("mutants", MUTANTS)
@pytest.mark.parametrize(
    ("importer", "damaged_file"),
    [(importer, file) for importer in IMPORTERS for file in FILES_OF_FOLDER.get(importer, [""])],
)
def test_samples_are_recognised_and_mutants_end_in_session_or_sentence(tmp_path, importer, damaged_file, mutants):
    """A copy of each importer's sample is recognised; the bag of ROS 2 is "mcap", as its first bytes are MCAP's.

    ``survive`` then imports so many ``mutants``, copies with random bytes changed, and fails where one gives neither
    a session nor one error in a sentence that names the file.
    """
    sample = HERE / SAMPLES[importer]
    source = tmp_path / sample.name
    if sample.is_dir():
        shutil.copytree(sample, source)
    else:
        shutil.copy(sample, source)
    if importer == "mjcf":
        pytest.importorskip("mujoco")
        source.with_suffix(".csv").write_text("time,hinge\n0,0\n0.1,1\n")  # the joint angles of the model
    if importer == "usd":
        pytest.importorskip("pxr")

    recognised, _reason = recognised_format(source)
    assert recognised == ("mcap" if importer == "ros2" else importer)
    survive(importer, source / damaged_file, count=mutants, source=source)


@pytest.mark.slow
def test_binary_mutants_of_usd_end_in_session_or_sentence(tmp_path):
    """Each of 20 damaged copies of a binary USD file gives a session or one error in a sentence that names the file.

    USD's library reads each in a process of its own, which may die of the copy; the importer may not.
    """
    pytest.importorskip("pxr")
    source = tmp_path / "lid.usdc"
    shutil.copy(HERE / "samples/lid.usdc", source)
    survive("usd", source, count=20, source=source)


def test_text_of_several_cells_is_recognised_as_csv(tmp_path):
    """The file is called take.txt; its first line, after a byte order mark, has three cells between semicolons."""
    (tmp_path / "take.txt").write_bytes(b"\xef\xbb\xbftime;x;y\r\n")
    recognised, reason = recognised_format(tmp_path / "take.txt")
    assert recognised == "csv"
    assert reason == "line 1 has 3 cells between ';'"


def test_seven_numbers_between_spaces_are_recognised_as_csv(tmp_path):
    """A place and a quaternion are seven numbers; a line of six numbers is of no known format."""
    (tmp_path / "take.txt").write_text("0.1 0.2 0.3 0 0 0 1\n")
    assert recognised_format(tmp_path / "take.txt") == ("csv", "line 1 has 7 numbers between spaces")
    (tmp_path / "take.txt").write_text("0.1 0.2 0.3 0 0 0\n")
    with pytest.raises(ImportFileError, match="nothing says what it is"):
        recognised_format(tmp_path / "take.txt")


def test_table_of_uxf_trials_is_recognised_by_its_name(tmp_path):
    """UXF always calls this file trial_results.csv; by its text it would be any CSV."""
    (tmp_path / "trial_results.csv").write_text("experiment,ppid\n")
    recognised, _reason = recognised_format(tmp_path / "trial_results.csv")
    assert recognised == "uxf"


def test_folder_without_files_of_uxf_is_refused(tmp_path):
    """Only recordings of UXF are folders; this folder has another CSV alone, and is no CSV file itself."""
    (tmp_path / "notes.csv").write_text("time,pos_x\n")
    with pytest.raises(ImportFileError, match="is a folder, but not one of UXF; name a file"):
        import_session("auto", tmp_path)
    with pytest.raises(ImportFileError, match="does not exist or is no file"):
        import_session("csv", tmp_path)


@pytest.fixture
def uxf_folder(tmp_path):
    """A folder with one tracker file and one table of trials of UXF, each in a folder of its own."""
    (tmp_path / "trackers").mkdir()
    (tmp_path / "trackers" / "hand_movement_T001.csv").write_text("time,pos_x\n")
    (tmp_path / "trials").mkdir()
    (tmp_path / "trials" / "trial_results.csv").write_text("experiment,ppid\n")
    return tmp_path


def test_uxf_folder_is_recognised_by_tracker_and_trial_files(uxf_folder):
    """A tracker file (OBJECT_movement_T001.csv) or trial_results.csv anywhere below a folder makes it one of UXF."""
    for folder in (uxf_folder, uxf_folder / "trackers", uxf_folder / "trials"):
        recognised, _reason = recognised_format(folder)
        assert recognised == "uxf"


def test_single_tracker_file_of_uxf_asks_for_its_folder(uxf_folder):
    """The file holds one object of one trial; the session is the whole folder."""
    with pytest.raises(ImportFileError, match="is one file of a UXF session; name the session's folder"):
        import_session("auto", uxf_folder / "trackers" / "hand_movement_T001.csv")


@pytest.mark.parametrize(
    "first_bytes",
    [pytest.param(b"#ROSBAG V2.0\n", id="ROS 1"), pytest.param(b"SQLite format 3\x00", id="ROS 2 in SQLite")],
)
def test_other_bags_are_refused_with_the_converting_command(tmp_path, first_bytes):
    """Only bags in MCAP files are read. These two are known by their first bytes; zeros stand for the rest."""
    (tmp_path / "x.bag").write_bytes(first_bytes + bytes(100))
    with pytest.raises(ImportFileError, match=r"bags? of ROS .*rosbags-convert --src BAG .* --dst-storage mcap"):
        recognised_format(tmp_path / "x.bag")


def test_folder_of_ros_2_bag_asks_for_its_mcap_file(tmp_path):
    """A metadata.yaml makes a folder a bag of ROS 2."""
    (tmp_path / "metadata.yaml").write_text("rosbag2_bagfile_information:\n")
    with pytest.raises(ImportFileError, match=r"bag of ROS 2: name the .mcap file in it"):
        recognised_format(tmp_path)


@pytest.mark.parametrize("importer", ["csv", "auto"])
@pytest.mark.parametrize(
    ("first_bytes", "text"),
    [
        pytest.param(
            b"PK\x03\x04" + bytes(200), "a workbook of a spreadsheet, or another archive; unpack it", id="zip"
        ),
        pytest.param(b"PAR1" + bytes(200), "a Parquet file; write its table as CSV", id="Parquet"),
        pytest.param(b"version https://git-lfs.github.com/spec/v1\noid sha256:0\n", "git lfs pull", id="Git LFS"),
    ],
)
def test_files_that_are_no_text_are_named(tmp_path, importer, first_bytes, text):
    """A file called log.csv begins like one of another kind: the error says which, and what to do."""
    (tmp_path / "log.csv").write_bytes(first_bytes)
    with pytest.raises(ImportFileError, match=text):
        import_session(importer, tmp_path / "log.csv")


@pytest.mark.parametrize(
    ("prefix", "is_hands"),
    [
        pytest.param("", True, id="x y z"),
        pytest.param("pos", True, id="position"),
        pytest.param("q", False, id="quaternion"),
        pytest.param("v", False, id="velocity"),
    ],
)
def test_joints_make_hands_by_their_positions_alone(tmp_path, prefix, is_hands):
    """A CSV has three columns for each joint of a left hand, such as left_wrist_posx, and one row of zeros.

    Only where the letters before the axis mean a position is it a recording of hands, with a reason.
    """
    columns = [f"left_{joint.replace(' ', '_')}_{prefix}{axis}" for joint in JOINTS for axis in "xyz"]
    header, zeros = ["time", *columns], ["0"] * (len(columns) + 1)
    (tmp_path / "take.csv").write_text("\n".join([",".join(header), ",".join(zeros)]))
    reason = joints_in(tmp_path / "take.csv")
    assert reason == ("its columns are called like joints of a hand" if is_hands else "")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('{"time": 0, "pose": [1, 2]}\n{"time": 1, "pose": [1, 2]}\n', "it is JSON Lines, an object a line; write its"),
        ('[{"time": 0, "pose": [1, 2]}]', "it is JSON, but no A-Frame motion capture; write its poses as CSV"),
        ('{"time": [0, 1], "pose": {"x": [1, 2]}}', "this is no A-Frame motion capture; write its poses as CSV"),
    ],
    ids=["lines", "list", "columns"],
)
def test_json_of_another_shape_is_named_with_a_cure(tmp_path, text, words):
    """JSON that is no recording by A-Frame: an object for each row, a list of rows, and an object of columns."""
    (tmp_path / "log.json").write_text(text)
    with pytest.raises(ImportFileError, match=words):
        import_session("auto", tmp_path / "log.json")
