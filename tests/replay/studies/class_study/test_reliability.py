import json
from pathlib import Path

import numpy as np
import pytest
import scipy.stats

from replay.studies.class_study.refusals import StudyRefusedError
from replay.studies.class_study.reliability import bartlett_test, kaiser_word, kmo, reliability
from replay.studies.class_study.resampling import interval

REFERENCE = json.loads(Path(__file__).with_name("reference.json").read_text("utf-8"))
"""Answers of 52 students to 19 items, and what pingouin and factor_analyzer computed from them."""
ANSWERS = np.array(REFERENCE["answers"], dtype=np.float64)


def alpha_of(answers):
    """Cronbach's alpha of answers (students, items), with a fixed seed."""
    return reliability(answers, np.random.default_rng(0)).alpha


@pytest.mark.parametrize(
    ("first_item", "end_item", "expected"),
    [
        (first, end, alpha)
        for (first, end), alpha in zip([(0, 5), (5, 10), (10, 15), (15, 19), (0, 19)], REFERENCE["alpha"], strict=True)
    ],
    ids=["first scale", "second scale", "third scale", "fourth scale", "all items"],
)
def test_alpha_equals_the_stored_values_of_pingouin(first_item, end_item, expected):
    """Cronbach's alpha of answers of 52 students to some of 19 items, which pingouin computed once.

    Items are numbered from 0; the end is not among them.
    """
    assert alpha_of(ANSWERS[:, first_item:end_item]) == pytest.approx(expected, abs=1e-10)


def interval_of(statistic, values, seed):
    """The bootstrap interval of a statistic, from 20,000 draws of as many values and the statistic without each."""
    drawn = np.random.default_rng(seed).integers(0, len(values), (20_000, len(values)))
    left_out = np.array([statistic(np.delete(values, k)) for k in range(len(values))])
    return interval(statistic(values[drawn], axis=1), float(statistic(values)), left_out)


def test_the_interval_of_a_mean_is_students_own():
    """52 values and their negatives are 104, symmetric about 0: Student's interval has 103 degrees of freedom."""
    values = np.random.default_rng(2).normal(size=52)
    values -= values.mean()
    both = np.concatenate([values, -values])
    half_width = scipy.stats.t.ppf(0.975, 103) * both.std(ddof=1) / np.sqrt(104)
    # The ends scatter by about 1 % (a standard error of 20,000 draws).
    assert interval_of(np.mean, both, seed=0) == pytest.approx((-half_width, half_width), rel=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("statistic", [np.mean, np.var])
def test_bootstrap_interval_of_a_large_sample_agrees_with_scipy(statistic):
    """400 skewed values: the t quantile is nearly the normal one, and SciPy's BCa is an independent implementation.

    Both draw 20,000 times, with seeds of their own: 1.2 % of the width for that.
    """
    values = np.random.default_rng(5).exponential(size=400)
    lower, upper = interval_of(statistic, values, seed=1)
    other = scipy.stats.bootstrap((values,), statistic, n_resamples=20_000, method="BCa", rng=np.random.default_rng(2))
    assert (lower, upper) == pytest.approx(tuple(other.confidence_interval), abs=0.012 * (upper - lower))


def test_interval_of_constant_resamples_is_a_point():
    """All 50 resamples of nine students give 2, and so does each sample without one of them."""
    ends = interval(bootstrap_estimates=np.full(50, 2.0), estimate=2.0, jackknife_estimates=np.full(9, 2.0))
    assert ends == (2.0, 2.0)


@pytest.fixture
def uncorrelated_answers():
    """Answers of twelve students to two items, each of the four pairs of +1 and -1 three times."""
    return np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]] * 3, dtype=float)


def test_kmo_of_uncorrelated_items_is_refused(uncorrelated_answers):
    """Two items whose answers go together in no way: every correlation is 0, so that KMO would be 0 divided by 0."""
    with pytest.raises(StudyRefusedError) as refused:
        kmo(uncorrelated_answers)
    assert refused.value.rule == "uncorrelated"


def test_uncorrelated_items_have_alpha_0_and_p_1(uncorrelated_answers):
    """Two items whose answers go together in no way: alpha is Cronbach's, p Bartlett's, that chance makes them so."""
    assert alpha_of(uncorrelated_answers) == pytest.approx(0.0)
    assert bartlett_test(uncorrelated_answers).p == pytest.approx(1.0)


def test_kmo_and_bartlett_equal_the_stored_values_of_factor_analyzer():
    """Chi-square and p of Bartlett's test; its degrees of freedom are the 19 x 18 / 2 = 171 pairs of items."""
    assert kmo(ANSWERS) == pytest.approx(REFERENCE["kmo"], abs=1e-10)
    result = bartlett_test(ANSWERS)
    assert [result.chi_square, result.p] == pytest.approx(REFERENCE["bartlett"], rel=1e-10, abs=1e-10)
    assert result.degrees == 171


def test_kmo_of_two_correlated_items_is_a_half():
    """KMO is r^2 / (r^2 + partial r^2); without a third item the partial correlation is the correlation r itself."""
    assert kmo(ANSWERS[:, :2]) == pytest.approx(0.5)


FIRST_ITEM, THREE_ITEMS = ANSWERS[:, :1], ANSWERS[:, :3]


@pytest.mark.parametrize(
    ("measure", "answers", "rule"),
    [
        pytest.param(alpha_of, FIRST_ITEM, "one-item", id="alpha of one item"),
        pytest.param(alpha_of, np.full((12, 3), 4.0), "no-variance", id="alpha of constant answers"),
        pytest.param(kmo, FIRST_ITEM, "one-item", id="KMO of one item"),
        pytest.param(kmo, np.column_stack([THREE_ITEMS, FIRST_ITEM]), "singular", id="KMO of an item twice"),
        pytest.param(kmo, ANSWERS[:19], "singular", id="KMO of 19 students and 19 items"),
        pytest.param(kmo, np.column_stack([THREE_ITEMS, np.full(52, 3.0)]), "no-variance", id="KMO of a constant item"),
    ],
)
def test_reliability_of_unsuitable_answers_is_refused_with_its_rule(measure, answers, rule):
    """Answers of 52 students to some of 19 items, or changed ones; a refusal says what would lift its rule."""
    with pytest.raises(StudyRefusedError) as refused:
        measure(answers)
    assert refused.value.rule == rule
    assert refused.value.lift != ""


@pytest.mark.parametrize(
    ("value", "word"),
    [
        (0.95, "marvellous"),
        (0.9, "marvellous"),
        (0.89, "meritorious"),
        (0.75, "middling"),
        (0.65, "mediocre"),
        (0.5, "miserable"),
        (0.49, "unacceptable"),
    ],
)
def test_kmo_has_kaisers_word(value, word):
    """Words change at 0.5, 0.6, 0.7, 0.8 and 0.9 (Kaiser, 1974); the limit itself has the better word."""
    assert kaiser_word(value) == word
