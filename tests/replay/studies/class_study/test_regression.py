import json
from pathlib import Path

import numpy as np
import pytest

from replay.studies.class_study import regression
from replay.studies.class_study.refusals import StudyRefusedError
from replay.studies.class_study.regression import permutation_p, standardised_findings

REFERENCE = json.loads(Path(__file__).with_name("reference.json").read_text("utf-8"))
ANSWERS = np.array(REFERENCE["answers"], dtype=np.float64)
SCORES = np.column_stack([ANSWERS[:, a:b].mean(axis=1) for a, b in ((0, 5), (5, 10), (10, 15), (15, 19))])
VARIABLE_NAMES = ("y", "a", "b", "c")


def findings_of_regression(y, x):
    """Findings of a regression of y on the columns of x, with a fixed seed."""
    table = np.column_stack([y, x])
    return standardised_findings(VARIABLE_NAMES[: table.shape[1]], table, np.random.default_rng(0))


def test_regression_equals_stored_pingouin_and_statsmodels_values():
    """The fourth scale by the other three, and by the first alone."""
    requested = REFERENCE["multiple"]
    result = findings_of_regression(SCORES[:, 3], SCORES[:, :3])
    assert [c.beta for c in result] == pytest.approx(requested["beta"], abs=1e-10)
    assert [c.vif for c in result] == pytest.approx(requested["vif"], abs=1e-10)
    assert result[0].adjusted_r2 == pytest.approx(requested["adjusted_r2"], abs=1e-10)
    simple = findings_of_regression(SCORES[:, 3], SCORES[:, :1])
    assert simple[0].beta == pytest.approx(REFERENCE["simple"]["beta"], abs=1e-10)
    assert simple[0].adjusted_r2 == pytest.approx(REFERENCE["simple"]["adjusted_r2"], abs=1e-10)


def test_permuted_and_textbook_p_agree_where_errors_are_normal():
    """Within four standard errors of 4,999 permutations and 0.01."""
    random = np.random.default_rng(3)
    x = random.normal(size=(60, 2))
    y = 0.25 * x[:, 0] + random.normal(size=60)
    import statsmodels.api as sm

    textbook = sm.OLS(y, sm.add_constant(x)).fit(cov_type="HC3", use_t=True).pvalues[1:]
    for column in range(2):
        permuted = permutation_p(y - y.mean(), x - x.mean(axis=0), column, random)
        assert permuted == pytest.approx(textbook[column], abs=4 * np.sqrt(0.25 / 4999) + 0.01)


@pytest.mark.slow
def test_p_holds_its_level_where_scatter_grows_with_predictor(monkeypatch):
    """400 samples without an association, whose scatter is proportional to the predictor."""
    monkeypatch.setattr(regression, "PERMUTATIONS", 199)
    rejected = []
    for number in range(400):
        random = np.random.default_rng([number, 3])
        x = random.exponential(size=(40, 1))
        y = random.normal(size=40) * x[:, 0]
        rejected.append(permutation_p(y - y.mean(), x - x.mean(axis=0), 0, random) < 0.05)
    # 5 % and three standard errors; with the plain correlation 21 %.
    assert np.mean(rejected) < 0.05 + 3 * np.sqrt(0.05 * 0.95 / 400)


def test_permutation_p_of_a_perfect_fit_is_1_in_5000():
    """The data themselves count as one of 5000 permutations."""
    x = np.random.default_rng(3).normal(size=(60, 1))
    assert permutation_p(x[:, 0] - x.mean(), x - x.mean(), 0, np.random.default_rng(0)) == pytest.approx(1 / 5000)


@pytest.mark.parametrize(
    "y, x, rule",
    [
        (SCORES[:, 3], np.column_stack([SCORES[:, 0], 2.0 * SCORES[:, 0] + 1.0]), "collinear"),
        (np.full(52, 2.0), SCORES[:, :1], "no-variance"),
        (SCORES[:, 3], np.full((52, 1), 2.0), "no-variance"),
        (SCORES[:3, 3], SCORES[:3, :2], "no-variance"),
    ],
)
def test_collinear_or_constant_variables_are_refused(y, x, rule):
    """Also where nothing varies, or three students have three unknowns; ``rule``: by which it is refused."""
    with pytest.raises(StudyRefusedError) as refused:
        findings_of_regression(y, x)
    assert refused.value.rule == rule
