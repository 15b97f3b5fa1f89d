import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sessions.geometry.rings import area_factor, capped, even_angles, sewn, turned, turned_solid
from sessions.mesh_data import is_closed

CYLINDER = np.array([(0.0, 0.0), (0.02, 0.0), (0.02, 0.1), (0.0, 0.1)])


@given(st.integers(3, 200))
def test_a_turned_polygon_has_the_volume_of_the_round_solid(sections):
    solid = turned_solid(CYLINDER, sections)
    assert is_closed(solid)
    assert solid.volume == pytest.approx(np.pi * 0.02**2 * 0.1, rel=1e-5)


@given(st.integers(4, 60), st.integers(0, 2**32))
def test_uneven_angles_enclose_the_same_area(sections, seed):
    steps = np.random.default_rng(seed).uniform(0.5, 1.5, sections)
    angles = np.concatenate([[0.0], np.cumsum(steps)[:-1]]) * 2 * np.pi / steps.sum()
    if np.diff(angles, append=2 * np.pi).max() < 3.0:
        assert sewn(turned(CYLINDER, angles)).volume == pytest.approx(np.pi * 0.02**2 * 0.1, rel=1e-5)
        assert area_factor(angles) >= area_factor(even_angles(sections)) - 1e-12


def test_the_order_of_the_rings_does_not_turn_the_surface_inside_out():
    rings = turned(CYLINDER, even_angles(12))
    assert sewn(rings).volume == pytest.approx(sewn(rings[::-1]).volume)
    assert sewn(rings).volume > 0


def test_a_ring_sewn_around_is_a_closed_torus():
    outline = np.array([(0.05, 0.0), (0.06, 0.0), (0.06, 0.01), (0.05, 0.01)])
    torus = sewn(turned(outline, even_angles(40)), around=True)
    assert is_closed(torus)
    edges = len(torus.faces) * 3 // 2
    assert len(torus.vertices) - edges + len(torus.faces) == 0
    assert torus.volume == pytest.approx(2 * np.pi * 0.055 * 1e-4, rel=1e-3)


def test_falling_bands_use_the_other_diagonal_and_nothing_else_changes():
    rings = turned(CYLINDER, even_angles(5))
    rising, falling = sewn(rings), sewn(rings, falling_from=1)
    assert is_closed(falling)
    assert falling.volume == pytest.approx(rising.volume, rel=1e-6)
    changed = (np.sort(rising.faces, axis=1) != np.sort(falling.faces, axis=1)).any(axis=1)
    assert changed.sum() == 10


def test_open_rings_are_closed_by_caps():
    rings = turned(CYLINDER[1:3], even_angles(9))
    assert is_closed(capped(rings))
    assert capped(rings).volume == pytest.approx(np.pi * 0.02**2 * 0.1, rel=1e-5)
