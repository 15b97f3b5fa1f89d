from __future__ import annotations

import numpy as np
import pytest

from sessions.geometry.solids import box, inscribed_depth, pointed_ball, prism
from sessions.mesh_data import is_closed

MESHES = {
    "block": box((0.5, 0.25, 0.125)),
    "ball": pointed_ball(1 / 32),
    "fine ball": pointed_ball(1 / 32, 4),
    "prism": prism(12, 1 / 128, 0.25),
    "ring": prism(16, 3 / 64, 1 / 64, hole=1 / 32),
}


@pytest.mark.parametrize("name", MESHES)
def test_solids_are_closed_and_wind_outwards(name):
    assert is_closed(MESHES[name])
    assert MESHES[name].volume > 0.0


def test_volumes_are_those_of_the_shapes():
    assert MESHES["block"].volume == pytest.approx(0.5 * 0.25 * 0.125, rel=1e-12)
    assert MESHES["fine ball"].volume == pytest.approx(4 / 3 * np.pi / 32**3, rel=0.01)
    flats = 16 * np.tan(np.pi / 16)
    assert MESHES["ring"].volume == pytest.approx(flats * ((3 / 64) ** 2 - (1 / 32) ** 2) / 64, rel=1e-6)


@pytest.mark.parametrize(("name", "reach"), [("ball", 1 / 32), ("fine ball", 1 / 32), ("prism", 1 / 128)])
def test_the_outermost_corners_on_x_are_exact(name, reach):
    assert MESHES[name].bounds[:, 0].tolist() == [-reach, reach]
    assert reach in MESHES[name].vertices[np.abs(MESHES[name].vertices[:, 2]) == 0.0][:, 0]


def test_a_ball_has_a_corner_on_each_half_axis():
    points = {tuple(row) for row in MESHES["ball"].vertices.tolist()}
    for axis in range(3):
        for sign in (-1 / 32, 1 / 32):
            assert tuple(sign if k == axis else 0.0 for k in range(3)) in points


def test_the_flats_of_a_ring_face_along_x_at_the_exact_distance():
    x = np.abs(MESHES["ring"].vertices[:, 0])
    radial = np.hypot(MESHES["ring"].vertices[:, 0], MESHES["ring"].vertices[:, 2])
    for size in (1 / 32, 3 / 64):
        assert (x == size).sum() == 8
        assert radial.min() >= 1 / 32


def test_inscribed_depth_is_that_of_the_flattest_face():
    assert inscribed_depth(box((2.0, 2.0, 2.0))) == pytest.approx(np.sqrt(3.0) - 1.0)
    assert inscribed_depth(MESHES["fine ball"]) < inscribed_depth(MESHES["ball"]) / 3.0


def test_impossible_prisms_are_refused():
    for wrong in ((3, 1.0, 1.0, 0.0), (5, 1.0, 1.0, 0.0), (8, 1.0, 1.0, 2.0)):
        with pytest.raises(ValueError, match="not possible"):
            prism(*wrong[:3], hole=wrong[3])
