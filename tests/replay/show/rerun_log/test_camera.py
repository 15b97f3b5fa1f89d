"""The eye looks across a gap, and the overview sees everything from the user's side."""

from types import SimpleNamespace

import numpy as np
import pytest

from cdcore import Motion
from replay.show import camera
from sessions import Scene


@pytest.mark.parametrize("rotation", np.linspace(0.0, 6.0, 7))
def test_gap_is_viewed_sideways_from_the_users_side(rotation):
    """A gap of 2 cm in some direction; the camera looks down a little, across the gap, from where the user stands."""
    along, user = np.array([np.cos(rotation), 0.0, np.sin(rotation)]), np.array([0.0, 0.0, 1.0])
    away = camera.viewing_direction(0.02 * along, user)
    assert np.linalg.norm(away) == pytest.approx(1.0) and away[1] > 0.3
    assert abs(away @ along) < 0.8 and away @ user > -0.3
    assert camera.viewing_direction(np.zeros(3), user) @ user > 0.9


def assembly_with(head, *, posed=True, frames=3):
    """A cup at the origin and a headset that is 9 m away until it comes to ``head`` in the last frame."""
    translations = np.zeros((frames, 2, 3))
    translations[:, 1] = [0.0, 0.0, -9.0]
    translations[-1, 1] = head
    valid = np.tile([True, posed], (frames, 1))
    motion = Motion(np.arange(frames), translations, np.tile(np.eye(3), (frames, 2, 1, 1)), valid)
    return SimpleNamespace(bodies=[SimpleNamespace(name="cup"), SimpleNamespace(name="headset")], motion=motion)


@pytest.mark.parametrize(
    ("head", "posed", "direction"),
    [
        ((4.0, 1.7, -2.0), True, (0.6, 0.0, -0.8)),
        ((1.02, 1.7, 2.04), True, (0.0, 0.0, 1.0)),
        ((1.04, 1.7, 2.04), True, (np.sqrt(0.5), 0.0, np.sqrt(0.5))),
        ((4.0, 1.7, -2.0), False, (0.0, 0.0, 1.0)),
    ],
    ids=["away", "within 5 cm", "beyond 5 cm", "no pose"],
)
def test_user_is_in_the_horizontal_direction_of_the_headset(head, posed, direction):
    """From a point at x = 1, z = 2; +Z where the headset has no pose or is above the point."""
    towards = camera.towards_user(assembly_with(head, posed=posed), Scene(), 2, (1.0, 0.3, 2.0))
    assert towards == pytest.approx(np.array(direction))


POINTS = np.array([[-0.2, 0.7, -0.1], [0.9, 0.8, 0.2], [0.1, 1.3, 0.4], [0.4, 0.9, -0.6]])


@pytest.mark.parametrize("aspect", [0.3, 1.5])
@pytest.mark.parametrize("user", [(0.0, 1.0), (0.6, 0.8), (-0.8, -0.6)])
def test_overview_sees_all_points_as_large_as_its_margin_allows(user, aspect):
    """14 degrees aside of the user and 22 above; the outermost point is at 1/1.12 of the way to the rim."""
    centre = POINTS.mean(axis=0)
    assembly = assembly_with(centre + 5.0 * np.array([user[0], 0.1, user[1]]))
    eye = camera.overview(assembly, Scene(), POINTS, frame=99, aspect=aspect)  # frames end at 2
    back = np.subtract(eye.position, eye.target)
    back /= np.linalg.norm(back)
    aside = np.degrees(np.arctan2(back[0], back[2]) - np.arctan2(*user)) % 360.0
    assert (aside, np.degrees(np.arcsin(back[1]))) == pytest.approx((14.0, 22.0))
    right = np.array([back[2], 0.0, -back[0]]) / np.hypot(back[0], back[2])
    offsets = POINTS - eye.position
    half_height = np.tan(np.radians(55.0 / 2)) * -(offsets @ back)
    x, y = offsets @ right / (half_height * aspect), offsets @ np.cross(back, right) / half_height
    assert max(np.abs(x).max(), np.abs(y).max()) == pytest.approx(1 / 1.12)
    across = (POINTS - eye.target) @ np.stack([right, np.cross(back, right), back], axis=1)
    assert across.min(axis=0) == pytest.approx(-across.max(axis=0))


def test_overview_without_points_sees_all_bodies():
    """The cup stays at the origin and the headset comes from -9 m; without any pose the origin is seen from 20 cm."""
    assembly = assembly_with((0.0, 1.7, 1.0))
    points = assembly.motion.translations.reshape(-1, 3)
    assert camera.overview(assembly, Scene(), points[:0], 2) == camera.overview(assembly, Scene(), points, 2)
    nobody = SimpleNamespace(bodies=[], motion=Motion([0.0], np.zeros((1, 0, 3)), np.zeros((1, 0, 3, 3))))
    eye = camera.overview(nobody, Scene(), points[:0], 0)
    assert eye.target == (0.0, 0.0, 0.0) and np.linalg.norm(eye.position) == pytest.approx(0.2)
