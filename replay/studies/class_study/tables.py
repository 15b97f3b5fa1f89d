"""The sentences and tables of a study, for page, terminal and files; none of them claims a cause."""

import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

from replay.outputs.tables import STRONG, Cell, Column, Marked, Table
from replay.pipeline.gates import figure
from replay.studies.class_study.analysis import Sensitivity, Study
from replay.studies.class_study.refusals import few
from replay.studies.class_study.regression import UNDECIDED, Finding

OBSERVED_ONLY: Final = (
    "Associations in the students observed. Nothing was assigned at random, so no figure here says what would happen "
    "if something were changed."
)


PRINTED: Final = {
    "students": "52, at this stage of a chemistry course",
    "groups": "2 of 26",
    "content": "inorganic-chemistry manipulative experiment",
    "device": "HTC VIVE",
    "answers": "questionnaire",
    "computed with": "IBM SPSS Statistics 24",
}
"""The sample as Table II of the paper prints it."""


def words(name: str) -> str:
    """A column's name as words: ``contacts_per_min`` is contacts per minute."""
    return re.sub(r"\bper min\b", "per minute", name.replace("_", " "))


def p_words(p: float | None) -> str:
    """A p-value with three places; ``none`` where no rule allows one."""
    return "none" if p is None else "< 0.001" if p < 0.001 else f"{p:.3f}"


def headlines(study: Study) -> list[str]:
    """What a reader should know first: the associations found, most pronounced first, or that there are none."""
    found = [(fit, c) for fit in study.regressions for c in fit.coefficients if c.associated]
    lines = []
    for fit, c in sorted(found, key=lambda pair: -abs(pair[1].beta)):
        held = "" if fit.kind == "simple" else ", the other predictors held equal"
        lines.append(
            f"{_capital(c.name)} is associated with {_more(c)} {words(fit.outcome)}{held}: "
            f"{_between(c)}, n = {fit.students}"
        )
    for two in study.groups:
        if two.effect.associated:
            (first, second), (n, of) = two.groups, two.students
            lines.append(
                f"{_capital(two.outcome)} is {_more(two.effect)} in group {second} than in {first}: "
                f"{_between(two.effect)}, n = {n} and {of}"
            )
    if lines:
        return lines
    tested = [result.students for result in study.findings if result.finding.p is not None]
    if not tested:
        return ["No association was tested"]
    open_ = sum(result.finding.conclusion.startswith(UNDECIDED) for result in study.findings)
    more = f"; {open_} of {len(study.findings)} {UNDECIDED}" if open_ else ""
    return [f"No association was told from chance in {_range(tested)} students{more}"]


def _more(finding: Finding) -> str:
    return "higher" if finding.beta > 0 else "lower"


def _between(finding: Finding) -> str:
    return f"{finding.beta:+.2f} [{finding.low:+.2f}, {finding.high:+.2f}]"


def _range(counts: Sequence[int]) -> str:
    return f"{min(counts)}" if min(counts) == max(counts) else f"{min(counts)} to {max(counts)}"


def _capital(name: str) -> str:
    return words(name)[:1].upper() + words(name)[1:]


def behind(study: Study) -> str:
    """Whose behaviour was looked at, by which detector, and what that finds."""
    recall = (
        "recall not measured"
        if study.recall is None
        else f"which finds {figure(100 * study.recall)} % of contact frames"
    )
    return f"{study.students} students, {study.rows} sessions, contacts as {study.detector} sees them, {recall}"


def _conclusion(value: str) -> Cell:
    return Marked(value, STRONG if value == "associated" else "")


def _pair(value: tuple[float, float]) -> str:
    return "{:.4g}, {:.4g}".format(*value)


def _recall(value: float | None) -> str:
    return "not measured" if value is None else f"{figure(100 * value)} %"


WORDS: Final[dict[str, Callable[[Any], Cell]]] = {
    "outcome": words, "predictor": words, "conclusion": _conclusion, "construct": str, "regression": str,
    "detector": str, "groups": ", ".join, "means": _pair,
}  # fmt: skip
"""Column of words -> what people read of it."""

NUMBERS: Final[dict[str, Callable[[Any], Cell] | str]] = {
    "beta": "+.3f", "difference": "+.3f", "low": "+.3f", "high": "+.3f", "p": p_words, "p_holm": p_words, "vif": ".2f",
    "adjusted_r2": ".3f", "recall": _recall, "alpha": ".3f", "least_item_total": ".2f", "pooled_beta": "+.3f",
    "pooled_fit": ".3f", "pooled_p": ".3f",
}  # fmt: skip
"""Column of numbers -> its format."""

HEADS: Final = {
    "students": "n", "low": "95 % from", "high": "to", "p_holm": "p (Holm)", "adjusted_r2": "adj. R²", "vif": "VIF",
    "alpha": "Cronbach's alpha", "least_item_total": "least item with the rest", "pooled_beta": "paper's coefficient",
    "pooled_fit": "its fit", "pooled_p": "its p",
}  # fmt: skip
"""Column -> its heading on the page."""

