"""``report.html``: what was missed, where and at what price, on one self-contained page."""

from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from replay.base.constants import CAVEAT
from replay.effects.effect_summary import titration_curves
from replay.outputs.plots import curve
from replay.outputs.report.charts import curve_figure
from replay.outputs.report.first_screen import first_screen, page_head
from replay.outputs.report.markup import Markup, Section, element, page_html, section_html
from replay.outputs.report.run_view import MISS, Fault, Hero, RunView, session_names
from replay.outputs.report.sections import effect_section, fault_sections, last_section, words_section
from replay.outputs.report.still import CARD, FIRST, fault_still
from replay.outputs.report.tradeoff import tradeoff_parts
from replay.outputs.run_tables import contact_table
from replay.pipeline.headline import beside, undecided
from replay.pipeline.run_result import RunResult

WARMED = ("warmest", "coldest", "heated", "boil")
"""Names of events that tell of a temperature."""


def write_report(result: RunResult, path: Path) -> None:
    """Write the page of a run; the same result gives the same bytes."""
    path.write_text(report_html(result), encoding="utf-8", newline="\n")


def report_html(result: RunResult) -> str:
    """The page as text."""
    curves = [*_temperatures(result), *_titrations(result)]
    notes = beside(result)[len(undecided(result)) :]
    return page_of(view_of(result), notes, _other_sections(result), curves)


def page_of(view: RunView, notes: Sequence[str], more: Iterable[Section] = (), curves: Sequence[Markup] = ()) -> str:
    """The page of a run.

    ``notes``: what was not counted, or is chance; ``more`` sections come first, ``curves`` stand above what the effects
    found.
    """
    sections = [
        *more, *fault_sections(view), *effect_section(view, curves), last_section(view, notes), *words_section(view),
    ]  # fmt: skip
    # What a reader must know before the answer.
    doubts = [element("p", line, class_="doubt") for line in view.doubts]
    top = [page_head(view, sections), *doubts, *first_screen(view)]
    return page_html(view.title, top, [section_html(section) for section in sections], CAVEAT)


def view_of(result: RunResult) -> RunView:
    """A run in memory, its faults with a picture each, and the command that shows it in motion."""
    folder = str(result.out or "RUN")

    def look(fault: Fault) -> Markup:
        by = f" --by {fault.label}" if len(result.answers) > 1 else ""
        return element("code", f"replay view {folder} --{fault.kind} {fault.number}{by}")

    return RunView(
        run=result, rows=lambda name: result.tables[name].plain(), name=session_names(result.summary)[0],
        asked=None if result.tradeoff is None else Hero(result.tradeoff.answer), folder=folder,
        still=partial(_still, result), look=look,
    )  # fmt: skip


def _still(result: RunResult, fault: Fault, first: bool) -> tuple[Markup, str]:
    """The picture of a fault."""
    things = result.misses[fault.label] if fault.kind == MISS else result.false[fault.label]
    thing = next(thing for thing in things if thing.number == fault.number)
    return fault_still(result, fault.label, thing, FIRST if first else CARD)


def _other_sections(result: RunResult) -> Iterator[Section]:
    """What other settings cost, and contacts that nobody audited."""
    if result.tradeoff is not None:
        yield Section("What accuracy costs", "What accuracy costs", [*tradeoff_parts(result.tradeoff)])
    if result.detections and not result.comparisons:
        yield Section("Contacts", "Contacts", [contact_table(result, label) for label in result.episodes])


def _temperatures(result: RunResult) -> Iterator[Markup]:
    """The temperature over time of each body of which an effect tells that it became warmer or colder."""
    for run in result.effects.values():
        warmed = {body for event in run.events if event.name in WARMED for body in event.bodies}
        for name, celsius in run.series.items():
            body = name.removesuffix("/temperature")
            if body != name and body in warmed:
                points = np.stack([celsius.times, celsius.values], axis=1).tolist()
                lowest, highest = float(celsius.values.min()), float(celsius.values.max())
                words = f"The temperature of {body}: {lowest:.2f} to {highest:.2f} degC."
                yield curve_figure(curve(points, (), words, "seconds", "degC", lowest))


def _titrations(result: RunResult) -> Iterator[Markup]:
    """The pH of each vessel that was titrated over what came in, with a line at each end point."""
    for vessel, (added, ph, ends) in titration_curves(result.effects).items():
        words = f"The pH in {vessel} over what came in"
        if ends:
            points = " and ".join(f"{end:.2f}" for end in ends)
            lines = "line is its end point" if len(ends) == 1 else "lines are its end points"
            words += f"; the {lines}, {points} mL"
        points_of = np.stack([added, ph], axis=1).tolist()
        yield curve_figure(curve(points_of, ends, f"{words}.", "came in, mL", "pH"))
