import numpy as np
import pytest
from support.surface_rays import distances_along_rays, points_on_faces

from sessions.glassware.tools import alcohol_lamp, delivery_tube, stirring_rod, tongs


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


def test_a_rod_is_as_long_as_asked():
    assert stirring_rod(500, length=0.15).mesh.bounds[:, 1] == pytest.approx([0, 0.15], abs=1e-6)


def test_tongs_open_by_the_angle_asked():
    closed, opened = tongs(1000, opening_deg=4.0).mesh, tongs(1000, opening_deg=16.0).mesh
    jaws = [np.ptp(mesh.vertices[mesh.vertices[:, 2] < -0.11][:, 0]) for mesh in (closed, opened)]
    assert jaws[1] - jaws[0] == pytest.approx(2 * 0.115 * np.radians(6.0), rel=0.35)
    assert closed.bounds[0, 1] == opened.bounds[0, 1] == 0


def test_the_wick_hangs_into_the_liquid_and_holds_the_flame_above():
    lamp = alcohol_lamp(2000)
    holder = lamp.parts[0]
    wick = holder.instrument.mesh.transformed(holder.to_parent)
    assert wick.bounds[0, 1] < lamp.cavity.mark_height
    assert lamp.sites["flame"].point[1] == pytest.approx(wick.bounds[1, 1], abs=1e-3)
    neck = lamp.cavity.to_brim.vertices[lamp.cavity.to_brim.vertices[:, 1] > 0.07]
    assert (
        np.hypot(*wick.vertices[wick.vertices[:, 1] < 0.07][:, [0, 2]].T).max() < np.hypot(*neck[:-1, [0, 2]].T).max()
    )
