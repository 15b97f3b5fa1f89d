"""How far a questionnaire can be relied on: Cronbach's alpha with its interval, KMO and Bartlett's test."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cdcore.numerics import FloatArray
from replay.studies.class_study.refusals import LEAST_STUDENTS, StudyRefusedError
from replay.studies.class_study.resampling import with_intervals

WORST_CONDITION: Final = 1e12
"""Condition of the correlation matrix above which its inverse keeps fewer than four digits."""

LEAST_SPREAD: Final = 1e-12
"""Below this a variance of answers is rounding."""

ACCEPTABLE_ALPHA: Final = 0.7
"""Alpha from which on a scale is commonly called reliable. Source: Nunnally (1978), Psychometric Theory."""

KAISER_LABELS: Final = (
    (0.9, "marvellous"),
    (0.8, "meritorious"),
    (0.7, "middling"),
    (0.6, "mediocre"),
    (0.5, "miserable"),
)
"""Kaiser's words. Source: Kaiser (1974), Psychometrika 39, 31-36."""


@dataclass(frozen=True)
class Reliability:
    """How far the items of one construct agree.

    ``alpha`` is Cronbach's, ``low`` and ``high`` its 95 % bootstrap interval over students; ``item_total`` (k,) is the
    correlation of each item with the sum of the others.
    """

    alpha: float
    low: float
    high: float
    item_total: tuple[float, ...]
    students: int
    items: int

    @property
    def least_item_total(self) -> float:
        """Smallest item-total correlation."""
        return min(self.item_total)


@dataclass(frozen=True)
class Bartlett:
    """Bartlett's test that all correlations are zero: chi-square, degrees of freedom, p, students with all answers."""

    chi_square: float
    degrees: int
    p: float
    students: int


def reliability(answers: FloatArray, random: np.random.Generator) -> Reliability:
    """Cronbach's alpha, ``k/(k-1) (1 - sum var(x_i) / var(sum x_i))``, its interval over students, and item totals.

    ``answers`` are (students, items), reverse-coded items already turned. Refused as ``one-item``, and as
    ``no-variance`` when every student's sum is the same.

    Source: Cronbach (1951), Psychometrika 16, 297-334.
    """
    students, items = answers.shape
    if items < 2:
        raise StudyRefusedError("one-item", "Cronbach's alpha")
    if not answers.sum(axis=1).var() > 0.0:
        raise StudyRefusedError("no-variance", "Cronbach's alpha")
    columns = np.column_stack([answers, answers.sum(axis=1)])
    columns -= columns.mean(axis=0)

    def alphas(weights: FloatArray) -> FloatArray:
        fractions = weights / weights.sum(axis=1, keepdims=True)
        variances = fractions @ columns**2 - (fractions @ columns) ** 2
        # Rounding leaves a little of sums that do not vary.
        total_variance = np.where(variances[:, -1] > LEAST_SPREAD, variances[:, -1], np.nan)
        return np.asarray(items / (items - 1) * (1.0 - variances[:, :-1].sum(axis=1) / total_variance))[:, None]

    (alpha,), ((lower, upper),) = with_intervals(alphas, students, random)
    return Reliability(float(alpha), float(lower), float(upper), item_total(answers), students, items)


def item_total(answers: FloatArray) -> tuple[float, ...]:
    """Correlation of each item with the sum of the others; nan for an item that everyone answered alike."""
    sum_of_others = answers.sum(axis=1, keepdims=True) - answers
    with np.errstate(invalid="ignore", divide="ignore"):
        return tuple(
            float(np.corrcoef(item, rest_sum)[0, 1]) for item, rest_sum in zip(answers.T, sum_of_others.T, strict=True)
        )


def kaiser_word(kmo: float) -> str:
    """Kaiser's word for a KMO of this size."""
    return next((word for least_kmo, word in KAISER_LABELS if kmo >= least_kmo), "unacceptable")


def correlations(answers: FloatArray) -> FloatArray:
    """Correlation matrix of items, (k, k); refused as ``one-item``, ``no-variance`` or ``singular``."""
    if answers.shape[1] < 2:
        raise StudyRefusedError("one-item", "correlations of items")
    if len(answers) < 2 or np.any(np.ptp(answers, axis=0) == 0.0):
        raise StudyRefusedError("no-variance", "correlations of items")
    matrix: FloatArray = np.asarray(np.corrcoef(answers, rowvar=False), dtype=np.float64)
    if len(answers) <= answers.shape[1] or np.linalg.cond(matrix) > WORST_CONDITION:
        raise StudyRefusedError("singular", "KMO and Bartlett's test")
    return matrix


def kmo(answers: FloatArray) -> float:
    """Kaiser-Meyer-Olkin measure of sampling adequacy, ``sum r^2 / (sum r^2 + sum a^2)`` over i != j.

    ``a`` are the partial correlations, ``-P_ij / sqrt(P_ii P_jj)`` with ``P`` the inverse correlation matrix.
    ``answers`` are (students, items); refused as by ``correlations``, and as ``uncorrelated``.

    Source: Kaiser (1970), Psychometrika 35, 401-415.
    """
    matrix = correlations(answers)
    inverse_matrix = np.linalg.inv(matrix)
    scale = np.sqrt(np.diag(inverse_matrix))
    off_diagonal = ~np.eye(len(matrix), dtype=bool)
    plain_squares, partial_squares = (
        float(np.square(matrix_of[off_diagonal]).sum())
        for matrix_of in (matrix, inverse_matrix / np.outer(scale, scale))
    )
    if plain_squares + partial_squares < LEAST_SPREAD:
        raise StudyRefusedError("uncorrelated", "KMO")
    return plain_squares / (plain_squares + partial_squares)


def bartlett_test(answers: FloatArray) -> Bartlett:
    """Bartlett's test of sphericity, ``chi2 = -(n - 1 - (2k + 5)/6) ln det R`` with ``k (k - 1)/2`` degrees.

    Refused as by ``correlations``, and as ``few-students``.

    Source: Bartlett (1951), Biometrika 38, 337-344.
    """
    from scipy.special import chdtrc

    students, items = answers.shape
    if students < LEAST_STUDENTS:
        raise StudyRefusedError("few-students", "Bartlett's test")
    _, log_determinant = np.linalg.slogdet(correlations(answers))
    chi_square = -(students - 1 - (2 * items + 5) / 6) * float(log_determinant)
    degrees = items * (items - 1) // 2
    return Bartlett(chi_square, degrees, float(chdtrc(degrees, chi_square)), students)
