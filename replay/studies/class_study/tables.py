"""The sentences and tables of a study, for page and terminal; none of them claims a cause."""

import re
from typing import Final

from replay.outputs.tables import STRONG, Marked, Table, table
from replay.pipeline.gates import figure
from replay.studies.class_study.analysis import UNDECIDED, Study, associated, conclusion
from replay.studies.class_study.regression import Coefficient, Regression

OBSERVED_ONLY: Final = (
    "Associations in the students observed. Nothing was assigned at random, so no figure here says what would happen "
    "if something were changed."
)


def words(name: str) -> str:
    """A column's name as words: ``contacts_per_min`` is contacts per minute."""
    return re.sub(r"\bper min\b", "per minute", name.replace("_", " "))


def p_words(p: float | None) -> str:
    """A p-value with three places; ``none`` where no rule allows one."""
    return "none" if p is None else "< 0.001" if p < 0.001 else f"{p:.3f}"


def coefficients(study: Study) -> list[tuple[Regression, Coefficient]]:
    """Every coefficient beside its regression."""
    return [(one, c) for one in study.regressions for c in one.coefficients]


def headlines(study: Study) -> list[str]:
    """What a reader should know first: the associations found, most pronounced first, or that there are none."""
    every = coefficients(study)
    found = sorted((pair for pair in every if associated(pair[1])), key=lambda pair: -abs(pair[1].beta))
    if found:
        return [_sentence(one, c) for one, c in found]
    tested = [one.students for one, c in every if c.p is not None]
    if not tested:
        return ["No association was tested"]
    least = "" if min(tested) == max(tested) else f"{min(tested)} to "
    open_ = sum(conclusion(c).startswith(UNDECIDED) for _, c in every)
    more = f"; {open_} of {len(every)} {UNDECIDED}" if open_ else ""
    return [f"No association was told from chance in {least}{max(tested)} students{more}"]


def _sentence(regression: Regression, c: Coefficient) -> str:
    more = "higher" if c.beta > 0 else "lower"
    held = "" if regression.kind == "simple" else ", the other predictors held equal"
    name = words(c.name)
    more_rows = f" students in {regression.rows} sessions" if regression.rows > regression.students else ""
    return (
        f"{name[:1].upper()}{name[1:]} is associated with {more} {words(regression.outcome)}{held}: "
        f"{c.beta:+.2f} [{c.low:+.2f}, {c.high:+.2f}], n = {regression.students}{more_rows}"
    )


def behind(study: Study) -> str:
    """Whose behaviour was looked at, by which detector, and what that finds."""
    if not study.detector:
        return f"{study.students} students, questionnaire alone"
    recall = (
        "recall not measured"
        if study.recall is None
        else f"which finds {figure(100 * study.recall)} % of contact frames"
    )
    return f"{study.students} students, {study.rows} sessions, contacts as {study.detector} sees them, {recall}"


def coefficient_table(study: Study) -> Table:
    """A row per coefficient; associated ones are strong."""
    rows = []
    for one, c in coefficients(study):
        cells = (
            words(one.outcome), words(c.name), one.kind, f"{one.students}", f"{one.rows}", f"{c.beta:+.3f}",
            f"{c.low:+.3f} to {c.high:+.3f}", p_words(c.p), p_words(c.p_holm), conclusion(c), c.p_from,
            f"{one.adjusted_r2:.3f}", "" if c.vif is None else f"{c.vif:.2f}",
        )  # fmt: skip
        rows.append([Marked(cell, STRONG if associated(c) else "") for cell in cells])
    head = (
        "outcome", "predictor", "regression", "n", "rows", "beta", "95 % interval", "p", "p (Holm)", "conclusion",
        "p from", "adj. R²", "VIF",
    )  # fmt: skip
    note = "n counts students; several rows of a student are taken as their mean."
    return table(behind(study), head, rows, words=3, notes=(note,))


def reliability_table(study: Study) -> Table:
    """A row per construct of the questionnaire."""
    rows = [
        (
            name, r.items, r.students, f"{r.alpha:.3f}", f"{r.low:.3f} to {r.high:.3f}",
            f"{min(r.item_total):.2f} to {max(r.item_total):.2f}",
        )
        for name, r in study.reliabilities.items()
    ]  # fmt: skip
    head = ("construct", "items", "n", "Cronbach's alpha", "95 % interval", "item with the rest")
    return table("questionnaire", head, rows)


def sensitivity_table(study: Study) -> Table:
    """A row per coefficient fitted with another detector."""
    rows = [
        (
            words(row.outcome), words(row.predictor), row.detector, row.students,
            "not measured" if row.recall is None else f"{figure(100 * row.recall)} %",
            f"{row.beta:+.3f}", p_words(row.p_holm), "another conclusion" if row.changes else "the same",
        )
        for row in study.sensitivity
    ]  # fmt: skip
    head = ("outcome", "predictor", "detector", "n", "recall", "beta", "p (Holm)", "conclusion")
    return table(f"compared with {study.detector} above", head, rows, words=3)
