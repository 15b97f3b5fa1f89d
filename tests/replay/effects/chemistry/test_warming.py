"""Warming and cooling against closed forms."""

import numpy as np
import pytest

from replay.effects.chemistry.warming import cooled, heat_given_off


def test_an_acid_in_much_water_gives_all_its_heat():
    heat = 17860 * 4.184  # thermochemical calories. Source: NIST SP 811, appendix B
    assert heat_given_off(1.0, 1e9, heat, 1.798) == pytest.approx(heat, rel=1e-8)
    assert heat_given_off(1.0, 1.798, heat, 1.798) == pytest.approx(heat / 2)
    assert [heat_given_off(*two, heat, 1.798) for two in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))] == [0.0, 0.0, 0.0]


@pytest.mark.parametrize("loss", [0.0, 1e-9, 0.4, 40.0])
def test_an_excess_falls_by_newtons_law(loss):
    seconds, capacity = np.array([0.0, 0.01, 1.0, 60.0]), 418.0
    expected = 30.0 * np.exp(-loss * seconds / capacity)
    assert cooled(30.0, seconds, capacity=capacity, loss=loss) == pytest.approx(expected, rel=1e-12, abs=1e-13)


def test_a_steady_power_leads_to_its_balance():
    assert cooled(20.0, 1e6, power_w=8.0, capacity=100.0, loss=0.4, ambient=20.0) == pytest.approx(40.0, rel=1e-12)
    assert cooled(20.0, 10.0, power_w=8.0, capacity=100.0, loss=0.0, ambient=20.0) == pytest.approx(20.8, rel=1e-12)
