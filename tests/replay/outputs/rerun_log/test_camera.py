"""The eye looks across a gap, and knows what stands before it."""

import numpy as np
import pytest

from replay.outputs import camera


@pytest.mark.parametrize("turn", np.linspace(0.0, 6.0, 7))
def test_a_gap_is_seen_from_aside_on_the_side_of_the_user(turn):
    along, user = np.array([np.cos(turn), 0.0, np.sin(turn)]), np.array([0.0, 0.0, 1.0])
    away = camera.across(0.02 * along, user)
    assert np.linalg.norm(away) == pytest.approx(1.0) and away[1] > 0.3
    assert abs(away @ along) < 0.8 and away @ user > -0.3
    assert camera.across(np.zeros(3), user) @ user > 0.9


def test_the_overview_holds_every_point_and_wastes_no_room(demo):
    random = np.random.default_rng(1)
    points = random.uniform([-0.5, 0.9, -0.1], [0.5, 1.1, 0.1], (50, 3))
    eye = camera.overview(demo.assembly, demo.session.scene, points, 0)
    local = (points - eye.position) @ camera.look_rotation(eye)
    slope = np.tan(camera.FIELD_OF_VIEW / 2)
    reach = np.maximum(np.abs(local[:, 0]) / (slope * camera.ASPECT), np.abs(local[:, 1]) / slope) / -local[:, 2]
    assert 0.7 < reach.max() < 1.0


def test_an_eye_that_looks_along_minus_z_has_the_axes_of_the_world():
    assert np.allclose(camera.look_rotation(camera.Eye((0.0, 0.0, 1.0), (0.0, 0.0, 0.0))), np.eye(3))
