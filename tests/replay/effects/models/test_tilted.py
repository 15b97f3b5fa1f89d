import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from replay.effects.models.tilted import volume_kept

RADIUS, HEIGHT = 0.03, 0.08
NODES, WEIGHTS = np.polynomial.legendre.leggauss(80)
RIGHT = math.pi / 2


def integral(tilt, radius, height):
    """Columns of liquid over the floor, summed: no formula of the module, and no difference of nearly equal numbers.

    A column at distance u from the wall below the lip is ``height - u tan(tilt)`` high and ``2 sqrt(u (2R - u))`` wide;
    with u = 2 R sin^2(a / 2) both are smooth in a.
    """
    slope = math.tan(tilt)
    reach = height / slope if slope > 0.0 else math.inf
    last = math.pi if reach >= 2 * radius else 2 * math.asin(math.sqrt(reach / (2 * radius)))
    angle = 0.5 * last * (NODES + 1.0)
    column = height - 2.0 * radius * np.sin(angle / 2) ** 2 * slope
    if last < math.pi:
        column = 2.0 * radius * slope * np.sin((last - angle) / 2) * np.sin((last + angle) / 2)
    return float(0.5 * last * np.sum(WEIGHTS * 2.0 * radius**2 * np.sin(angle) ** 2 * column))


TILTS = [1e-9, 0.1, 10, 50, 53, 53.13, 54, 70, 80, 85, 89, 89.9, 89.99, 89.9999, 90 - 1e-6, 90 - 1e-8, 90 - 1e-9]


@pytest.mark.parametrize("degrees", TILTS)
@pytest.mark.parametrize(("radius", "height"), [(0.03, 0.08), (0.04, 0.006), (0.004, 0.2)])
def test_the_volume_kept_is_the_integral_to_one_in_a_billion(degrees, radius, height):
    tilt = math.radians(degrees)
    assert volume_kept(tilt, radius, height) == pytest.approx(integral(tilt, radius, height), rel=1e-9)


@given(st.floats(0.0, 90 - 1e-9), st.floats(0.001, 1.0), st.floats(0.001, 1.0))
def test_the_volume_kept_is_the_integral_for_any_cylinder(degrees, radius, height):
    tilt = math.radians(degrees)
    assert volume_kept(tilt, radius, height) == pytest.approx(integral(tilt, radius, height), rel=1e-9)


def test_more_tilt_never_keeps_more_up_to_a_billionth_of_a_degree_from_level():
    degrees = np.concatenate([np.linspace(0, 89, 2000), 90 - np.logspace(0, -9, 4000)])
    kept = [volume_kept(math.radians(value), RADIUS, HEIGHT) for value in degrees]
    assert all(after <= before for before, after in pairwise(kept)) and kept[-1] > 0.0


def test_both_forms_meet_where_the_liquid_leaves_half_the_floor():
    joint = math.atan(HEIGHT / (2 * RADIUS))
    assert volume_kept(joint, RADIUS, HEIGHT) == pytest.approx(math.pi * RADIUS**2 * HEIGHT / 2, rel=1e-12)


def test_a_level_or_overturned_vessel_keeps_nothing_and_an_upright_one_all():
    assert [volume_kept(angle, RADIUS, HEIGHT) for angle in (RIGHT, 2.0, math.pi)] == [0.0, 0.0, 0.0]
    assert volume_kept(0.0, RADIUS, HEIGHT) == math.pi * RADIUS**2 * HEIGHT
