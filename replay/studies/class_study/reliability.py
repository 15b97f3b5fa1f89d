"""Internal consistency of a construct: Cronbach's alpha with a bootstrap interval, and each item against the rest."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from replay.studies.class_study.bootstrap import interval
from replay.studies.class_study.refusals import RefusedError

Floats = NDArray[np.float64]

BOOTSTRAPS: Final = 2000
"""Resamples of students behind an interval: its ends then move by about 0.005 from seed to seed."""


@dataclass(frozen=True)
class Reliability:
    """How far the items of one construct agree.

    Parameters
    ----------
    alpha : Cronbach's alpha.
    low, high : 95 % bootstrap interval over students (``bootstrap.interval``).
    item_total : (k,) correlation of each item with the sum of the others.
    students, items : how many.
    """

    alpha: float
    low: float
    high: float
    item_total: tuple[float, ...]
    students: int
    items: int


def cronbach_alpha(answers: Floats) -> float:
    """Cronbach's alpha, ``k/(k-1) (1 - sum var(x_i) / var(sum x_i))`` with variances over n - 1.

    ``answers`` are (students, items), reverse-coded items already turned. Refused as ``one-item``, and as
    ``no-variance`` when every student's sum is the same.

    Source: Cronbach (1951), Psychometrika 16, 297-334.
    """
    k = answers.shape[1]
    if k < 2:
        raise RefusedError("one-item", "Cronbach's alpha")
    total = answers.sum(axis=1).var(ddof=1) if len(answers) > 1 else 0.0
    if not total > 0.0:
        raise RefusedError("no-variance", "Cronbach's alpha")
    return float(k / (k - 1) * (1.0 - answers.var(axis=0, ddof=1).sum() / total))


def reliability(answers: Floats, random: np.random.Generator) -> Reliability:
    """Alpha of ``answers`` (as ``cronbach_alpha``) with its interval and item-total correlations.

    ``random`` draws the resamples of students.
    """
    alpha = cronbach_alpha(answers)
    students, items = answers.shape
    drawn = _alphas(answers[random.integers(0, students, (BOOTSTRAPS, students))])
    others = np.array([np.delete(np.arange(students), k) for k in range(students)])
    low, high = interval(drawn, alpha, _alphas(answers[others]))
    return Reliability(alpha, low, high, item_total(answers), students, items)


def _alphas(answers: Floats) -> Floats:
    """Alpha of each of (B, students, items), nan where the sums do not vary."""
    items = answers.shape[2]
    total = answers.sum(axis=2).var(axis=1, ddof=1)
    single = answers.var(axis=1, ddof=1).sum(axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        alphas: Floats = np.where(total > 0.0, items / (items - 1) * (1.0 - single / total), np.nan)
    return alphas


def item_total(answers: Floats) -> tuple[float, ...]:
    """Correlation of each item with the sum of the others; nan for an item that everyone answered alike."""
    total = answers.sum(axis=1)
    return tuple(_correlation(answers[:, i], total - answers[:, i]) for i in range(answers.shape[1]))


def _correlation(x: Floats, y: Floats) -> float:
    x, y = x - x.mean(), y - y.mean()
    size = float(np.sqrt((x @ x) * (y @ y)))
    return float(x @ y) / size if size > 0.0 else float("nan")
