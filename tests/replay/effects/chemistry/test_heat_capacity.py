"""The heat capacity of a liquid that a scene does not tell is that of its water and of what is dissolved."""

import numpy as np
import pytest
from support.liquid_worlds import WIDE_BEAKER, effects_of_tilt_degrees, glass

HEAT = {"of": "liquids", "ambient_c": 20.0, "loss_w_per_k": 0.0}
NEUTRAL = ("reaction", {"equation": "HCl + NaOH -> NaCl + H2O"})


def heat_of_neutralisation(molar, per_ml=None):
    """The effect heat of 50 mL of hydrochloric acid poured on 50 mL of lye, of so many mol/L each.

    ``per_ml``: J/(mL K) of the liquids that the scene declares, if it does.
    """
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
    """50 mL of a solution (mol/L) cool from 30 degC at 100 W/K in a room of 20 degC; ``per_ml``: J/(mL K) of handbooks.

    By Newton's law the cooling reveals the heat capacity that the product takes; 4.18 J/(mL K), that of water, would be
    farther off for all but lye.
    """
    beaker = glass("b", volume_ml=50.0, solutes=solutes, properties={"temperature_c": 30.0}, cavity=WIDE_BEAKER)
    heat = ("heat", {**HEAT, "loss_w_per_k": 100.0})
    effects = effects_of_tilt_degrees([0.0] * 60, (glass("a", volume_ml=1.0), beaker), ("mixing", {"in": ["b"]}), heat)
    series = effects["heat"].series["b/temperature"]
    seconds = series.times[-1] - series.times[0]
    room_c, loss_w_per_k = 20.0, 100.0
    cooling = np.log((series.values[0] - room_c) / (series.values[-1] - room_c))
    computed_per_ml = loss_w_per_k * seconds / cooling / 50.0
    assert computed_per_ml == pytest.approx(per_ml, rel=tolerance)
    if "NaOH" not in solutes:
        assert abs(computed_per_ml - per_ml) < abs(4.18 - per_ml)


def test_dilute_solutions_have_the_heat_capacity_of_water():
    """Acid is poured into lye, 1 mol/L each: it ends as warm as where the scene declares water's 4.18 J/(mL K).

    No event says that the heat capacity is estimated.
    """
    effect, declared = heat_of_neutralisation(molar=1.0), heat_of_neutralisation(molar=1.0, per_ml=4.18)
    assert last_temperature_of_b(effect) == pytest.approx(last_temperature_of_b(declared), abs=0.02)
    assert not effect.output.events_named("estimated")


def test_a_strong_capacity_is_named_as_estimated_unless_declared():
    """Acid in glass a is poured into lye in b, 6 mol/L each: for each an event says that its capacity is estimated.

    Where the scene declares 4 J/(mL K) there is none, and the mixture ends at another temperature.
    """
    effect, declared = heat_of_neutralisation(molar=6.0), heat_of_neutralisation(molar=6.0, per_ml=4.0)
    events = effect.output.events_named("estimated")
    assert {event.bodies for event in events} == {("a",), ("b",)}
    assert all("may be off by a tenth" in event.text for event in events)
    assert not declared.output.events_named("estimated")
    assert last_temperature_of_b(effect) != pytest.approx(last_temperature_of_b(declared), abs=0.1)
