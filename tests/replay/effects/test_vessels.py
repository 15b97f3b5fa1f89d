import math

import numpy as np
import pytest
from support.liquid_worlds import HEIGHT, RADIUS, glass

from replay.effects.vessels import Cylinder, Vessel
from replay.errors import EffectError
from sessions.glassware.catalogue import make_instrument
from sessions.model.scene import SceneBody


def test_the_brim_is_that_of_the_cylinder_and_unknown_for_any_other():
    assert Vessel(glass("a")).brim_ml == pytest.approx(math.pi * RADIUS**2 * HEIGHT * 1e6)
    body = glass("a")
    del body.extra["cavity"]["radius"]
    assert Vessel(body).brim_ml == math.inf


def test_an_instrument_brings_its_cavity():
    vessel, cavity = Vessel(SceneBody("a", instrument="beaker_250")), make_instrument("beaker_250").cavity
    assert vessel.size("capacity_ml") == pytest.approx(cavity.capacity_m3 * 1e6)
    assert vessel.brim_ml == pytest.approx(cavity.to_brim.volume * 1e6, rel=1e-9)
    with pytest.raises(EffectError, match="or an instrument that is a vessel"):
        Vessel(SceneBody("rod", instrument="stirring_rod"))
    with pytest.raises(EffectError, match="has a cavity that cannot be made: beaker_250 has no option grip"):
        Vessel(SceneBody("a", instrument="beaker_250", extra={"options": {"grip": 1}}))


@pytest.mark.parametrize("name", ["beaker_100", "erlenmeyer_flask", "burette"])
def test_the_level_in_an_instrument_is_that_of_its_cavity(name):
    cavity = make_instrument(name).cavity
    level = Vessel(SceneBody("a", instrument=name)).drawn(np.zeros(1), np.array([cavity.capacity_m3 * 1e6])).level
    assert level[0] == pytest.approx(cavity.mark_height, abs=5e-4)


def test_a_declared_cylinder_stays_one_until_its_shape_is_said_to_be_the_cavity():
    cavity = dict(glass("a").extra["cavity"])
    assert isinstance(Vessel(SceneBody("a", instrument="beaker_50", extra={"cavity": cavity})).shape, Cylinder)
    real = Vessel(SceneBody("a", instrument="beaker_50", extra={"cavity": {**cavity, "shape": "cavity"}}))
    assert real.brim_ml == pytest.approx(Vessel(SceneBody("b", instrument="beaker_50")).brim_ml)
