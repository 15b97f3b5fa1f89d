"""The sentences and tables of a study, for page and terminal; none of them claims a cause."""

import re
from collections.abc import Mapping
from typing import Final

from replay.outputs.tables import STRONG, Marked, Table, table
from replay.pipeline.gates import figure
from replay.pipeline.sentences import plural
from replay.studies.class_study.analysis import LEVEL, UNDECIDED, Sensitivity, Study, associated, conclusion
from replay.studies.class_study.groups import GroupDifference
from replay.studies.class_study.refusals import few
from replay.studies.class_study.regression import Coefficient, Regression

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


def coefficients(study: Study) -> list[tuple[Regression, Coefficient]]:
    """Every coefficient beside its regression."""
    return [(one, c) for one in study.regressions for c in one.coefficients]


def headlines(study: Study) -> list[str]:
    """What a reader should know first: the associations found, most pronounced first, or that there are none."""
    found = sorted((pair for pair in coefficients(study) if associated(pair[1])), key=lambda pair: -abs(pair[1].beta))
    said = [*(_sentence(*pair) for pair in found), *(_apart(one) for one in study.groups if associated(one))]
    if said:
        return said
    every: list[tuple[int, Coefficient | GroupDifference]] = [(one.students, c) for one, c in coefficients(study)]
    every += [(sum(one.students), one) for one in study.groups]
    tested = [students for students, c in every if c.p is not None]
    if not tested:
        return ["No association was tested"]
    least = "" if min(tested) == max(tested) else f"{min(tested)} to "
    open_ = sum(conclusion(c).startswith(UNDECIDED) for _, c in every)
    more = f"; {open_} of {len(every)} {UNDECIDED}" if open_ else ""
    return [f"No association was told from chance in {least}{max(tested)} students{more}"]


def _sentence(regression: Regression, c: Coefficient) -> str:
    more = "higher" if c.beta > 0 else "lower"
    held = "" if regression.kind == "simple" else ", the other predictors held equal"
    more_rows = f" students in {regression.rows} sessions" if regression.rows > regression.students else ""
    return (
        f"{_capital(c.name)} is associated with {more} {words(regression.outcome)}{held}: "
        f"{c.beta:+.2f} [{c.low:+.2f}, {c.high:+.2f}], n = {regression.students}{more_rows}"
    )


def _apart(one: GroupDifference) -> str:
    more, (first, second), (n, of) = "higher" if one.difference > 0 else "lower", one.groups, one.students
    between = f"{one.difference:+.2f} [{one.low:+.2f}, {one.high:+.2f}], n = {n} and {of}"
    return f"{_capital(one.outcome)} is {more} in group {second} than in {first}: {between}"


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


