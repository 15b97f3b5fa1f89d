"""The nearest point is that of a search over the whole simplex, and lies in the corners that are kept."""

import numpy as np
import pytest
from scipy.optimize import minimize

from cdcore.kernels.compiling import kernel
from cdcore.narrow.solid_style import closest


@kernel
def nearest(corners):
    y, v = np.zeros((4, 3)), np.zeros(3)
    y[: len(corners)] = corners
    count = closest.nearest_on_simplex(y, len(corners), v, np.empty((4, 3)), np.empty((4, 3)))
    return count, v, y


def searched(corners):
    def distance(weights):
        point = weights @ corners
        return point @ point

    start = np.full(len(corners), 1 / len(corners))
    bounds = [(0, 1)] * len(corners)
    whole = {"type": "eq", "fun": lambda weights: weights.sum() - 1}
    found = minimize(distance, start, bounds=bounds, constraints=[whole], options={"ftol": 1e-14, "maxiter": 300})
    return np.sqrt(found.fun)


@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_the_distance_is_that_of_a_search_over_all_weights(count):
    rng = np.random.default_rng(count)
    used = set()
    for _ in range(40):
        corners = rng.normal(size=(count, 3)) + rng.normal(size=3) * 0.7
        left, v, y = nearest(corners)
        distance = 0.0 if left == 0 else np.linalg.norm(v)
        assert distance == pytest.approx(searched(corners), abs=1e-5)
        used.add(left)
        if left:
            kept = np.linalg.lstsq(np.vstack([y[:left].T, np.ones(left)]), np.append(v, 1.0), rcond=None)[0]
            assert np.allclose(kept @ y[:left], v, atol=1e-9) and (kept > -1e-9).all()
    assert used >= {1, 2, 3, 4, 0} - set(range(count + 1, 5)) - ({0} if count < 4 else {4})
