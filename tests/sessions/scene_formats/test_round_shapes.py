"""Round shapes with ends of two radii have the volume and the height of the true shape, from within."""

import math

import pytest

from sessions.scene_formats.round_shapes import tapered_shape


@pytest.mark.parametrize(
    ("shape", "lower", "upper", "volume_in_pi", "bottom", "top"),
    [
        # A cylinder has pi r^2 h, a cone a third of it, and between radii r and s it is pi h (r^2 + r s + s^2) / 3.
        pytest.param("cylinder", 1.0, 1.0, 2.0, -1.0, 1.0, id="cylinder"),
        pytest.param("cylinder", 1.0, 0.5, 2.0 / 3.0 * (1.0 + 0.5 + 0.25), -1.0, 1.0, id="cone without its tip"),
        pytest.param("cylinder", 1.0, 0.0, 2.0 / 3.0, -1.0, 1.0, id="cone"),
        pytest.param("cylinder", 0.0, 1.0, 2.0 / 3.0, -1.0, 1.0, id="cone upside down"),
        # A cylinder of radius 1/2, and both halves of a ball of that radius.
        pytest.param("capsule", 0.5, 0.5, 2.0 / 4.0 + 4.0 / 3.0 / 8.0, -1.5, 1.5, id="capsule"),
        # A ball without the cap beyond its tangent cone, and that cone: 4/3 - 5/24 + 3/8.
        pytest.param("capsule", 1.0, 0.0, 4.0 / 3.0 - 5.0 / 24.0 + 3.0 / 8.0, -2.0, 1.0, id="ball and a point"),
    ],
)
def test_tapered_shape_has_volume_and_height_of_the_true_shape(shape, lower, upper, volume_in_pi, bottom, top):
    """``lower``, ``upper``: radii of the ends, whose middles are at y = -1 and 1.

    The corners of the mesh lie on the true shape, so that its volume is at most that, and at least 98 % of it.
    """
    mesh = tapered_shape(shape, height=2.0, lower=lower, upper=upper)
    true_volume = math.pi * volume_in_pi
    assert 0.98 * true_volume <= mesh.volume <= true_volume * (1.0 + 1e-9)
    assert mesh.bounds[:, 1].tolist() == pytest.approx([bottom, top], abs=1e-3)


@pytest.mark.parametrize(
    ("shape", "height", "exists"),
    [
        pytest.param("cylinder", 0.0, False, id="flat cylinder"),
        pytest.param("cylinder", -1.0, False, id="cylinder below 0"),
        pytest.param("capsule", -1.0, False, id="capsule below 0"),
        pytest.param("capsule", 0.0, True, id="capsule of two balls"),
    ],
)
def test_shape_without_height_is_none_but_a_capsule(shape, height, exists):
    """Ends have radii of 0.1 and 0.2; a capsule without height is the balls of its ends."""
    assert (tapered_shape(shape, height, lower=0.1, upper=0.2) is not None) == exists
