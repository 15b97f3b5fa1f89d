"""The equations as printed in the paper: what is certain of ants that do not turn, although the equations break.

An ant has two qubits, one for a face of each body; a qubit's two amplitudes name two faces, ``printed_15``.
"""

from itertools import chain, islice, repeat

import numpy as np
import pytest

from cdcore.search.printed import iterations_as_printed, printed_15, printed_17
from cdcore.search.search_settings import SearchSettings

ITERATIONS, FEATURES = 3, 1000


@pytest.mark.parametrize(
    ("ants", "rotation"),
    [pytest.param(5, 0.0, id="ants do not turn"), pytest.param(1, 0.5, id="an ant turns to itself")],
)
@pytest.mark.parametrize(
    ("mutation", "next_position_of_the_first"), [pytest.param(0.0, 0, id="never"), pytest.param(1.0, 1, id="always")]
)
def test_mutation_swaps_the_amplitudes(ants, rotation, mutation, next_position_of_the_first):
    """Amplitudes of each ant's two qubits over three iterations, read from the faces whose distance is asked.

    A mutation swaps them in each iteration or never: the first of an iteration is the first or second of the next.
    """
    queried_faces = []

    def distance(*faces):
        queried_faces.append(faces)
        return 1.0

    settings, stream = SearchSettings(ants=ants, turn=rotation, mutation=mutation), np.random.default_rng(3)
    for iteration in iterations_as_printed(distance, (FEATURES, FEATURES), settings, stream):
        if iteration > ITERATIONS:
            break
    faces = np.reshape(queried_faces, (ITERATIONS, ants, 2, 2))  # iteration, ant, amplitude, body
    amplitudes = (2 * faces + 1) / FEATURES - 1  # the middle of each face's share of the range from -1 to 1
    assert np.allclose((amplitudes**2).sum(axis=2), 1.0, atol=5 / FEATURES), "a qubit is a unit vector"
    assert np.allclose(amplitudes[1:, :, next_position_of_the_first], amplitudes[:-1, :, 0])


@pytest.mark.parametrize(("beta", "iterations_begun"), [(2.0, [1, 2]), (1.0, [1, 2, 3])])
def test_search_ends_at_negative_probabilities(beta, iterations_begun):
    """Two ants search nine faces of each body, and the distances that they find are planted: 10 m six times, 0 twice.

    The pheromone of the second ant, 1 + 10, evaporates to 9.9 and falls to -0.1 with its distance. Its heuristic,
    1 + 10^beta, falls below 0 too, by 20^beta, so that only an even power of it leaves a product below 0: the search
    ends with the second iteration.
    """
    distances = chain([10.0] * 6, [0.0] * 2, repeat(10.0))
    settings = SearchSettings(ants=2, alpha=1.0, beta=beta, evaporation=0.1)
    iterations = iterations_as_printed(
        lambda *pair: next(distances), sizes=(9, 9), settings=settings, stream=np.random.default_rng(3)
    )
    assert list(islice(iterations, 3)) == iterations_begun


@pytest.mark.parametrize(("amplitude", "feature"), [(-1.0, 0), (0.0, 4), (1.0, 8)])
def test_the_amplitudes_run_from_the_first_feature_to_the_last(amplitude, feature):
    """Equation 15 over nine features, 0 to 8: the amplitude -1 names the first, 1 the last."""
    assert printed_15(amplitude, 9) == feature


def test_equation_17_as_printed_has_a_wrong_sign():
    """A rotation of a + i b by t has the imaginary part a sin t + b cos t; printed is - b cos t instead."""
    t, a, b = np.random.default_rng(4).uniform(-3, 3, (3, 8))
    printed = printed_17(t, np.stack([a, b], axis=1))
    rotated = (a + 1j * b) * np.exp(1j * t)
    assert np.allclose(printed[:, 0], rotated.real)
    assert np.allclose(printed[:, 1], rotated.imag - 2 * b * np.cos(t))
