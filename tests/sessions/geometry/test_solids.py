"""Solids and surfaces sewn of rings have their closed-form bounds, and face outwards."""

import numpy as np
import pytest

from sessions.geometry.rings import sewn
from sessions.geometry.solids import box


def test_box_stands_about_its_centre():
    """2 x 4 x 6 m about (1, 2, 3)."""
    solid = box((2.0, 4.0, 6.0), (1.0, 2.0, 3.0))
    assert solid.bounds.tolist() == [[0.0, 0.0, 0.0], [2.0, 4.0, 6.0]]
    assert solid.volume == pytest.approx(48.0)


@pytest.mark.parametrize("upwards", [1, -1])
def test_sewn_rings_face_outwards_in_either_order(upwards):
    """A square double pyramid with the corners of its base on the axes: 4/3 cubic metres, sewn up or down."""
    base = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    rings = [np.array([[0.0, -1.0, 0.0]]), base, np.array([[0.0, 1.0, 0.0]])][::upwards]
    assert sewn(rings).volume == pytest.approx(4.0 / 3.0)