IN_FILES: Final = ("associated", "changes", "tested")
"""Columns that a page does not show, since it says the same in other words."""


def _table(title: str, rows: Sequence[Mapping[str, Any]], *notes: str) -> Table:
    """Rows of raw values by the names of their columns."""
    columns = (
        Column(name, str if name in WORDS else float, show=(WORDS | NUMBERS).get(name, ""))
        for name in (rows[0] if rows else ())
    )
    values = (tuple(None if value != value else value for value in row.values()) for row in rows)
    return Table(tuple(columns), tuple(values), title, notes)


def on_page(table: Table) -> Table:
    """What a page shows of a table."""
    return table.only(*(name for name in table.head if name not in IN_FILES), heads=HEADS)


def _judged(finding: Finding) -> dict[str, Any]:
    return {
        "low": finding.low, "high": finding.high, "p": finding.p, "p_holm": finding.p_holm,
        "conclusion": finding.conclusion,
    }  # fmt: skip


def coefficient_table(study: Study) -> Table:
    """A row per coefficient."""
    rows = [
        {"outcome": fit.outcome, "predictor": c.name, "regression": fit.kind, "students": fit.students}
        | {"beta": c.beta, **_judged(c), "adjusted_r2": fit.adjusted_r2, "vif": c.vif}
        | {"associated": c.associated, "detector": study.detector, "recall": study.recall}
        for fit in study.regressions
        for c in fit.coefficients
    ]
    return _table(behind(study), rows, "n counts students; several sessions of a student are taken as their mean.")


def reliability_table(study: Study) -> Table:
    """A row per construct of the questionnaire."""
    rows = [
        {"construct": name, "items": r.items, "students": r.students, "alpha": r.alpha, "low": r.low, "high": r.high}
        | {"least_item_total": min(r.item_total)}
        for name, r in study.reliabilities.items()
    ]
    return _table("questionnaire", rows)


def sensitivity_table(study: Study) -> Table:
    """A row per result about behaviour, as another detector gives it."""
    rows = [
        {"outcome": row.outcome, "predictor": row.before.name, "detector": row.detector, "students": row.students}
        | {"recall": row.recall, "beta": row.after and row.after.beta, "p_holm": row.after and row.after.p_holm}
        | {"conclusion": row.conclusion, "changes": row.changes, "tested": row.tested}
        for row in study.sensitivity
    ]
    notes = ("Of groups, beta is the difference of their means.",) if study.groups else ()
    return _table(f"compared with {study.detector} above", rows, *notes)


def group_table(study: Study) -> Table:
    """A row per outcome: as the paper computes, then what the data allow."""
    rows = [
        {name: value for name, value in vars(two).items() if name != "effect"}
        | {"difference": two.effect.beta, **_judged(two.effect)}
        for two in study.groups
    ]
    return _table(
        "Groups compared",
        rows,
        "As the paper computes: coefficient, adjusted fit and significance, with one predictor, nothing corrected.",
        "What the data allow: the second group's mean less the first's, p of Welch's statistic, Holm across the rows.",
    )


QUESTION: Final = "Does the detector change a conclusion?"


def opening(study: Study | None, counts: str) -> str:
    """The first sentence of page and terminal: how many, and whether a conclusion changes with the detector."""
    return f"{counts}. {QUESTION} {_verdict(study)}"


def _verdict(study: Study | None) -> str:
    """``No.``, or what changes, or why that is not known."""
    if study is None:
        return "Not known: there is no questionnaire."
    if not study.sensitivity:
        return "Not known: no result about contacts could be compared between detectors."
    if not any(row.tested for row in study.sensitivity):
        return "Not known: no result could be tested with another detector."
    changed = [_changed(study, row) for row in study.sensitivity if row.tested and row.changes]
    return f"Yes: {'; '.join(changed)}." if changed else "No."


def _changed(study: Study, row: Sensitivity) -> str:
    """With which detector a conclusion holds, and with which it does not."""
    what = f"{words(row.before.name)} with {words(row.outcome)}"
    if row.after is not None and row.before.associated and row.after.associated:
        return f"{what} has another sign with {row.detector} than with {study.detector}"
    detectors = (study.detector, row.detector) if row.before.associated else (row.detector, study.detector)
    return "{} holds with {}, not with {}".format(what, *detectors)


def sample_table(study: Study, here: Mapping[str, str]) -> Table:
    """The sample as the paper prints it, beside this one; ``here`` is what the sessions state."""
    sizes = ", ".join(f"{name} {count}" for name, count in study.group_sizes.items())
    own = {
        "students": few(study.students), "groups": sizes or "none declared", "answers": "questionnaire",
        "computed with": "this tool: permutations, bootstrap, Holm", **here,
    }  # fmt: skip
    rows = tuple((name, printed, own[name]) for name, printed in PRINTED.items())
    columns = Column("what"), Column("printed"), Column("here")
    return Table(columns, rows, "Table II of the paper, beside this study")
