import json
from pathlib import Path

import numpy as np
import pytest

from replay.studies.class_study.refusals import StudyRefusedError
from replay.studies.class_study.regression import holm, permutation_p, regress

REFERENCE = json.loads(Path(__file__).with_name("reference.json").read_text("utf-8"))
ANSWERS = np.array(REFERENCE["answers"], dtype=np.float64)
SCORES = np.column_stack([ANSWERS[:, a:b].mean(axis=1) for a, b in ((0, 5), (5, 10), (10, 15), (15, 19))])
NAMES = ("a", "b", "c")


def fit(y, x, students=None, seed=0):
    students = np.arange(len(y)) if students is None else np.asarray(students)
    return regress("y", y, NAMES[: x.shape[1]], x, students, np.random.default_rng(seed))


def test_coefficients_fit_and_inflation_equal_the_stored_values_of_pingouin_and_statsmodels():
    wanted = REFERENCE["multiple"]
    found = fit(SCORES[:, 3], SCORES[:, :3])
    assert [c.beta for c in found.coefficients] == pytest.approx(wanted["beta"], abs=1e-10)
    assert [c.vif for c in found.coefficients] == pytest.approx(wanted["vif"], abs=1e-10)
    assert found.adjusted_r2 == pytest.approx(wanted["adjusted_r2"], abs=1e-10)
    simple = fit(SCORES[:, 3], SCORES[:, :1])
    assert simple.coefficients[0].beta == pytest.approx(REFERENCE["simple"]["beta"], abs=1e-10)
    assert simple.adjusted_r2 == pytest.approx(REFERENCE["simple"]["adjusted_r2"], abs=1e-10)


def test_a_student_counts_once_with_the_mean_of_the_sessions_however_many_there_are():
    apart = np.random.default_rng(1).normal(size=(52, 4))
    rows = np.concatenate([SCORES + apart, SCORES - apart, *[SCORES[:3]] * 18])
    students = np.concatenate([np.arange(52), np.arange(52), *[np.arange(3)] * 18])
    found, plain = fit(rows[:, 3], rows[:, :3], students), fit(SCORES[:, 3], SCORES[:, :3])
    for one, other in zip(found.coefficients, plain.coefficients, strict=True):
        assert (one.beta, one.low, one.high, one.p) == pytest.approx((other.beta, other.low, other.high, other.p))
    assert (found.rows, found.students, found.adjusted_r2) == (158, 52, pytest.approx(plain.adjusted_r2))


DESIGNS = {
    "15 of whom three have 20": [20] * 3 + [1] * 12, "12 of whom one has 40": [40] + [1] * 11, "10 with 4": [4] * 10,
    "30 with one": [1] * 30,
}  # fmt: skip


def null_rate(sessions, classes):
    """Share of classes with p < 0.05 in which behaviour, alike in a student's sessions, and answers go apart."""
    random, below = np.random.default_rng(5), 0
    students = np.repeat(np.arange(len(sessions)), sessions)
    for _ in range(classes):
        behaviour = random.normal(size=len(sessions))[students] + random.normal(size=len(students))
        answers = random.normal(size=len(sessions))[students]
        both = (answers, behaviour) if random.random() < 0.5 else (behaviour, answers)
        below += fit(both[0], both[1][:, None], students).coefficients[0].p < 0.05
    return below / classes


def test_where_nothing_is_associated_p_is_rarely_below_a_twentieth_though_three_students_have_most_sessions():
    assert null_rate(DESIGNS["15 of whom three have 20"], 100) <= 0.12


@pytest.mark.slow
@pytest.mark.parametrize("design", DESIGNS)
def test_p_is_below_a_twentieth_in_a_twentieth_of_classes_without_association(design):
    assert 0.03 <= null_rate(DESIGNS[design], 1000) <= 0.07


def test_permuted_and_textbook_p_agree_where_errors_are_normal():
    random = np.random.default_rng(3)
    x = random.normal(size=(60, 2))
    y = 0.25 * x[:, 0] + random.normal(size=60)
    import statsmodels.api as sm

    textbook = sm.OLS(y, sm.add_constant(x)).fit().pvalues[1:]
    for column in range(2):
        permuted = permutation_p(y - y.mean(), x - x.mean(axis=0), column, random)
        assert permuted == pytest.approx(textbook[column], abs=4 * np.sqrt(0.25 / 4999) + 0.01)


def test_no_p_is_zero_because_what_was_found_is_one_of_its_permutations():
    x = np.random.default_rng(3).normal(size=(60, 1))
    assert permutation_p(x[:, 0] - x.mean(), x - x.mean(), 0, np.random.default_rng(0)) == pytest.approx(1 / 5000)


def test_nine_students_get_coefficients_and_no_p():
    found = fit(SCORES[:9, 3], SCORES[:9, :1])
    assert found.coefficients[0].p is None
    assert fit(SCORES[:10, 3], SCORES[:10, :1]).coefficients[0].p is not None


@pytest.mark.parametrize(
    "y, x, rule",
    [
        (SCORES[:, 3], np.column_stack([SCORES[:, 0], 2.0 * SCORES[:, 0] + 1.0]), "collinear"),
        (np.full(52, 2.0), SCORES[:, :1], "no-variance"),
        (SCORES[:, 3], np.full((52, 1), 2.0), "no-variance"),
        (SCORES[:3, 3], SCORES[:3, :2], "no-variance"),
    ],
)
def test_what_cannot_be_told_apart_is_refused(y, x, rule):
    with pytest.raises(StudyRefusedError) as refused:
        fit(y, x)
    assert refused.value.rule == rule


def test_a_behaviour_that_is_the_same_in_all_sessions_of_all_has_no_variance_though_means_round():
    students = np.repeat(np.arange(12), np.arange(12) * 7 + 1)
    with pytest.raises(StudyRefusedError) as refused:
        fit(SCORES[students, 3], np.full((len(students), 1), 0.1), students)
    assert refused.value.rule == "no-variance"


def test_holm_corrects_across_all_regressions_as_by_hand():
    first, second = fit(SCORES[:, 3], SCORES[:, :1]), fit(SCORES[:, 2], SCORES[:, :2])
    raw = [c.p for one in (first, second) for c in one.coefficients]
    order = np.argsort(raw)
    by_hand, most = np.empty(3), 0.0
    for rank, k in enumerate(order):
        most = max(most, min(1.0, (3 - rank) * raw[k]))
        by_hand[k] = most
    corrected = holm([*first.coefficients, *second.coefficients])
    assert [c.p_holm for c in corrected] == pytest.approx(by_hand, abs=1e-12)
