"""On two hundred made-up classes: intervals hold the truth as often as they say, and chance is rarely a finding."""

import numpy as np
import pytest
from pandas import DataFrame
from support.study_samples import metrics, names

from replay.studies.class_study.analysis import analyse
from replay.studies.class_study.codebook import Codebook, Item
from replay.studies.class_study.regression import regress
from replay.studies.class_study.reliability import reliability

pytestmark = pytest.mark.slow

CLASSES = 200
STUDENTS = 52
LOW, HIGH = 0.91, 0.98


def covered(intervals, truth):
    share = np.mean([low <= truth <= high for low, high in intervals])
    print(f"truth {truth:g} inside {share:.1%} of {len(intervals)} intervals")
    return share


@pytest.mark.parametrize("slope", [0.0, 0.3, 0.6, 0.8])
def test_intervals_of_a_simple_coefficient_hold_the_truth(slope):
    found = []
    for k in range(CLASSES):
        random = np.random.default_rng([k, round(1000 * slope)])
        x = random.normal(size=STUDENTS)
        y = slope * x + np.sqrt(1 - slope**2) * random.normal(size=STUDENTS)
        c = regress(("y", "x"), np.column_stack([y, x]), random)[0]
        found.append((c.low, c.high))
    assert LOW <= covered(found, slope) <= HIGH


def test_intervals_of_a_multiple_regression_hold_the_truth():
    """Predictors correlate at 0.4; the truth is the standardised coefficient of the population."""
    betas = np.array([0.5, -0.3])
    between = np.array([[1.0, 0.4], [0.4, 1.0]])
    rest = np.sqrt(1.0 - betas @ between @ betas)
    root = np.linalg.cholesky(between)
    found = []
    for k in range(CLASSES):
        random = np.random.default_rng([k, 77])
        x = random.normal(size=(STUDENTS, 2)) @ root.T
        y = x @ betas + rest * random.normal(size=STUDENTS)
        found.append([(c.low, c.high) for c in regress(("y", "a", "b"), np.column_stack([y, x]), random)])
    for column, truth in enumerate(betas):
        assert LOW <= covered([one[column] for one in found], truth) <= HIGH


def test_intervals_of_alpha_hold_the_truth():
    """Five items of common correlation r have alpha = 5 r / (1 + 4 r)."""
    r, k = 0.4, 5
    found = []
    for number in range(CLASSES):
        random = np.random.default_rng([number, 5])
        common = random.normal(size=(STUDENTS, 1))
        answers = np.sqrt(r) * common + np.sqrt(1 - r) * random.normal(size=(STUDENTS, k))
        one = reliability(answers, random)
        found.append((one.low, one.high))
    assert LOW <= covered(found, k * r / (1 + (k - 1) * r)) <= HIGH


def test_answers_that_mean_nothing_give_findings_in_five_classes_of_a_hundred_at_most():
    """Eight coefficients are asked about in every class: without Holm's correction a third of them would err."""
    items = tuple(Item(f"i{k}", f"c{k // 3}", (1, 5)) for k in range(12))
    questions = (
        ("c0", "c1"),
        ("c0", "c1", "c2", "c3"),
        ("c1", "c2", "c3"),
    )
    book = Codebook("who", items, (*questions, ("c2", "c3"), ("c3", "c0")))
    false = 0
    for k in range(CLASSES):
        random = np.random.default_rng([k, 9])
        answers = {item.name: random.integers(1, 6, STUDENTS).astype(float) for item in items}
        study = analyse(book, DataFrame(answers, index=names(STUDENTS)), metrics(np.zeros(STUDENTS)), seed=k)
        assert len(study.coefficients) == 8
        false += any(one.associated for one in study.coefficients)
    most = 0.05 + 2 * np.sqrt(0.05 * 0.95 / CLASSES)
    print(f"a finding in {false} of {CLASSES} classes of chance; at most {most:.1%} are allowed")
    assert false / CLASSES <= most
