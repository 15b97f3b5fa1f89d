"""``report.html``: what was missed, where and at what price, on one self-contained page."""

from collections import Counter
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from replay.base.constants import CAVEAT
from replay.effects.effect_summary import RESULTS, happened, happened_words, leading, titration_curves
from replay.outputs.contact_tables import episode_rows, false_rows, miss_rows
from replay.outputs.plots import curve
from replay.outputs.report.charts import curve_figure
from replay.outputs.report.first_screen import first_screen, page_head
from replay.outputs.report.markup import Markup, Section, element, page_html, section_html
from replay.outputs.report.run_view import MISS, Fault, Hero, Look, RunView, Shown, Still, contacts_of, faults_of
from replay.outputs.report.sections import effect_section, fault_sections, last_section, words_section
from replay.outputs.report.still import CARD, FIRST, fault_still
from replay.outputs.run_tables import contact_table
from replay.outputs.words import NOT_LOOKED_FOR, tallied
from replay.pipeline.headline import beside, doubts, undecided
from replay.pipeline.run_result import RunResult
from replay.pipeline.sentences import plural
from replay.pipeline.summary import session_name

WARMED = ("warmest", "coldest", "heated", "boil")
"""Names of events that tell of a temperature."""

EVENTS_FIRST = 6
"""Events listed first of all, where no contact was looked for."""


def write_report(result: RunResult, path: Path) -> None:
    """Write the page of a run; the same result gives the same bytes."""
    path.write_text(report_html(result), encoding="utf-8", newline="\n")


def report_html(result: RunResult) -> str:
    """The page as text."""
    view = view_of(result)
    more, curves = [*_other_sections(result)], [*_temperatures(result), *_titrations(result)]
    return run_page(view, partial(_still, result), partial(_look, view), more, curves)


def run_page(
    view: RunView, still: Still | None, look: Look, more: Sequence[Section] = (), curves: Sequence[Markup] = ()
) -> str:
    """The page of a run, its faults with a ``still`` each and a ``look`` at it in motion; ``more`` sections first."""
    sections = [
        *more, *fault_sections(view, still, look), *effect_section(view, curves), last_section(view),
        *words_section(view),
    ]  # fmt: skip
    # What a reader must know before the answer.
    doubt_lines = [element("p", line, class_="doubt") for line in view.doubts]
    top = [page_head(view, sections), *doubt_lines, *first_screen(view, still, look)]
    return page_html(view.title, top, [section_html(section) for section in sections], CAVEAT)


def view_of(result: RunResult) -> RunView:
    """A run in memory."""
    events = [
        {"source": kind, "name": event.name, "message": event.text, "time": event.time, "end_time": event.end}
        for kind, event in happened(result.effects)
    ]
    return RunView(
        summary=result.summary, oracle=result.oracle, ranking=result.ranking, answers=result.answers,
        faults=faults_of(result.comparisons, miss_rows(result).plain(), false_rows(result).plain()),
        contacts=contacts_of(result.detections, episode_rows(result).plain(), result.oracle), events=events,
        name=session_name(result.session, result.summary["session"]["id"]), hero=_hero(result),
        doubts=doubts(result), notes=beside(result)[len(undecided(result)) :], folder=str(result.out or "RUN"),
    )  # fmt: skip


def _hero(result: RunResult) -> Hero | None:
    """What is said of a tradeoff, or where no detector is compared: how many contacts, or what the effects say."""
    if result.tradeoff is not None:
        return Hero(result.tradeoff.answer)
    if result.answers:
        return None
    if result.detections:
        counts = [f"{plural(len(found), 'contact')} found by {label}" for label, found in result.episodes.items()]
        return Hero(", ".join(counts))
    found, best = happened(result.effects), leading(result.effects)
    lines = [*happened_words(result.effects, EVENTS_FIRST), f"{NOT_LOOKED_FOR}."] if found else []
    if best is not None and best.name in RESULTS:
        return Hero(f"{best.text[:1].upper()}{best.text[1:]}", lines)
    return Hero(tallied(Counter(event.name for _, event in found)) or NOT_LOOKED_FOR, lines)


def _still(result: RunResult, fault: Fault, first: bool) -> Shown:
    """The picture of a fault."""
    things = result.misses[fault.label] if fault.kind == MISS else result.false[fault.label]
    thing = next(thing for thing in things if thing.number == fault.number)
    return fault_still(result, fault.label, thing, FIRST if first else CARD)


def _look(view: RunView, fault: Fault) -> Markup:
    """The command that shows a fault in motion."""
    by = f" --by {fault.label}" if len(view.answers) > 1 else ""
    return element("code", f"replay view {view.folder} --{fault.kind} {fault.number}{by}")


def _other_sections(result: RunResult) -> Iterator[Section]:
    """What other settings cost, and contacts that nobody audited."""
    if result.tradeoff is not None:
        from replay.outputs.report.tradeoff import tradeoff_parts

        yield Section("What accuracy costs", "What accuracy costs", [*tradeoff_parts(result.tradeoff)])
    if result.detections and not result.comparisons:
        tables = [contact_table(result, label) for label in result.episodes]
        yield Section("Contacts", "Contacts", tables)


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
