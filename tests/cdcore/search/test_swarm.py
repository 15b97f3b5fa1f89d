"""The corrected equations keep what they promise, and a search that comes to nothing begins again within its budget."""

from types import SimpleNamespace

import numpy as np
import pytest
from support.search_scenes import I3, ball_of, search_of

from cdcore.search.state import ANT, SEARCH_RECORD, draw
from cdcore.search.swarm import decode_angle, rotated_towards, weigh


def search_state(**changes):
    """The state of one search, with the published settings but for ``changes``."""
    return search_states(**changes)[0]


def search_states(**changes):
    """The same as an array of one state."""
    states = np.zeros(1, dtype=SEARCH_RECORD).view(np.recarray)
    state = states[0]
    usual = {"turn": 0.15 * np.pi, "alpha": 1.0, "beta": 3.0, "evaporation": 0.1}
    for name, value in {**usual, "pheromone_least": 1e-3, "pheromone_most": 10.0, **changes}.items():
        state[name] = value
    return states


def test_angles_without_equation_15_name_features_in_their_order():
    """From -pi to pi the ten features follow each other, a tenth of a turn each."""
    state = SimpleNamespace(left_out_equation=15)
    middles = np.linspace(-np.pi, np.pi, 10, endpoint=False) + 0.1 * np.pi
    assert [decode_angle(angle, 0, 10, state) for angle in middles] == list(range(10))


def test_search_random_numbers_are_splitmix64():
    """The first numbers of seed 1234567 that the reference implementation prints; a draw has their upper 53 bits."""
    state = search_state(stream=1234567)
    expected = [6457827717110365317, 3203168211198807973, 9817491932198370423]
    with np.errstate(over="ignore"):
        assert [int(draw(state) * 2.0**53) for _ in expected] == [number >> 11 for number in expected]


@pytest.mark.parametrize("chain", [0, 1], ids=["cosine", "sine"])
def test_equation_15_draws_every_face_about_equally_often(chain):
    """The quantum ant colony's equation 15 names a face by the cosine (chain 0) or the sine (chain 1) of an angle."""
    count, draws, state = 20, 10_000, SimpleNamespace(left_out_equation=0)
    angles = np.random.default_rng(0).uniform(0, 2 * np.pi, draws).tolist()
    drawn = np.bincount([decode_angle(angle, chain, count, state) for angle in angles], minlength=count)
    expected = draws / count  # 500 each, with a standard deviation of 22
    assert np.abs(drawn - expected).max() < 120


def test_step_takes_the_short_arc_only_with_equation_17():
    """From 3 to -3 rad the short arc goes up, by 0.28; without equation 17 half of the ants go down.

    Equation 18 is left out first, which steps do not need, then 17.
    """
    directions = []
    for equation in (18, 17):
        state = search_state(left_out_equation=equation)
        with np.errstate(over="ignore"):
            angles = np.array([rotated_towards(3.0, -3.0, state) for _ in range(500)])
        directions.append(np.angle(np.exp(1j * (angles - 3.0))))
    assert (directions[0] > 0).all()
    assert 0.4 < (directions[1] < 0).mean() < 0.6


@pytest.mark.sampled(3)
@pytest.mark.parametrize("spread", [0.0, 2.0, 300.0])
@pytest.mark.parametrize("left_out_equation", [0, 16, 20])
def test_probabilities_are_finite_not_negative_and_sum_to_1(spread, left_out_equation):
    """Pheromone within 10^-spread to 10^spread; probability goes with pheromone x heuristic^3 (equation 16)."""
    rng = np.random.default_rng(5)
    ants = 50
    swarm = np.zeros(ants, dtype=ANT).view(np.recarray)
    swarm["pheromone"] = 10.0 ** rng.uniform(-spread, spread, ants)
    swarm["heuristic"] = 1 / (1e-3 + rng.random(ants) * 1e3)
    swarm["fitness"] = rng.random(ants)
    state = search_state(
        ants=ants, left_out_equation=left_out_equation, pheromone_least=1e-300, pheromone_most=1e300, evaporation=0.0
    )
    pheromone, heuristic = (swarm[name] / swarm[name].max() for name in ("pheromone", "heuristic"))
    expected = pheromone * heuristic**3
    total = weigh(swarm, 0, state)
    chance = np.diff(swarm["weight"], prepend=0.0) / total
    assert np.isfinite(chance).all()
    assert (chance >= 0).all()
    assert chance.sum() == pytest.approx(1.0, abs=1e-12)
    expected = np.ones(ants) if left_out_equation == 16 else expected
    assert np.allclose(chance, expected / expected.sum(), atol=1e-9)


