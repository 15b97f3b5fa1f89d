"""The corrected equations keep what they promise, and a search that comes to nothing begins again within its budget.

Equations 15 to 20 are those of the paper's quantum ant colony; a setting leaves out one of them.
"""

from types import SimpleNamespace

import numpy as np
import pytest
from support.search_scenes import I3, ball_of, search_of

from cdcore.search.state import ANT, SEARCH_RECORD, draw
from cdcore.search.swarm import decode_angle, rotated_towards, weigh

AT_ORIGIN = (I3, np.zeros(3))


def search_state(**changes):
    """The state of a search, with the published settings but for ``changes``."""
    states = np.zeros(1, dtype=SEARCH_RECORD).view(np.recarray)
    state = states[0]
    published = {"turn": 0.15 * np.pi, "alpha": 1.0, "beta": 3.0, "evaporation": 0.1}
    for name, value in {**published, "pheromone_least": 1e-3, "pheromone_most": 10.0, **changes}.items():
        state[name] = value
    return state


def test_angles_without_equation_15_name_features_in_their_order():
    """From -pi to pi ten features (faces) follow each other, a fifth of pi each; here the angles in their middles."""
    state, ant_of_first_body = SimpleNamespace(left_out_equation=15), 0
    middles = np.linspace(-np.pi, np.pi, 10, endpoint=False) + 0.1 * np.pi
    assert [decode_angle(angle, ant_of_first_body, 10, state) for angle in middles] == list(range(10))


def test_search_random_numbers_are_splitmix64():
    """SplitMix64's reference implementation prints these first numbers of seed 1234567; a draw has
    their upper 53 bits.
    """
    state = search_state(stream=1234567)
    expected = [6457827717110365317, 3203168211198807973, 9817491932198370423]
    with np.errstate(over="ignore"):
        drawn = [int(draw(state) * 2.0**53) for _ in expected]
    assert drawn == [number >> 11 for number in expected]


@pytest.mark.parametrize("chain", [0, 1], ids=["cosine", "sine"])
def test_equation_15_draws_every_face_about_equally_often(chain):
    """Equation 15 names a face by the cosine (chain 0) or the sine (chain 1) of an angle: 20 faces, 10,000 angles.

    Each face is expected 500 times, with a standard deviation of 22; more than 120 off is no chance.
    """
    count, draws, state = 20, 10_000, SimpleNamespace(left_out_equation=0)
    angles = np.random.default_rng(0).uniform(0, 2 * np.pi, draws).tolist()
    drawn = np.bincount([decode_angle(angle, chain, count, state) for angle in angles], minlength=count)
    assert np.abs(drawn - draws / count).max() < 120


def steps_of_ants(left_out_equation):
    """Changes of angle of 500 ants at 3 rad that turn towards one at -3 rad, from -pi to pi."""
    state = search_state(left_out_equation=left_out_equation)
    with np.errstate(over="ignore"):
        angles = np.array([rotated_towards(3.0, -3.0, state) for _ in range(500)])
    return np.angle(np.exp(1j * (angles - 3.0)))


def test_step_takes_the_short_arc_with_equation_17():
    """From 3 to -3 rad the short arc goes up, by 0.28 rad; equation 18, which steps do not need, is left out."""
    assert (steps_of_ants(left_out_equation=18) > 0).all()


def test_step_takes_either_arc_without_equation_17():
    """From 3 to -3 rad half of 500 ants go up, by the short arc, and half down."""
    assert 0.4 < (steps_of_ants(left_out_equation=17) < 0).mean() < 0.6


@pytest.mark.sampled(3)
@pytest.mark.parametrize("spread", [0.0, 2.0, 300.0], ids="pheromone from 10^-{0} to 10^{0}".format)
@pytest.mark.parametrize("left_out_equation", [0, 16, 20], ids=["all equations", "without 16", "without 20"])
def test_probabilities_are_finite_not_negative_and_sum_to_1(spread, left_out_equation):
    """``weigh`` gives 50 ants running sums of their weights and returns the last: a probability is an ant's part of it.

    Weights go with pheromone x heuristic^3, equation 16 with alpha 1 and beta 3; without equation 16 all are equal.
    Nothing evaporates here, so that equation 20 changes no pheromone.
    """
    rng, ants = np.random.default_rng(5), 50
    swarm = np.zeros(ants, dtype=ANT).view(np.recarray)
    swarm["pheromone"] = 10.0 ** rng.uniform(-spread, spread, ants)
    swarm["heuristic"] = 1 / (1e-3 + rng.random(ants) * 1e3)
    swarm["fitness"] = rng.random(ants)
    state = search_state(
        ants=ants, left_out_equation=left_out_equation, pheromone_least=1e-300, pheromone_most=1e300, evaporation=0.0
    )
    if left_out_equation == 16:
        expected = np.ones(ants)
    else:
        pheromone, heuristic = (swarm[name] / swarm[name].max() for name in ("pheromone", "heuristic"))
        expected = pheromone * heuristic**3
    best_ant = 0
    total = weigh(swarm, best_ant, state)
    probability = np.diff(swarm["weight"], prepend=0.0) / total
    assert np.isfinite(probability).all()
    assert (probability >= 0).all()
    assert probability.sum() == pytest.approx(1.0, abs=1e-12)
    assert np.allclose(probability, expected / expected.sum(), atol=1e-9)


