"""Correlations that a class of some size shows, and how many students a correlation takes."""

from math import atanh, ceil, sqrt, tanh
from statistics import NormalDist
from typing import Final

from replay.studies.class_study.analysis import Study
from replay.studies.class_study.regression import SIGNIFICANCE_LEVEL

LEAST_STUDENTS_NEEDED: Final = 20
"""Students from which on Fisher's transformation is near enough."""

MEDIUM_CORRELATION: Final = 0.3
"""A correlation of medium size (Cohen 1988)."""

TARGET_POWER: Final = 0.8
"""Probability that a test finds the correlation: in four of five classes."""


def tests_together(study: Study) -> int:
    """Number of tests among which the p-values of the associations are corrected, else those of the groups; 1: none."""
    families = (study.coefficients, study.groups)
    return next((count for family in families if (count := sum(row.p is not None for row in family))), 1)


def least_correlation(students: int, tests: int) -> float | None:
    """The correlation that is found in four of five such classes, corrected for some tests; ``None``: too few students.

    The correction is Bonferroni's, the first step of Holm's, which the largest correlation has to pass.

    Source: Fisher's z transformation, of which the deviation is 1 / sqrt(n - 3).
    """
    return None if students < LEAST_STUDENTS_NEEDED else tanh(_detectable_deviations(tests) / sqrt(students - 3))


def students_needed(correlation: float, tests: int) -> int:
    """The fewest students of which this correlation is found in four of five classes, corrected for some tests."""
    return ceil((_detectable_deviations(tests) / atanh(correlation)) ** 2 + 3)


def _detectable_deviations(tests: int) -> float:
    """Standard deviations between no correlation and one that a two-sided test finds in four of five classes."""
    normal = NormalDist()
    return normal.inv_cdf(1.0 - SIGNIFICANCE_LEVEL / (2 * tests)) + normal.inv_cdf(TARGET_POWER)


def more_students_needed(study: Study) -> bool:
    """Whether nothing is associated, and a medium correlation takes more students than were tested."""
    needed_students = students_needed(MEDIUM_CORRELATION, tests_together(study))
    return study.tested and study.nothing_associated and study.students < needed_students
