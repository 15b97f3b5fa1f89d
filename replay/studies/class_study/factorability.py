"""Whether a questionnaire has factors to find: Kaiser-Meyer-Olkin measure and Bartlett's test of sphericity."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from replay.studies.class_study.refusals import LEAST_STUDENTS, RefusedError

Floats = NDArray[np.float64]

WORST_CONDITION: Final = 1e12
"""Condition of the correlation matrix above which its inverse keeps fewer than four digits."""

KAISER: Final = ((0.9, "marvellous"), (0.8, "meritorious"), (0.7, "middling"), (0.6, "mediocre"), (0.5, "miserable"))
"""Kaiser's words. Source: Kaiser (1974), Psychometrika 39, 31-36."""


@dataclass(frozen=True)
class Bartlett:
    """Bartlett's test that all correlations are zero: chi-square, degrees of freedom, p."""

    chi_square: float
    degrees: int
    p: float


def kaiser_word(kmo: float) -> str:
    """What Kaiser called a KMO of this size."""
    return next((word for least, word in KAISER if kmo >= least), "unacceptable")


def correlations(answers: Floats) -> Floats:
    """Correlation matrix of items, (k, k).

    Raises ``RefusedError``: ``one-item``; ``no-variance``; ``singular``.
    """
    if answers.shape[1] < 2:
        raise RefusedError("one-item", "correlations of items")
    if len(answers) < 2 or np.any(np.ptp(answers, axis=0) == 0.0):
        raise RefusedError("no-variance", "correlations of items")
    matrix: Floats = np.asarray(np.corrcoef(answers, rowvar=False), dtype=np.float64)
    if len(answers) <= answers.shape[1] or np.linalg.cond(matrix) > WORST_CONDITION:
        raise RefusedError("singular", "KMO and Bartlett's test")
    return matrix


def kmo(answers: Floats) -> float:
    """Kaiser-Meyer-Olkin measure of sampling adequacy, ``sum r^2 / (sum r^2 + sum a^2)`` over i != j.

    ``a`` are the partial correlations, ``-P_ij / sqrt(P_ii P_jj)`` with ``P`` the inverse correlation matrix.
    ``answers`` are (students, items); refused as by ``correlations``.

    Source: Kaiser (1970), Psychometrika 35, 401-415.
    """
    matrix = correlations(answers)
    inverse = np.linalg.inv(matrix)
    scale = np.sqrt(np.diag(inverse))
    partial = -inverse / np.outer(scale, scale)
    off = ~np.eye(len(matrix), dtype=bool)
    plain = float(np.square(matrix[off]).sum())
    return plain / (plain + float(np.square(partial[off]).sum()))


def bartlett(answers: Floats) -> Bartlett:
    """Bartlett's test of sphericity, ``chi2 = -(n - 1 - (2k + 5)/6) ln det R`` with ``k (k - 1)/2`` degrees.

    Refused as by ``correlations``, and as ``few-students``.

    Source: Bartlett (1951), Biometrika 38, 337-344.
    """
    students, items = answers.shape
    if students < LEAST_STUDENTS:
        raise RefusedError("few-students", "Bartlett's test")
    _, log_determinant = np.linalg.slogdet(correlations(answers))
    chi_square = -(students - 1 - (2 * items + 5) / 6) * float(log_determinant)
    degrees = items * (items - 1) // 2
    return Bartlett(chi_square, degrees, chi_square_tail(chi_square, degrees))


def chi_square_tail(value: float, degrees: int) -> float:
    """Probability of a chi-square above ``value``."""
    from scipy.stats import chi2

    return float(chi2.sf(value, degrees))
