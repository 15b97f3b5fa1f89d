"""``study.html``: what a study found, in plain words that claim association and never cause."""

from __future__ import annotations

import re
from collections.abc import Sequence
from importlib.resources import files
from typing import TYPE_CHECKING, Final

from replay.outputs.report.drawing import PAPER, svg_in_page
from replay.outputs.report.markup import Markup, element, joined, page_section, table
from replay.studies.class_study.analysis import LEVEL, Study, associated
from replay.studies.class_study.factorability import kaiser_word
from replay.studies.class_study.refusals import RefusedError
from replay.studies.class_study.regression import Coefficient, Regression

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BLUE: Final = "#4a86c5"
"""Can be seen on a white and on a dark page."""

CAUSAL: Final = re.compile(
    r"\b(caus\w*|because of|effects? of|impact of|improv\w*|increas\w*|decreas\w*|leads? to|influenc\w*|enhanc\w*)\b",
    re.IGNORECASE,
)
"""Words that claim a cause: no text of a study may hold one, names from the codebook included."""

OBSERVED_ONLY: Final = (
    "Associations in the students observed. Nothing was assigned at random, so no figure here says what would happen "
    "if something were changed."
)


def study_html(study: Study, title: str) -> str:
    """The page as text.

    Raises ``RefusedError``: ``causal-wording``: a name from the codebook or the title claims a cause.
    """
    style = Markup(files("replay.outputs.report").joinpath("style.css").read_text(encoding="utf-8"))
    head = [
        Markup('<meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">'),
        element("title", title),
        Markup(f"<style>{style}</style>"),
    ]
    body = [
        element("header", element("p", title), *(element("h1", line) for line in headlines(study)[:1])),
        element("main", joined(_sections(study))),
        element("footer", element("p", OBSERVED_ONLY)),
    ]
    named = [name for one in study.regressions for name in (one.outcome, *(c.name for c in one.coefficients))]
    refuse_causal_words([title, *study.reliabilities, *named])
    return f'<!doctype html>\n<html lang="en"><head>{joined(head)}</head><body>{joined(body)}</body></html>\n'


def refuse_causal_words(words: Sequence[str]) -> None:
    """Raise ``RefusedError`` for a text that claims a cause."""
    for text in words:
        if CAUSAL.search(text):
            raise RefusedError("causal-wording", f"the words {text!r}")


def headlines(study: Study) -> list[str]:
    """What a reader should know first: the associations found, most pronounced first, or that there are none."""
    found = [(one, c) for one in study.regressions for c in one.coefficients if associated(c)]
    found.sort(key=lambda pair: -abs(pair[1].beta))
    if not found:
        return [f"No association was told from chance in {study.students} students"]
    return [_sentence(one, c) for one, c in found]


def _sentence(regression: Regression, c: Coefficient) -> str:
    more = "higher" if c.beta > 0 else "lower"
    held = "" if regression.kind == "simple" else ", the other predictors held equal"
    name = words(c.name)
    return (
        f"{name[:1].upper()}{name[1:]} is associated with {more} {words(regression.outcome)}{held}: "
        f"{c.beta:+.2f} [{c.low:+.2f}, {c.high:+.2f}], n = {regression.students}"
    )


def words(name: str) -> str:
    """A column's name as words: ``contacts_per_min`` is contacts per minute."""
    return re.sub(r"\bper min\b", "per minute", name.replace("_", " "))


def _sections(study: Study) -> list[Markup]:
    parts = [page_section("What was found", element("ul", *(element("li", line) for line in headlines(study))))]
    if study.regressions:
        parts.append(page_section("Every association asked about", _forest(study), _coefficients(study)))
    if study.sensitivity:
        parts.append(page_section("Does it hang on what the detector missed?", *_sensitivity(study)))
    parts.append(page_section("How far the questionnaire can be relied on", *_questionnaire(study)))
    parts.append(page_section("What is not said, and why", *_refusals(study)))
    parts.append(page_section("How it was computed", _methods(study)))
    return parts


def _behind(study: Study) -> str:
    if not study.detector:
        return f"{study.students} students, questionnaire alone"
    recall = "recall not measured" if study.recall is None else f"which finds {study.recall:.1%} of contact frames"
    return f"{study.students} students, {study.rows} sessions, contacts as {study.detector} sees them, {recall}"


