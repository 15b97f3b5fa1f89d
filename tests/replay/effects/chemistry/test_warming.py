"""Warming and gases against closed forms."""

import pytest

from replay.effects.chemistry.gas_laws import gas_ml_per_mol
from replay.effects.chemistry.warming import heat_given_off


def test_an_acid_in_much_water_gives_all_and_in_none_nothing():
    heat = 17860 * 4.184  # thermochemical calories. Source: NIST SP 811, appendix B
    assert heat_given_off(1.0, 1e9, heat, 1.798) == pytest.approx(heat, rel=1e-8)
    assert heat_given_off(1.0, 1.798, heat, 1.798) == pytest.approx(heat / 2)
    assert [heat_given_off(*two, heat, 1.798) for two in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))] == [0.0, 0.0, 0.0]


WATER = (8.07131, 1730.63, 233.426)
"""Of water from 1 to 100 degC, as handbooks print it; here only a test's input."""


def test_the_molar_volume_at_standard_conditions_is_that_of_codata():
    assert gas_ml_per_mol(0.0, 101325.0) == pytest.approx(22413.97, abs=0.01)
    assert gas_ml_per_mol(0.0, 100000.0) == pytest.approx(22710.95, abs=0.01)


def test_over_water_a_gas_takes_more_room_up_to_the_boiling_point():
    wet = gas_ml_per_mol(20.0, 101325.0, WATER)
    assert wet / gas_ml_per_mol(20.0, 101325.0) == pytest.approx(1.0236, abs=2e-4)
    with pytest.raises(ValueError, match="no gas is collected"):
        gas_ml_per_mol(100.1, 101325.0, WATER)
    with pytest.raises(ValueError, match="has no value"):
        gas_ml_per_mol(-234.0, 101325.0, WATER)
