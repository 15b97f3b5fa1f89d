"""``study.html``: what a study found, in plain words that claim association and never cause."""

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from replay.base.shown import drawable
from replay.outputs.report.drawing import PAPER, svg_in_page
from replay.outputs.report.markup import Markup, element, page_html, page_section, page_table
from replay.outputs.tables import table
from replay.outputs.words import counted
from replay.studies.class_study.analysis import LEVEL, Study, associated
from replay.studies.class_study.refusals import StudyRefusedError
from replay.studies.class_study.reliability import kaiser_word
from replay.studies.class_study.tables import (
    OBSERVED_ONLY,
    behind,
    coefficient_table,
    coefficients,
    headlines,
    p_words,
    reliability_table,
    sensitivity_table,
    words,
)  # fmt: skip

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BLUE: Final = "#4a86c5"
"""Can be seen on a white and on a dark page."""

CAUSAL: Final = re.compile(
    r"\b(caus\w*|because of|effects? of|impact of|improv\w*|increas\w*|decreas\w*|leads? to|influenc\w*|enhanc\w*)\b",
    re.IGNORECASE,
)
"""Words that claim a cause: no text of a study may hold one, names from the codebook included."""


def study_html(study: Study, title: str) -> str:
    """The page as text; ``StudyRefusedError`` where a name from the codebook or the title claims a cause."""
    named = [name for one, c in coefficients(study) for name in (one.outcome, c.name)]
    refuse_causal_words([title, *study.reliabilities, *named])
    top = [element("p", title), *(element("h1", line) for line in headlines(study)[:1])]
    return page_html(title, top, _sections(study), OBSERVED_ONLY)


def refuse_causal_words(texts: Sequence[str]) -> None:
    """Raise ``StudyRefusedError`` for a text that claims a cause."""
    for text in texts:
        if CAUSAL.search(text):
            raise StudyRefusedError("causal-wording", f"the words {text!r}")


def _sections(study: Study) -> list[Markup]:
    parts = [page_section("What was found", _list(headlines(study)))]
    if study.regressions:
        title = "Every association asked about"
        parts.append(page_section(title, _forest(study), page_table(coefficient_table(study))))
    if study.sensitivity:
        title = "Does it hang on what the detector missed?"
        parts.append(page_section(title, element("p", _changes(study)), page_table(sensitivity_table(study))))
    parts.append(page_section("How far the questionnaire can be relied on", *_questionnaire(study)))
    parts.append(page_section("What is not said, and why", _refusals(study)))
    parts.append(page_section("How it was computed", _methods(study)))
    return parts


def _list(lines: Sequence[str]) -> Markup:
    return element("ul", *(element("li", line) for line in lines))


def _changes(study: Study) -> str:
    changed = [row for row in study.sensitivity if row.changes]
    if not changed:
        names = dict.fromkeys(row.detector for row in study.sensitivity)
        return f"No conclusion changes when {' or '.join(names)} decides what a contact was."
    named = [f"{words(row.predictor)} with {words(row.outcome)} (seen by {row.detector})" for row in changed]
    return f"{counted(len(changed), 'conclusion')} changed with the detector: {'; '.join(named)}."


def _questionnaire(study: Study) -> list[Markup]:
    parts = [page_table(reliability_table(study))] if study.reliabilities else []
    if study.kmo is not None and study.bartlett is not None:
        b = study.bartlett
        said = (
            f"All items together: KMO {study.kmo:.3f} ({kaiser_word(study.kmo)}); Bartlett's chi-square "
            f"{b.chi_square:.1f} with {b.degrees} degrees of freedom, p {p_words(b.p)}; n = {b.students}."
        )
        parts.append(element("p", said))
    return parts + [element("p", warning) for warning in study.warnings]


def _refusals(study: Study) -> Markup:
    if not study.refusals:
        return element("p", "Nothing that was asked had to be refused.")
    rows = [(one.what, one.rule, one.reason, one.lift) for one in study.refusals]
    return page_table(table("Results not given", ("result", "rule", "reason", "what lifts it"), rows, words=4))


def _methods(study: Study) -> Markup:
    lines = [
        behind(study) + ".",
        "Coefficients are standardised; intervals are bootstrapped over whole students, corrected for bias and skew.",
        "A simple regression has one predictor; in a multiple one each coefficient holds the others equal.",
        f"Associated means p below {LEVEL:g} after Holm's correction across every coefficient on this page, and an "
        "interval that leaves out zero.",
        "Every student counts once, with several sessions by their mean. Below 100 students p comes from permutations.",
    ]
    return _list(lines)


def _forest(study: Study) -> Markup:
    """Every coefficient with its interval; the ones told from zero filled."""
    rows = coefficients(study)

    def draw(axes: "Axes") -> None:
        for k, (_, c) in enumerate(rows):
            axes.plot([c.low, c.high], [k, k], color=BLUE, lw=1.6)
            axes.plot(c.beta, k, "o", ms=7, color=BLUE, mfc=BLUE if associated(c) else PAPER)
        axes.axvline(0.0, color="#8a93a0", lw=1)
        held = ["" if one.kind == "simple" else ", others held equal" for one, _ in rows]
        names = [f"{words(c.name)} – {words(one.outcome)}{more}" for (one, c), more in zip(rows, held, strict=True)]
        axes.set_yticks(range(len(rows)), list(map(drawable, names)))
        axes.invert_yaxis()
        axes.set_xlabel("standardised coefficient with 95 % interval; filled: associated")
        axes.spines[["top", "right", "left"]].set_visible(False)
        axes.tick_params(axis="y", length=0)

    return element("figure", svg_in_page(11, 0.9 + 0.32 * len(rows), "Every coefficient with its interval", draw))
