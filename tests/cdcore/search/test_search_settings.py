"""The equations as printed break, their gate is no rotation and their gain no gain."""

from itertools import count, islice

import numpy as np
import pytest
from support.search_scenes import I3, ball_of, search_of
from support.shapes import box_mesh

from cdcore.search.printed import iterations_as_printed, printed_16, printed_17
from cdcore.search.search_settings import SearchSettings


def test_printed_gate_shrinks_its_vector():
    """The printed matrix of a step t is [[cos t, -sin t], [sin t, -cos t]]; twice it is cos 2t times 1.

    So 100 steps of 0.05 pi leave a length of cos(0.1 pi)^50, which is 0.081.
    """
    qubit = np.array([[1.0, 0.0]])
    for _ in range(100):
        qubit = printed_17(np.array([0.05 * np.pi]), qubit)
    assert np.linalg.norm(qubit) == pytest.approx(np.cos(0.1 * np.pi) ** 50)


def test_equation_17_as_printed_does_not_keep_length():
    """The squared length is 1 - sin(2 theta) sin(2 t) instead of 1; only at theta = 0, column 10, it is kept."""
    theta, t = np.meshgrid(np.linspace(-1, 1, 21), np.linspace(0, 6, 25))
    norm = (printed_17(theta, np.stack([np.cos(t), np.sin(t)], axis=-1)) ** 2).sum(axis=-1)
    assert np.allclose(norm, 1 - np.sin(2 * theta) * np.sin(2 * t))
    assert np.abs(norm - 1).max() > 0.9
    assert np.allclose(norm[:, 10], 1.0)


def test_negative_pheromone_breaks_equation_16_as_printed():
    """Equation 16 of the paper: probabilities are tau^alpha eta^beta over their sum; tau: pheromone, eta: heuristic.

    Pheromone that evaporates may be negative: -0.5 beside 1 gives -1 and 2, and -0.5 to the power 1.5 is no number.
    """
    eta, negative = np.ones(2), np.array([-0.5, 1.0])
    assert printed_16(np.array([1.0, 3.0]), eta, alpha=1.0, beta=1.0).tolist() == [0.25, 0.75]
    assert printed_16(negative, eta, alpha=1.0, beta=1.0).tolist() == [-1.0, 2.0]
    assert not np.isfinite(printed_16(negative, eta, alpha=1.5, beta=1.0)).all()


def test_iterations_as_printed_end_when_distances_fall():
    """At constant distance all 100 run; where the distance falls by 0.1 each, fewer than 10."""

    def iterations(distances):
        stream, settings = np.random.default_rng(0), SearchSettings(variant="printed")
        requested = iterations_as_printed(lambda i, j: next(distances), (50, 70), settings, stream)
        return list(islice(requested, 100))

    assert iterations(1.0 for _ in count()) == [*range(1, 101)]
    assert len(iterations(10.0 - 0.1 * k for k in count())) < 10


@pytest.mark.slow
@pytest.mark.parametrize("alpha", [1.5, 1.0])
def test_printed_search_breaks_within_a_few_dozen_steps(alpha):
    """Balls 5 m apart, so that only a fault of the printed equations ends the search."""
    ball = ball_of(faces=600)
    broke = []
    for seed in range(50):
        search = search_of(ball, ball, variant="printed", alpha=alpha, beta=2.0, budget=100_000, seed=seed)
        query = search.search((I3, np.array([5.0, 0, 0])), (I3, np.zeros(3)), stamp=0.0)
        assert query.reason == "broken"
        broke.append(query.iterations)
    assert 1 <= np.median(broke) <= 30


def test_hit_during_descent_is_still_confirmed():
    """Unit cubes 0.02 apart overlap; the pair reported is one of those that meet, which the curve lists."""
    box = box_mesh()
    search = search_of(box, box, variant="printed", budget=100_000)
    query = search.search((I3, np.array([0.02, 0, 0])), (I3, np.zeros(3)), stamp=0.0)
    assert query.reason == "hit"
    assert query.hit in {tuple(row) for row in search.curve(np.zeros((0, 2), dtype=np.int64)).tolist()}
