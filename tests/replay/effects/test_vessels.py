import math
from types import SimpleNamespace

import numpy as np
import pytest
from support.liquid_worlds import HEIGHT, RADIUS, glass

from replay.effects.inputs import BodyPoses
from replay.effects.models.outflow import Stream
from replay.effects.vessels import Cylinder, Vessel, check_vessels, flow_event, is_inside
from replay.errors import PlanError
from sessions.glassware.catalogue import make_instrument
from sessions.model.scene import Scene, SceneBody


def test_a_declared_cylinder_precedes_the_cavity_of_the_instrument():
    """Without its radius the cylinder does not count but the beaker's cavity; without a beaker nothing is full."""
    cavity = dict(glass("a").extra["cavity"])
    declared = SceneBody("a", instrument="beaker_50", extra={"cavity": cavity})
    assert Vessel(declared).brim_ml == pytest.approx(math.pi * RADIUS**2 * HEIGHT * 1e6)
    del cavity["radius"]
    assert Vessel(declared).brim_ml == pytest.approx(make_instrument("beaker_50").cavity.to_brim.volume * 1e6, rel=1e-9)
    assert Vessel(SceneBody("a", extra={"cavity": cavity})).brim_ml == math.inf


@pytest.mark.parametrize("name", ["beaker_100", "erlenmeyer_flask", "burette"])
def test_an_instrument_brings_its_cavity_and_its_level(name):
    """Filled to its capacity the liquid stands at the mark."""
    vessel, cavity = Vessel(SceneBody("a", instrument=name)), make_instrument(name).cavity
    assert vessel.size("capacity_ml") == pytest.approx(cavity.capacity_m3 * 1e6)
    level = vessel.liquid_to_draw(np.zeros(1), np.array([cavity.capacity_m3 * 1e6])).level
    assert level[0] == pytest.approx(cavity.mark_height, abs=5e-4)


def test_liquid_leaves_a_tilted_cylinder_at_its_lowest_rim_point():
    """The rim is sampled by 3600 points and has a lip of 0.1 m; ``down`` is gravity in axes of the vessel."""
    cylinder = Cylinder(
        radius=1.0, height=2.0, lip=np.array([1.1, 2.05, 0.0]), opening=np.array([0.0, 2.0, 0.0]), opening_radius=1.0
    )
    around = np.linspace(0.0, 2.0 * np.pi, 3600, endpoint=False)
    rim = np.column_stack([np.cos(around), np.full(3600, 2.0), np.sin(around)])
    points = np.concatenate([rim, [cylinder.lip]])
    down = np.random.default_rng(5).normal(size=(50, 3))
    down = np.concatenate([down / np.linalg.norm(down, axis=1)[:, None], [[0.0, -1.0, 0.0], [0.0, 1.0, 0.0]]])
    depths = (cylinder.exit(down) * down).sum(axis=1)
    assert depths[:50] == pytest.approx((points @ down.T).max(axis=0)[:50], abs=1e-6)
    assert np.isfinite(depths).all()


def test_point_inside_a_vessel_is_between_floor_and_opening():
    """A cylinder of radius 0.2 from y = 0.1 to 0.5; at unobserved frames no point is inside."""
    vessel = Vessel(glass("a", cavity={"floor": 0.1, "opening": [0.3, 0.5, -0.4], "opening_radius": 0.2}))
    within = np.array([[0.3, 0.11, -0.4], [0.3, 0.49, -0.4], [0.49, 0.3, -0.4], [0.3, 0.3, -0.59], [0.16, 0.3, -0.26]])
    without = np.array([[0.3, 0.09, -0.4], [0.3, 0.51, -0.4], [0.51, 0.3, -0.4], [0.3, 0.3, -0.61], [0.15, 0.3, -0.25]])
    rotated = np.tile([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], (5, 1, 1))
    observed = np.arange(5) != 2
    poses = BodyPoses(np.arange(5.0), np.full((5, 3), 7.0), rotated, observed, observed)
    assert is_inside(within @ rotated[0].T + 7.0, poses, vessel).tolist() == observed.tolist()
    assert not is_inside(without @ rotated[0].T + 7.0, poses, vessel).any()


def test_vessel_may_be_full_to_its_brim_and_not_above():
    """The cylinder of 75.4 mL is full, or has a thousandth more."""
    brim_ml = math.pi * RADIUS**2 * HEIGHT * 1e6
    tables = {"mixing": ({"in": ["a"]},)}
    check_vessels(tables, Scene(bodies=(glass("a", brim_ml),)), "scene.toml")
    with pytest.raises(PlanError, match="and a brim at"):
        check_vessels(tables, Scene(bodies=(glass("a", 1.001 * brim_ml),)), "scene.toml")


class Inputs(SimpleNamespace):
    """Inputs of an effect, with as many frames as times."""

    def __len__(self):
        return len(self.times)


@pytest.mark.parametrize(("frames", "end"), [([2, 3, 5], 0.5), ([2, 3, 9], None)])
def test_flow_ends_unless_it_runs_in_the_last_frame(frames, end):
    """Ten frames, 0.1 s apart."""
    times = np.arange(10) / 10.0
    flow = Stream("a", "b", False, times[frames], np.array(frames), np.array([1.0, 2.0, 3.5]), np.zeros((3, 3)))
    event = flow_event(Inputs(times=times), flow, "pour", "are poured")
    assert (event.time, event.end, event.text) == (0.2, end, "6.5 mL are poured")
    assert event.values == {"volume_ml": 6.5, "seconds": pytest.approx(times[frames[-1]] - 0.2)}
