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
    """A scene declares a cavity for a body that is an instrument, a beaker of 50 mL: a cylinder with radius and height.

    Its brim is at the cylinder's volume; without the radius at that of the beaker's own mesh; without the beaker too,
    nothing says how much it holds.
    """
    cylinder = dict(glass("a").extra["cavity"])
    without_radius = {key: value for key, value in cylinder.items() if key != "radius"}
    beaker_ml = make_instrument("beaker_50").cavity.to_brim.volume * 1e6
    brim_of_cylinder = Vessel(SceneBody("a", instrument="beaker_50", extra={"cavity": cylinder})).brim_ml
    assert brim_of_cylinder == pytest.approx(math.pi * RADIUS**2 * HEIGHT * 1e6)
    brim_of_beaker = Vessel(SceneBody("a", instrument="beaker_50", extra={"cavity": without_radius})).brim_ml
    assert brim_of_beaker == pytest.approx(beaker_ml, rel=1e-9)
    assert Vessel(SceneBody("a", extra={"cavity": without_radius})).brim_ml == math.inf


@pytest.mark.parametrize("name", ["beaker_100", "erlenmeyer_flask", "burette"])
def test_an_instrument_brings_its_cavity_and_its_level(name):
    """An instrument of the catalogue, by its name alone; filled to its capacity, the liquid drawn stands at its mark.

    The level is of slices of the mesh: right within 0.5 mm.
    """
    vessel, cavity = Vessel(SceneBody("a", instrument=name)), make_instrument(name).cavity
    assert vessel.size("capacity_ml") == pytest.approx(cavity.capacity_m3 * 1e6)
    full = vessel.liquid_to_draw(times=np.zeros(1), volume_ml=np.array([cavity.capacity_m3 * 1e6]))
    assert full.level[0] == pytest.approx(cavity.mark_height, abs=5e-4)


def test_liquid_leaves_a_tilted_cylinder_at_its_lowest_rim_point():
    """A cylinder of radius 1 m, 2 m high, with a lip that stands out by 0.1 m and is 5 cm higher.

    Gravity points in 50 random directions in axes of the vessel; the lowest of 3600 points of the rim and the lip is as
    low as the exit. Upright and overturned the cylinder has an exit, too.
    """
    cylinder = Cylinder(
        radius=1.0, height=2.0, lip=np.array([1.1, 2.05, 0.0]), opening=np.array([0.0, 2.0, 0.0]), opening_radius=1.0
    )
    around = np.linspace(0.0, 2.0 * np.pi, 3600, endpoint=False)
    rim = np.column_stack([np.cos(around), np.full(3600, 2.0), np.sin(around)])
    rim_and_lip = np.concatenate([rim, [cylinder.lip]])
    down = np.random.default_rng(5).normal(size=(50, 3))
    down /= np.linalg.norm(down, axis=1)[:, None]
    depths = (cylinder.exit(down) * down).sum(axis=1)
    assert depths == pytest.approx((rim_and_lip @ down.T).max(axis=0), abs=1e-6)
    upright_and_overturned = np.array([[0.0, -1.0, 0.0], [0.0, 1.0, 0.0]])
    assert np.isfinite(cylinder.exit(upright_and_overturned)).all()


def test_point_inside_a_vessel_is_between_floor_and_opening():
    """A cylinder of radius 0.2 about x = 0.3, z = -0.4, from y = 0.1 to 0.5.

    Points are 1 cm within or beyond the floor, the opening and the wall, the last ones beside the wall on its diagonal.
    The vessel is rotated by 90 degrees about z and moved by 7 m on each axis in five frames, in each of which one point
    is tested; in frame 2 its pose is not observed, and no point is inside.
    """
    vessel = Vessel(glass("a", cavity={"floor": 0.1, "opening": [0.3, 0.5, -0.4], "opening_radius": 0.2}))
    inside = np.array([[0.3, 0.11, -0.4], [0.3, 0.49, -0.4], [0.49, 0.3, -0.4], [0.3, 0.3, -0.59], [0.3, 0.3, -0.4]])
    outside = np.array([[0.3, 0.09, -0.4], [0.3, 0.51, -0.4], [0.51, 0.3, -0.4], [0.3, 0.3, -0.61], [0.3, 0.3, -0.4]])
    diagonal = np.array([-1.0, 0.0, 1.0]) / np.sqrt(2.0)
    inside[-1] += 0.19 * diagonal
    outside[-1] += 0.21 * diagonal
    rotation = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    observed = np.array([True, True, False, True, True])
    poses = BodyPoses(
        np.arange(5.0), np.full((5, 3), 7.0), np.tile(rotation, (5, 1, 1)), valid=observed, linked=observed
    )
    assert is_inside(inside @ rotation.T + 7.0, poses, vessel).tolist() == observed.tolist()
    assert not is_inside(outside @ rotation.T + 7.0, poses, vessel).any()


def test_vessel_may_be_full_to_its_brim_and_not_above():
    """A scene's glass a is a cylinder of 75.4 mL, and is full, or has a thousandth more, which is refused."""
    brim_ml = math.pi * RADIUS**2 * HEIGHT * 1e6
    tables = {"mixing": ({"in": ["a"]},)}
    check_vessels(tables, Scene(bodies=(glass("a", brim_ml),)), "scene.toml")
    with pytest.raises(PlanError, match="and a brim at"):
        check_vessels(tables, Scene(bodies=(glass("a", 1.001 * brim_ml),)), "scene.toml")


class Inputs(SimpleNamespace):
    """Inputs of an effect, with as many frames as times."""

    def __len__(self):
        return len(self.times)


def test_flow_ends_unless_it_runs_in_the_last_frame():
    """Liquid runs from a into b in three of ten ``frames``, 0.1 s apart: 1, 2 and 3.5 mL, 6.5 together.

    The event ends with the last of them, or has no end (None) where that is the last of the recording.
    """
    for case, (frames, end_s) in {
        "until frame 5": ([2, 3, 5], 0.5),
        "until the last frame": ([2, 3, 9], None),
    }.items():
        times = np.arange(10) / 10.0
        flow = Stream(
            source="a",
            target="b",
            over=False,
            times=times[frames],
            frames=np.array(frames),
            volume_ml=np.array([1.0, 2.0, 3.5]),
            points=np.zeros((3, 3)),
        )
        event = flow_event(Inputs(times=times), flow, "pour", "are poured")
        assert (event.time, event.end, event.text) == (0.2, end_s, "6.5 mL are poured"), case
        assert event.values == {"volume_ml": 6.5, "seconds": pytest.approx(times[frames[-1]] - 0.2)}, case
