"""Intervals of slopes that hold where groups are unequal: Student's t with HC3 errors, its quantiles from permutations.

With 5 or 10 of 52 students in one group a bootstrap over students covers 85 to 90 %, and Welch's t of lognormal answers
85 to 92 %; this covers 93 to 97 % of both, and of groups of equal size.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cdcore.numerics import FloatArray

DRAWS: Final = 1999
"""Permutations of the residuals behind the quantiles of t."""

MOST_SKEW: Final = 1.0
"""Skewness of the residuals beyond which a standardised coefficient gets no interval: the few students far out decide
the spread by which it is standardised, and an interval of 95 % would cover 80 to 90 %. Of 52 normal answers one class
in 300 is beyond it."""

NO_INTERVAL: Final = (float("nan"), float("nan"))


@dataclass(frozen=True, eq=False)
class Slopes:
    """Least squares with an intercept: ``slopes`` (k,) and their HC3 ``errors`` (k,), ``residuals`` (n,).

    ``least``, ``most`` (k,) are the quantiles of t, 2.5 and 97.5 %, among permuted residuals.
    """

    slopes: FloatArray
    errors: FloatArray
    residuals: FloatArray
    least: FloatArray
    most: FloatArray

    def ends(self, errors: FloatArray | None = None) -> FloatArray:
        """(k, 2) ends of the 95 % intervals, with these errors or the HC3 ones."""
        wide = self.errors if errors is None else errors
        return np.column_stack([self.slopes - self.most * wide, self.slopes - self.least * wide])


def fit_slopes(y: FloatArray, x: FloatArray, random: np.random.Generator) -> Slopes:
    """Fit ``y`` (n,) on ``x`` (n, k), and ask permuted residuals how far t may lie from 0.

    Source: MacKinnon and White (1985), J. Econometrics 29, 305-325, for HC3; ter Braak (1992) in: Bootstrapping and
    related techniques, 79-86, for permuting residuals.
    """
    design = np.column_stack([np.ones(len(y)), x])
    solver = np.linalg.pinv(design)
    leverage = np.einsum("nk,kn->n", design, solver)
    found = solver @ y
    residuals = y - design @ found
    # A student alone in a group is fitted exactly and says nothing of its spread.
    weights = np.square(solver[1:] / np.maximum(1.0 - leverage, 1e-6))
    drawn = random.permuted(np.broadcast_to(residuals, (DRAWS, len(y))), axis=1)
    again = drawn @ solver.T
    left = drawn - again @ design.T
    spread = np.maximum(np.square(left) @ weights.T, 1e-300)
    least, most = np.quantile(again[:, 1:] / np.sqrt(spread), [0.025, 0.975], axis=0)
    return Slopes(found[1:], np.sqrt(weights @ np.square(residuals)), residuals, least, most)


def standardised_intervals(y: FloatArray, x: FloatArray, random: np.random.Generator) -> list[tuple[float, float]]:
    """Intervals of the standardised coefficients of ``y`` (n,) on ``x`` (n, k), all of mean 0 and variance 1.

    The spread of y that standardises a coefficient is that of what the slopes explain and of the residuals: an end of
    the interval is standardised with its own slope, and the error of the residuals' spread is part of its width.
    nan: the residuals are too skewed for an interval.
    """
    fit = fit_slopes(y, x, random)
    size = np.sqrt(np.mean(np.square(fit.residuals)))
    shape = fit.residuals / max(float(size), 1e-300)
    if abs(float(np.mean(shape**3))) > MOST_SKEW:
        return [NO_INTERVAL] * x.shape[1]
    of_spread = np.square(fit.slopes) * max(float(np.mean(shape**4)) - 1.0, 0.0) / (4.0 * len(y))
    between = np.atleast_2d(np.corrcoef(x, rowvar=False))
    found = []
    for k, (low, high) in enumerate(fit.ends(np.sqrt(np.square(fit.errors) + of_spread)).tolist()):
        own, others = float(fit.slopes[k]), np.where(np.arange(len(fit.slopes)) == k, 0.0, fit.slopes)
        shared, rest = float(between[k] @ others), float(others @ between @ others)
        noise = max(1.0 - own * own - 2.0 * own * shared - rest, 1e-12)
        low, high = (end / np.sqrt(end * end + 2.0 * end * shared + rest + noise) for end in (low, high))
        found.append((float(low), float(high)))
    return found
