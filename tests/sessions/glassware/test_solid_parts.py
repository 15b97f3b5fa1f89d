from importlib import import_module

import numpy as np
import pytest
from support.surface_rays import distances_along_rays, points_on_faces

from sessions.glassware.devices import GRIPS, hand_right
from sessions.glassware.furniture import test_tube_rack
from sessions.glassware.tools import delivery_tube
from sessions.glassware.tubes import test_tube
from sessions.synthetic.bench_bumps import PLACED
from sessions.synthetic.scenes import SCENES


@pytest.mark.parametrize("faces", [500, 2000, 5000, pytest.param(50_000, marks=pytest.mark.slow)])
def test_the_wall_of_the_delivery_tube_is_as_thick_as_stated(faces):
    tube = delivery_tube(faces)
    points, normals = points_on_faces(tube.mesh, 300, faces)
    ends = np.array([site.point for site in tube.sites.values()])
    away = np.linalg.norm(points[:, None] - ends, axis=2).min(axis=1) > 0.005
    points, normals = points[away], normals[away]
    across = distances_along_rays(tube.mesh.triangles, points + 1e-6 * normals, normals)
    in_bore = np.array([len(hit) > 0 and hit[0] < 0.0065 for hit in across])  # the bore is 6 mm wide
    assert in_bore.sum() > 80
    outwards = -normals[in_bore]
    hits = distances_along_rays(tube.mesh.triangles, points[in_bore] + 1e-6 * outwards, outwards)
    assert np.array([hit[0] for hit in hits]) == pytest.approx(tube.wall.thickness, rel=0.10)


def test_the_bore_of_the_delivery_tube_leads_from_inlet_to_outlet():
    tube = delivery_tube(2000)
    x, y, _ = tube.sites["outlet"].point
    up = distances_along_rays(tube.mesh.triangles, [[x + 1e-5, y - 0.1, 1e-5]], [[0, 1, 0]])[0]
    assert up[0] > 0.2  # past the open end, up the bore to the bend


def test_the_stopper_holds_the_tube_without_touching_it():
    tube = delivery_tube(2000)
    stopper = tube.parts[0].instrument.mesh
    outside = np.hypot(*tube.mesh.vertices[np.abs(tube.mesh.vertices[:, 1]) < 0.028][:, [0, 2]].T)
    hole = np.hypot(*stopper.vertices[:, [0, 2]].T).min()
    assert outside[outside < 0.01].max() < hole * 1.06
    assert hole > 0.004


def test_a_test_tube_fits_every_hole_of_the_rack_without_touching():
    rack = test_tube_rack(3000)
    tube = test_tube(500).mesh
    assert len(rack.sites) == 6
    body = np.hypot(*tube.vertices[:, [0, 2]].T)[tube.vertices[:, 1] < 0.15].max()
    for site in rack.sites.values():
        x, y, z = site.point
        turns = np.linspace(0, 2 * np.pi, 24, endpoint=False)
        outward = np.column_stack([np.cos(turns), np.zeros(24), np.sin(turns)])
        top = distances_along_rays(rack.mesh.triangles, np.tile([x, 0.085, z], (24, 1)), outward)
        assert min(hit[0] for hit in top) > body
        down = distances_along_rays(rack.mesh.triangles, [[x + 1e-4, 0.2, z + 1e-4]], [[0, -1, 0]])[0]
        assert 0.2 - down[0] == pytest.approx(y, abs=1e-6)


@pytest.mark.parametrize("grip_radius", GRIPS)
def test_a_hand_goes_round_a_cylinder_of_the_grip_without_entering_it(grip_radius):
    mesh = hand_right(3000, grip_radius=grip_radius).mesh
    radii = np.hypot(mesh.vertices[:, 0], mesh.vertices[:, 2])
    assert radii.min() > grip_radius - 1e-3
    assert radii.min() < grip_radius + 5e-3
    level = (np.abs(mesh.vertices[:, 1]) < 0.04) & (radii < grip_radius + 0.02)
    around = np.sort(np.arctan2(mesh.vertices[level, 2], mesh.vertices[level, 0]))
    assert np.degrees(np.diff(around, append=around[0] + 2 * np.pi).max()) < 140


def test_the_hands_of_every_scene_hold_a_grip_that_is_shipped():
    """Another grip gets the nearest hand, which would change what a seed makes."""
    made = [getattr(import_module(module), name) for module, name in (where.split(":") for where in SCENES.values())]
    grips = {grip for experiment in made for grip in getattr(experiment, "grips", ())}
    grips |= {item.options["grip_radius"] for item in PLACED.values() if "grip_radius" in item.options}
    assert 0.01 in grips and grips <= {*GRIPS}
