"""Checks of a published table of regressions and reliabilities, recomputed from its own figures.

Given n, the standardised coefficient, the adjusted fit and p, each follows from the others when the regression had one
predictor; and all rows of one multiple regression share one fit. What disagrees by more than rounding is reported.
"""

import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from replay.errors import StudyError
from replay.studies.class_study.refusals import PERSONS_PER_ITEM
from replay.studies.class_study.reliability import kaiser_word
from sessions.input_files import kind_of_file, read_text

FIT_TOLERANCE: Final = 0.0035
"""An adjusted fit printed to three places may differ by this much from what its coefficient gives (measured on the
rows that agree: at most 0.003, and half a unit of the last place)."""

P_TOLERANCE: Final = 0.001
"""One unit of the last place of a printed p."""

KIND_INCONSISTENT: Final = "inconsistent"
KIND_WEAK: Final = "weak"
KIND_AGREES: Final = "agrees"


@dataclass(frozen=True)
class Remark:
    """One result of the check, on a row of a table or (row ``""``) on the whole table.

    ``kind`` is ``inconsistent`` (figures contradict each other), ``weak`` (agrees, but carries little) or ``agrees``;
    the message gives the recomputed and the printed figure.
    """

    kind: str
    table: str
    row: str
    message: str


def check_published(path: Path) -> list[Remark]:
    """Check the tables of a TOML file: ``n``, ``[reliability]``, ``[[regression]]`` as the shipped example has them.

    Raises ``StudyError``: the file cannot be read, or a field is missing or no number.
    """
    try:
        published_tables = tomllib.loads(read_text(path, "table file", StudyError))
    except tomllib.TOMLDecodeError as error:
        kind = kind_of_file(path)
        reason = f"is {kind}" if kind else f"cannot be read as TOML: {error}"
        raise StudyError(f"{path} {reason}") from error
    students = _required_number(published_tables, "n", path.name)
    remarks: list[Remark] = []
    if "reliability" in published_tables:
        remarks += _reliability_remarks(published_tables["reliability"], students, path.name)
    if "regression" in published_tables:
        remarks += _regression_remarks(published_tables["regression"], students, path.name)
    if not remarks:
        raise StudyError(f"{path} holds neither [reliability] nor [regression]; there is nothing to check")
    return remarks


def _reliability_remarks(reliability_table: Mapping[str, Any], n: float, file_name: str) -> Iterator[Remark]:
    from scipy.special import chdtrc

    table_name = str(reliability_table.get("table", "reliability"))
    reliability_keys = ("items", "alpha", "kmo", "chi_square", "df", "p")
    items, alpha, kmo, chi_square, degrees, printed_p = (
        _required_number(reliability_table, key, f"{file_name}: [reliability]") for key in reliability_keys
    )
    expected_degrees = items * (items - 1) / 2
    message = f"{items:g} items have {expected_degrees:g} degrees of freedom, printed {degrees:g}"
    yield Remark(KIND_AGREES if degrees == expected_degrees else KIND_INCONSISTENT, table_name, "df", message)
    p = float(chdtrc(expected_degrees, chi_square))
    message = f"a chi-square of {chi_square:g} has p = {p:.0e}, printed {printed_p:.3f}"
    yield Remark(KIND_AGREES if abs(p - printed_p) <= P_TOLERANCE else KIND_INCONSISTENT, table_name, "p", message)
    mean_r = alpha / (items - alpha * (items - 1))
    yield Remark(KIND_AGREES, table_name, "alpha", f"alpha {alpha:g} implies a mean correlation of {mean_r:.3f}")
    if n < PERSONS_PER_ITEM * items:
        yield Remark(KIND_WEAK, table_name, "n", f"{n / items:.1f} persons per item (usual advice 5 to 10)")
    yield Remark(KIND_WEAK if kmo < 0.7 else KIND_AGREES, table_name, "kmo", f"KMO {kmo:g} is {kaiser_word(kmo)}")


