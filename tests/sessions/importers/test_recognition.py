import pytest

from sessions.errors import ImportFileError
from sessions.importers import IMPORTERS, import_session
from sessions.importers.recognition import recognised

FILES = {
    "aframe": ("m.json", b' {"left": {}}'),
    "csv": ("take.txt", b"\xef\xbb\xbftime;x;y\r\n"),
    "mcap": ("a.mcap", b"\x89MCAP0\r\n\x01" + bytes(30)),
    "optitrack": ("take.csv", b"Format Version,1.23,Take Name,a\n"),
    "uxf": ("trial_results.csv", b"experiment,ppid\n"),
    "xdf": ("a.xdf", b"XDF:\x01"),
}


@pytest.mark.parametrize("name", [name for name in IMPORTERS if name != "ros2"])  # one reader with mcap
def test_every_format_is_known_by_its_first_bytes(tmp_path, name):
    file, data = FILES[name]
    (tmp_path / file).write_bytes(data)
    assert recognised(tmp_path / file)[0] == name


def test_a_folder_of_uxf_is_known_by_its_files_and_any_other_refused(tmp_path):
    with pytest.raises(ImportFileError, match="is a folder, but none of UXF; name a file"):
        import_session("auto", tmp_path)
    (tmp_path / "trackers").mkdir()
    (tmp_path / "trackers" / "hand_movement_T001.csv").write_text("time,pos_x\n")
    assert recognised(tmp_path)[0] == "uxf"
    with pytest.raises(ImportFileError, match="is one file of a UXF session; name the session's folder"):
        import_session("auto", tmp_path / "trackers" / "hand_movement_T001.csv")


@pytest.mark.parametrize("start", [b"#ROSBAG V2.0\n", b"SQLite format 3\x00"])
def test_a_bag_that_is_no_mcap_file_is_refused_with_the_command_that_makes_one(tmp_path, start):
    (tmp_path / "x.bag").write_bytes(start + bytes(100))
    with pytest.raises(ImportFileError, match=r"bags? of ROS .*rosbags-convert --src BAG .* --dst-storage mcap"):
        recognised(tmp_path / "x.bag")
    (tmp_path / "metadata.yaml").write_text("rosbag2_bagfile_information:\n")
    with pytest.raises(ImportFileError, match=r"bag of ROS 2: name the .mcap file in it"):
        recognised(tmp_path)
