import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sessions.errors import SessionError
from sessions.meshes.conventions import CONVENTIONS, convention, quaternion_from_euler, same_euler_order

AS_IS = ((1, 2, 3), (1, 2, 3, 4), "right")
TABLE = {
    "canonical": AS_IS, "openvr": AS_IS, "openxr": AS_IS, "webxr": AS_IS, "aframe": AS_IS, "gltf": AS_IS,
    "godot": AS_IS, "unity": ((1, 2, -3), (-1, -2, 3, 4), "left"), "unreal": ((2, 3, -1), (-2, -3, 1, 4), "left"),
    "ros": ((-2, 3, -1), (-2, 3, -1, 4), "right"), "z-up": ((1, 3, -2), (1, 3, -2, 4), "right"),
}  # fmt: skip
"""Point (1, 2, 3) and quaternion (1, 2, 3, 4) of each source in the canonical frame, written out by hand."""

TEXTS = {
    "x forward, y up": ("right", "x", "y"),
    "+X forward, +Y left, +Z up": ("right", "x", "z"),
    "z up, left-handed": ("left", None, "z"),
    "forward=+X up=+Z left handed": ("left", "x", "z"),
    "up: y; forward: -z": ("right", "-z", "y"),
    "x right, z up, y back": ("left", "-y", "z"),
    "LH y-up z-forward": ("left", "z", "y"),
    "x up": ("right", None, "x"),
}
"""Axes as text -> handedness, and the source axis that points forward and up."""


def axis(name):
    """The unit vector of "x", "-z" and so on."""
    return np.eye(3)["xyz".index(name[-1])] * (-1 if name[0] == "-" else 1)


def test_conventions_convert_points_and_quaternions_as_tabled():
    """TABLE has by hand, for each engine's axes, where (1, 2, 3) and a quaternion (1, 2, 3, 4) end up, and the hand."""
    assert CONVENTIONS.keys() == TABLE.keys()
    for name, (point, quaternion, side) in TABLE.items():
        assert CONVENTIONS[name].points([1, 2, 3]).tolist() == list(point), name
        assert CONVENTIONS[name].quaternions([1, 2, 3, 4]).tolist() == list(quaternion), name
        assert CONVENTIONS[name].handedness == side, name
        assert np.array_equal(CONVENTIONS[name].matrix @ [1, 2, 3], point), name


def test_a_rotated_point_is_the_same_in_both_frames():
    """A random point is rotated in a source's axes and then converted, or converted and then rotated.

    Numbers of a quaternion make the same matrix in left-handed axes; only its picture is mirrored.
    """
    point, rotation = np.random.default_rng(3).standard_normal(3), Rotation.random(random_state=5)
    for name in [*CONVENTIONS, *TEXTS]:
        source = convention(name)
        rotated_then_converted = source.points(rotation.apply(point))
        converted_rotation = Rotation.from_quat(source.quaternions(rotation.as_quat()))
        converted_then_rotated = converted_rotation.apply(source.points(point))
        assert rotated_then_converted == pytest.approx(converted_then_rotated, rel=0, abs=1e-12), name


def test_axes_as_text_point_in_the_stated_directions():
    """The axis that a text calls up becomes +Y of a session, and the axis it calls forward, if any, becomes -Z.

    TEXTS says of "LH y-up z-forward": left-handed, z is forward, y is up; of "x up" it says no axis that is forward.
    """
    for text, (handedness, forward, up) in TEXTS.items():
        described = convention(text)
        assert described.handedness == handedness, text
        assert described.points(axis(up)).tolist() == [0, 1, 0], text
        assert forward is None or described.points(axis(forward)).tolist() == [0, 0, -1], text


def test_name_of_described_axes_describes_them_whole():
    """Axes that a text describes have a name, which is such a text too: it gives the same axes and assumes nothing."""
    for text in TEXTS:
        described = convention(text)
        by_name = convention(described.name)
        assert np.array_equal(by_name.matrix, described.matrix), text
        assert not by_name.assumed_handedness, text


def test_handedness_is_assumed_only_where_two_axes_are_named():
    """Nothing is assumed where the third axis or the handedness itself is named too."""
    assert convention("x forward, y up").assumed_handedness
    assert not convention("x forward, y up, left-handed").assumed_handedness
    assert not convention("x forward, y up, z right").assumed_handedness


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("unitty", "did you mean 'unity'"),
        ("x forward", "which axis is up"),
        ("y up, y forward", "twice"),
        ("x up, y up", "twice"),
        ("x right, y up, z forward, right-handed", "are not right-handed"),
        ("sideways", "there are: canonical"),
    ],
)
def test_unknown_axes_are_refused_with_the_cure(text, message):
    """A name is misspelt, an axis is lacking or named twice, or three axes are left-handed that should not be."""
    with pytest.raises(SessionError, match=message):
        convention(text)


def test_convention_names_ignore_case_hyphens_and_underscores():
    """The names of the table are "aframe" and "z-up"."""
    assert convention("A-Frame").name == "aframe"
    assert convention("Z_UP").name == "z-up"


@pytest.mark.parametrize(
    ("extrinsic", "intrinsic", "another"),
    [("zxy", "YXZ", "ZXY"), ("xyz", "ZYX", "XYZ"), ("xyx", "XYX", "YXY")],
)
def test_extrinsic_euler_order_equals_its_reversed_intrinsic_order(extrinsic, intrinsic, another):
    """Lower case letters are rotations about fixed axes, capitals about the body's axes, as in SciPy.

    In ``another`` order of the body's axes the same angles give another rotation.
    """
    angles = np.array([0.3, -1.1, 2.0])
    assert same_euler_order(extrinsic, intrinsic)
    assert not same_euler_order(extrinsic, another)
    about_fixed_axes = quaternion_from_euler(angles, extrinsic)
    about_own_axes = quaternion_from_euler(angles[::-1], intrinsic)
    assert np.allclose(about_fixed_axes, about_own_axes, rtol=0, atol=1e-15)


@pytest.mark.parametrize("order", ["", "xy", "xyzx", "xYz", "abc", "xxy", "XYY"])
def test_euler_order_that_names_no_three_axes_is_refused(order):
    """An order has too few or too many letters, letters of both cases, other letters, or an axis twice in a row."""
    with pytest.raises(SessionError, match=f"no Euler order '{order}'"):
        quaternion_from_euler(np.zeros(3), order)
