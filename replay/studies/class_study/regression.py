"""Regressions stated as what they are: simple or multiple, with intervals, and p-values that fit the sample.

Coefficients are standardised. Their intervals are bootstrapped over students, because the textbook interval of a
standardised slope forgets that the scales were estimated too: at a correlation of 0.6 it covers the truth in 99 %.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, TypeVar

import numpy as np

from cdcore.numerics import FloatArray
from replay.studies.class_study.refusals import LEAST_STUDENTS, StudyRefusedError
from replay.studies.class_study.resampling import with_intervals

PERMUTATIONS: Final = 4999

LEAST_SPREAD: Final = 1e-10
"""Share of a predictor's variance that the others must leave unexplained; below it digits run out."""


SIGNIFICANCE_LEVEL: Final = 0.05
"""Associated: p after Holm's correction is below this, and the interval leaves out zero."""

UNDECIDED: Final = "undecided"
AFTER_HOLM: Final = f"{UNDECIDED} after Holm"
INTERVAL_HOLDS_ZERO: Final = f"{UNDECIDED}: interval holds zero"


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One figure to judge: the standardised coefficient of a predictor, or the difference of two groups' means.

    ``name`` is the predictor, or the groups, ``variables`` the outcome and all predictors. ``kind`` is ``simple``,
    ``multiple`` or ``groups``. ``low`` and ``high`` are the 95 % interval over students; ``p`` is two-sided, from
    permutations, ``None`` of fewer students than the rules ask for, and ``p_holm`` is that after Holm's rule. Of a
    regression ``adjusted_r2`` is its fit; ``vif`` is the variance inflation factor, where there are several predictors.
    """

    name: str
    kind: str
    variables: tuple[str, ...]
    students: int
    beta: float
    low: float
    high: float
    p: float | None
    p_holm: float | None = None
    adjusted_r2: float | None = None
    vif: float | None = None

    @property
    def outcome(self) -> str:
        """The variable that is looked at."""
        return self.variables[0]

    @property
    def direction(self) -> int:
        """Whether it lies above (1) or below (-1) zero, by its p after Holm's correction and by its interval; else 0.

        The two come from different resamplings, and among few students they can differ; a page that claims an
        association and prints an interval around zero contradicts itself.
        """
        return self._side if self.p_holm is not None and self.p_holm < SIGNIFICANCE_LEVEL else 0

    @property
    def associated(self) -> bool:
        """Whether it differs from zero."""
        return self.direction != 0

    @property
    def conclusion(self) -> str:
        """Conclusion in the words of every table."""
        if self.associated:
            return "associated"
        if self.p is None:
            return "not tested"
        if self.p >= SIGNIFICANCE_LEVEL:
            return "not distinguished from chance"
        return AFTER_HOLM if self._side else INTERVAL_HOLDS_ZERO

    @property
    def _side(self) -> int:
        """On which side of zero the whole interval lies; 0: it holds zero."""
        return int(self.low > 0) - int(self.high < 0)


Kind = TypeVar("Kind", bound=Finding)


def standardised_findings(
    variable_names: tuple[str, ...], variable_values: FloatArray, random: np.random.Generator
) -> list[Finding]:
    """Fit one regression of students by ordinary least squares on standardised variables: a finding per predictor.

    ``variable_values`` has a row a student and a column a name, the outcome first. Refused as ``no-variance`` or
    ``collinear``.

    Source: Freedman and Lane (1983), J. Bus. Econ. Stat. 1, 292-298, for the permutations of ``permutation_p``.
    """
    students, predictors = len(variable_values), len(variable_names) - 1
    # The mean of equal values may differ from them in its last digit.
    is_constant = np.ptp(variable_values, axis=0) <= LEAST_SPREAD * np.abs(variable_values).max(axis=0)
    if students <= len(variable_names) or is_constant.any():
        raise StudyRefusedError("no-variance", "")
    correlation_matrix: FloatArray = np.asarray(np.corrcoef(variable_values, rowvar=False))
    if np.linalg.eigvalsh(correlation_matrix[1:, 1:])[0] < LEAST_SPREAD:
        raise StudyRefusedError("collinear", "")
    inverse_correlation = np.linalg.inv(correlation_matrix[1:, 1:])
    variable_values = variable_values - variable_values.mean(axis=0)
    betas, interval_ends = with_intervals(lambda weights: _betas(weights, variable_values), students, random)
    unexplained_variance = (1.0 - betas @ correlation_matrix[1:, 0]) * (students - 1) / (students - 1 - predictors)
    return [
        Finding(
            name=name,
            kind="simple" if predictors == 1 else "multiple",
            variables=variable_names,
            students=students,
            beta=float(betas[k]),
            low=float(interval_ends[k, 0]),
            high=float(interval_ends[k, 1]),
            p=permutation_p(variable_values[:, 0], variable_values[:, 1:], k, random)
            if students >= LEAST_STUDENTS
            else None,
            adjusted_r2=float(1.0 - unexplained_variance),
            vif=float(inverse_correlation[k, k]) if predictors > 1 else None,
        )
        for k, name in enumerate(variable_names[1:])
    ]


def holm_corrected(findings: Sequence[Kind]) -> tuple[Kind, ...]:
    """The same with p corrected across all that have one.

    Source: Holm (1979), Scand. J. Stat. 6, 65-70.
    """
    # That of statsmodels collects garbage at every call, which in a large process takes longer than all else here.
    tested_p = np.array([finding.p for finding in findings if finding.p is not None])
    p_order = np.argsort(tested_p)
    least = np.maximum.accumulate(tested_p[p_order] * np.arange(len(tested_p), 0, -1))
    corrected_p = iter(np.minimum(1.0, least)[np.argsort(p_order)].tolist())
    return tuple(finding if finding.p is None else replace(finding, p_holm=next(corrected_p)) for finding in findings)


def permutation_p(y: FloatArray, x: FloatArray, column: int, random: np.random.Generator) -> float:
    """Two-sided p of one predictor by permuting what the other predictors leave unexplained of the outcome.

    ``y`` (n,) and ``x`` (n, k), centred. The statistic is the coefficient in its HC3 errors: with the plain correlation
    p was below 0.05 in 21 % of classes without association whose scatter grew with the predictor.

    Source: Freedman and Lane (1983) for the permutations; DiCiccio and Romano (2017), J. Am. Stat. Assoc. 112,
    1211-1220, for permuting a studentised coefficient; MacKinnon and White (1985), J. Econometrics 29, 305-325, for
    HC3.
    """
    other_predictors = np.column_stack([np.ones(len(y)), np.delete(x, column, axis=1)])
    orthonormal_basis, _ = np.linalg.qr(other_predictors)
    outcome = y - orthonormal_basis @ (orthonormal_basis.T @ y)
    predictor_residual = x[:, column] - orthonormal_basis @ (orthonormal_basis.T @ x[:, column])
    leverage = (orthonormal_basis**2).sum(axis=1) + predictor_residual**2 / (predictor_residual @ predictor_residual)
    permuted_outcomes = random.permuted(np.broadcast_to(outcome, (PERMUTATIONS, len(y))), axis=1)
    permuted_residuals = permuted_outcomes - (permuted_outcomes @ orthonormal_basis) @ orthonormal_basis.T
    null_coefficients = _studentised_coefficients(permuted_residuals, predictor_residual, leverage)
    observed_coefficient = float(_studentised_coefficients(outcome[None], predictor_residual, leverage)[0])
    # A draw equal to the observed value, up to rounding, counts as no smaller.
    return (1 + int((null_coefficients >= observed_coefficient * (1.0 - 1e-12)).sum())) / (1 + PERMUTATIONS)


def _studentised_coefficients(outcomes: FloatArray, predictor: FloatArray, leverage: FloatArray) -> FloatArray:
    """Absolute coefficients (B,) of ``outcomes`` (B, n) on ``predictor`` (n,) in HC3 errors, up to a common factor.

    Both are at right angles to the other predictors; ``leverage`` (n,) is that of all predictors.
    """
    coefficients = outcomes @ predictor / (predictor @ predictor)
    residuals = outcomes - coefficients[:, None] * predictor
    spread = (residuals / np.maximum(1.0 - leverage, LEAST_SPREAD)) ** 2 @ predictor**2
    return np.abs(coefficients) / np.sqrt(np.maximum(spread, 1e-300))


def _betas(weights: FloatArray, variable_values: FloatArray) -> FloatArray:
    """Standardised coefficients (B, k) of the first column of (n, 1 + k) on the others, rows weighted by (B, n)."""
    fractions = weights / weights.sum(axis=1, keepdims=True)
    mean = fractions @ variable_values
    second_moments = np.einsum("bn,ni,nj->bij", fractions, variable_values, variable_values, optimize=True)
    covariance = second_moments - mean[:, :, None] * mean[:, None, :]
    deviations = np.sqrt(np.maximum(np.einsum("bii->bi", covariance), 0.0))
    with np.errstate(invalid="ignore", divide="ignore"):
        correlation = covariance / (deviations[:, :, None] * deviations[:, None, :])
    is_usable = np.isfinite(correlation).all(axis=(1, 2))
    is_usable[is_usable] = np.linalg.eigvalsh(correlation[is_usable, 1:, 1:])[:, 0] > LEAST_SPREAD
    betas = np.full((len(fractions), variable_values.shape[1] - 1), np.nan)
    betas[is_usable] = np.linalg.solve(correlation[is_usable, 1:, 1:], correlation[is_usable, 1:, :1])[:, :, 0]
    return betas
