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
def compiled_equation(number, a, b, c, d):
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
    """Equation 15 of the paper: an amplitude's arc cosine, over pi, times the number of features, give or take one."""
    angle, chain, features = draws.uniform(-20, 20), int(draws.integers(2)), int(draws.integers(1, 500))
    fraction = np.arccos(amplitudes(angle)[chain]) / np.pi
    assert abs(equation_15(angle, chain, features) - min(fraction * features, features - 1)) <= 1.0
    assert equation_15(np.pi + 0.5 * np.pi * chain, chain, features) == features - 1  # no feature follows the last


def test_the_weight_is_the_product_of_powers(draws):
    """Equation 16 of the paper, tau^alpha eta^beta; its logarithm is computed."""
    tau, eta, alpha, beta = draws.uniform(0.01, 10, 4)
    assert np.exp(equation_16(tau, eta, alpha, beta)) == pytest.approx(tau**alpha * eta**beta)


def test_gate_is_a_rotation_and_not_swaps_amplitudes(draws):
    """Equation 17 is the rotation gate, 18 the quantum NOT; both are given the angle of a qubit."""
    angle, step = draws.uniform(-10, 10, 2)
    rotation = np.array([[np.cos(step), -np.sin(step)], [np.sin(step), np.cos(step)]])
    np.testing.assert_allclose(amplitudes(equation_17(angle, step)), rotation @ amplitudes(angle), atol=1e-12)
    np.testing.assert_allclose(amplitudes(equation_18(angle)), amplitudes(angle)[::-1], atol=1e-12)


def test_pheromone_follows_fitness_and_evaporates(draws):
    """Equation 19 of the paper adds a power of the change, with its sign; 20 is (1 - rho) tau + rho times a deposit."""
    tau, change, exponent, rho, deposit = draws.uniform([0, -1, 0.5, 0, 0], [10, 1, 3, 1, 1])
    assert equation_19(tau, change, exponent) == pytest.approx(tau + np.sign(change) * abs(change) ** exponent)
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
    """The kernel takes four arguments; an equation with fewer ignores the rest."""
    padded = (*map(float, arguments), 0.0, 0.0, 0.0)[:4]
    assert float(equation(*arguments)).hex() == float(compiled_equation(number, *padded)).hex()
