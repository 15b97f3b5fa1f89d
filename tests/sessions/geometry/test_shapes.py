import numpy as np
import pytest

from sessions.geometry.shapes import SIZES, make_shape
from sessions.geometry.solids import pointed_ball
from sessions.mesh_data import has_consistent_winding

CASES = {
    "box": ({"x": 0.2, "y": 0.3, "z": 0.4}, 0.2 * 0.3 * 0.4, (0.1, 0.15, 0.2)),
    "sphere": ({"radius": 0.1}, 4 / 3 * np.pi * 1e-3, (0.1, 0.1, 0.1)),
    "capsule": ({"radius": 0.1, "length": 0.5}, np.pi * 1e-2 * 0.3 + 4 / 3 * np.pi * 1e-3, (0.1, 0.25, 0.1)),
    "cylinder": ({"radius": 0.1, "length": 0.5}, np.pi * 1e-2 * 0.5, (0.1, 0.25, 0.1)),
}


@pytest.mark.parametrize("shape", SIZES)
@pytest.mark.parametrize("faces", [48, 500, 5000])
def test_shape_is_closed_outward_and_within_its_size(shape, faces):
    """A row of CASES: sizes, the volume in closed form, and half of the extent. A mesh lies within its shape.

    It lacks up to 30 / faces of the volume, and 0.1 more at 48 faces; a box lacks none. From 500 faces on it has the
    requested number within 40 %; a box has always 12.
    """
    size, volume, half = CASES[shape]
    mesh = make_shape(shape, size, faces)
    assert has_consistent_winding(mesh)
    assert 0 < mesh.volume <= volume * (1 + 1e-12)
    assert mesh.volume == pytest.approx(
        volume, rel=30 / faces + (0.1 if faces < 100 else 0) if shape != "box" else 1e-12, abs=0
    )
    assert np.all(np.abs(mesh.vertices) <= np.array(half) * (1 + 1e-12))
    assert mesh.bounds[1][1] == pytest.approx(half[1], rel=1e-15, abs=0)
    if shape != "box":
        assert 0.6 * faces <= len(mesh.faces) <= 1.4 * faces or faces < 100


def test_pointed_ball_is_closed_and_touches_its_sphere_on_axes():
    """A ball of radius 0.5 is an octahedron whose 8 faces are split into 4 twice; all its vertices are on the sphere.

    Six of them are the corners of the octahedron, exactly on the axes.
    """
    ball = pointed_ball(0.5, splits=2)
    assert has_consistent_winding(ball)
    assert ball.volume > 0
    assert len(ball.faces) == 8 * 4**2
    assert np.linalg.norm(ball.vertices, axis=1) == pytest.approx(0.5)
    on_axes = {*map(tuple, ball.vertices[np.count_nonzero(ball.vertices, axis=1) == 1].tolist())}
    corners = np.concatenate([0.5 * np.eye(3), -0.5 * np.eye(3)])
    assert on_axes == {*map(tuple, corners.tolist())}
