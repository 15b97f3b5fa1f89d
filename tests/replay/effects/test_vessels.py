import math

import numpy as np
import pytest
from support.liquid_worlds import HEIGHT, RADIUS, glass

from replay.effects.vessels import COLOURS, Vessel, blended
from replay.errors import EffectError
from sessions.model.scene import SceneBody


def test_a_body_without_a_cavity_is_no_vessel():
    with pytest.raises(EffectError, match="body 'bench' has no cavity; give capacity_ml"):
        Vessel(SceneBody("bench"))


@pytest.mark.parametrize("volume", [-1.0, math.nan, "full", True])
def test_a_volume_that_cannot_be_is_named(volume):
    with pytest.raises(EffectError, match="volume_ml"):
        assert Vessel(glass("a", volume)).volume_ml


def test_the_brim_is_that_of_the_cylinder_and_unknown_for_any_other():
    assert Vessel(glass("a")).brim_ml == pytest.approx(math.pi * RADIUS**2 * HEIGHT * 1e6)
    body = glass("a")
    del body.extra["cavity"]["radius"]
    assert Vessel(body).brim_ml == math.inf
    with pytest.raises(EffectError, match="no radius and height"):
        assert Vessel(body).shape


def test_a_level_rises_from_the_floor_to_the_mark_as_it_fills():
    liquid = Vessel(glass("a")).drawn(np.array([0.0, 1.0]), np.array([0.0, 50.0]))
    assert liquid.level.tolist() == pytest.approx([0.0, 50e-6 / (math.pi * RADIUS**2)])


def test_a_blend_begins_and_ends_at_its_colours_and_stays_between():
    shades = blended(COLOURS["red"], COLOURS["blue"], np.array([-1.0, 0.0, 0.5, 1.0, 9.0]))
    assert tuple(shades[0]) == tuple(shades[1]) == COLOURS["red"] and tuple(shades[3]) == tuple(shades[4])
    assert tuple(shades[4]) == COLOURS["blue"] and shades.dtype == np.uint8
    assert COLOURS["blue"][0] < shades[2][0] < COLOURS["red"][0]


def test_an_instrument_brings_its_cavity():
    from sessions.glassware.catalogue import make_instrument

    vessel, cavity = Vessel(SceneBody("a", instrument="beaker_250")), make_instrument("beaker_250").cavity
    assert vessel.size("capacity_ml") == pytest.approx(cavity.capacity_m3 * 1e6)
    assert vessel.shape.brim_ml == pytest.approx(
        math.pi * vessel.size("radius") ** 2 * (cavity.opening.centre[1] - cavity.floor_height) * 1e6, rel=1e-4
    )
    with pytest.raises(EffectError, match="or an instrument that is a vessel"):
        Vessel(SceneBody("rod", instrument="stirring_rod"))
