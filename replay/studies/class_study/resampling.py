"""Intervals by resampling: whole students are drawn anew, with all of their sessions."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from cdcore.numerics import FloatArray
from replay.auditing.wilson import wilson_interval
from sessions.synthetic.rng import random_stream

BOOTSTRAPS: Final = 2000
"""Resamples of students behind an interval: its ends then move by about 0.005 from seed to seed."""


def interval(bootstrap_estimates: FloatArray, estimate: float, jackknife_estimates: FloatArray) -> tuple[float, float]:
    """95 % bootstrap interval, bias-corrected and accelerated, its quantiles those of Student's t.

    ``bootstrap_estimates`` (B,), ``estimate``: in each resample and itself; ``jackknife_estimates`` (n,): the estimate
    without each one of the n students. At 52 students a plain percentile interval of 95 % holds the truth in 92.6 % of
    classes, this one in 94.0 % (alpha of five items, 1,000 synthetic classes; slopes: 92.8 to 94.4 % against 93.9 to
    95.1 %). ``scipy.stats.bootstrap`` has no such widening.

    Source: Efron (1987), J. Am. Stat. Assoc. 82, 171-185; the widening is Hesterberg's (2015), Am. Stat. 69, 371-386.
    """
    from scipy.special import ndtr, ndtri, stdtrit  # scipy.stats would take 35 MB for these three

    bootstrap_estimates, jackknife_estimates = (
        bootstrap_estimates[np.isfinite(bootstrap_estimates)],
        jackknife_estimates[np.isfinite(jackknife_estimates)],
    )
    students = len(jackknife_estimates)
    if len(bootstrap_estimates) == 0 or students < 3:
        return float("nan"), float("nan")
    fraction_below = (
        np.count_nonzero(bootstrap_estimates < estimate) + 0.5 * np.count_nonzero(bootstrap_estimates == estimate)
    ) / len(bootstrap_estimates)
    bias_correction = float(
        ndtri(np.clip(fraction_below, 0.5 / len(bootstrap_estimates), 1.0 - 0.5 / len(bootstrap_estimates)))
    )
    deviations = jackknife_estimates.mean() - jackknife_estimates
    sum_of_squares = float(np.square(deviations).sum())
    acceleration = float((deviations**3).sum()) / (6.0 * sum_of_squares**1.5) if sum_of_squares > 0.0 else 0.0
    widened_quantile = np.sqrt(students / (students - 1.0)) * float(stdtrit(students - 1, 0.975))
    moved_quantiles = bias_correction + np.array([-widened_quantile, widened_quantile])
    # Beyond the pole of the correction the bound is the end of what was drawn.
    lower, upper = np.quantile(
        bootstrap_estimates,
        ndtr(bias_correction + moved_quantiles / np.maximum(1.0 - acceleration * moved_quantiles, 1e-6)),
    )
    return float(lower), float(upper)


def weights_of(students: int, random: np.random.Generator) -> FloatArray:
    """How often each student is drawn, in each resample: (B, n)."""
    return random.multinomial(students, np.full(students, 1.0 / students), BOOTSTRAPS).astype(np.float64)


def with_intervals(
    statistic: Callable[[FloatArray], FloatArray], students: int, random: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Figures (k,) of all students, and their 95 % intervals (k, 2).

    ``statistic`` makes figures (B, k) of weights (B, n), how often each student counts.
    """
    (estimates,), bootstrap_estimates = statistic(np.ones((1, students))), statistic(weights_of(students, random))
    jackknife_estimates = statistic(1.0 - np.eye(students))
    interval_ends = [
        interval(bootstrap_estimates[:, k], float(value), jackknife_estimates[:, k])
        for k, value in enumerate(estimates)
    ]
    return estimates, np.array(interval_ends)


@dataclass(frozen=True)
class Estimate:
    """A figure, its 95 % interval, and how many students stand behind it; nan: there is none."""

    value: float
    low: float
    high: float
    students: int


class Resampling:
    """Students drawn with replacement, the same draws for every figure of a page.

    ``students`` is how many the class has; figures of some of them vary with how many of these are drawn.

    Source: Field and Welsh (2007), J. R. Stat. Soc. B 69, 369-390, for drawing whole clusters.
    """

    def __init__(self, students: int, seed: int = 0) -> None:
        self._weights = weights_of(max(1, students), random_stream(seed, "class page"))

    def ratio(self, numerators: FloatArray, denominators: FloatArray) -> Estimate:
        """Sum over sum, of each student (n,): contacts by sessions, or contacts missed by contacts."""
        counted_rows = np.flatnonzero(denominators)
        numerators_counted, denominators_counted, students = (
            numerators[counted_rows],
            denominators[counted_rows],
            len(counted_rows),
        )
        if not students:
            return Estimate(np.nan, np.nan, np.nan, 0)
        estimate = float(numerators_counted.sum() / denominators_counted.sum())
        if np.all(numerators_counted == 0.0) or np.array_equal(numerators_counted, denominators_counted):
            # All or nothing looks alike in every draw; each student then counts as one who did or did not.
            return Estimate(estimate, *wilson_interval(estimate * students, students), students)
        weights = self._weights[:, counted_rows]
        with np.errstate(invalid="ignore", divide="ignore"):
            bootstrap_estimates = (weights @ numerators_counted) / (weights @ denominators_counted)
            jackknife_estimates = (numerators_counted.sum() - numerators_counted) / (
                denominators_counted.sum() - denominators_counted
            )
        return Estimate(estimate, *interval(bootstrap_estimates, estimate, jackknife_estimates), students)
