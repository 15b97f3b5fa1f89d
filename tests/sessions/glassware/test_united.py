import numpy as np
import pytest

from sessions import MeshData
from sessions.glassware.united import bent, divided_path, fitted_mesh, rod
from sessions.mesh_data import has_consistent_winding


@pytest.mark.parametrize("power", [1, 2, 3, 5])
@pytest.mark.parametrize("start", [0.007, 0.015])
def test_mesh_has_requested_face_count_for_any_spacing_exponent(power, start):
    """A mesh has 1000 * (0.01 / spacing) ** power faces: more at a smaller spacing, as of lines, surfaces, solids.

    The search for 1,000 faces ends at a mesh within 8 %, its tolerance, whether it starts from 7 or from 15 mm.
    """

    def build(spacing):
        return MeshData(np.eye(3), np.tile(np.arange(3), (round(1000 * (0.01 / spacing) ** power), 1)))

    mesh, spacing = fitted_mesh(build, 1000, start)
    assert len(mesh.faces) == pytest.approx(1000, rel=0.08)
    assert spacing == pytest.approx(0.01, rel=0.08)


def test_bend_of_a_path_is_an_arc_of_its_radius():
    """A path along X bends by 60 degrees at (3, 1), rounded by a radius of 0.3 m: an arc of 0.31 m.

    In pieces of about 0.08 m it has four of 15 degrees; it begins 0.3 m times tan(30 degrees) before the corner.
    """
    radius = 0.3
    reach = radius * np.tan(np.radians(30.0))
    end = np.array([3.0 + 0.5, 1.0 + np.sqrt(0.75), 2.0])
    path = bent([(1, 1, 2), (3, 1, 2), end], radius, 0.08)
    angles = np.radians([-90.0, -75.0, -60.0, -45.0, -30.0])
    arc = [(3.0 - reach + radius * np.cos(angle), 1.0 + radius + radius * np.sin(angle), 2.0) for angle in angles]
    np.testing.assert_allclose(path, [(1, 1, 2), *arc, end], atol=1e-12)


def test_path_is_divided_into_pieces_of_the_spacing():
    """A path goes 0.4 m up and 0.2 m aside; in pieces of 0.1 m it has four and two."""
    path = divided_path(np.array([(1.0, 1.0), (1.0, 1.4), (1.2, 1.4)]), 0.1)
    np.testing.assert_allclose(path[:5], [(1.0, 1.0 + 0.1 * k) for k in range(5)])
    np.testing.assert_allclose(path[5:], [(1.1, 1.4), (1.2, 1.4)])


def test_rod_has_its_radius_about_the_path_and_round_ends():
    """A rod of radius 0.1 m along Z, far from the origin; a ring of 16 corners is 1.3 % wider than its circle."""
    radius = 0.1
    mesh = rod([(5.0, 7.0, 3.0), (5.0, 7.0, 3.4), (5.0, 7.0, 4.0)], radius, 16)
    nearest = np.clip(mesh.vertices[:, 2], 3.0, 4.0)[:, None] * [0, 0, 1] + [5.0, 7.0, 0.0]
    assert has_consistent_winding(mesh)
    assert np.linalg.norm(mesh.vertices - nearest, axis=1) == pytest.approx(radius, rel=0.02)
    assert mesh.bounds[:, 2] == pytest.approx([3.0 - radius, 4.0 + radius])
