import numpy as np
import pytest

from sessions.glassware.field import blended, capsule, carved, ellipsoid, hoop, rounded_box, surface_of
from sessions.mesh_data import is_closed, least_area

LOW, HIGH = (-0.06, -0.06, -0.06), (0.06, 0.06, 0.06)


def ball(points):
    return np.linalg.norm(points, axis=1) - 0.05


@pytest.mark.parametrize("faces", [500, 3000, 20_000])
def test_a_ball_is_closed_round_and_of_its_volume(faces):
    mesh = surface_of(ball, LOW, HIGH, faces)
    assert is_closed(mesh)
    assert least_area(mesh) > 1e-9
    assert len(mesh.faces) == pytest.approx(faces, rel=0.15)
    assert np.linalg.norm(mesh.vertices, axis=1) == pytest.approx(0.05, rel=1e-4)
    assert mesh.volume == pytest.approx(4 / 3 * np.pi * 0.05**3, rel=30 / faces)


def test_the_surface_is_as_connected_as_the_solid():
    torus = surface_of(lambda p: hoop(p, (0, 0, 0), (0, 1, 0), 0.035, 0.012, 0.012), LOW, HIGH, 2000)
    assert is_closed(torus)
    assert len(torus.vertices) - len(torus.faces) // 2 == 0  # Euler characteristic of a torus


def test_what_reaches_out_of_the_box_is_cut_off_and_closed():
    mesh = surface_of(lambda p: np.hypot(p[:, 0], p[:, 1]) - 0.02, LOW, HIGH, 2000)
    assert is_closed(mesh)
    assert np.abs(mesh.bounds[:, 2]).max() <= 0.06 + 3e-3


def test_distances_are_those_of_the_solids():
    points = np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0], [0.0, 0.4, 0.0], [0.0, 0.0, -1.0]])
    assert capsule(points, (0, 0, 0), (0, 1, 0), 0.1, 0.1) == pytest.approx([-0.1, 0.2, -0.1, 0.9])
    assert rounded_box(points, (0, 0, 0), (0.2, 0.3, 0.4), 0.05) == pytest.approx([-0.2, 0.1, 0.1, 0.6])
    assert np.sign(ellipsoid(points[1:], (0, 0, 0), (0.35, 0.35, 0.9))).tolist() == [-1, 1, 1]
    assert ellipsoid(np.array([[0.35, 0, 0], [0, 0, 0.9]]), (0, 0, 0), (0.35, 0.35, 0.9)) == pytest.approx(0, abs=1e-15)
    assert (
        hoop(points, (0, 0, 0), (0, 1, 0), 0.3, 0.1, 0.1)[1] < 0 < hoop(points, (0, 0, 0), (0, 1, 0), 0.3, 0.1, 0.1)[2]
    )


def test_a_blend_only_adds_and_a_carving_only_removes():
    rng = np.random.default_rng(3)
    a, b = rng.normal(0, 0.01, 1000), rng.normal(0, 0.01, 1000)
    assert (blended(a, b, 0.005) <= np.minimum(a, b) + 1e-15).all()
    assert (carved(a, b, 0.005) >= np.maximum(a, -b) - 1e-15).all()
    far = np.abs(a - b) > 0.005
    assert blended(a, b, 0.005)[far] == pytest.approx(np.minimum(a, b)[far], abs=1e-15)
