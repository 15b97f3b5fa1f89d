import numpy as np
import pytest

from sessions import MeshData, Track
from sessions.errors import ImportFileError
from sessions.importers.finish import Samples, finished, proxy_for, side_of, usable_track
from sessions.scene_files.scene_toml import parse_scene

TRIANGLE = MeshData([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])


def samples(*names):
    track = Track([0, 10], np.zeros((2, 3)), np.tile([0, 0, 0, 1.0], (2, 1)))
    return Samples(dict.fromkeys(names, track), ("done",))


def test_a_stamp_that_goes_back_costs_its_row_and_those_it_overtakes(tmp_path):
    stamps = np.array([0, 10, 5, 7, 10, 11])
    track, dropped, flagged = usable_track(stamps, np.zeros((6, 3)), np.tile([0, 0, 0, 1.0], (6, 1)), np.ones(6, bool))
    assert track.times_ns.tolist() == [0, 10, 11]
    assert (dropped, flagged) == (3, 0)


def test_rows_without_a_rotation_are_flagged_and_keep_their_numbers():
    turn = np.array([[0, 0, 0, 1.0], [0, 0, 0, 0], [0, 0, 0, 1.1], [np.nan, 0, 0, 1], [0, 0, 0, 1.0005]])
    track, dropped, flagged = usable_track(np.arange(5), np.zeros((5, 3)), turn, np.ones(5, bool))
    assert track.valid.tolist() == [True, False, False, False, True]
    assert track.quaternions_xyzw[2].tolist() == [0, 0, 0, 1.1]
    assert (dropped, flagged) == (0, 3)


def test_given_meshes_win_over_the_scene_and_proxies_can_be_asked_for(tmp_path):
    scene = parse_scene('[[body]]\nid = "left"\nshape = "sphere"\nradius = 0.1\n')
    session = finished(samples("left", "camera"), tmp_path / "x", meshes={"left": TRIANGLE}, scene=scene, proxies=True)
    assert len(session.meshes["left"].faces) == 1
    assert session.scene.body("camera").proxy
    assert not session.scene.body("left").proxy
    assert parse_scene(session.scene.text).body("camera").proxy


@pytest.mark.parametrize(
    ("name", "row"),
    [
        ("camera", "proxy_headset"),
        ("Main Camera", "proxy_headset"),
        ("HMD", "proxy_headset"),
        ("leftHand", "proxy_wand"),
        ("XRController_2", "proxy_wand"),
        ("RIGHT", "proxy_wand"),
        ("bright-lamp", ""),
        ("handle", ""),
        ("overhead", ""),
    ],
)
def test_a_stand_in_is_chosen_by_whole_words_of_the_name(name, row):
    assert proxy_for(name) == row


def test_the_side_of_a_hand_is_a_word_of_its_name():
    assert [side_of(name) for name in ("leftHand", "Lefthand", "tool_Right", "bright", "w1")] == [
        "left", "left", "right", "bright", "w1",
    ]  # fmt: skip


def test_a_recording_without_poses_is_refused(tmp_path):
    with pytest.raises(ImportFileError, match="there is no pose in it"):
        finished(Samples({}, ()), tmp_path / "x")