def coefficient_table(study: Study) -> Table:
    """A row per coefficient; associated ones are strong."""
    rows = []
    for one, c in coefficients(study):
        cells = (
            words(one.outcome), words(c.name), one.kind, f"{one.students}", f"{one.rows}", f"{c.beta:+.3f}",
            f"{c.low:+.3f} to {c.high:+.3f}", p_words(c.p), p_words(c.p_holm), conclusion(c),
            f"{one.adjusted_r2:.3f}", "" if c.vif is None else f"{c.vif:.2f}",
        )  # fmt: skip
        rows.append([Marked(cell, STRONG if associated(c) else "") for cell in cells])
    head = (
        "outcome", "predictor", "regression", "n", "rows", "beta", "95 % interval", "p", "p (Holm)", "conclusion",
        "adj. R²", "VIF",
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
    """A row per result about behaviour, as another detector gives it."""
    rows = [
        (
            words(row.outcome), words(row.predictor), row.detector, row.students,
            "not measured" if row.recall is None else f"{figure(100 * row.recall)} %",
            "none" if row.beta is None else f"{row.beta:+.3f}", p_words(row.p_holm), row.conclusion,
        )
        for row in study.sensitivity
    ]  # fmt: skip
    head = ("outcome", "predictor", "detector", "n", "recall", "beta", "p (Holm)", "conclusion")
    note = "Of groups, beta is the difference of their means."
    return table(f"compared with {study.detector} above", head, rows, words=3, notes=(note,) if study.groups else ())


QUESTION: Final = "Does the detector change a conclusion?"


def opening(study: Study | None, counts: str) -> str:
    """The first sentence of page and terminal: how many, and whether a conclusion changes with the detector."""
    return f"{counts}. {QUESTION} {_verdict(study)}"


def _verdict(study: Study | None) -> str:
    """``No.``, or what changes, or why that is not known."""
    if study is None:
        return "Not known: there is no questionnaire."
    tested = [row for row in study.sensitivity if row.tested]
    if not study.sensitivity:
        return "Not known: no result about contacts could be compared between detectors."
    if not tested:
        return "Not known: no result could be tested with another detector."
    changed = [row for row in tested if row.changes]
    return f"Yes: {'; '.join(_changed(study, row) for row in changed)}." if changed else "No."


def _changed(study: Study, row: Sensitivity) -> str:
    """With which detector a conclusion holds, and with which it does not."""
    what = f"{words(row.predictor)} with {words(row.outcome)}"
    found = [c for one, c in coefficients(study) if (one.outcome, c.name) == (row.outcome, row.predictor)]
    held = any(associated(c) for c in found) or any(
        associated(one) for one in study.groups if one.outcome == row.outcome and not found
    )
    again = row.p_holm is not None and row.p_holm < LEVEL
    if held and again:
        return f"{what} has another sign with {row.detector} than with {study.detector}"
    first, second = (study.detector, row.detector) if held else (row.detector, study.detector)
    return f"{what} holds with {first}, not with {second}"


def retest_words(study: Study) -> list[str]:
    """How many conclusions were tested with which other detectors; nothing where none was."""
    tested = [row for row in study.sensitivity if row.tested]
    if not tested:
        return []
    names = " and ".join(dict.fromkeys(row.detector for row in study.sensitivity))
    least, most = (choose(row.students for row in tested) for choose in (min, max))
    students = f"{most}" if least == most else f"{least} to {most}"
    line = f"{plural(len(tested), 'conclusion')} tested again with {names}, n = {students}"
    if unsure := sum(row.undecided for row in tested):
        line += f"; {unsure} of them {UNDECIDED}"
    if rest := len(study.sensitivity) - len(tested):
        line += f"; {rest} could not be tested"
    return [f"{line}."]


def sample_table(study: Study, here: Mapping[str, str]) -> Table:
    """The sample as the paper prints it, beside this one; ``here`` is what the sessions state."""
    sizes = ", ".join(f"{name} {count}" for name, count in study.group_sizes.items())
    own = {
        "students": few(study.students), "groups": sizes or "none declared", "answers": "questionnaire",
        "computed with": "this tool: permutations, bootstrap, Holm", **here,
    }  # fmt: skip
    rows = [(name, printed, own.get(name, "not stated")) for name, printed in PRINTED.items()]
    return table("Table II of the paper, beside this study", ("what", "printed", "here"), rows, words=3)


def group_table(study: Study) -> Table:
    """A row per outcome: as the paper computes, then what the data allow."""
    rows = []
    for one in study.groups:
        mark = STRONG if associated(one) else ""
        fit = f"fit {one.pooled_fit:.3f}, significance {one.pooled_p:.3f}"
        rows.append([
            Marked(words(one.outcome), mark),
            Marked("{:.2f}, {:.2f}".format(*one.means), mark, f"{one.groups[0]}, {one.groups[1]}"),
            "{}, {}".format(*one.students), Marked(f"{one.pooled_beta:+.3f}", "", fit),
            Marked(f"{one.difference:+.2f}", mark, f"{one.low:+.2f} to {one.high:+.2f}"),
            Marked(p_words(one.p_holm), mark, f"{p_words(one.p)} before Holm"), Marked(conclusion(one), mark),
        ])  # fmt: skip
    head = ("outcome", "means", "n", "as the paper", "difference", "p (Holm)", "conclusion")
    notes = (
        "As the paper computes: coefficient, adjusted fit and significance, with one predictor, nothing corrected.",
        "What the data allow: the second group's mean less the first's, p of Welch's statistic, Holm across the rows.",
    )
    return table("Groups compared", head, rows, words=("outcome", "means", "conclusion"), notes=notes)