def _regression_remarks(regression_tables: Sequence[Mapping[str, Any]], n: float, file_name: str) -> Iterator[Remark]:
    for table in regression_tables:
        table_name = str(table.get("table", "regressions"))
        rows = [
            _checked_row(row, n, f"{file_name}: {table_name}, row {k}")
            for k, row in enumerate(table.get("rows", ()), 1)
        ]
        if not rows:
            raise StudyError(
                f"{file_name}: {table_name} has no rows; write rows = [{{outcome=..., predictor=..., ...}}]"
            )
        for row in rows:
            yield from (
                Remark(kind, table_name, f"{row.predictor} on {row.outcome}", message)
                for kind, message in row.remarks()
            )
        single_predictor_rows = [row for row in rows if row.agrees]
        fits_of_outcome = {
            outcome: {row.fit for row in rows if row.outcome == outcome} for outcome in (r.outcome for r in rows)
        }
        differing_outcomes = ", ".join(outcome for outcome, printed in fits_of_outcome.items() if len(printed) > 1)
        if str(table.get("label", "")) == "multiple" and differing_outcomes:
            yield Remark(
                KIND_INCONSISTENT,
                table_name,
                "label",
                f"called multiple, yet rows of one outcome ({differing_outcomes}) have different fits, and "
                f"{len(single_predictor_rows)} of "
                f"{len(rows)} follow from their own coefficient with n = {n:g}: these are {len(rows)} regressions of "
                "one predictor each",
            )
        if (groups := table.get("groups", 1)) > 1 and not table.get("compared", False):
            message = f"{groups} groups were formed but not compared"
            if single_predictor_rows:
                best_fit_row = max(single_predictor_rows, key=lambda row: row.fit)
                single_group_text = (
                    f"one group alone would give a fit of {adjusted_fit(best_fit_row.beta, n / groups):.3f}"
                )
                message += f"; the groups are pooled ({single_group_text}, printed {best_fit_row.fit:g})"
            yield Remark(KIND_WEAK, table_name, "groups", message)


@dataclass(frozen=True)
class _Row:
    outcome: str
    predictor: str
    n: float
    beta: float
    fit: float
    p: float

    @property
    def agrees(self) -> bool:
        """Whether the printed fit is that of a regression with this one predictor."""
        return abs(adjusted_fit(self.beta, self.n) - self.fit) <= FIT_TOLERANCE

    def remarks(self) -> Iterator[tuple[str, str]]:
        """Kind and message of each."""
        p, fit, gives = p_of_correlation(self.beta, self.n), adjusted_fit(self.beta, self.n), f"{self.beta:g}"
        if not self.agrees:
            r = implied_correlation(self.fit, self.n)
            needed_text = f"which would need r = {r:.3f} (p = {p_of_correlation(r, self.n):.4f})"
            message = (
                f"a coefficient of {gives} gives an adjusted fit of {fit:.3f}, printed {self.fit:g}, {needed_text}"
            )
            yield KIND_INCONSISTENT, message
        if abs(p - self.p) > P_TOLERANCE:
            yield (
                KIND_INCONSISTENT,
                f"a coefficient of {gives} has p = {p:.2f} with n = {self.n:g}, printed {self.p:.3f}",
            )
        elif self.agrees:
            yield KIND_AGREES, f"fit {fit:.3f} and p {p:.1g} follow from {gives}"


def adjusted_fit(r: float, n: float) -> float:
    """Adjusted share of variance of one predictor with correlation ``r``: ``1 - (1 - r^2)(n - 1)/(n - 2)``."""
    return 1.0 - (1.0 - r * r) * (n - 1.0) / (n - 2.0)


def implied_correlation(fit: float, n: float) -> float:
    """The correlation that one predictor needs for an adjusted fit; 0 where none gives so low a one."""
    return float(np.sqrt(max(0.0, 1.0 - (1.0 - fit) * (n - 2.0) / (n - 1.0))))


def p_of_correlation(r: float, n: float) -> float:
    """Two-sided p of a correlation: ``t = r sqrt((n - 2)/(1 - r^2))`` with n - 2 degrees of freedom."""
    from scipy.special import stdtr

    return float(2.0 * stdtr(n - 2.0, -abs(r) * np.sqrt((n - 2.0) / (1.0 - r * r))))


def _checked_row(table_row: Mapping[str, Any], n: float, row_text: str) -> _Row:
    outcome_and_predictor = [table_row.get("outcome"), table_row.get("predictor")]
    if not all(isinstance(word, str) and word for word in outcome_and_predictor):
        raise StudyError(f"{row_text}: outcome and predictor must be words")
    beta = _required_number(table_row, "beta", row_text)
    if not -1.0 < beta < 1.0:
        raise StudyError(f"{row_text}: beta = {beta:g} is no correlation; the check needs standardised coefficients")
    return _Row(
        str(outcome_and_predictor[0]),
        str(outcome_and_predictor[1]),
        n,
        beta,
        _required_number(table_row, "adjusted_fit", row_text),
        _required_number(table_row, "p", row_text),
    )


def _required_number(table: Mapping[str, Any], key_name: str, row_text: str) -> float:
    toml_value = table.get(key_name)
    if isinstance(toml_value, bool) or not isinstance(toml_value, int | float) or not np.isfinite(toml_value):
        raise StudyError(f"{row_text}: {key_name} must be a number, not {toml_value!r}")
    if key_name == "n" and toml_value < 4:
        raise StudyError(f"{row_text}: n = {toml_value} is too few to check")
    return float(toml_value)
