from pathlib import Path

import numpy as np
import pytest
import trimesh
from support.session_files import samples, stream_header, write_transforms, xdf_file

from sessions.importers import import_session
from sessions.importers.importing import SourceFrame, length_unit, pose_assumptions
from sessions.importers.unstated_units import length_unit_assumption, room_radius
from sessions.meshes.conventions import convention
from sessions.model.assumption import Confidence, Origin, Subject
from sessions.model.session import Track
from sessions.scene_files.answers import recording_assumptions

TAKES = Path(__file__).with_name("optitrack")
MOCAP_CHANNELS = ("PositionX", "PositionY", "PositionZ", "OrientationB", "OrientationC", "OrientationD", "OrientationA")


def assumptions_by_subject(session):
    """Subject -> assumption of a session."""
    return {row.subject: row for row in recording_assumptions(session)}


@pytest.mark.parametrize(
    ("farthest", "confidence"), [(0.0, "open"), (0.019, "open"), (0.02, "sure"), (30.0, "sure"), (31.0, "open")]
)
def test_guessed_unit_is_open_for_implausible_room_size(farthest, confidence):
    """``farthest``: how far from the origin poses are, in the guessed metres; rooms have 2 cm to 30 m.

    A stated unit is sure.
    """
    row = length_unit_assumption("m", farthest, "", ())
    assert (row.value, row.origin, row.confidence) == ("m", Origin.GUESS, Confidence(confidence))
    stated = SourceFrame.in_axes("openxr", "openxr", "mm", "clock")
    assert length_unit(stated, []).confidence is Confidence.SURE


def test_omitted_handedness_is_a_guess():
    """The user says where x and y point, and not z."""
    frame = SourceFrame(convention("x right, y up"), "m", "clock", axes_origin=Origin.USER)
    rows = {row.subject: row for row in pose_assumptions(frame, [])}
    assert rows[Subject.HANDEDNESS].origin is Origin.GUESS and rows[Subject.POSE_AXES].origin is Origin.USER


@pytest.mark.parametrize("kind", ["metres", "angles-xyz-centimetres"])
def test_motive_states_unit_and_order_with_sure_axes(kind):
    """A take's header states its unit and its kind of rotation: quaternions, or Euler angles in the order X, Y, Z."""
    rows = assumptions_by_subject(import_session("optitrack", TAKES / f"{kind}.csv"))
    assert rows[Subject.LENGTH_UNIT].origin is Origin.FILE
    axes = rows[Subject.POSE_AXES]
    assert (axes.value, axes.origin, axes.confidence) == ("gltf", Origin.GUESS, Confidence.SURE)
    if kind == "metres":
        assert (rows[Subject.QUATERNION_ORDER].value, rows[Subject.QUATERNION_ORDER].origin) == ("xyzw", Origin.FILE)
    else:
        assert (rows[Subject.EULER_ORDER].value, rows[Subject.EULER_ORDER].origin) == ("XYZ", Origin.FILE)
        assert (rows[Subject.ANGLE_UNIT].value, rows[Subject.ANGLE_UNIT].origin) == ("deg", Origin.GUESS)


@pytest.mark.parametrize(("pieces", "name"), [(MOCAP_CHANNELS, "ROS"), (tuple(reversed(MOCAP_CHANNELS)), "ROS")])
def test_stream_axes_are_open_and_channels_state_the_order(tmp_path, pieces, name):
    """The order of channels does not matter: their types say which is which."""
    values = {"PositionX": 0.1, "PositionY": 0.2, "PositionZ": 0.3, "OrientationA": 1.0}
    described = [{"label": piece, "type": piece, "object": "cup", "unit": "m"} for piece in pieces]
    rows = np.array([[values.get(piece, 0.0) for piece in pieces]] * 3)
    path = xdf_file(
        tmp_path,
        stream_header(number=1, name=name, kind="MoCap", channels=described),
        samples(number=1, stamps=np.array([1.0, 1.1, 1.2]), rows=rows),
    )
    session = import_session("xdf", path)
    assert session.tracks["cup"].positions[0].tolist() == [0.1, 0.2, 0.3]
    assert session.tracks["cup"].quaternions_xyzw[0].tolist() == [0, 0, 0, 1]
    axes = assumptions_by_subject(session)[Subject.POSE_AXES]
    assert (axes.value, axes.origin, axes.confidence) == ("openxr", Origin.GUESS, Confidence.OPEN)


def test_axes_of_foxglove_transforms_are_an_open_guess(tmp_path):
    """Transforms are usually in axes of ROS, and nothing in the file says so."""
    write_transforms(tmp_path / "take.mcap", [("cup", 10**9, (0, 0, 1), (0, 0, 0, 1))])
    axes = assumptions_by_subject(import_session("mcap", tmp_path / "take.mcap"))[Subject.POSE_AXES]
    assert (axes.value, axes.confidence) == ("ros", Confidence.OPEN) and "unity" in axes.alternatives


def test_small_mesh_beside_others_in_centimetres_may_be_in_centimetres(tmp_path):
    """0.8 units pass for metres by their size alone; the file beside it is in centimetres."""
    for name, size in (("beaker", 12.0), ("stopper", 0.8)):
        trimesh.creation.box((size, size, size)).export(tmp_path / f"{name}.obj")
    rows = [(name, 10**9, (0, 0, 1), (0, 0, 0, 1)) for name in ("beaker", "stopper")]
    write_transforms(tmp_path / "take.mcap", rows)
    meshes = {name: tmp_path / f"{name}.obj" for name in ("beaker", "stopper")}
    units = [
        row
        for row in recording_assumptions(import_session("mcap", tmp_path / "take.mcap", meshes=meshes))
        if row.subject is Subject.MESH_UNIT
    ]
    of_stopper = next(row for row in units if row.bodies == ("stopper",))
    assert (of_stopper.value, of_stopper.is_open, of_stopper.alternatives) == ("m", True, ("m", "cm"))
    alone = import_session("mcap", tmp_path / "take.mcap", meshes={"stopper": meshes["stopper"]})
    assert assumptions_by_subject(alone)[Subject.MESH_UNIT].alternatives == ("m", "cm")


@pytest.mark.parametrize("far", [1e3, 1e9, 1e160, 1.7e308])
def test_two_outliers_in_300_positions_do_not_enlarge_the_room(far):
    """All other positions are (0.5, 0.5, 0.5), which is the root of 0.75 from the origin."""
    positions = np.full((300, 3), 0.5)
    positions[[7, 250]] = far
    times, upright = np.arange(300), np.tile([0.0, 0.0, 0.0, 1.0], (300, 1))
    track = Track(times, positions, upright, np.ones(300, dtype=bool))
    assert room_radius([track]) == pytest.approx(0.75**0.5)
    assert room_radius([]) == 0.0


def test_room_radius_includes_many_far_positions():
    """A tenth of the positions is 1,500 m away: too many to be outliers."""
    positions = np.full((300, 3), 0.0)
    positions[::10, 0] = 1500.0
    track = Track(np.arange(300), positions, np.tile([0.0, 0.0, 0.0, 1.0], (300, 1)), np.ones(300, dtype=bool))
    assert room_radius([track]) == 1500.0
