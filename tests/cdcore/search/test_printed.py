"""The equations as printed: what is certain of ants that do not turn, although the equations break."""

from itertools import chain, islice, repeat

import numpy as np
import pytest

from cdcore.search.printed import iterations_as_printed, printed_15, printed_17
from cdcore.search.search_settings import SearchSettings

ITERATIONS, FEATURES = 3, 1000


# The only ant follows itself, from which nothing is turned.
@pytest.mark.parametrize(("ants", "rotation"), [(5, 0.0), (1, 0.5)])
@pytest.mark.parametrize(("mutation", "then"), [(0.0, 0), (1.0, 1)])
def test_mutation_swaps_the_amplitudes(ants, rotation, mutation, then):
    """Amplitudes of each ant's two qubits over three iterations; a mutation swaps them in each iteration or never.

    ``then``: the amplitude, 0 or 1, that was 0 one iteration before.
    """
    requested = []
    settings = SearchSettings(ants=ants, turn=rotation, mutation=mutation)
    stream = np.random.default_rng(3)
    for iteration in iterations_as_printed(
        lambda *positions: requested.append(positions) or 1.0, (FEATURES, FEATURES), settings, stream
    ):
        if iteration > ITERATIONS:
            break
    amplitudes = (2 * np.reshape(requested, (ITERATIONS, ants, 2, 2)) + 1) / FEATURES - 1
    assert np.allclose((amplitudes**2).sum(axis=2), 1.0, atol=5 / FEATURES)
    assert np.allclose(amplitudes[1:, :, then], amplitudes[:-1, :, 0])


@pytest.mark.parametrize(("beta", "begun"), [(2.0, [1, 2]), (1.0, [1, 2, 3])])
def test_search_ends_at_negative_probabilities(beta, begun):
    """Two ants search nine features of each body, and the distances that they find are planted.

    The pheromone of the second ant, 1 + 10, evaporates to 9.9 and falls to -0.1 with its distance. Its heuristic,
    1 + 10^beta, falls below 0 too, by 20^beta, so that only an even power of it leaves a product below 0: the search
    ends with the second iteration.
    """
    distances = chain([10.0] * 6, [0.0] * 2, repeat(10.0))
    settings = SearchSettings(ants=2, alpha=1.0, beta=beta, evaporation=0.1)
    iterations = iterations_as_printed(
        lambda *pair: next(distances), sizes=(9, 9), settings=settings, stream=np.random.default_rng(3)
    )
    assert list(islice(iterations, 3)) == begun


def test_the_amplitudes_run_from_the_first_feature_to_the_last():
    """Amplitudes from -1 to 1 over nine features, 0 to 8."""
    assert [printed_15(amplitude, 9) for amplitude in (-1.0, 0.0, 1.0)] == [0, 4, 8]


def test_equation_17_as_printed_has_a_wrong_sign():
    """A rotation of a + i b by an angle; the printed second component has - b cos instead of + b cos."""
    rotation, a, b = np.random.default_rng(4).uniform(-3, 3, (3, 8))
    rotated = (a + 1j * b) * np.exp(1j * rotation)
    assert np.allclose(
        printed_17(rotation, np.stack([a, b], axis=1)).T, [rotated.real, rotated.imag - 2 * np.cos(rotation) * b]
    )
