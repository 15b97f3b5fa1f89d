"""Warming and cooling against closed forms."""

import numpy as np
import pytest

from replay.effects.chemistry.warming import heat_given_off, heating_curve, temperature_after_seconds


# Source: R. M. Felder and R. W. Rousseau, Elementary Principles of Chemical Processes, table B.11.
@pytest.mark.parametrize(
    ("acid_mol", "water_mol", "joule", "relative"),
    [
        pytest.param(1.0, 1.0, 28.07e3, 1e-6, id="first row"),
        pytest.param(2.0, 20.0, 2.0 * 67.03e3, 1e-6, id="two mol with ten times as much"),
        pytest.param(1.0, 50.0, 73.34e3, 1e-6, id="last row"),
        pytest.param(1.0, 1e9, 73.34e3, 1e-6, id="beyond the table its last"),
        pytest.param(1.0, 4.0, 54.06e3, 0.01, id="4, between rows, by the literature"),
        pytest.param(1.0, 25.0, 72.3e3, 0.01, id="25, between rows, by the literature"),
        pytest.param(0.0, 0.0, 0.0, 0.0, id="nothing"),
        pytest.param(1.0, 0.0, 0.0, 0.0, id="acid alone"),
        pytest.param(0.0, 1.0, 0.0, 0.0, id="water alone"),
    ],
)
def test_acid_gives_the_heat_of_its_table_and_no_more(acid_mol, water_mol, joule, relative):
    """The table has J per mol of sulfuric acid that is mixed with 1, 10 and 50 mol of water per mol of acid."""
    table = {1.0: 28.07e3, 10.0: 67.03e3, 50.0: 73.34e3}
    released = heat_given_off(np.array([acid_mol]), np.array([water_mol]), table)
    assert released == pytest.approx([joule], rel=relative, abs=0.0)


@pytest.mark.parametrize("loss_w_per_k", [0.0, 1e-9, 0.4, 40.0])
def test_an_excess_falls_by_newtons_law(loss_w_per_k):
    """A body of 418 J/K is 30 K above the room, which is at 0 where nothing else is stated."""
    seconds, capacity = np.array([0.0, 0.01, 1.0, 60.0]), 418.0
    expected = 30.0 * np.exp(-loss_w_per_k * seconds / capacity)
    above_room = temperature_after_seconds(30.0, seconds, capacity=capacity, loss=loss_w_per_k)
    assert above_room == pytest.approx(expected, rel=1e-12, abs=1e-13)


@pytest.mark.parametrize(
    ("seconds", "loss_w_per_k", "celsius"),
    [(1e6, 0.4, 20.0 + 8.0 / 0.4), (10.0, 0.0, 20.0 + 8.0 * 10.0 / 100.0)],
    ids=["balance with the loss after long", "no loss, 10 s"],
)
def test_a_steady_power_leads_to_its_balance(seconds, loss_w_per_k, celsius):
    """A body of 100 J/K, as warm as the room of 20 degC at first, is heated by 8 W."""
    warmed = temperature_after_seconds(
        celsius=20.0, seconds=seconds, power_w=8.0, capacity=100.0, loss=loss_w_per_k, ambient=20.0
    )
    assert warmed == pytest.approx(celsius, rel=1e-12)


@pytest.mark.parametrize(("boils", "highest"), [(100.0, 25.0), (22.5, 22.5)])
def test_heating_curve_rises_while_there_is_power(boils, highest):
    """A body of 10 J/K without loss, a row a second: 10 W from the first and from the sixth row on, none in between.

    It rises by 1 K a second, up to ``boils``, its boiling point.
    """
    times, power_w = np.arange(8.0), np.array([10.0, 10.0, 10.0, 0.0, 0.0, 10.0, 10.0, 10.0])
    curve = heating_curve(times, power_w, capacity=10.0, loss=0.0, ambient=20.0, boils=boils)
    unlimited = np.array([20.0, 21.0, 22.0, 23.0, 23.0, 23.0, 24.0, 25.0])
    assert curve == pytest.approx(np.minimum(unlimited, highest), rel=1e-12)


def test_heating_curve_cools_by_newtons_law_without_power():
    """10 W for 2 s warm a body of 10 J/K that loses 1 W/K; afterwards it cools towards the room's 20 degC.

    It goes towards 10 W / 1 W/K = 10 K above the room, and back, by exp(-1/10) a second.
    """
    times, power_w = np.arange(5.0), np.array([10.0, 10.0, 0.0, 0.0, 0.0])
    curve = heating_curve(times, power_w, capacity=10.0, loss=1.0, ambient=20.0, boils=100.0)
    highest = 10.0 * (1.0 - np.exp(-0.2))
    expected = 20.0 + np.array([0.0, 10.0 * (1.0 - np.exp(-0.1)), *(highest * np.exp([0.0, -0.1, -0.2]))])
    assert curve == pytest.approx(expected, rel=1e-12)
