"""The eye looks across a gap, and the overview sees everything from the user's side."""

from dataclasses import dataclass
from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest

from cdcore import Motion
from replay.show import camera
from sessions import Scene


def test_gap_is_viewed_sideways_from_the_users_side():
    """A gap of 2 cm in some horizontal direction, so many radians from X; the user stands at +Z.

    From the gap to the eye: upwards by over 0.3 of the way, at over 36.8 degrees (cosine 0.8) to the line of the gap,
    and less than 17.5 degrees (sine 0.3) behind the gap as the user sees it.
    """
    to_user = np.array([0.0, 0.0, 1.0])
    for radians in np.linspace(0.0, 6.0, 7):
        along_gap = np.array([np.cos(radians), 0.0, np.sin(radians)])
        to_eye = camera.viewing_direction(0.02 * along_gap, to_user)
        assert np.linalg.norm(to_eye) == pytest.approx(1.0), radians
        _x, up, _z = to_eye
        assert up > 0.3, radians
        assert abs(to_eye @ along_gap) < 0.8, radians
        assert to_eye @ to_user > -0.3, radians


def test_gap_without_a_direction_is_viewed_as_the_user_does():
    """A gap of no width; the user stands at +Z, and the eye within 26 degrees (cosine 0.9) of there."""
    to_user = np.array([0.0, 0.0, 1.0])
    assert camera.viewing_direction(np.zeros(3), to_user) @ to_user > 0.9


def assembly_with(head, *, posed=True):
    """Frames 0 to 2 of a cup at the origin and a headset, which is 9 m away until it comes to ``head`` in frame 2."""
    frames = 3
    translations = np.zeros((frames, 2, 3))
    translations[:, 1] = [0.0, 0.0, -9.0]
    translations[-1, 1] = head
    valid = np.tile([True, posed], (frames, 1))
    motion = Motion(np.arange(frames), translations, np.tile(np.eye(3), (frames, 2, 1, 1)), valid)
    return SimpleNamespace(bodies=[SimpleNamespace(name="cup"), SimpleNamespace(name="headset")], motion=motion)


def test_user_is_in_the_horizontal_direction_of_the_headset():
    """``head``: of the headset in frame 2; the direction is from the point x = 1, z = 2 to it, without its height.

    +Z where the headset has no pose, or is less than 5 cm beside the point.
    """
    rows = {
        "3 m and -4 m away": ((4.0, 1.7, -2.0), True, (0.6, 0.0, -0.8)),
        "above, within 5 cm": ((1.02, 1.7, 2.04), True, (0.0, 0.0, 1.0)),
        "above, 5.7 cm aside": ((1.04, 1.7, 2.04), True, (0.5**0.5, 0.0, 0.5**0.5)),
        "no pose": ((4.0, 1.7, -2.0), False, (0.0, 0.0, 1.0)),
    }
    for row, (head, posed, direction) in rows.items():
        point = (1.0, 0.3, 2.0)
        towards = camera.towards_user(assembly_with(head, posed=posed), Scene(), 2, point)
        assert towards == pytest.approx(np.array(direction)), row


POINTS = np.array([[-0.2, 0.7, -0.1], [0.9, 0.8, 0.2], [0.1, 1.3, 0.4], [0.4, 0.9, -0.6]])


@dataclass(frozen=True)
class OverviewOfPoints:
    """``POINTS`` as the eye of an overview sees them.

    ``back``: from the target to the eye; ``x``, ``y``: fractions of half the picture, 1 is its rim; ``across``: metres
    right, up and back from the target.
    """

    back: np.ndarray
    x: np.ndarray
    y: np.ndarray
    across: np.ndarray


def overview_of_points(user, aspect):
    """The overview of ``POINTS`` for a user 5 m away in this horizontal direction (x, z)."""
    user_x, user_z = user
    assembly = assembly_with(POINTS.mean(axis=0) + 5.0 * np.array([user_x, 0.1, user_z]))
    eye = camera.overview(assembly, Scene(), POINTS, frame=99, aspect=aspect)  # beyond the last frame, 2
    back = np.subtract(eye.position, eye.target)
    back /= np.linalg.norm(back)
    right = np.array([back[2], 0.0, -back[0]]) / np.hypot(back[0], back[2])
    up = np.cross(back, right)
    offsets = POINTS - eye.position
    half_height = np.tan(np.radians(OPENING_DEG / 2)) * -(offsets @ back)
    return OverviewOfPoints(
        back=back,
        x=offsets @ right / (half_height * aspect),
        y=offsets @ up / half_height,
        across=(POINTS - eye.target) @ np.stack([right, up, back], axis=1),
    )


OPENING_DEG = 55.0
"""Of the eye of a viewer, from the lower rim to the upper one."""

USERS_AND_ASPECTS = [*product([(0.0, 1.0), (0.6, 0.8), (-0.8, -0.6)], [0.3, 1.5])]
"""Horizontal directions (x, z) of the user, and the width of a narrow or wide picture over its height."""


def test_overview_is_14_degrees_aside_and_22_above_the_user():
    """The user is 5 m from the middle of four points, in the horizontal direction (x, z) from there.

    ``back`` is the direction from the points to the eye; angles are degrees about the upright axis, and upwards.
    """
    for user, aspect in USERS_AND_ASPECTS:
        back = overview_of_points(user, aspect).back
        degrees_aside = np.degrees(np.arctan2(back[0], back[2]) - np.arctan2(*user)) % 360.0
        degrees_up = np.degrees(np.arcsin(back[1]))
        assert (degrees_aside, degrees_up) == pytest.approx((14.0, 22.0)), (user, aspect)


def test_overview_sees_all_points_as_large_as_its_margin_allows():
    """The outermost of four points is at 1/1.12 of the way from the middle of the picture to its rim."""
    for user, aspect in USERS_AND_ASPECTS:
        overview = overview_of_points(user, aspect)
        farthest = max(np.abs(overview.x).max(), np.abs(overview.y).max())
        assert farthest == pytest.approx(1 / 1.12), (user, aspect)


def test_overview_is_aimed_at_the_middle_of_all_points():
    """The box of four points, along the axes of the eye, reaches as far to one side of the target as to the other."""
    for user, aspect in USERS_AND_ASPECTS:
        across = overview_of_points(user, aspect).across
        assert across.min(axis=0) == pytest.approx(-across.max(axis=0)), (user, aspect)


def test_overview_without_points_sees_all_bodies():
    """The cup stays at the origin, the headset comes from z = -9 m: the overview is that of these positions."""
    assembly = assembly_with(head=(0.0, 1.7, 1.0))
    positions = assembly.motion.translations.reshape(-1, 3)
    no_points = np.zeros((0, 3))
    assert camera.overview(assembly, Scene(), no_points, 2) == camera.overview(assembly, Scene(), positions, 2)


def test_overview_without_any_pose_sees_the_origin_from_20_cm():
    """A recording without bodies, and no points to see."""
    no_body = SimpleNamespace(bodies=[], motion=Motion([0.0], np.zeros((1, 0, 3)), np.zeros((1, 0, 3, 3))))
    eye = camera.overview(no_body, Scene(), np.zeros((0, 3)), 0)
    assert eye.target == (0.0, 0.0, 0.0)
    assert np.linalg.norm(eye.position) == pytest.approx(0.2)