def _coefficients(study: Study) -> Markup:
    rows = [
        (
            words(one.outcome), words(c.name), one.kind, f"{one.students}",
            f"{c.beta:+.3f}", f"{c.low:+.3f} to {c.high:+.3f}",
            _p(c.p), _p(c.p_holm), c.p_from, f"{one.adjusted_r2:.3f}", "" if c.vif is None else f"{c.vif:.2f}",
        )
        for one in study.regressions
        for c in one.coefficients
    ]  # fmt: skip
    head = ["outcome", "predictor", "regression", "n", "beta", "95 % interval", "p", "p (Holm)", "p from", "adj. R²",
            "VIF"]  # fmt: skip
    return table(_behind(study), head, rows, words=3)


def _p(p: float | None) -> str:
    if p is None:
        return "none"
    return "< 0.001" if p < 0.001 else f"{p:.3f}"


def _sensitivity(study: Study) -> list[Markup]:
    changed = [row for row in study.sensitivity if row.changes]
    names = list(dict.fromkeys(row.detector for row in study.sensitivity))
    said = f"No conclusion changes when {' or '.join(names)} decides what a contact was."
    if changed:
        named = [f"{words(row.predictor)} with {words(row.outcome)} (seen by {row.detector})" for row in changed]
        said = f"{len(changed)} conclusions change with the detector: {'; '.join(named)}."
    rows = [
        (
            words(row.outcome), words(row.predictor), row.detector,
            "not measured" if row.recall is None else f"{row.recall:.1%}",
            f"{row.beta:+.3f}", _p(row.p_holm), "another conclusion" if row.changes else "the same",
        )
        for row in study.sensitivity
    ]  # fmt: skip
    head = ["outcome", "predictor", "detector", "recall", "beta", "p (Holm)", "conclusion"]
    caption = f"n = {study.students}; compared with {study.detector} above"
    return [element("p", said), table(caption, head, rows, words=3)]


def _questionnaire(study: Study) -> list[Markup]:
    rows = [
        (
            name, r.items, r.students, f"{r.alpha:.3f}", f"{r.low:.3f} to {r.high:.3f}",
            f"{min(r.item_total):.2f} to {max(r.item_total):.2f}",
        )
        for name, r in study.reliabilities.items()
    ]  # fmt: skip
    head = ["construct", "items", "n", "Cronbach's alpha", "95 % interval", "item with the rest"]
    parts = [table(f"n = {study.students}", head, rows)] if rows else []
    if study.kmo is not None and study.bartlett is not None:
        b = study.bartlett
        said = (
            f"All items together: KMO {study.kmo:.3f} ({kaiser_word(study.kmo)}); Bartlett's chi-square "
            f"{b.chi_square:.1f} with {b.degrees} degrees of freedom, p {_p(b.p)}; n = {study.students}."
        )
        parts.append(element("p", said))
    return parts + [element("p", warning) for warning in study.warnings]


def _refusals(study: Study) -> list[Markup]:
    if not study.refusals:
        return [element("p", "Nothing that was asked had to be refused.")]
    rows = [(one.what, one.rule, one.reason, one.lift) for one in study.refusals]
    return [table("Results not given", ["result", "rule", "reason", "what lifts it"], rows, words=4)]


def _methods(study: Study) -> Markup:
    lines = [
        _behind(study) + ".",
        "Coefficients are standardised; intervals are bootstrapped over whole students, corrected for bias and skew.",
        "A simple regression has one predictor; in a multiple one each coefficient holds the others equal.",
        f"Associated means p below {LEVEL:g} after Holm's correction across every coefficient on this page, and an "
        "interval that leaves out zero.",
        "p comes from permutations below 100 students, and from cluster-robust errors where students repeat sessions.",
    ]
    return element("ul", *(element("li", line) for line in lines))


def _forest(study: Study) -> Markup:
    """Every coefficient with its interval; the ones told from zero filled."""
    rows = [(one, c) for one in study.regressions for c in one.coefficients]

    def draw(axes: Axes) -> None:
        for k, (_, c) in enumerate(rows):
            axes.plot([c.low, c.high], [k, k], color=BLUE, lw=1.6)
            axes.plot(c.beta, k, "o", ms=7, color=BLUE, mfc=BLUE if associated(c) else PAPER)
        axes.axvline(0.0, color="#8a93a0", lw=1)
        held = ["" if one.kind == "simple" else ", others held equal" for one, _ in rows]
        names = [f"{words(c.name)} – {words(one.outcome)}{more}" for (one, c), more in zip(rows, held, strict=True)]
        axes.set_yticks(range(len(rows)), names)
        axes.invert_yaxis()
        axes.set_xlabel("standardised coefficient with 95 % interval; filled: associated")
        axes.spines[["top", "right", "left"]].set_visible(False)
        axes.tick_params(axis="y", length=0)

    return element("figure", svg_in_page(11, 0.9 + 0.32 * len(rows), "Every coefficient with its interval", draw))
