"""Warming and cooling against closed forms."""

import numpy as np
import pytest

from replay.effects.chemistry.warming import heat_given_off, temperature_after_seconds


def test_acid_gives_the_heat_of_its_table_and_no_more():
    """``heats``: J per mol of acid, by mol of water per mol of acid; beyond the table its last, of nothing none.

    At 4 and 25 mol of water, between rows of the table, the literature has 54.06 and 72.3 kJ/mol.
    """
    heats = {1.0: 28.07e3, 10.0: 67.03e3, 50.0: 73.34e3}
    acid, water = np.array([1.0, 2.0, 1.0, 1.0]), np.array([1.0, 20.0, 50.0, 1e9])
    assert heat_given_off(acid, water, heats) == pytest.approx([28.07e3, 2.0 * 67.03e3, 73.34e3, 73.34e3])
    # Source: R. M. Felder and R. W. Rousseau, Elementary Principles of Chemical Processes, table B.11.
    acid, water = np.ones(2), np.array([4.0, 25.0])
    assert heat_given_off(acid, water, heats) == pytest.approx([54.06e3, 72.3e3], rel=0.01)
    acid, water = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
    nothing = heat_given_off(acid, water, heats)
    assert nothing.tolist() == [0.0, 0.0, 0.0]


@pytest.mark.parametrize("loss", [0.0, 1e-9, 0.4, 40.0])
def test_an_excess_falls_by_newtons_law(loss):
    """30 K above the room at first, a heat capacity of 418 J/K, and ``loss`` in W/K."""
    seconds, capacity = np.array([0.0, 0.01, 1.0, 60.0]), 418.0
    expected = 30.0 * np.exp(-loss * seconds / capacity)
    assert temperature_after_seconds(30.0, seconds, capacity=capacity, loss=loss) == pytest.approx(
        expected, rel=1e-12, abs=1e-13
    )


def test_a_steady_power_leads_to_its_balance():
    """8 W and a loss of 0.4 W/K end 20 K above the room; without loss 8 W warm 100 J/K by 0.8 K in 10 s."""
    assert temperature_after_seconds(
        celsius=20.0, seconds=1e6, power_w=8.0, capacity=100.0, loss=0.4, ambient=20.0
    ) == pytest.approx(40.0, rel=1e-12)
    assert temperature_after_seconds(
        celsius=20.0, seconds=10.0, power_w=8.0, capacity=100.0, loss=0.0, ambient=20.0
    ) == pytest.approx(20.8, rel=1e-12)
