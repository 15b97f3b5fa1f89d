import numpy as np
import pytest
from support.surface_rays import distances_along_rays

from sessions.glassware.furniture import bench, stand, test_tube_rack, tripod
from sessions.glassware.tubes import test_tube


@pytest.mark.parametrize("height", [0.75, 0.9])
def test_the_working_surface_of_a_bench_is_flat_at_its_height(height):
    mesh = bench(1000, height=height).mesh
    down = distances_along_rays(mesh.triangles, [[0.3, 2.0, 0.1], [-0.7, 2.0, -0.3]], [[0, -1, 0]] * 2)
    assert np.array([hit[0] for hit in down]) == pytest.approx(2.0 - height, abs=1e-6)
    assert mesh.bounds[1, 1] == pytest.approx(height, abs=1e-6)


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


@pytest.mark.parametrize("grip_radius", [0.0065, 0.011])
def test_the_clamp_leaves_room_for_what_it_grips(grip_radius):
    made = stand(3000, grip_radius=grip_radius, clamp_height=0.3)
    x, y, z = made.sites["clamp"].point
    distance = np.hypot(made.mesh.vertices[:, 0] - x, made.mesh.vertices[:, 2] - z)
    level = np.abs(made.mesh.vertices[:, 1] - 0.3) < 0.02
    assert y == 0.3
    assert distance[level].min() == pytest.approx(grip_radius, rel=0.12)


def test_the_gauze_lies_on_the_tripod():
    made = tripod(2000)
    gauze = made.parts[0].instrument.mesh.transformed(made.parts[0].to_parent)
    assert gauze.bounds[0, 1] == pytest.approx(made.mesh.bounds[1, 1], abs=1e-6)
    assert made.sites["top"].point[1] == pytest.approx(gauze.bounds[1, 1], abs=1e-6)
    feet = made.mesh.vertices[made.mesh.vertices[:, 1] < 0.002]
    assert np.hypot(feet[:, 0], feet[:, 2]).min() > 0.08
