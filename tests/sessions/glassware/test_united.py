import numpy as np
import pytest

from sessions import MeshData
from sessions.glassware.united import bent, fitted_mesh


@pytest.mark.parametrize("power", [1, 2, 3, 5])
@pytest.mark.parametrize("start", [0.007, 0.015])
def test_mesh_has_requested_face_count_for_any_spacing_exponent(power, start):
    def build(spacing):
        return MeshData(np.eye(3), np.tile(np.arange(3), (round(1000 * (0.01 / spacing) ** power), 1)))

    mesh, spacing = fitted_mesh(build, 1000, start)
    assert len(mesh.faces) == pytest.approx(1000, rel=0.08) and spacing == pytest.approx(0.01, rel=0.08)


def test_bend_of_a_path_is_an_arc_of_its_radius():
    """A right angle at (3, 1) rounded by 0.25 m: an arc about (2.75, 1.25) of 0.39 m, in 4 pieces of about 0.1 m."""
    path = bent([(1, 1, 2), (3, 1, 2), (3, 4, 2)], 0.25, 0.1)
    angles = np.radians([-90.0, -67.5, -45.0, -22.5, 0.0])
    arc = np.stack([2.75 + 0.25 * np.cos(angles), 1.25 + 0.25 * np.sin(angles), np.full(5, 2.0)], axis=1)
    np.testing.assert_allclose(path, [(1, 1, 2), *arc, (3, 4, 2)], atol=1e-12)
