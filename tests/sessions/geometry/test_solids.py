"""Solids and surfaces sewn of rings have their closed-form bounds, and face outwards."""

import numpy as np
import pytest

from sessions.geometry.rings import sewn
from sessions.geometry.solids import box


def test_box_stands_about_its_centre():
    """A box of 2 x 4 x 6 m about (1, 2, 3) reaches from the origin to (2, 4, 6) and has 48 m3."""
    solid = box((2.0, 4.0, 6.0), (1.0, 2.0, 3.0))
    assert solid.bounds.tolist() == [[0.0, 0.0, 0.0], [2.0, 4.0, 6.0]]
    assert solid.volume == pytest.approx(48.0)


@pytest.mark.parametrize("upwards", [1, -1])
def test_sewn_rings_face_outwards_in_either_order(upwards):
    """A double pyramid, sewn up or down: a base of 2 m2 (corners at 1 m on the axes) times 2 m of height, by 3.

    The volume is negative where faces look inwards.
    """
    base = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    rings = [np.array([[0.0, -1.0, 0.0]]), base, np.array([[0.0, 1.0, 0.0]])][::upwards]
    assert sewn(rings).volume == pytest.approx(4.0 / 3.0)
