"""``study.html``: what a study found, in plain words that claim association and never cause."""

import hashlib
from base64 import b64encode
from collections.abc import Iterator, Mapping
from importlib.resources import files

from replay.base.tables import Column, Table
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
from replay.studies.class_study.analysis import Study
from replay.studies.class_study.class_runs import ClassRuns
from replay.studies.class_study.class_tables import ClassTables, Place, class_counts, sessions_table
from replay.studies.class_study.regression import LEVEL
from replay.studies.class_study.reliability import kaiser_word
from replay.studies.class_study.tables import (
    OBSERVED_ONLY,
    behind,
    headlines,
    on_page,
    opening,
    p_words,
    sample_table,
    study_tables,
)  # fmt: skip


def study_html(
    runs: ClassRuns, where: Mapping[str, Place], study: Study | None = None, title: str = "Class", seed: int = 0
) -> str:
    """The page as text: of the sessions of a class, and of a study where there is a questionnaire.

    ``where`` is run -> name and address of its page.
    """
    tables = ClassTables(runs, seed)
    lines = tables.headlines()
    if study is not None:
        lines = [*headlines(study)[:1], f"{behind(study)}.", *lines]
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


def _sections(study: Study | None, tables: ClassTables, where: Mapping[str, Place]) -> Iterator[Section]:
    """Sessions to look at, then groups, associations and reliability; tables of the class and methods are folded."""
    yield Section("Sessions to look at first", "Sessions", [sessions_table(tables.runs, where)])
    if study is not None:
        shown = {name: on_page(table) for name, table in study_tables(study).items()}
        groups: Part = shown["groups"] if study.groups else "There is no comparison of groups."
        if not study.group_sizes:
            groups = "The codebook declares no groups, so none are compared."
        sample = Fold("The sample", [sample_table(study, tables.sample())])
        yield Section("Groups, as Table II", "Groups", [groups, sample])
        results = (shown[name] for name in ("associations", "sensitivity") if shown[name].rows)
        yield Section("Associations", "Associations", [listed(headlines(study)), *results])
        alphas = [shown["reliability"]] if study.reliabilities else []
        title = "Reliability of the questionnaire"
        yield Section(title, "Reliability", [*alphas, *_all_items(study), *study.warnings])
    yield Section("Contacts of the class", "Contacts", [*_contacts(tables)])
    if study is not None:
        folds = [Fold("Not said, and why", [_refusals(study)]), Fold("How it was computed", [_methods(study)])]
        yield Section("Method", "Method", folds)


def _contacts(made: ClassTables) -> Iterator[Fold]:
    """The tables of the class; the first of them open."""
    for title, found in (
        ("How detectors differ", made.detectors()), ("Pairs missed most", made.pairs()),
        ("Task, stage, VR type", made.doing()), ("Causes", made.causes()),
    ):  # fmt: skip
        yield Fold(title, [found if found.rows else "There is none in the sessions with a pseudonym."])


def _all_items(study: Study) -> Iterator[str]:
    if study.kmo is not None and study.bartlett is not None:
        b = study.bartlett
        yield (
            f"All items together: KMO {study.kmo:.3f} ({kaiser_word(study.kmo)}); Bartlett's chi-square "
            f"{b.chi_square:.1f} with {b.degrees} degrees of freedom, p {p_words(b.p)}; n = {b.students}."
        )


def _refusals(study: Study) -> Part:
    if not study.refusals:
        return "Nothing that was asked had to be refused."
    columns = (
        Column("result", of="what", whole=True), Column("rule"), Column("reason"), Column("what lifts it", of="lift"),
    )  # fmt: skip
    return Table.of(columns, study.refusals, "Results not given")


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
