"""Round shapes with ends of two radii have the volume and the height of the true shape, from within."""

import math

import pytest

from sessions.scene_formats.round_shapes import tapered_shape


@pytest.mark.parametrize(
    ("shape", "lower", "upper", "volume", "bottom", "top"),
    [
        ("cylinder", 1.0, 1.0, 2.0, -1.0, 1.0),
        ("cylinder", 1.0, 0.5, 2.0 / 3.0 * (1.0 + 0.5 + 0.25), -1.0, 1.0),
        ("cylinder", 1.0, 0.0, 2.0 / 3.0, -1.0, 1.0),
        ("cylinder", 0.0, 1.0, 2.0 / 3.0, -1.0, 1.0),
        ("capsule", 0.5, 0.5, 2.0 / 4.0 + 4.0 / 3.0 / 8.0, -1.5, 1.5),
        # A ball without the cap beyond its tangent cone, and that cone: 4/3 - 5/24 + 3/8.
        ("capsule", 1.0, 0.0, 1.5, -2.0, 1.0),
    ],
)
def test_tapered_shape_has_volume_and_height_of_the_true_shape(shape, lower, upper, volume, bottom, top):
    """``volume`` is in units of pi; the height is 2, of a capsule that between the middles of its ends."""
    mesh = tapered_shape(shape, 2.0, lower, upper)
    assert 0.98 * math.pi * volume <= mesh.volume <= (1.0 + 1e-9) * math.pi * volume
    assert mesh.bounds[:, 1].tolist() == pytest.approx([bottom, top], abs=1e-3)


@pytest.mark.parametrize(
    ("shape", "height", "exists"),
    [("cylinder", 0.0, False), ("cylinder", -1.0, False), ("capsule", -1.0, False), ("capsule", 0.0, True)],
)
def test_shape_without_height_is_none_but_a_capsule(shape, height, exists):
    """Ends have radii of 0.1 and 0.2; a capsule without height is the balls of its ends."""
    assert (tapered_shape(shape, height, lower=0.1, upper=0.2) is not None) == exists
