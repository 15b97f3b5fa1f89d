import json
from pathlib import Path

import numpy as np
import pytest
import scipy.stats

from replay.studies.class_study.refusals import StudyRefusedError
from replay.studies.class_study.reliability import bartlett_test, kaiser_word, kmo, reliability
from replay.studies.class_study.resampling import interval

REFERENCE = json.loads(Path(__file__).with_name("reference.json").read_text("utf-8"))
ANSWERS = np.array(REFERENCE["answers"], dtype=np.float64)


def alpha_of(answers):
    """Cronbach's alpha of answers (students, items), with a fixed seed."""
    return reliability(answers, np.random.default_rng(0)).alpha


@pytest.mark.parametrize("k, columns", list(enumerate([(0, 5), (5, 10), (10, 15), (15, 19), (0, 19)])))
def test_alpha_equals_the_stored_values_of_pingouin(k, columns):
    """``columns``: items of one of four scales, or all 19."""
    assert alpha_of(ANSWERS[:, slice(*columns)]) == pytest.approx(REFERENCE["alpha"][k], abs=1e-10)


def interval_of(statistic, values, seed):
    """The bootstrap interval of a statistic, from 20,000 draws."""
    drawn = statistic(values[np.random.default_rng(seed).integers(0, len(values), (20_000, len(values)))], axis=1)
    left_out = np.array([statistic(np.delete(values, k)) for k in range(len(values))])
    return interval(drawn, float(statistic(values)), left_out)


def test_the_interval_of_a_mean_is_students_own():
    """52 values and their negatives: a mean of 0 and 103 degrees of freedom."""
    values = np.random.default_rng(2).normal(size=52)
    values -= values.mean()
    both = np.concatenate([values, -values])
    half = scipy.stats.t.ppf(0.975, 103) * both.std(ddof=1) / np.sqrt(104)
    assert interval_of(np.mean, both, seed=0) == pytest.approx((-half, half), rel=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("statistic", [np.mean, np.var])
def test_bootstrap_interval_of_a_large_sample_agrees_with_scipy(statistic):
    """Large samples: the t quantile is the normal one, and scipy's BCa is an independent implementation."""
    values = np.random.default_rng(5).exponential(size=400)
    lower, upper = interval_of(statistic, values, seed=1)
    other = scipy.stats.bootstrap((values,), statistic, n_resamples=20_000, method="BCa", rng=np.random.default_rng(2))
    assert (lower, upper) == pytest.approx(tuple(other.confidence_interval), abs=0.012 * (upper - lower))


def test_interval_of_constant_resamples_is_a_point():
    """Absent resamples have no interval, nor have only two leave-one-out values."""
    assert interval(np.full(50, 2.0), 2.0, np.full(9, 2.0)) == (2.0, 2.0)
    assert np.isnan(interval(np.full(50, np.nan), 2.0, np.full(9, 2.0))).all()
    assert np.isnan(interval(np.ones(50), 1.0, np.ones(2))).all()


def test_kmo_of_uncorrelated_items_is_refused():
    """Two items of twelve students, each pair of answers equally often: alpha is 0 and Bartlett's p is 1."""
    signs = np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]] * 3, dtype=float)
    with pytest.raises(StudyRefusedError) as refused:
        kmo(signs)
    assert refused.value.rule == "uncorrelated"
    assert bartlett_test(signs).p == pytest.approx(1.0) and alpha_of(signs) == pytest.approx(0.0)


def test_kmo_and_bartlett_equal_the_stored_values_of_factor_analyzer():
    """19 items have 19 x 18 / 2 = 171 pairs."""
    assert kmo(ANSWERS) == pytest.approx(REFERENCE["kmo"], abs=1e-10)
    result = bartlett_test(ANSWERS)
    assert [result.chi_square, result.p] == pytest.approx(REFERENCE["bartlett"], rel=1e-10, abs=1e-10)
    assert result.degrees == 171


@pytest.mark.parametrize(
    "measure, answers, rule",
    [
        (alpha_of, ANSWERS[:, :1], "one-item"),
        (alpha_of, np.full((12, 3), 4.0), "no-variance"),
        (kmo, ANSWERS[:, :1], "one-item"),
        (kmo, np.column_stack([ANSWERS[:, :3], ANSWERS[:, :1]]), "singular"),
        (kmo, ANSWERS[:19], "singular"),
        (kmo, np.column_stack([ANSWERS[:, :3], np.full(52, 3.0)]), "no-variance"),
    ],
)
def test_reliability_of_unsuitable_answers_is_refused_with_its_rule(measure, answers, rule):
    """One item; constant answers; one item twice; as many students as items. ``lift``: what would help."""
    with pytest.raises(StudyRefusedError) as refused:
        measure(answers)
    assert refused.value.rule == rule and refused.value.lift


@pytest.mark.parametrize(
    ("value", "word"),
    [(0.95, "marvellous"), (0.9, "marvellous"), (0.89, "meritorious"), (0.65, "mediocre"), (0.5, "miserable"),
     (0.49, "unacceptable")],
)  # fmt: skip
def test_kmo_has_kaisers_word(value, word):
    """Words change at 0.5, 0.6 to 0.9 (Kaiser, 1974)."""
    assert kaiser_word(value) == word
