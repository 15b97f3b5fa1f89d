"""``study.html``: what a study found, in plain words that claim association and never cause."""

import hashlib
import re
from base64 import b64encode
from collections.abc import Iterator, Mapping, Sequence
from importlib.resources import files
from typing import Final

from replay.outputs.report.markup import (
    ALLOWED,
    Fold,
    Markup,
    Part,
    Section,
    contents,
    element,
    listed,
    page_html,
    section_html,
)
from replay.outputs.tables import table
from replay.studies.class_study.analysis import LEVEL, Study
from replay.studies.class_study.class_runs import ClassRuns
from replay.studies.class_study.class_tables import ClassTables, Place, class_counts, sessions_table
from replay.studies.class_study.refusals import StudyRefusedError
from replay.studies.class_study.reliability import kaiser_word
from replay.studies.class_study.tables import (
    OBSERVED_ONLY,
    behind,
    coefficient_table,
    coefficients,
    group_table,
    headlines,
    opening,
    p_words,
    reliability_table,
    retest_words,
    sample_table,
    sensitivity_table,
)  # fmt: skip

CAUSAL: Final = re.compile(
    r"\b(caus\w*|because of|effects? of|impact of|improv\w*|increas\w*|decreas\w*|leads? to|influenc\w*|enhanc\w*)\b",
    re.IGNORECASE,
)
"""Words that claim a cause: no text of a study may hold one, names from the codebook included."""


def study_html(
    runs: ClassRuns, where: Mapping[str, Place], study: Study | None = None, title: str = "Class", seed: int = 0
) -> str:
    """The page as text: of the sessions of a class, and of a study where there is a questionnaire.

    ``where`` is run -> name and address of its page. Raises ``StudyRefusedError`` where a name from the codebook or the
    title claims a cause.
    """
    named = [title]
    tables = ClassTables(runs, seed)
    lines = tables.headlines()
    if study is not None:
        named += [*study.reliabilities, *study.group_sizes, *(two.outcome for two in study.groups)]
        named += [name for fit, c in coefficients(study) for name in (fit.outcome, c.name)]
        lines = [*headlines(study)[:1], f"{behind(study)}.", *retest_words(study), *lines]
    refuse_causal_words(named)
    sections = [*_sections(study, tables, where)]
    top = [
        element("header", element("p", title), contents(sections), class_="top"),
        element("h1", opening(study, class_counts(runs))), *(element("p", line) for line in lines),
    ]  # fmt: skip
    parts = [section_html(section) for section in sections]
    return _with_script(page_html(title, top, parts, OBSERVED_ONLY, _file("page.css")))


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


def _sections(study: Study | None, tables: ClassTables, where: Mapping[str, Place]) -> Iterator[Section]:
    """Sessions to look at, then groups, associations and reliability; tables of the class and methods are folded."""
    yield Section("Sessions to look at first", "Sessions", [sessions_table(tables.runs, where)])
    if study is not None:
        groups: Part = group_table(study) if study.groups else "There is no comparison of groups."
        if not study.group_sizes:
            groups = "The codebook declares no groups, so none are compared."
        sample = Fold("The sample", [sample_table(study, tables.sample())])
        yield Section("Groups, as Table II", "Groups", [groups, sample])
        results: list[Part] = [listed(headlines(study))]
        if study.regressions:
            results.append(coefficient_table(study))
        if study.sensitivity:
            results.append(sensitivity_table(study))
        yield Section("Associations", "Associations", results)
        yield Section("Reliability of the questionnaire", "Reliability", _questionnaire(study))
    yield Section("Contacts of the class", "Contacts", [*_contacts(tables)])
    if study is not None:
        folds = [Fold("Not said, and why", [_refusals(study)]), Fold("How it was computed", [_methods(study)])]
        yield Section("Method", "Method", folds)


def _contacts(made: ClassTables) -> Iterator[Fold]:
    """The tables of the class; the first of them open."""
    for title, found in (
        ("How detectors differ", made.detectors()), ("Pairs missed most", made.pairs()),
        ("Task, stage, VR type", made.doing()), ("Causes", made.causes()), ("Events", made.events()),
        ("Data quality", made.quality()),
    ):  # fmt: skip
        yield Fold(title, [found if found.rows else "There is none in the sessions with a pseudonym."])


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
        "Intervals of groups are t-based (HC3), for unequal sizes too, with quantiles from permutations.",
        "A simple regression has one predictor; in a multiple one each coefficient holds the others equal.",
        f"Associated means p below {LEVEL:g} after Holm's correction across every coefficient on this page, and an "
        "interval that leaves out zero.",
        "Every student counts once, with several sessions by their mean. p comes from permutations.",
    ]
    return listed(lines)
