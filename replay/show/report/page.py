"""``report.html``: what was missed, where and at what price, on one self-contained page."""

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from replay import words
from replay.document.headline import notes_of
from replay.document.run_result import RunResult
from replay.document.summary import CAVEAT
from replay.effects.effect_summary import titration_curves
from replay.show.plots import Plot, curve
from replay.show.report.fault_cards import MOST_LISTED_FAULTS, MOST_PAIRS, cards, fault_counts, first_fault
from replay.show.report.first_screen import comparison_of, page_facts
from replay.show.report.markup import render_template
from replay.show.report.page_script import REPORT_SCRIPTS, page_script
from replay.show.report.run_view import Hero, RunView, session_names
from replay.show.report.sections import GLOSSARY, effect_parts, folds
from replay.show.report.still import fault_still
from replay.show.report.tradeoff import tradeoff_values
from replay.show.sections import SectionName, section_of

TEMPERATURE_EVENTS = ("warmest", "coldest", "heated", "boil")
"""Names of events that tell of a temperature."""


def write_report(result: RunResult, path: Path) -> None:
    """Write the page of a run; the same result gives the same bytes."""
    path.write_text(report_html(result), encoding="utf-8", newline="\n")


def report_html(result: RunResult) -> str:
    """The page as text."""
    ranking = section_of(result, SectionName.RANKING)
    # Those of the ranking stand below it.
    notes = notes_of(result)[len(ranking.sentences) :] if result.ranking else notes_of(result)
    return page_of(
        view_of(result),
        notes,
        curves=[*_temperatures(result), *_titrations(result)],
        tradeoff=None if result.tradeoff is None else tradeoff_values(result.tradeoff),
        contacts=() if result.ranking else ranking.tables,
    )


def page_of(
    view: RunView,
    notes: Sequence[str],
    template: str = "show/report/run.html",
    *,
    curves: Sequence[Plot] = (),
    **extra_values: object,
) -> str:
    """The page of a run.

    ``notes``: what was not counted, or is chance; ``curves`` stand above what the effects found; ``extra_values``: what
    other settings cost, contacts that nobody audited.
    """
    first_answer = None if view.hero else view.answers[0]
    faults = [(answer, cards(view, answer.label)) for answer in view.answers]
    template_values = {
        "view": view,
        "notes": notes,
        "about": page_facts(view),
        "caveat": CAVEAT,
        "first": None if first_answer is None else first_fault(view),
        "comparison": comparison_of(
            view, first_answer.moment.seconds if first_answer and first_answer.moment else None
        ),
        "faults": faults,
        "lead": fault_counts(view, view.answers[0].label) if view.answers else "",
        "most_pairs": MOST_PAIRS,
        "most_listed": MOST_LISTED_FAULTS,
        "effects": effect_parts(view, curves),
        "folds": list(folds(view)),
        "glossary": GLOSSARY,
        "tradeoff": None,
        "contacts": (),
        "script": page_script(REPORT_SCRIPTS),
    }
    return render_template(template, **template_values | extra_values)


def view_of(result: RunResult) -> RunView:
    """A run in memory, its faults with a picture each."""
    return RunView(
        run=result,
        name=", ".join(session_names(result.document)),
        asked=None if result.tradeoff is None else Hero(result.tradeoff.answer),
        folder="RUN" if result.out is None else ".",
        still=partial(fault_still, result),
    )


def _temperatures(result: RunResult) -> Iterator[Plot]:
    """The temperature over time of each body of which an effect tells that it became warmer or colder."""
    for run in result.effects.values():
        warmed_bodies = {body for event in run.events if event.name in TEMPERATURE_EVENTS for body in event.bodies}
        for name, celsius in run.series.items():
            body = name.removesuffix("/temperature")
            if body != name and body in warmed_bodies:
                points = np.stack([celsius.times, celsius.values], axis=1).tolist()
                lowest, highest = float(celsius.values.min()), float(celsius.values.max())
                alternative_text = (
                    f"The temperature of {body}: {words.decimal(lowest, 2)} to {words.decimal(highest, 2)} degC."
                )
                yield curve(points, (), alternative_text, "seconds", "degC", lowest)


def _titrations(result: RunResult) -> Iterator[Plot]:
    """The pH, potential or free metal of each vessel that was titrated, with a line at each end point."""
    for titration in titration_curves(result.effects):
        title = f"The {titration.quantity} in {titration.vessel} over what came in"
        if titration.ends_ml:
            points = " and ".join(words.decimal(end, 2) for end in titration.ends_ml)
            title += f"; a line marks each end point: {points} mL"
        points_of = np.stack([titration.added_ml, titration.values], axis=1).tolist()
        lowest = min(0.0, float(titration.values.min()))
        yield curve(points_of, titration.ends_ml, f"{title}.", "came in, mL", titration.unit, lowest)
