import numpy as np
import pytest
import scipy.stats

from replay.studies.class_study.reliability import interval


def means(values, random, draws=4000):
    drawn = values[random.integers(0, len(values), (draws, len(values)))].mean(axis=1)
    left_out = np.array([np.delete(values, k).mean() for k in range(len(values))])
    return drawn, float(values.mean()), left_out


def test_the_interval_of_a_mean_is_students_own():
    values = np.random.default_rng(2).normal(size=52)
    values -= values.mean()
    low, high = interval(*means(np.concatenate([values, -values]), np.random.default_rng(0), 20_000))
    both = np.concatenate([values, -values])
    half = scipy.stats.t.ppf(0.975, 103) * both.std(ddof=1) / np.sqrt(104)
    assert (low, high) == pytest.approx((-half, half), rel=0.05)


def test_without_the_widening_it_is_what_scipy_gives():
    """Large samples: the t quantile is the normal one, and scipy's BCa is an independent implementation."""
    values = np.random.default_rng(5).exponential(size=400)
    low, high = interval(*means(values, np.random.default_rng(1), 20_000))
    other = scipy.stats.bootstrap((values,), np.mean, n_resamples=20_000, method="BCa", rng=np.random.default_rng(2))
    assert (low, high) == pytest.approx(tuple(other.confidence_interval), abs=0.06 * (high - low))


def test_a_skewed_statistic_gets_a_skewed_interval():
    drawn, found, left_out = means(np.random.default_rng(5).exponential(size=40), np.random.default_rng(1))
    low, high = interval(drawn, found, left_out)
    assert high - found > 1.1 * (found - low)


def test_what_does_not_vary_has_a_point_and_what_is_not_there_has_none():
    assert interval(np.full(50, 2.0), 2.0, np.full(9, 2.0)) == (2.0, 2.0)
    assert np.isnan(interval(np.full(50, np.nan), 2.0, np.full(9, 2.0))).all()
    assert np.isnan(interval(np.ones(50), 1.0, np.ones(2))).all()
