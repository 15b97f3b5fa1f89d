"""The eye looks across a gap."""

import numpy as np
import pytest

from replay.show import camera


@pytest.mark.parametrize("rotation", np.linspace(0.0, 6.0, 7))
def test_gap_is_viewed_sideways_from_the_users_side(rotation):
    """A gap of 2 cm in some direction; the camera looks down a little, across the gap, from where the user stands."""
    along, user = np.array([np.cos(rotation), 0.0, np.sin(rotation)]), np.array([0.0, 0.0, 1.0])
    away = camera.viewing_direction(0.02 * along, user)
    assert np.linalg.norm(away) == pytest.approx(1.0) and away[1] > 0.3
    assert abs(away @ along) < 0.8 and away @ user > -0.3
    assert camera.viewing_direction(np.zeros(3), user) @ user > 0.9
