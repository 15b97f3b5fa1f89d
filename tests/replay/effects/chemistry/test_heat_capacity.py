"""The heat capacity of a liquid that a scene does not tell is that of its water and of what is dissolved."""

import numpy as np
import pytest
from support.liquid_worlds import WIDE_BEAKER, effects_of_tilt_degrees, glass

HEAT = {"of": "liquids", "ambient_c": 20.0, "loss_w_per_k": 0.0}
NEUTRAL = ("reaction", {"equation": "HCl + NaOH -> NaCl + H2O"})


def neutralised(molar, per_ml=None):
    """The effect heat of 50 mL of hydrochloric acid poured on 50 mL of lye."""
    a, b = (
        glass(name, volume_ml=50.0, solute=solute, molar=molar, cavity=WIDE_BEAKER)
        for name, solute in (("a", "HCl"), ("b", "NaOH"))
    )
    heat = ("heat", HEAT if per_ml is None else {**HEAT, "heat_capacity_j_per_ml_k": per_ml})
    effects = effects_of_tilt_degrees([0.0, *([120.0] * 60)], (a, b), ("mixing", {"in": ["b"]}), NEUTRAL, heat)
    return effects["heat"]


def last_temperature_of_b(effect):
    """The temperature of vessel b at the end, degC."""
    return effect.series["b/temperature"].values[-1]


# Solution of 20 % by mass unless named, J/(mL K) of it by handbooks (specific heat times density, without a copy
# at hand), and by how much of it the estimate may be off.
STRONG = [
    ({"NaCl": 3.93}, 3.45 * 1.148, 0.04),
    ({"CaCl2": 2.13}, 3.1 * 1.177, 0.09),
    ({"NaOH": 6.1}, 3.5 * 1.219, 0.06),
    ({"KNO3": 2.24}, 3.5 * 1.133, 0.05),
    ({"H2SO4": 7.11}, 2.57 * 1.395, 0.05),  # 50 %
    ({"HCl": 9.08}, 2.64 * 1.144, 0.20),  # 29 %
]


@pytest.mark.parametrize(("solutes", "per_ml", "tolerance"), STRONG)
def test_concentrated_solution_cools_by_its_own_heat_capacity(solutes, per_ml, tolerance):
    """By Newton's law at 100 W/K; with 4.18 J/K for every millilitre all but lye are farther off."""
    beaker = glass("b", volume_ml=50.0, solutes=solutes, properties={"temperature_c": 30.0}, cavity=WIDE_BEAKER)
    heat = ("heat", {**HEAT, "loss_w_per_k": 100.0})
    effects = effects_of_tilt_degrees([0.0] * 60, (glass("a", volume_ml=1.0), beaker), ("mixing", {"in": ["b"]}), heat)
    series = effects["heat"].series["b/temperature"]
    seconds = series.times[-1] - series.times[0]
    capacity = 100.0 * seconds / np.log((series.values[0] - 20.0) / (series.values[-1] - 20.0)) / 50.0
    assert capacity == pytest.approx(per_ml, rel=tolerance)
    if "NaOH" not in solutes:
        assert abs(capacity - per_ml) < abs(4.18 - per_ml)


def test_dilute_solutions_keep_the_heat_of_water():
    """1 mol/L, against water's 4.18 J/K a millilitre."""
    effect, declared = neutralised(molar=1.0), neutralised(molar=1.0, per_ml=4.18)
    assert last_temperature_of_b(effect) == pytest.approx(last_temperature_of_b(declared), abs=0.02)
    assert not effect.output.events_named("estimated")


def test_a_strong_capacity_is_named_as_estimated_unless_declared():
    """6 mol/L, against a declared 4 J/K a millilitre: estimates are named for both vessels, and are not 4 J/K."""
    effect, declared = neutralised(molar=6.0), neutralised(molar=6.0, per_ml=4.0)
    events = effect.output.events_named("estimated")
    assert {event.bodies for event in events} == {("a",), ("b",)}
    assert all("may be off by a tenth" in event.text for event in events)
    assert not declared.output.events_named("estimated")
    assert last_temperature_of_b(effect) != pytest.approx(last_temperature_of_b(declared), abs=0.1)
