import numpy as np
import pytest

from sessions import MeshData
from sessions.glassware.united import fitted_mesh


@pytest.mark.parametrize("power", [1, 2, 3, 5])
@pytest.mark.parametrize("start", [0.007, 0.015])
def test_mesh_has_requested_face_count_for_any_spacing_exponent(power, start):
    def build(spacing):
        return MeshData(np.eye(3), np.tile(np.arange(3), (round(1000 * (0.01 / spacing) ** power), 1)))

    mesh, spacing = fitted_mesh(build, 1000, start)
    assert len(mesh.faces) == pytest.approx(1000, rel=0.08) and spacing == pytest.approx(0.01, rel=0.08)
