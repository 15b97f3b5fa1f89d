import pytest

from replay.effects.models.gas_laws import gas_ml_per_mol, vapour_pressure_pa

WATER = (8.07131, 1730.63, 233.426)
"""Of water from 1 to 100 degC, as handbooks print it; here only a test's input."""


def test_the_molar_volume_at_standard_conditions_is_that_of_codata():
    assert gas_ml_per_mol(0.0, 101325.0) == pytest.approx(22413.97, abs=0.01)
    assert gas_ml_per_mol(0.0, 100000.0) == pytest.approx(22710.95, abs=0.01)


def test_water_boils_at_its_boiling_point_and_over_water_a_gas_takes_more_room():
    assert vapour_pressure_pa(100.0, WATER) == pytest.approx(101325.0, rel=0.002)
    wet = gas_ml_per_mol(20.0, 101325.0, vapour_pressure_pa(20.0, WATER))
    assert wet / gas_ml_per_mol(20.0, 101325.0) == pytest.approx(1.0236, abs=2e-4)


@pytest.mark.parametrize(("celsius", "vapour"), [(-273.15, 0.0), (20.0, 101325.0), (20.0, 2e5)])
def test_where_there_is_no_gas_it_says_so(celsius, vapour):
    with pytest.raises(ValueError, match="no gas is collected"):
        gas_ml_per_mol(celsius, 101325.0, vapour)


def test_antoines_pole_is_refused():
    with pytest.raises(ValueError, match="no value at -233"):
        vapour_pressure_pa(-233.426, WATER)