def test_evaporation_pulls_pheromone_down_and_lifts_the_best():
    """1 less a tenth is 0.9; the best, ant 1, gets a tenth of its fitness of 0.5 back.

    Without equation 20 all stays.
    """
    swarm = np.ones(3, dtype=ANT).view(np.recarray)
    swarm["fitness"] = 0.5
    weigh(swarm, 1, search_state(ants=3))
    assert np.allclose(swarm["pheromone"], [0.9, 0.95, 0.9])
    weigh(swarm, 1, search_state(ants=3, left_out_equation=20))
    assert np.allclose(swarm["pheromone"], [0.9, 0.95, 0.9])


@pytest.mark.parametrize("equation", [None, 15, 16, 17, 18, 19, 20])
def test_pheromone_stays_inside_its_clamp_and_every_equation_matters(equation):
    """Balls 2.4 m apart never meet; pheromone is clamped to 0.001 to 10.

    Without any one of the equations the search takes another path than with all.
    """
    ball = ball_of(faces=600)
    search = search_of(ball, ball, variant="corrected", budget=4000, without_equation=equation, restart_after=10**9)
    query = search.search((I3, np.array([2.4, 0, 0])), (I3, np.zeros(3)), stamp=0.0)
    pheromone = search.swarm["pheromone"]
    assert (pheromone >= 1e-3).all()
    assert (pheromone <= 10.0).all()
    whole = search_of(ball, ball, variant="corrected", budget=4000, restart_after=10**9)
    same = whole.search((I3, np.array([2.4, 0, 0])), (I3, np.zeros(3)), stamp=0.0)
    assert (query == same) == (equation is None)


def test_search_of_larger_meshes_evaluates_the_same_pairs():
    """A power of two changes no rounding, and fitness is a distance over the mean size of both meshes."""
    results = []
    for scale in (1.0, 1024.0):
        ball = ball_of(600, radius=scale)
        search = search_of(ball, ball, variant="corrected", budget=1000)
        results.append(search.search((I3, np.array([2.4, 0, 0]) * scale), (I3, np.zeros(3)), stamp=0.0))
    small, large = results
    assert large == small._replace(distance=1024.0 * small.distance)


FAR = (I3, np.array([2.4, 0.2, 0.1]))
AT_ORIGIN = (I3, np.zeros(3))


@pytest.mark.parametrize("variant", ["memetic", "corrected", "local", "random", "printed"])
@pytest.mark.parametrize("budget", [1, 7, 40, 1000])
def test_the_budget_is_kept_to_the_evaluation(variant, budget):
    """The balls are far apart, so that no hit ends the search early."""
    ball = ball_of(faces=600)
    query = search_of(ball, ball, variant=variant, budget=budget).search(FAR, AT_ORIGIN, stamp=0.0)
    assert query.evaluations == budget or (query.reason == "broken" and query.evaluations < budget)


@pytest.mark.parametrize("variant", ["memetic", "corrected"])
def test_population_is_redrawn_after_quiet_evaluations(variant):
    """A budget of 9,000 has room for nine stretches of 1,000 without progress."""
    ball = ball_of(faces=600)
    query = search_of(ball, ball, variant=variant, budget=9000, restart_after=1000).search(FAR, AT_ORIGIN, stamp=0.0)
    assert 5 <= query.restarts <= 9
    patient = search_of(ball, ball, variant=variant, budget=9000, restart_after=10**6)
    assert patient.search(FAR, AT_ORIGIN, stamp=0.0).restarts == 0
