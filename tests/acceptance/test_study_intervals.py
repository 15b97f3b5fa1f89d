"""On 100 or 200 made-up classes: intervals hold the truth as often as they say, and chance is rarely a finding."""

import numpy as np
import pytest
from pandas import DataFrame
from support.study_samples import metrics, names

from replay.studies.class_study.analysis import analyse
from replay.studies.class_study.codebook import Codebook, Item
from replay.studies.class_study.regression import standardised_findings
from replay.studies.class_study.reliability import reliability

pytestmark = pytest.mark.slow

CLASSES = 200
STUDENTS = 52
LOWER, UPPER = 0.91, 0.98
CLASSES_OF_CHANCE = 100
"""Classes that are analysed as a whole, which takes a tenth of a second each."""


def regression(random, betas, between):
    """Coefficients of predictors that correlate so; the truth is that of the population."""
    x = random.normal(size=(STUDENTS, len(betas))) @ np.linalg.cholesky(between).T
    y = x @ betas + np.sqrt(1.0 - betas @ between @ betas) * random.normal(size=STUDENTS)
    return standardised_findings(("y", "a", "b")[: 1 + len(betas)], np.column_stack([y, x]), random)


def alpha(random, r):
    """Five items of common correlation r have alpha = 5 r / (1 + 4 r)."""
    common = random.normal(size=(STUDENTS, 1))
    return [reliability(np.sqrt(r) * common + np.sqrt(1 - r) * random.normal(size=(STUDENTS, 5)), random)]


TWO = np.array([0.5, -0.3]), np.array([[1.0, 0.4], [0.4, 1.0]])
MODELS = {f"slope {slope:g}": ((slope,), regression, np.array([slope]), np.eye(1)) for slope in (0.0, 0.3, 0.6, 0.8)}
MODELS |= {"two predictors": (TWO[0], regression, *TWO), "alpha": ((5 * 0.4 / (1 + 4 * 0.4),), alpha, 0.4)}
"""Truths, and how to draw a class of which they are."""


@pytest.mark.parametrize("model", MODELS)
def test_intervals_hold_the_truth(model, monkeypatch):
    """Intervals of 95 % hold the number that a class of 52 students is drawn from, in 91 to 98 % of 200 classes."""
    # drawn after the interval, and not asked here
    monkeypatch.setattr("replay.studies.class_study.regression.permutation_p", lambda *_: None)
    truths, draw, *given = MODELS[model]
    result = [draw(np.random.default_rng([number, len(model)]), *given) for number in range(CLASSES)]
    for truth, figures in zip(truths, zip(*result, strict=True), strict=True):
        fraction = np.mean([figure.low <= truth <= figure.high for figure in figures])
        print(f"truth {truth:g} inside {fraction:.1%} of {CLASSES} intervals")
        assert LOWER <= fraction <= UPPER


def test_meaningless_answers_give_findings_in_five_percent_of_classes(monkeypatch):
    """Eight coefficients are asked about in every class: without Holm's correction a third of them would err.

    Allowed are 5 % of 100 classes and two standard errors.
    """
    # drawn from a stream of its own, and not asked here
    monkeypatch.setattr("replay.studies.class_study.analysis.reliability", lambda *_: None)
    items = tuple(Item(f"i{k}", f"c{k // 3}", (1, 5)) for k in range(12))
    questions = [("c0", "c1"), ("c0", "c1", "c2", "c3"), ("c1", "c2", "c3"), ("c2", "c3"), ("c3", "c0")]
    book = Codebook("who", items, tuple(questions))
    false = 0
    for k in range(CLASSES_OF_CHANCE):
        random = np.random.default_rng([k, 9])
        answers = {item.name: random.integers(1, 6, STUDENTS).astype(float) for item in items}
        study = analyse(book, DataFrame(answers, index=names(STUDENTS)), metrics(np.zeros(STUDENTS)), seed=k)
        assert len(study.coefficients) == 8
        false += any(element.associated for element in study.coefficients)
    most = 0.05 + 2 * np.sqrt(0.05 * 0.95 / CLASSES_OF_CHANCE)
    print(f"a finding in {false} of {CLASSES_OF_CHANCE} classes of chance; at most {most:.1%} are allowed")
    assert false / CLASSES_OF_CHANCE <= most
