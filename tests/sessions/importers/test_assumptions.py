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
    """Metres are guessed of poses that are up to ``farthest`` from the origin; rooms have 2 cm to 30 m."""
    guess = length_unit_assumption("m", farthest, "", ())
    assert (guess.value, guess.origin, guess.confidence) == ("m", Origin.GUESS, Confidence(confidence))


def test_stated_unit_of_lengths_is_sure():
    """A source states millimetres; it has no tracks, whose size would otherwise decide."""
    stated = SourceFrame.in_axes("openxr", "openxr", "mm", "clock")
    assert length_unit(stated, []).confidence is Confidence.SURE


def test_omitted_handedness_is_a_guess():
    """The user says where x and y point, and not z: whether the axes are right-handed is guessed."""
    frame = SourceFrame(axes=convention("x right, y up"), units="m", clock="clock", axes_origin=Origin.USER)
    rows = {row.subject: row for row in pose_assumptions(frame, [])}
    assert rows[Subject.HANDEDNESS].origin is Origin.GUESS
    assert rows[Subject.POSE_AXES].origin is Origin.USER


TAKE_OF_QUATERNIONS, TAKE_OF_ANGLES = TAKES / "metres.csv", TAKES / "angles-xyz-centimetres.csv"


@pytest.mark.parametrize("take", [TAKE_OF_QUATERNIONS, TAKE_OF_ANGLES], ids=lambda take: take.stem)
def test_unit_of_motive_is_stated_and_its_axes_are_sure(take):
    """The header of a take states its unit; its axes it does not state, but Motive's are always glTF's."""
    rows = assumptions_by_subject(import_session("optitrack", take))
    assert rows[Subject.LENGTH_UNIT].origin is Origin.FILE
    axes = rows[Subject.POSE_AXES]
    assert (axes.value, axes.origin, axes.confidence) == ("gltf", Origin.GUESS, Confidence.SURE)


def test_order_of_motives_quaternions_is_stated():
    """The header names a quaternion's columns X, Y, Z, W."""
    order = assumptions_by_subject(import_session("optitrack", TAKE_OF_QUATERNIONS))[Subject.QUATERNION_ORDER]
    assert (order.value, order.origin) == ("xyzw", Origin.FILE)


def test_order_of_motives_angles_is_stated_their_unit_not():
    """The header says Euler angles in the order X, Y, Z, and nothing of degrees."""
    rows = assumptions_by_subject(import_session("optitrack", TAKE_OF_ANGLES))
    order, unit = rows[Subject.EULER_ORDER], rows[Subject.ANGLE_UNIT]
    assert (order.value, order.origin) == ("XYZ", Origin.FILE)
    assert (unit.value, unit.origin) == ("deg", Origin.GUESS)


@pytest.mark.parametrize(
    "channels",
    [pytest.param(MOCAP_CHANNELS, id="position first"), pytest.param(MOCAP_CHANNELS[::-1], id="backwards")],
)
def test_stream_axes_are_open_and_channels_state_the_order(tmp_path, channels):
    """A stream of motion capture has a cup at (0.1, 0.2, 0.3) m without rotation; OrientationA is a quaternion's w.

    The order of its channels does not matter: their types say which is which. Nothing says the axes.
    """
    values = {"PositionX": 0.1, "PositionY": 0.2, "PositionZ": 0.3, "OrientationA": 1.0}
    described = [{"label": channel, "type": channel, "object": "cup", "unit": "m"} for channel in channels]
    rows = np.array([[values.get(channel, 0.0) for channel in channels]] * 3)
    path = xdf_file(
        tmp_path,
        stream_header(number=1, name="ROS", kind="MoCap", channels=described),
        samples(number=1, stamps=np.array([1.0, 1.1, 1.2]), rows=rows),
    )
    session = import_session("xdf", path)
    assert session.tracks["cup"].positions[0].tolist() == [0.1, 0.2, 0.3]
    assert session.tracks["cup"].quaternions_xyzw[0].tolist() == [0, 0, 0, 1]
    axes = assumptions_by_subject(session)[Subject.POSE_AXES]
    assert (axes.value, axes.origin, axes.confidence) == ("openxr", Origin.GUESS, Confidence.OPEN)


def write_resting_bodies(path, *names):
    """Writes Foxglove's transforms: each body once, at 1 s, a metre above the origin."""
    return write_transforms(path, [(name, 10**9, (0, 0, 1), (0, 0, 0, 1)) for name in names])


def test_axes_of_foxglove_transforms_are_an_open_guess(tmp_path):
    """Transforms are usually in axes of ROS, and nothing in the file says so: Unity's are possible too."""
    path = write_resting_bodies(tmp_path / "take.mcap", "cup")
    axes = assumptions_by_subject(import_session("mcap", path))[Subject.POSE_AXES]
    assert (axes.value, axes.confidence) == ("ros", Confidence.OPEN)
    assert "unity" in axes.alternatives


@pytest.mark.parametrize("beside", [("beaker",), ()], ids=["beside a beaker", "alone"])
def test_small_mesh_beside_others_in_centimetres_may_be_in_centimetres(tmp_path, beside):
    """A stopper's mesh is a box of 0.8 units, which may be metres or centimetres; a beaker's has 12, centimetres.

    Metres are guessed of the stopper, and both units stay possible, beside the beaker and alone.
    """
    for name, size in (("beaker", 12.0), ("stopper", 0.8)):
        trimesh.creation.box((size, size, size)).export(tmp_path / f"{name}.obj")
    path = write_resting_bodies(tmp_path / "take.mcap", "beaker", "stopper")
    meshes = {name: tmp_path / f"{name}.obj" for name in ("stopper", *beside)}
    rows = recording_assumptions(import_session("mcap", path, meshes=meshes))
    units = [row for row in rows if row.subject is Subject.MESH_UNIT]
    of_stopper = next(row for row in units if "stopper" in (row.bodies or ("stopper",)))
    assert (of_stopper.value, of_stopper.is_open, of_stopper.alternatives) == ("m", True, ("m", "cm"))


def track_of(positions):
    """A track of a body at these positions, 1 ns apart, that does not rotate and is never lost."""
    count = len(positions)
    return Track(np.arange(count), positions, np.tile([0.0, 0.0, 0.0, 1.0], (count, 1)), np.ones(count, dtype=bool))


@pytest.mark.parametrize("far", [1e3, 1e9, 1e160, 1.7e308])
def test_two_outliers_in_300_positions_do_not_enlarge_the_room(far):
    """298 positions are (0.5, 0.5, 0.5), which is the root of 0.75 from the origin, and two are very far."""
    positions = np.full((300, 3), 0.5)
    positions[[7, 250]] = far
    assert room_radius([track_of(positions)]) == pytest.approx(0.75**0.5)


def test_room_of_no_tracks_has_no_radius():
    """A recording without bodies has no position, and none that is far from the origin: 0 m."""
    assert room_radius([]) == 0.0


def test_room_radius_includes_many_far_positions():
    """A tenth of 300 positions is 1,500 m from the origin, the others are there: too many to be outliers."""
    positions = np.zeros((300, 3))
    positions[::10, 0] = 1500.0
    assert room_radius([track_of(positions)]) == 1500.0
