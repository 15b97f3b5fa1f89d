"""``report.html``: what was missed, where and at what price, on one self-contained page."""

from collections import Counter
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np

from replay.base.constants import CAVEAT
from replay.effects.effect_summary import RESULTS, happened, happened_words, leading, titration_curves
from replay.outputs.report.charts import curve
from replay.outputs.report.details import last_section, words_section
from replay.outputs.report.first_screen import (
    Hero,
    all_detectors,
    audit_screen,
    doubt_lines,
    page_head,
    plain_hero,
    timeline_part,
)
from replay.outputs.report.markup import Markup, Section, element, page_html, section_html
from replay.outputs.report.run_view import Fault, RunView, key_fault, kind_of, view_of
from replay.outputs.report.sections import effect_section, fault_sections
from replay.outputs.report.still import FIRST, bench_still, fault_still
from replay.outputs.run_tables import contact_table
from replay.outputs.words import NOT_LOOKED_FOR, tallied
from replay.pipeline.headline import beside, doubts, undecided
from replay.pipeline.run_result import RunResult
from replay.pipeline.sentences import plural
from replay.pipeline.summary import session_name

EVENTS_FIRST = 6
"""Events listed first of all, where no contact was looked for."""


def write_report(result: RunResult, path: Path) -> None:
    """Write the page of a run; the same result gives the same bytes."""
    path.write_text(report_html(result), encoding="utf-8", newline="\n")


def report_html(result: RunResult) -> str:
    """The page as text."""
    view = view_of(result)
    name = session_name(result.session, result.summary["session"]["id"])
    events = [
        {"source": kind, "name": event.name, "message": event.text, "time": event.time, "end_time": event.end}
        for kind, event in happened(result.effects)
    ]
    notes = beside(result)[len(undecided(view)) :]
    sections = [
        *_other_sections(result), *fault_sections(view, partial(fault_still, result), partial(_look, view)),
        *effect_section(view, events, [*_titrations(result)]), last_section(view, notes), *words_section(view),
    ]  # fmt: skip
    title, screen = _first_screen(result, view)
    top = [page_head(view, name, sections), *doubt_lines(doubts(result)), *screen]
    return page_html(f"{title} Replay of {name}", top, [section_html(section) for section in sections], CAVEAT)


def _first_screen(result: RunResult, view: RunView) -> tuple[str, list[Markup]]:
    """The sentence of the title, and everything above the fold."""
    look = partial(_look, view)
    if result.tradeoff is not None:
        rest = all_detectors(view, None) if view.answers else []
        return result.tradeoff.answer, [plain_hero(Hero(result.tradeoff.answer)), *rest]
    if not view.answers:
        told = _without_audit(result)
        lanes = [timeline_part(view, None)] if result.detections else []
        return f"{told.sentence.rstrip('.')}.", [plain_hero(told, bench_still(result)), *lanes]
    answer = view.answers[0]
    fault = key_fault(view, answer)
    shown = bench_still(result) if fault is None else fault_still(result, answer.label, fault, FIRST)
    return answer.sentence, audit_screen(view, shown, look)


def _without_audit(result: RunResult) -> Hero:
    """What was found where no detector is compared with another: contacts, or what the effects say."""
    if result.detections:
        counts = [f"{plural(len(found), 'contact')} found by {label}" for label, found in result.episodes.items()]
        return Hero(", ".join(counts))
    found, best = happened(result.effects), leading(result.effects)
    lines = [*happened_words(result.effects, EVENTS_FIRST), f"{NOT_LOOKED_FOR}."] if found else []
    if best is not None and best.name in RESULTS:
        return Hero(f"{best.text[:1].upper()}{best.text[1:]}", lines)
    return Hero(tallied(Counter(event.name for _, event in found)) or NOT_LOOKED_FOR, lines)


def _look(view: RunView, label: str, fault: Fault) -> Markup:
    """The command that shows a fault in motion."""
    by = f" --by {label}" if len(view.answers) > 1 else ""
    return element("code", f"replay view {view.folder} --{kind_of(fault)} {fault.number}{by}")


def _other_sections(result: RunResult) -> Iterator[Section]:
    """What other settings cost, and contacts that nobody audited."""
    if result.tradeoff is not None:
        from replay.outputs.report.tradeoff import tradeoff_parts

        yield Section("What accuracy costs", "What accuracy costs", [*tradeoff_parts(result.tradeoff)])
    if result.detections and not result.comparisons:
        tables = [contact_table(result, label) for label in result.episodes]
        yield Section("Contacts", "Contacts", tables)


def _titrations(result: RunResult) -> Iterator[Markup]:
    """The pH of each vessel that was titrated over what came in, with a line at each end point."""
    for vessel, (added, ph, ends) in titration_curves(result.effects).items():
        words = f"The pH in {vessel} over what came in"
        if ends:
            points = " and ".join(f"{end:.2f}" for end in ends)
            words += (
                f"; the line is its end point, {points} mL"
                if len(ends) == 1
                else f"; the lines are its end points, {points} mL"
            )
        points_of = np.stack([added, ph], axis=1).tolist()
        yield curve(points_of, ends, f"{words}.", "came in, mL", "pH")
