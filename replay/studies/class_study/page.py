"""``study.html``: what a study found, in plain words that claim association and never cause."""

import hashlib
import re
from base64 import b64encode
from collections.abc import Mapping, Sequence
from importlib.resources import files
from typing import TYPE_CHECKING, Final

from replay.base.shown import drawable
from replay.outputs.report.drawing import PAPER, svg_in_page
from replay.outputs.report.markup import ALLOWED, Markup, Part, contents, element, listed, page_html, page_section
from replay.outputs.tables import table
from replay.studies.class_study.analysis import Study
from replay.studies.class_study.class_runs import ClassRuns
from replay.studies.class_study.class_tables import ClassTables
from replay.studies.class_study.conclusions import LEVEL, associated
from replay.studies.class_study.refusals import StudyRefusedError
from replay.studies.class_study.reliability import kaiser_word
from replay.studies.class_study.tables import (
    OBSERVED_ONLY,
    behind,
    changes,
    coefficient_table,
    coefficients,
    group_table,
    headlines,
    p_words,
    reliability_table,
    sample_table,
    sensitivity_table,
    words,
)  # fmt: skip
from replay.studies.class_study.to_open import Place, sessions_table

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BLUE: Final = "#4a86c5"
"""Can be seen on a white and on a dark page."""

SEEN: Final = "Every coefficient with its interval"

CAUSAL: Final = re.compile(
    r"\b(caus\w*|because of|effects? of|impact of|improv\w*|increas\w*|decreas\w*|leads? to|influenc\w*|enhanc\w*)\b",
    re.IGNORECASE,
)
"""Words that claim a cause: no text of a study may hold one, names from the codebook included."""


def study_html(
    study: Study | None, title: str, runs: ClassRuns | None = None, where: Mapping[str, Place] | None = None,
    seed: int = 0,
) -> str:  # fmt: skip
    """The page as text: of a study, of the sessions of a class, or of both.

    ``where`` is run -> name and address of its page. Raises ``StudyRefusedError`` where a name from the codebook or the
    title claims a cause.
    """
    named = [title]
    if study is not None:
        named += [*study.reliabilities, *study.group_sizes, *(one.outcome for one in study.groups)]
        named += [name for one, c in coefficients(study) for name in (one.outcome, c.name)]
    refuse_causal_words(named)
    made = None if runs is None else ClassTables(runs, seed)
    top = [element("p", title), element("h1", changes(study))]
    said = [] if study is None else [*headlines(study)[:1], f"{behind(study)}."]
    if made is not None:
        said += made.headlines()
    top += [element("p", line, class_="price") for line in said]
    parts = [] if made is None else _sessions(made, where or {})
    parts += [] if study is None else _sections(study, {} if made is None else made.sample())
    text = page_html(title, [element("div", *top), contents(parts)], parts, OBSERVED_ONLY, _file("page.css"))
    return _with_script(text)


def _file(name: str) -> str:
    return files("replay.studies.class_study").joinpath(name).read_text(encoding="utf-8")


def _with_script(page: str) -> str:
    """A page that may run the one script it brings, and no other."""
    script = _file("page.js")
    digest = b64encode(hashlib.sha256(script.encode()).digest()).decode()
    page = page.replace(ALLOWED, f"{ALLOWED}; script-src 'sha256-{digest}'", 1)
    return page.replace("</body>", f"<script>{script}</script></body>", 1)


def refuse_causal_words(texts: Sequence[str]) -> None:
    """Raise ``StudyRefusedError`` for a text that claims a cause."""
    for text in texts:
        if CAUSAL.search(text):
            raise StudyRefusedError("causal-wording", f"the words {text!r}")


def _sessions(made: ClassTables, where: Mapping[str, Place]) -> list[Markup]:
    parts = [page_section("Sessions to look at first", sessions_table(made.runs, where))]
    for title, found, fold in (
        ("How detectors differ", made.detectors(), False), ("Pairs missed most", made.pairs(), False),
        ("Task, stage, VR type", made.doing(), False), ("Causes", made.causes(), True),
        ("Events", made.events(), True), ("Data quality", made.quality(), False),
    ):  # fmt: skip
        content = found if found.rows else "There is none in the sessions with a pseudonym."
        parts.append(page_section(title, content, fold=fold))
    return parts


def _sections(study: Study, here: Mapping[str, str]) -> list[Markup]:
    parts = [page_section("What was found", listed(headlines(study)))]
    if study.sensitivity:
        parts.append(page_section("Under another detector", sensitivity_table(study)))
    if study.regressions:
        parts.append(page_section("Every association", _forest(study), coefficient_table(study)))
    compared: list[Part] = [group_table(study)] if study.groups else []
    if not study.group_sizes:
        compared = ["The codebook declares no groups, so none are compared."]
    parts.append(page_section("Groups, as Table II", *compared, sample_table(study, here)))
    parts.append(page_section("Questionnaire", *_questionnaire(study)))
    parts.append(page_section("Not said, and why", _refusals(study), fold=True))
    parts.append(page_section("How it was computed", _methods(study), fold=True))
    return parts


def _questionnaire(study: Study) -> list[Part]:
    parts: list[Part] = [reliability_table(study)] if study.reliabilities else []
    if study.kmo is not None and study.bartlett is not None:
        b = study.bartlett
        said = (
            f"All items together: KMO {study.kmo:.3f} ({kaiser_word(study.kmo)}); Bartlett's chi-square "
            f"{b.chi_square:.1f} with {b.degrees} degrees of freedom, p {p_words(b.p)}; n = {b.students}."
        )
        parts.append(said)
    return [*parts, *study.warnings]


def _refusals(study: Study) -> Part:
    if not study.refusals:
        return "Nothing that was asked had to be refused."
    rows = [(one.what, one.rule, one.reason, one.lift) for one in study.refusals]
    return table("Results not given", ("result", "rule", "reason", "what lifts it"), rows, words=4)


def _methods(study: Study) -> Markup:
    lines = [
        behind(study) + ".",
        "Coefficients are standardised; intervals are bootstrapped over whole students, corrected for bias and skew.",
        "With groups, intervals are t-based (HC3), for groups of unequal size too, with quantiles from permutations.",
        "A simple regression has one predictor; in a multiple one each coefficient holds the others equal.",
        f"Associated means p below {LEVEL:g} after Holm's correction across every coefficient on this page, and an "
        "interval that leaves out zero.",
        "Every student counts once, with several sessions by their mean. Below 100 students p comes from permutations.",
    ]
    return listed(lines)


def _forest(study: Study) -> Markup:
    """Every coefficient with its interval; the ones told from zero filled."""
    rows = coefficients(study)

    def draw(axes: "Axes") -> None:
        for k, (_, c) in enumerate(rows):
            if c.has_interval:
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

    return element(
        "figure", svg_in_page(11, 0.9 + 0.32 * len(rows), SEEN, draw), tabindex=0, role="group", aria_label=SEEN
    )
