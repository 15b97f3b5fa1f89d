from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sessions.synthetic.experiments.pouring import SERIES_BELOW, kept_volume, tilt_keeping

R, H = 0.03, 0.08


@pytest.mark.parametrize(("degrees", "millilitres"), [(10, 211.24), (50, 125.11), (70, 46.09), (85, 5.96)])
def test_the_kept_volume_is_the_known_one(degrees, millilitres):
    assert kept_volume(math.radians(degrees), R, H) * 1e6 == pytest.approx(millilitres, abs=0.006)


@pytest.mark.parametrize("degrees", [5.0, 30.0, 53.0, 53.2, 65.0, 80.0, 88.0])
def test_the_kept_volume_is_what_columns_of_liquid_add_up_to(degrees):
    tilt = math.radians(degrees)
    x = (np.arange(40_000) + 0.5) / 20_000 * R - R
    level = np.clip(H - (R - x) * math.tan(tilt), 0.0, H)
    counted = (2.0 * np.sqrt(R**2 - x**2) * level).sum() * R / 20_000
    assert kept_volume(tilt, R, H) == pytest.approx(counted, rel=1e-4)


def test_both_forms_meet_and_nothing_is_kept_lying_down():
    joint = math.atan(H / (2.0 * R))
    assert kept_volume(joint, R, H) == pytest.approx(math.pi * R**2 * H / 2.0, rel=1e-12)
    assert kept_volume(joint + 1e-9, R, H) == pytest.approx(math.pi * R**2 * H / 2.0, rel=1e-7)
    assert kept_volume(math.pi / 2.0, R, H) == kept_volume(2.0, R, H) == 0.0
    assert kept_volume(0.0, R, H) == pytest.approx(math.pi * R**2 * H, rel=1e-15)


def test_it_falls_all_the_way_to_ninety_degrees():
    tilts = math.pi / 2.0 - np.logspace(0.0, -9.0, 4000)
    kept = [kept_volume(tilt, R, H) for tilt in tilts]
    assert (np.diff(kept) < 0.0).all()
    assert kept[-1] > 0.0


def test_the_series_continues_the_closed_form():
    # phi = SERIES_BELOW at tan(tilt) = H / (2 R sin^2(phi / 2)).
    slope = H / (2.0 * R * math.sin(SERIES_BELOW / 2.0) ** 2)
    below, above = (kept_volume(math.atan(slope * factor), R, H) for factor in (1.0 + 1e-9, 1.0 - 1e-9))
    # Kept volume goes with slope^-1.5 there, and the closed form has lost about five digits of sixteen.
    assert below == pytest.approx(above, rel=1e-8)
    phi = 1e-3
    steep = math.atan(H / (2.0 * R * math.sin(phi / 2.0) ** 2))
    exact = R**3 * math.tan(steep) * (2.0 / 15.0) * phi**5 * (1.0 - 11.0 * phi**2 / 42.0)
    assert kept_volume(steep, R, H) == pytest.approx(exact, rel=1e-9)


@given(st.floats(0.001, 0.999), st.floats(0.005, 0.05), st.floats(0.02, 0.3))
def test_the_tilt_that_keeps_a_volume_keeps_it(share, radius, height):
    volume = share * math.pi * radius**2 * height
    assert kept_volume(tilt_keeping(volume, radius, height), radius, height) == pytest.approx(volume, rel=1e-9)


def test_more_than_the_vessel_holds_is_refused():
    with pytest.raises(ValueError, match="cannot keep"):
        tilt_keeping(1.0, R, H)
