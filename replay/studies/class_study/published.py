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

FIT_TOLERANCE: Final = 0.0035
"""An adjusted fit printed to three places may differ by this much from what its coefficient gives (measured on the
rows that agree: at most 0.003, and half a unit of the last place)."""

P_TOLERANCE: Final = 0.001
"""One unit of the last place of a printed p."""

INCONSISTENT: Final = "inconsistent"
WEAK: Final = "weak"
AGREES: Final = "agrees"


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
        tables = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise StudyError(f"{path} cannot be read as TOML: {error}") from error
    students = _number(tables, "n", path.name)
    remarks: list[Remark] = []
    if "reliability" in tables:
        remarks += _reliability(tables["reliability"], students, path.name)
    if "regression" in tables:
        remarks += _regressions(tables["regression"], students, path.name)
    if not remarks:
        raise StudyError(f"{path} holds neither [reliability] nor [regression]; there is nothing to check")
    return remarks


def _reliability(table: Mapping[str, Any], n: float, where: str) -> Iterator[Remark]:
    from scipy.special import chdtrc

    name = str(table.get("table", "reliability"))
    keys = ("items", "alpha", "kmo", "chi_square", "df", "p")
    items, alpha, kmo, chi, degrees, printed_p = (_number(table, key, f"{where}: [reliability]") for key in keys)
    expected = items * (items - 1) / 2
    message = f"{items:g} items have {expected:g} degrees of freedom, printed {degrees:g}"
    yield Remark(AGREES if degrees == expected else INCONSISTENT, name, "df", message)
    p = float(chdtrc(expected, chi))
    message = f"a chi-square of {chi:g} has p = {p:.0e}, printed {printed_p:.3f}"
    yield Remark(AGREES if abs(p - printed_p) <= P_TOLERANCE else INCONSISTENT, name, "p", message)
    mean_r = alpha / (items - alpha * (items - 1))
    yield Remark(AGREES, name, "alpha", f"alpha {alpha:g} implies a mean correlation of {mean_r:.3f}")
    if n < PERSONS_PER_ITEM * items:
        yield Remark(WEAK, name, "n", f"{n / items:.1f} persons per item (usual advice 5 to 10)")
    yield Remark(WEAK if kmo < 0.7 else AGREES, name, "kmo", f"KMO {kmo:g} is {kaiser_word(kmo)}")


def _regressions(tables: Sequence[Mapping[str, Any]], n: float, where: str) -> Iterator[Remark]:
    for table in tables:
        name = str(table.get("table", "regressions"))
        rows = [_row(row, n, f"{where}: {name}, row {k}") for k, row in enumerate(table.get("rows", ()), 1)]
        if not rows:
            raise StudyError(f"{where}: {name} has no rows; write rows = [{{outcome=..., predictor=..., ...}}]")
        for row in rows:
            yield from (
                Remark(kind, name, f"{row.predictor} on {row.outcome}", message) for kind, message in row.remarks()
            )
        follow = [row for row in rows if row.agrees]
        fits = {outcome: {row.fit for row in rows if row.outcome == outcome} for outcome in (r.outcome for r in rows)}
        differing = ", ".join(outcome for outcome, printed in fits.items() if len(printed) > 1)
        if str(table.get("label", "")) == "multiple" and differing:
            yield Remark(
                INCONSISTENT,
                name,
                "label",
                f"called multiple, yet rows of one outcome ({differing}) have different fits, and {len(follow)} of "
                f"{len(rows)} follow from their own coefficient with n = {n:g}: these are {len(rows)} regressions of "
                "one predictor each",
            )
        if (groups := table.get("groups", 1)) > 1 and not table.get("compared", False):
            message = f"{groups} groups were formed but not compared"
            if follow:
                best = max(follow, key=lambda row: row.fit)
                single_group_text = f"one group alone would give a fit of {adjusted_fit(best.beta, n / groups):.3f}"
                message += f"; the groups are pooled ({single_group_text}, printed {best.fit:g})"
            yield Remark(WEAK, name, "groups", message)


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
            yield INCONSISTENT, message
        if abs(p - self.p) > P_TOLERANCE:
            yield INCONSISTENT, f"a coefficient of {gives} has p = {p:.2f} with n = {self.n:g}, printed {self.p:.3f}"
        elif self.agrees:
            yield AGREES, f"fit {fit:.3f} and p {p:.1g} follow from {gives}"


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


def _row(row: Mapping[str, Any], n: float, where: str) -> _Row:
    names = [row.get("outcome"), row.get("predictor")]
    if not all(isinstance(word, str) and word for word in names):
        raise StudyError(f"{where}: outcome and predictor must be words")
    beta = _number(row, "beta", where)
    if not -1.0 < beta < 1.0:
        raise StudyError(f"{where}: beta = {beta:g} is no correlation; the check needs standardised coefficients")
    return _Row(str(names[0]), str(names[1]), n, beta, _number(row, "adjusted_fit", where), _number(row, "p", where))


def _number(table: Mapping[str, Any], key: str, where: str) -> float:
    value = table.get(key)
    if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
        raise StudyError(f"{where}: {key} must be a number, not {value!r}")
    if key == "n" and value < 4:
        raise StudyError(f"{where}: n = {value} is too few to check")
    return float(value)
