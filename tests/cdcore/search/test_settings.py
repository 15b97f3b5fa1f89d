"""Settings are checked by name, and the message says what to give."""

import pytest

from cdcore.errors import InvalidSettingError
from cdcore.search.settings import EQUATIONS, VARIANTS, SearchSettings

BAD = [
    ("variant", "quick", "memetic, corrected"),
    ("decode", "sine", "angle, amplitude"),
    ("without_equation", 14, "15, 16"),
    ("ants", 0, "1 or more"),
    ("ants", 2.5, "whole number"),
    ("budget", 0, "1 or more"),
    ("mutation", 1.5, "0 to 1"),
    ("evaporation", -0.1, "0 to 1"),
    ("beta", float("nan"), "0 to 1000"),
    ("budget_seconds", 0.0, "above 0"),
    ("seed", 1.5, "whole number"),
    ("samples", 0, "1 or more"),
    ("samples", "many", "1 or more"),
    ("target_recall", 1.5, "0 to 1"),
    ("pheromone_least", 11.0, "up to pheromone_most"),
]


@pytest.mark.parametrize(("name", "value", "hint"), BAD)
def test_a_value_out_of_range_is_refused_by_name(name, value, hint):
    with pytest.raises(InvalidSettingError, match=f"{name}=.*{hint}"):
        SearchSettings(**{name: value})


def test_auto_has_its_own_budget_and_stops_at_the_first_hit():
    with pytest.raises(InvalidSettingError, match="leave budget_seconds out"):
        SearchSettings(samples="auto", budget_seconds=0.1)
    with pytest.raises(InvalidSettingError, match="leave stop_first=False out"):
        SearchSettings(samples="auto", stop_first=False)


def test_the_defaults_are_those_of_the_sweep():
    s = SearchSettings()
    assert (s.variant, s.ants, s.mutation, s.alpha, s.beta) == ("memetic", 20, 0.05, 1.0, 3.0)
    assert (s.evaporation, s.reward, s.pheromone_least, s.pheromone_most) == (0.1, 1.0, 1e-3, 10.0)
    assert s.restart_after == 1500
    assert s.turn == pytest.approx(0.15 * 3.14159265)


def test_every_variant_and_every_equation_switched_off_is_accepted():
    for variant in VARIANTS:
        for equation in (None, *EQUATIONS):
            assert SearchSettings(variant=variant, without_equation=equation).variant == variant
