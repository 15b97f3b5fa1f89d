"""A search keeps its budget, restarts when nothing comes of it, and does not depend on how numbers are handed to it."""

import numpy as np
import pytest
from support.search_scenes import I3, ball_of, search_of

from cdcore.search import pair_search

APART = (I3, np.array([2.4, 0.2, 0.1]))
HERE = (I3, np.zeros(3))


@pytest.mark.parametrize("variant", ["memetic", "corrected", "local", "random", "printed"])
@pytest.mark.parametrize("budget", [1, 7, 40, 1000])
def test_the_budget_is_kept_to_the_evaluation(variant, budget):
    ball = ball_of(600)
    look = search_of(ball, ball, variant=variant, budget=budget).look(APART, HERE, 0.0)
    assert look.evaluations == budget or (look.reason == "broken" and look.evaluations < budget)


@pytest.mark.parametrize("variant", ["memetic", "corrected"])
def test_the_population_is_drawn_anew_after_so_many_evaluations_without_a_hit(variant):
    ball = ball_of(600)
    look = search_of(ball, ball, variant=variant, budget=9000, restart_after=1000).look(APART, HERE, 0.0)
    assert 5 <= look.restarts <= 9
    assert search_of(ball, ball, variant=variant, budget=9000, restart_after=10**6).look(APART, HERE, 0.0).restarts == 0


@pytest.mark.parametrize("variant", ["memetic", "corrected", "local", "random"])
def test_the_block_in_which_random_numbers_come_changes_nothing(variant, monkeypatch):
    ball = ball_of(600)
    looks = []
    for block in (400, 2048, 50_000):
        monkeypatch.setattr(pair_search, "BLOCK", block)
        looks.append(search_of(ball, ball, variant=variant, budget=6000).look(APART, HERE, 0.0))
    assert looks[0] == looks[1] == looks[2]


@pytest.mark.parametrize("variant", ["memetic", "corrected", "local", "random"])
def test_the_closest_pair_only_gets_closer_with_the_budget(variant):
    ball = ball_of(600)
    search = search_of(ball, ball, variant=variant)
    best = [search.look(APART, HERE, 0.0, budget=budget).distance for budget in (20, 100, 500, 2500, 10_000)]
    assert best == sorted(best, reverse=True)
    assert best[-1] < best[0]


def test_one_ant_is_a_random_walk_that_still_ends():
    ball = ball_of(100)
    look = search_of(ball, ball, variant="corrected", ants=1, budget=500).look(APART, HERE, 0.0)
    assert (look.evaluations, look.reason) == (500, "budget")
