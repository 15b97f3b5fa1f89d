import json
from pathlib import Path

import numpy as np
import pytest

from replay.studies.class_study import regression
from replay.studies.class_study.refusals import StudyRefusedError
from replay.studies.class_study.regression import permutation_p, standardised_findings

REFERENCE = json.loads(Path(__file__).with_name("reference.json").read_text("utf-8"))
"""Answers of 52 students to 19 items, and what pingouin, statsmodels and factor_analyzer computed from them."""
ANSWERS = np.array(REFERENCE["answers"], dtype=np.float64)
SCORES = np.column_stack([ANSWERS[:, a:b].mean(axis=1) for a, b in ((0, 5), (5, 10), (10, 15), (15, 19))])
"""Mean of each of the 52 students on each of four scales, of 5, 5, 5 and 4 items."""
VARIABLE_NAMES = ("y", "a", "b", "c")


def findings_of_regression(y, x):
    """Findings of a regression of y on the columns of x, with a fixed seed: one a column."""
    table = np.column_stack([y, x])
    return standardised_findings(VARIABLE_NAMES[: table.shape[1]], table, np.random.default_rng(0))


def test_regression_equals_stored_pingouin_and_statsmodels_values():
    """Answers of 52 students on four scales: the fourth by the other three, and by the first alone.

    Expected values were computed by the libraries once and stored: coefficients, variance inflation (VIF) and fit.
    """
    *predictors, outcome = SCORES.T
    findings = findings_of_regression(outcome, np.column_stack(predictors))
    assert [finding.beta for finding in findings] == pytest.approx(REFERENCE["multiple"]["beta"], abs=1e-10)
    assert [finding.vif for finding in findings] == pytest.approx(REFERENCE["multiple"]["vif"], abs=1e-10)
    assert findings[0].adjusted_r2 == pytest.approx(REFERENCE["multiple"]["adjusted_r2"], abs=1e-10)
    (simple,) = findings_of_regression(outcome, predictors[0])
    assert simple.beta == pytest.approx(REFERENCE["simple"]["beta"], abs=1e-10)
    assert simple.adjusted_r2 == pytest.approx(REFERENCE["simple"]["adjusted_r2"], abs=1e-10)


def test_permuted_and_textbook_p_agree_where_errors_are_normal():
    """60 students; the first predictor has a weak effect, the second a strong one, which must not hide the first.

    Expected is p of statsmodels with HC3 errors.
    They may differ by four standard errors of 4,999 permutations (at most 0.5 / sqrt(4999) each), and by 0.01.
    """
    from statsmodels.regression.linear_model import OLS  # statsmodels.api takes 0.2 s more

    random = np.random.default_rng(3)
    x = random.normal(size=(60, 2))
    y = 0.25 * x[:, 0] + 3.0 * x[:, 1] + random.normal(size=60)
    _constant, *textbook = OLS(y, np.column_stack([np.ones(60), x])).fit(cov_type="HC3", use_t=True).pvalues
    permuted = [permutation_p(y - y.mean(), x - x.mean(axis=0), column, random) for column in (0, 1)]
    assert permuted == pytest.approx(textbook, abs=4 * 0.5 / np.sqrt(regression.PERMUTATIONS) + 0.01)


@pytest.mark.slow
def test_p_holds_its_level_where_scatter_grows_with_predictor(monkeypatch):
    """400 samples of 40 without an association, whose scatter is proportional to the predictor.

    p is below 0.05 in 5 % of them and at most three standard errors more; with the plain correlation it were in 21 %.
    """
    monkeypatch.setattr(regression, "PERMUTATIONS", 199)
    samples, rejected = 400, 0
    for seed in range(samples):
        random = np.random.default_rng([seed, 3])
        x = random.exponential(size=(40, 1))
        y = random.normal(size=40) * x[:, 0]
        rejected += permutation_p(y - y.mean(), x - x.mean(axis=0), column=0, random=random) < 0.05
    assert rejected / samples < 0.05 + 3 * np.sqrt(0.05 * 0.95 / samples)


def test_permutation_p_of_a_perfect_fit_is_1_in_5000():
    """No permutation is as extreme as y = x; the data themselves count beside the 4,999 permutations."""
    x = np.random.default_rng(3).normal(size=(60, 1))
    x -= x.mean()
    p = permutation_p(y=x[:, 0], x=x, column=0, random=np.random.default_rng(0))
    assert p == pytest.approx(1 / (regression.PERMUTATIONS + 1))


FIRST_SCALE, FOURTH_SCALE = SCORES[:, 0], SCORES[:, 3]


@pytest.mark.parametrize(
    ("y", "x", "rule"),
    [
        pytest.param(
            FOURTH_SCALE, np.column_stack([FIRST_SCALE, 2.0 * FIRST_SCALE + 1.0]), "collinear", id="twice the first"
        ),
        pytest.param(np.full(52, 2.0), FIRST_SCALE, "no-variance", id="constant outcome"),
        pytest.param(FOURTH_SCALE, np.full(52, 2.0), "no-variance", id="constant predictor"),
        pytest.param(FOURTH_SCALE[:3], SCORES[:3, :2], "no-variance", id="three students, three unknowns"),
    ],
)
def test_collinear_or_constant_variables_are_refused(y, x, rule):
    """A regression of y on x, answers of 52 students on scales; ``rule``: that by which it is refused."""
    with pytest.raises(StudyRefusedError) as refused:
        findings_of_regression(y, x)
    assert refused.value.rule == rule
