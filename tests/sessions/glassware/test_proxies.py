import numpy as np
import pytest
from support.surface_rays import distances_along_rays

from sessions.glassware.proxies import proxy_headset, proxy_wand


@pytest.mark.parametrize("faces", [500, 5000])
def test_the_ring_of_the_wand_is_open(faces):
    mesh = proxy_wand(faces).mesh
    centre, axis = np.array([0, -0.022, -0.045]), np.array([0, 0.8, -0.6])
    assert not len(distances_along_rays(mesh.triangles, [centre - axis], [axis])[0])
    aside = distances_along_rays(mesh.triangles, [centre], [[1.0, 0, 0]])[0]
    assert aside == pytest.approx([0.0325, 0.0555], abs=2e-3)


def test_the_wand_has_the_length_of_a_hand_held_controller():
    size = np.ptp(proxy_wand(5000).mesh.bounds, axis=0)
    assert 0.2 < size[2] < 0.27
    assert 0.10 < size[0] < 0.13


@pytest.mark.parametrize("faces", [500, 5000])
def test_there_is_room_for_a_head_between_face_and_strap(faces):
    mesh = proxy_headset(faces).mesh
    inside = np.array([[0.0, 0.0, 0.08]])
    directions = np.array([[1, 0, 0], [-1, 0, 0], [0, 0.05, 1], [0, 0, -1], [0, 1, 0]], dtype=float)
    met = distances_along_rays(mesh.triangles, np.tile(inside, (5, 1)), directions)
    assert [len(hit) >= 2 for hit in met[2:]] == [True] * 3
    assert min(hit[0] for hit in met if len(hit)) > 0.065


def test_the_headset_is_symmetric_from_left_to_right():
    bounds = proxy_headset(5000).mesh.bounds
    assert bounds[0, 0] == pytest.approx(-bounds[1, 0], abs=1e-3)
