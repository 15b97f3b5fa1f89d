"""Each corrected equation says what the paper's formula says of unit vectors, powers and probabilities."""

import numpy as np
import pytest

from cdcore.kernels.compiling import kernel
from cdcore.search.equations import (
    equation_15,
    equation_16,
    equation_17,
    equation_18,
    equation_19,
    equation_20,
)


@kernel
def equation_in_kernel(number, a, b, c, d):
    """The equation of this number for its arguments, in order, as the compiler made it."""
    if number == 15:
        return float(equation_15(a, int(b), int(c)))
    if number == 16:
        return equation_16(a, b, c, d)
    if number == 17:
        return equation_17(a, b)
    if number == 18:
        return equation_18(a)
    if number == 19:
        return equation_19(a, b, c)
    return equation_20(a, b, c)


@pytest.fixture(params=range(4))
def draws(request):
    """A generator of random numbers, from four seeds."""
    return np.random.default_rng(request.param)


def amplitudes(angle):
    """The two amplitudes of a qubit, a unit vector at this angle."""
    return np.array([np.cos(angle), np.sin(angle)])


def test_feature_index_follows_the_angle_fraction(draws):
    """Equation 15 names a feature (a face) by the arc cosine of an amplitude, over pi, times the number of features.

    Give or take one, as an index is whole; ``chain`` 0 chooses the cosine of the angle, 1 its sine.
    """
    angle, chain, features = draws.uniform(-20, 20), int(draws.integers(2)), int(draws.integers(1, 500))
    fraction = np.arccos(amplitudes(angle)[chain]) / np.pi
    expected = min(fraction * features, features - 1)
    assert abs(equation_15(angle, chain, features) - expected) <= 1.0


@pytest.mark.parametrize(("chain", "angle"), [(0, np.pi), (1, 1.5 * np.pi)], ids=["cosine", "sine"])
def test_amplitude_of_minus_1_names_the_last_feature(chain, angle):
    """An arc cosine of pi is the whole range: of 40 features the last, number 39."""
    assert equation_15(angle, chain, 40) == 39


def test_the_weight_is_the_product_of_powers(draws):
    """Equation 16 gives the logarithm of tau^alpha eta^beta: pheromone tau, heuristic eta."""
    tau, eta, alpha, beta = draws.uniform(0.01, 10, 4)
    assert np.exp(equation_16(tau, eta, alpha, beta)) == pytest.approx(tau**alpha * eta**beta)


def test_gate_is_a_rotation_of_the_amplitudes(draws):
    """Equation 17 is the rotation gate: it takes a qubit's angle, and a step; amplitudes are cosine and sine."""
    angle, step = draws.uniform(-10, 10, 2)
    rotation = np.array([[np.cos(step), -np.sin(step)], [np.sin(step), np.cos(step)]])
    np.testing.assert_allclose(amplitudes(equation_17(angle, step)), rotation @ amplitudes(angle), atol=1e-12)


def test_not_swaps_the_amplitudes(draws):
    """Equation 18 is the quantum NOT of a qubit at an angle."""
    angle = draws.uniform(-10, 10)
    np.testing.assert_allclose(amplitudes(equation_18(angle)), amplitudes(angle)[::-1], atol=1e-12)


def test_pheromone_follows_the_change_of_fitness(draws):
    """Equation 19 adds a power of the change, with its sign, to the pheromone tau."""
    tau, change, exponent = draws.uniform([0, -1, 0.5], [10, 1, 3])
    assert equation_19(tau, change, exponent) == pytest.approx(tau + np.sign(change) * abs(change) ** exponent)


def test_pheromone_evaporates_and_gets_a_deposit(draws):
    """Equation 20 is (1 - rho) tau + rho times the deposit."""
    tau, rho, deposit = draws.uniform([0, 0, 0], [10, 1, 1])
    assert equation_20(tau, rho, deposit) == pytest.approx((1 - rho) * tau + rho * deposit)


@pytest.mark.slow  # the kernel compiles for longer than all other tests here take
@pytest.mark.parametrize(
    ("number", "equation", "arguments"),
    [
        (15, equation_15, (0.3, 1, 40)),
        (16, equation_16, (0.2, 0.7, 1.0, 2.0)),
        (17, equation_17, (3.0, 0.5)),
        (18, equation_18, (0.3,)),
        (19, equation_19, (0.2, -0.1, 2.0)),
        (20, equation_20, (0.2, 0.1, 0.5)),
    ],
)
def test_python_call_gives_the_bits_of_the_kernel(number, equation, arguments):
    """Any arguments. A kernel that calls the equation of a number takes four; an equation with fewer
    ignores the rest.
    """
    four_arguments = (*map(float, arguments), 0.0, 0.0, 0.0)[:4]
    assert float(equation(*arguments)).hex() == float(equation_in_kernel(number, *four_arguments)).hex()
