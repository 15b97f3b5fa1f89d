import numpy as np
import pytest
from support.surface_rays import distances_along_rays

from sessions.glassware.hands import hand_left, hand_right


@pytest.mark.parametrize("grip_radius", [0.008, 0.02, 0.045])
def test_a_hand_goes_round_a_cylinder_of_the_grip_without_entering_it(grip_radius):
    mesh = hand_right(3000, grip_radius=grip_radius).mesh
    radii = np.hypot(mesh.vertices[:, 0], mesh.vertices[:, 2])
    assert radii.min() > grip_radius - 1e-3
    assert radii.min() < grip_radius + 5e-3
    level = (np.abs(mesh.vertices[:, 1]) < 0.04) & (radii < grip_radius + 0.02)
    around = np.sort(np.arctan2(mesh.vertices[level, 2], mesh.vertices[level, 0]))
    assert np.degrees(np.diff(around, append=around[0] + 2 * np.pi).max()) < 140


def test_the_left_hand_mirrors_the_right_one():
    left, right = hand_left(600).mesh, hand_right(600).mesh
    assert np.array_equal(left.vertices * [-1, 1, 1], right.vertices)
    assert left.volume == pytest.approx(right.volume)


def test_there_are_four_fingers_to_cross_in_front():
    mesh = hand_right(8000).mesh
    heights = np.linspace(-0.05, 0.05, 201)
    origins = np.column_stack([np.zeros(201), heights, np.full(201, -0.001)])
    met = np.array([len(hit) > 0 for hit in distances_along_rays(mesh.triangles, origins, [[0.2, 0, -1.0]] * 201)])
    assert met.any()
    front = mesh.vertices[mesh.vertices[:, 2] < -0.030]
    assert np.ptp(front[:, 1]) > 0.06


def test_a_hand_is_the_size_of_a_hand():
    made = hand_right(3000)
    assert 0.25 < made.mass < 0.7
    assert np.ptp(made.mesh.bounds[:, 1]) == pytest.approx(0.095, abs=0.015)
