import json
from pathlib import Path

import numpy as np
import pytest
import scipy.stats
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from replay.studies.class_study.refusals import StudyRefusedError
from replay.studies.class_study.reliability import (
    bartlett,
    cronbach_alpha,
    kmo,
)
from replay.studies.class_study.resampling import interval

REFERENCE = json.loads(Path(__file__).with_name("reference.json").read_text("utf-8"))
ANSWERS = np.array(REFERENCE["answers"], dtype=np.float64)
LIKERT = arrays(np.float64, st.tuples(st.integers(3, 30), st.integers(2, 8)), elements=st.integers(1, 5).map(float))


@pytest.mark.parametrize("k, columns", list(enumerate([(0, 5), (5, 10), (10, 15), (15, 19), (0, 19)])))
def test_alpha_equals_the_stored_values_of_pingouin(k, columns):
    assert cronbach_alpha(ANSWERS[:, slice(*columns)]) == pytest.approx(REFERENCE["alpha"][k], abs=1e-10)


@pytest.mark.parametrize("answers, rule", [(ANSWERS[:, :1], "one-item"), (np.full((12, 3), 4.0), "no-variance")])
def test_one_item_and_equal_answers_have_no_alpha(answers, rule):
    with pytest.raises(StudyRefusedError) as refused:
        cronbach_alpha(answers)
    assert refused.value.rule == rule and refused.value.lift


@given(LIKERT)
def test_alpha_knows_neither_the_order_of_students_nor_an_offset_nor_a_turned_scale(answers):
    if not answers.sum(axis=1).var() > 0:
        return
    alpha = cronbach_alpha(answers)
    for same in (answers[::-1], answers + 7.0, 6.0 - answers):
        assert cronbach_alpha(same) == pytest.approx(alpha, abs=1e-9)


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


@pytest.mark.parametrize("statistic", [np.mean, np.var])
def test_without_the_widening_it_is_what_scipy_gives(statistic):
    """Large samples: the t quantile is the normal one, and scipy's BCa is an independent implementation."""
    values = np.random.default_rng(5).exponential(size=400)
    drawn = statistic(values[np.random.default_rng(1).integers(0, 400, (20_000, 400))], axis=1)
    left_out = np.array([statistic(np.delete(values, k)) for k in range(400)])
    low, high = interval(drawn, float(statistic(values)), left_out)
    other = scipy.stats.bootstrap((values,), statistic, n_resamples=20_000, method="BCa", rng=np.random.default_rng(2))
    assert (low, high) == pytest.approx(tuple(other.confidence_interval), abs=0.012 * (high - low))


def test_what_does_not_vary_has_a_point_and_what_is_not_there_has_none():
    assert interval(np.full(50, 2.0), 2.0, np.full(9, 2.0)) == (2.0, 2.0)
    assert np.isnan(interval(np.full(50, np.nan), 2.0, np.full(9, 2.0))).all()
    assert np.isnan(interval(np.ones(50), 1.0, np.ones(2))).all()


def test_kmo_and_bartlett_equal_the_stored_values_of_factor_analyzer():
    assert kmo(ANSWERS) == pytest.approx(REFERENCE["kmo"], abs=1e-10)
    found = bartlett(ANSWERS)
    assert found.chi_square == pytest.approx(REFERENCE["bartlett"][0], rel=1e-10)
    assert found.p == pytest.approx(REFERENCE["bartlett"][1], rel=1e-9, abs=1e-10)
    assert found.degrees == 171


@pytest.mark.parametrize(
    "answers, rule",
    [
        (ANSWERS[:, :1], "one-item"),
        (np.column_stack([ANSWERS[:, :3], ANSWERS[:, :1]]), "singular"),
        (ANSWERS[:19], "singular"),
        (np.column_stack([ANSWERS[:, :3], np.full(52, 3.0)]), "no-variance"),
    ],
)
def test_what_has_no_inverse_has_no_kmo(answers, rule):
    with pytest.raises(StudyRefusedError) as refused:
        kmo(answers)
    assert refused.value.rule == rule
