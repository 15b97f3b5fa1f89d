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
"""Classes from which the share of intervals that hold the truth is counted."""
STUDENTS = 52
LEAST_HOLDING, MOST_HOLDING = 0.91, 0.98
"""Of intervals of 95 % in 200 classes: 95 % and 2 to 3 times their standard error of 1.5 points."""
CLASSES_OF_CHANCE = 100
"""Classes that are analysed as a whole, which takes a tenth of a second each."""


def regression(random, betas, between):
    """Coefficients of a class whose predictors have these coefficients and correlations in the population.

    ``betas``: (k,) standardised coefficients; ``between``: (k, k) correlations of the predictors.
    """
    x = random.normal(size=(STUDENTS, len(betas))) @ np.linalg.cholesky(between).T
    y = x @ betas + np.sqrt(1.0 - betas @ between @ betas) * random.normal(size=STUDENTS)
    return standardised_findings(("y", "a", "b")[: 1 + len(betas)], np.column_stack([y, x]), random)


def alpha(random, r):
    """Cronbach's alpha of a class with five items of common correlation r: 5 r / (1 + 4 r) in the population."""
    common = random.normal(size=(STUDENTS, 1))
    return [reliability(np.sqrt(r) * common + np.sqrt(1 - r) * random.normal(size=(STUDENTS, 5)), random)]


TWO_BETAS, TWO_CORRELATIONS = np.array([0.5, -0.3]), np.array([[1.0, 0.4], [0.4, 1.0]])
MODELS = {f"slope {slope:g}": ((slope,), regression, (np.array([slope]), np.eye(1))) for slope in (0.0, 0.3, 0.6, 0.8)}
MODELS["two predictors"] = (TWO_BETAS, regression, (TWO_BETAS, TWO_CORRELATIONS))
MODELS["alpha"] = ((5 * 0.4 / (1 + 4 * 0.4),), alpha, (0.4,))
"""Name -> true numbers of the population, the function that draws a class from it, and the arguments of that."""


@pytest.mark.parametrize("model", MODELS)
def test_intervals_hold_the_truth(model, monkeypatch):
    """Intervals of 95 % hold the number that a class of 52 students is drawn from, in 91 to 98 % of 200 classes."""
    # The p-value is drawn after the interval, and is no part of it.
    monkeypatch.setattr("replay.studies.class_study.regression.permutation_p", lambda *_: None)
    truths, draw_class, arguments = MODELS[model]
    figures_of_classes = [
        draw_class(np.random.default_rng([number, len(model)]), *arguments) for number in range(CLASSES)
    ]
    for truth, figures in zip(truths, zip(*figures_of_classes, strict=True), strict=True):
        fraction = np.mean([figure.low <= truth <= figure.high for figure in figures])
        print(f"truth {truth:g} inside {fraction:.1%} of {CLASSES} intervals")
        assert LEAST_HOLDING <= fraction <= MOST_HOLDING


def test_meaningless_answers_give_findings_in_five_percent_of_classes(monkeypatch):
    """52 students answer 12 items of four constructs at random; five models have eight coefficients a class.

    Without Holm's correction 1 - 0.95^8, a third of the classes, would have a finding. Allowed are 5 % of 100 classes
    and two standard errors.
    """
    # Reliability is drawn from a random stream of its own, and is no part of the models.
    monkeypatch.setattr("replay.studies.class_study.analysis.reliability", lambda *_: None)
    items = tuple(Item(f"i{k}", f"c{k // 3}", (1, 5)) for k in range(12))
    models = [("c0", "c1"), ("c0", "c1", "c2", "c3"), ("c1", "c2", "c3"), ("c2", "c3"), ("c3", "c0")]
    coefficients_a_class = sum(len(predictors) for _, *predictors in models)
    book = Codebook("who", items, tuple(models))
    classes_with_a_finding = 0
    for k in range(CLASSES_OF_CHANCE):
        random = np.random.default_rng([k, 9])
        answers = {item.name: random.integers(1, 6, STUDENTS).astype(float) for item in items}
        study = analyse(book, DataFrame(answers, index=names(STUDENTS)), metrics(np.zeros(STUDENTS)), seed=k)
        assert len(study.coefficients) == coefficients_a_class
        classes_with_a_finding += any(coefficient.associated for coefficient in study.coefficients)
    most = 0.05 + 2 * np.sqrt(0.05 * 0.95 / CLASSES_OF_CHANCE)
    print(f"a finding in {classes_with_a_finding} of {CLASSES_OF_CHANCE} classes; at most {most:.1%} are allowed")
    assert classes_with_a_finding / CLASSES_OF_CHANCE <= most
