"""The equations as printed break, their gate is no rotation and their gain no gain."""

from itertools import count, islice, repeat

import numpy as np
import pytest
from support.search_scenes import I3, ball_of, exact_pairs, search_of
from support.shapes import box_mesh

from cdcore.search.printed import iterations_as_printed, printed_16, printed_17
from cdcore.search.search_settings import SearchSettings


def test_printed_gate_shrinks_its_vector():
    """The printed matrix of a step t is [[cos t, -sin t], [sin t, -cos t]]; twice it is cos 2t times 1.

    So 100 steps of 0.05 pi leave of a length of 1 cos(0.1 pi)^50, which is 0.081.
    """
    qubit = np.array([[1.0, 0.0]])
    for _ in range(100):
        qubit = printed_17(np.array([0.05 * np.pi]), qubit)
    assert np.linalg.norm(qubit) == pytest.approx(np.cos(0.1 * np.pi) ** 50)


def test_equation_17_as_printed_does_not_keep_length():
    """A qubit (cos t, sin t) and steps theta: the squared length becomes 1 - sin(2 theta) sin(2 t) instead of 1.

    Only theta = 0 keeps it; other steps change it by up to 0.9 and more.
    """
    theta, t = np.meshgrid(np.linspace(-1, 1, 21), np.linspace(0, 6, 25))
    squared_length = (printed_17(theta, np.stack([np.cos(t), np.sin(t)], axis=-1)) ** 2).sum(axis=-1)
    assert np.allclose(squared_length, 1 - np.sin(2 * theta) * np.sin(2 * t))
    assert np.allclose(squared_length[theta == 0], 1.0)
    assert np.abs(squared_length - 1).max() > 0.9


def test_equation_16_as_printed_divides_products_by_their_sum():
    """Probabilities are tau^alpha eta^beta over their sum; pheromone tau of 1 and 3, heuristic eta of
    1: 1/4 and 3/4.
    """
    assert printed_16(np.array([1.0, 3.0]), np.ones(2), alpha=1.0, beta=1.0).tolist() == [0.25, 0.75]


def test_negative_pheromone_breaks_equation_16_as_printed():
    """Pheromone that evaporates may fall below 0: -0.5 beside 1 gives -0.5 / 0.5 and 1 / 0.5, which are no
    probabilities, and -0.5 to the power 1.5 is no number.
    """
    negative = np.array([-0.5, 1.0])
    assert printed_16(negative, np.ones(2), alpha=1.0, beta=1.0).tolist() == [-1.0, 2.0]
    assert not np.isfinite(printed_16(negative, np.ones(2), alpha=1.5, beta=1.0)).all()


def iterations_begun(distances, most=100):
    """Numbers of the iterations that a search as printed begins, at most so many, where these distances are found."""
    stream, settings = np.random.default_rng(0), SearchSettings(variant="printed")
    iterations = iterations_as_printed(lambda _i, _j: next(distances), (50, 70), settings, stream)
    return list(islice(iterations, most))


def test_iterations_as_printed_go_on_at_constant_distance():
    """Every pair of faces is 1 m apart: all 100 iterations are begun."""
    assert iterations_begun(repeat(1.0)) == list(range(1, 101))


def test_iterations_as_printed_end_when_distances_fall():
    """Distances fall from 10 m by 0.1 m with each pair of faces: pheromone falls below 0 before the tenth iteration."""
    assert len(iterations_begun(10.0 - 0.1 * k for k in count())) < 10


@pytest.mark.slow
@pytest.mark.parametrize("alpha", [1.5, 1.0])
def test_printed_search_breaks_within_a_few_dozen_steps(alpha):
    """Balls of radius 1 m, 5 m apart, so that no hit ends the search: by 50 seeds the equations as the paper prints
    them come to a negative probability, or to none, each time ("broken").

    At the median they do so within 30 iterations (a bound by trial).
    """
    ball = ball_of(faces=600)
    iterations = []
    for seed in range(50):
        search = search_of(ball, ball, variant="printed", alpha=alpha, beta=2.0, budget=100_000, seed=seed)
        query = search.search((I3, np.array([5.0, 0, 0])), (I3, np.zeros(3)), stamp=0.0)
        assert query.reason == "broken", seed
        iterations.append(query.iterations)
    assert 1 <= np.median(iterations) <= 30


def test_hit_of_the_printed_search_is_a_pair_that_meets():
    """Two cubes of 1 m, 2 cm from each other, overlap; ``intersecting_faces`` lists the face pairs that meet."""
    box, pose, at_origin = box_mesh(), (I3, np.array([0.02, 0, 0])), (I3, np.zeros(3))
    search = search_of(box, box, variant="printed", budget=100_000)
    query = search.search(pose, at_origin, stamp=0.0)
    assert query.reason == "hit"
    assert query.hit in exact_pairs(search, box, box, pose, at_origin)