@pytest.mark.parametrize(
    ("left_out_equation", "pheromone"),
    [
        pytest.param(0, [0.9, 0.95, 0.9], id="with equation 20"),
        pytest.param(20, [1.0, 1.0, 1.0], id="without equation 20"),
    ],
)
def test_evaporation_pulls_pheromone_down_and_lifts_the_best(left_out_equation, pheromone):
    """Three ants with a pheromone of 1: equation 20 takes a tenth off, and gives ant 1 a tenth of its
    fitness of 0.5.
    """
    swarm, best_ant = np.ones(3, dtype=ANT).view(np.recarray), 1
    swarm["fitness"] = 0.5
    weigh(swarm, best_ant, search_state(ants=3, left_out_equation=left_out_equation))
    assert np.allclose(swarm["pheromone"], pheromone)


def search_without(equation):
    """A search of two balls of radius 1 m, 2.4 m apart, that leaves out an equation, and its result."""
    ball = ball_of(faces=600)
    never = 10**9
    search = search_of(ball, ball, variant="corrected", budget=4000, without_equation=equation, restart_after=never)
    return search, search.search((I3, np.array([2.4, 0, 0])), AT_ORIGIN, stamp=0.0)


@pytest.mark.parametrize("equation", [None, 15, 16, 17, 18, 19, 20])
def test_pheromone_stays_inside_its_clamp(equation):
    """Balls that never meet, and 4,000 evaluations: pheromone stays from 0.001 to 10, whatever equation is left out."""
    search, _result = search_without(equation)
    pheromone = search.swarm["pheromone"]
    assert pheromone.min() >= 1e-3
    assert pheromone.max() <= 10.0


@pytest.mark.parametrize("equation", [15, 16, 17, 18, 19, 20])
def test_every_equation_matters(equation):
    """Without any one of the equations a search of 4,000 evaluations comes to another result than with all."""
    _search, result = search_without(equation)
    _search, result_of_all = search_without(equation=None)
    assert result != result_of_all


def test_search_of_larger_meshes_evaluates_the_same_pairs():
    """Two balls 2.4 m apart, and the same 1,024 times as large: only the smallest distance is 1,024 times as large.

    A power of two changes no rounding, and fitness is a distance over the mean size of both meshes.
    """
    results = []
    for scale in (1.0, 1024.0):
        ball = ball_of(600, radius=scale)
        search = search_of(ball, ball, variant="corrected", budget=1000)
        results.append(search.search((I3, np.array([2.4, 0, 0]) * scale), AT_ORIGIN, stamp=0.0))
    small, large = results
    assert large == small._replace(distance=1024.0 * small.distance)


SEPARATE = (I3, np.array([2.4, 0.2, 0.1]))
"""A pose of a ball of radius 1 m in which it does not meet one at the origin."""


@pytest.mark.parametrize("variant", ["memetic", "corrected", "local", "random"])
@pytest.mark.parametrize("budget", [1, 7, 40, 1000])
def test_the_budget_is_kept_to_the_evaluation(variant, budget):
    """Balls apart, so that no hit ends the search early: it evaluates exactly so many pairs of faces."""
    ball = ball_of(faces=600)
    query = search_of(ball, ball, variant=variant, budget=budget).search(SEPARATE, AT_ORIGIN, stamp=0.0)
    assert query.evaluations == budget


@pytest.mark.parametrize("budget", [1, 7, 40, 1000])
def test_printed_search_spends_its_budget_or_breaks(budget):
    """The printed equations may give probabilities that are none: then the search is "broken", before its budget."""
    ball = ball_of(faces=600)
    query = search_of(ball, ball, variant="printed", budget=budget).search(SEPARATE, AT_ORIGIN, stamp=0.0)
    if query.reason == "broken":
        assert query.evaluations < budget
    else:
        assert query.evaluations == budget


@pytest.mark.parametrize("variant", ["memetic", "corrected"])
@pytest.mark.parametrize(
    ("restart_after", "fewest", "most"),
    [pytest.param(1000, 5, 9, id="after 1,000"), pytest.param(10**6, 0, 0, id="after a million")],
)
def test_population_is_redrawn_after_evaluations_without_progress(variant, restart_after, fewest, most):
    """Balls apart, and a budget of 9,000 evaluations: room for at most nine times 1,000 without progress.

    Progress takes up some of them: at least five are left (by trial).
    """
    ball = ball_of(faces=600)
    search = search_of(ball, ball, variant=variant, budget=9000, restart_after=restart_after)
    assert fewest <= search.search(SEPARATE, AT_ORIGIN, stamp=0.0).restarts <= most
