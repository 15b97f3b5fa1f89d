"""Warming and cooling against closed forms."""

import numpy as np
import pytest

from replay.effects.chemistry.warming import heat_given_off, heating_curve, temperature_after_seconds

# Source: R. M. Felder and R. W. Rousseau, Elementary Principles of Chemical Processes, table B.11.
DILUTIONS = {
    "first row": (1.0, 1.0, 28.07e3, 1e-6),
    "two mol with ten times as much": (2.0, 20.0, 2.0 * 67.03e3, 1e-6),
    "last row": (1.0, 50.0, 73.34e3, 1e-6),
    "beyond the table its last": (1.0, 1e9, 73.34e3, 1e-6),
    "4, between rows, by the literature": (1.0, 4.0, 54.06e3, 0.01),
    "25, between rows, by the literature": (1.0, 25.0, 72.3e3, 0.01),
    "nothing": (0.0, 0.0, 0.0, 0.0),
    "acid alone": (1.0, 0.0, 0.0, 0.0),
    "water alone": (0.0, 1.0, 0.0, 0.0),
}


def test_acid_gives_the_heat_of_its_table_and_no_more():
    """``table``: mol of water for a mol of sulfuric acid -> J that their mixing gives off, by a textbook.

    ``joule`` of a mixture are a row of it, times the mol of acid; between rows, here 4 and 25, the textbook's values
    within 1 %; beyond the last row, that row.
    """
    table = {1.0: 28.07e3, 10.0: 67.03e3, 50.0: 73.34e3}
    for case, (acid_mol, water_mol, joule, relative) in DILUTIONS.items():
        released = heat_given_off(np.array([acid_mol]), np.array([water_mol]), table)
        assert released == pytest.approx([joule], rel=relative, abs=0.0), case


def test_an_excess_falls_by_newtons_law():
    """A body of 418 J/K is 30 K above the room at first; after t seconds exp(-loss t / 418) of that is left.

    The room is at 0 degC, as nothing else is stated.
    """
    for loss_w_per_k in [0.0, 1e-9, 0.4, 40.0]:
        seconds, capacity = np.array([0.0, 0.01, 1.0, 60.0]), 418.0
        expected = 30.0 * np.exp(-loss_w_per_k * seconds / capacity)
        above_room = temperature_after_seconds(30.0, seconds, capacity=capacity, loss=loss_w_per_k)
        assert above_room == pytest.approx(expected, rel=1e-12, abs=1e-13), loss_w_per_k


def test_a_steady_power_leads_to_its_balance():
    """A body of 100 J/K, as warm as the room of 20 degC at first, is heated by 8 W.

    At 20 K above the room a loss of 0.4 W/K takes all 8 W; without a loss it warms by 0.08 K a second.
    """
    for case, (seconds, loss_w_per_k, celsius) in {
        "balance with the loss after long": (1e6, 0.4, 20.0 + 8.0 / 0.4),
        "no loss, 10 s": (10.0, 0.0, 20.0 + 8.0 * 10.0 / 100.0),
    }.items():
        warmed = temperature_after_seconds(
            celsius=20.0, seconds=seconds, power_w=8.0, capacity=100.0, loss=loss_w_per_k, ambient=20.0
        )
        assert warmed == pytest.approx(celsius, rel=1e-12), case


def test_heating_curve_rises_while_there_is_power():
    """A body of 10 J/K without loss has 10 W from 0 to 3 s and from 5 s on, and none in between.

    With 10 W it warms by 1 K a second, from 20 degC up to ``boils``, its boiling point.
    """
    for boils, highest in [(100.0, 25.0), (22.5, 22.5)]:
        times, power_w = np.arange(8.0), np.array([10.0, 10.0, 10.0, 0.0, 0.0, 10.0, 10.0, 10.0])
        curve = heating_curve(times, power_w, capacity=10.0, loss=0.0, ambient=20.0, boils=boils)
        unlimited = np.array([20.0, 21.0, 22.0, 23.0, 23.0, 23.0, 24.0, 25.0])
        assert curve == pytest.approx(np.minimum(unlimited, highest), rel=1e-12), boils


def test_heating_curve_cools_by_newtons_law_without_power():
    """10 W for 2 s warm a body of 10 J/K that loses 1 W/K; afterwards it cools towards the room's 20 degC.

    It goes towards 10 W / 1 W/K = 10 K above the room, and back, by exp(-1/10) a second.
    """
    times, power_w = np.arange(5.0), np.array([10.0, 10.0, 0.0, 0.0, 0.0])
    curve = heating_curve(times, power_w, capacity=10.0, loss=1.0, ambient=20.0, boils=100.0)
    highest = 10.0 * (1.0 - np.exp(-0.2))
    expected = 20.0 + np.array([0.0, 10.0 * (1.0 - np.exp(-0.1)), *(highest * np.exp([0.0, -0.1, -0.2]))])
    assert curve == pytest.approx(expected, rel=1e-12)
