"""What stands below the first screen: the faults of each detector, and what the effects found."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from replay.comparison.misses import NEVER_FOUND
from replay.effects.effect_summary import EVENT_ROWS
from replay.outputs.report.cards import Look, Still, cards
from replay.outputs.report.first_screen import command_of
from replay.outputs.report.markup import Fold, Markup, Part, Section, element, joined
from replay.outputs.report.run_view import RunView
from replay.outputs.run_tables import effect_table
from replay.outputs.tables import table
from replay.pipeline.answer import Answer
from replay.pipeline.sentences import plural


def fault_sections(view: RunView, still: Still | None, look: Look) -> Iterator[Section]:
    """The faults of the worst detector, then those of the others, folded."""
    told = [(answer, cards(view, answer.label, still, look)) for answer in view.answers]
    if told and told[0][1]:
        answer, made = told[0]
        yield Section(f"Faults of {answer.label}", "Faults", [_lead(view, answer), *made])
    others = [Fold(answer.sentence, [_reasons(view, answer), *made]) for answer, made in told[1:]]
    if others:
        yield Section("Other detectors", "Other detectors", others)


def _lead(view: RunView, answer: Answer) -> Markup:
    """How many faults, and what a card is."""
    false, misses = view.false.get(answer.label, ()), view.misses[answer.label]
    missed = sum(miss.kind == NEVER_FOUND for miss in misses)
    things = "unconfirmed contact" if false and all(one.unconfirmed for one in false) else "false contact"
    counts = [plural(len(false), things)] if false else []
    counts += [f"{missed} missed"] if missed else []
    counts += [f"{len(misses) - missed} late or cut short"] if len(misses) > missed else []
    over = next(rank for rank in view.ranking if rank.label == answer.label).phases
    at = ", at the sampling offset of this run" if over > 1 else ""
    words = f"{', '.join(counts)}{at}. One card a pair of bodies, with its longest fault."
    return element("p", words, class_="lead")


def _reasons(view: RunView, answer: Answer) -> Markup:
    """Why and fix of a detector that is not the worst."""
    lines = [element("p", element("b", "Why "), answer.why)] if answer.why else []
    if answer.fix is not None:
        lines.append(element("p", element("b", "Fix "), f"{answer.fix.words} ", command_of(answer.fix.command, view)))
    return joined(lines)


def effect_section(
    view: RunView, events: Sequence[Mapping[str, Any]], curves: Sequence[Markup] = ()
) -> Iterator[Section]:
    """What the effects found, and what nobody asked for; beside an audit folded.

    ``events`` are rows of the table of events.
    """
    planned, effects = view.summary["plan"], view.summary["effects"]
    if not effects:
        return
    rows = [
        (one["source"], one["name"], one["message"], f"{one['time']:.3f}", _seconds(one["end_time"]))
        for one in events[:EVENT_ROWS]
    ]
    more = f", the first {EVENT_ROWS} of {len(events)}" if len(events) > EVENT_ROWS else ""
    found = table(f"What the effects found{more}", ("effect", "event", "in words", "from s", "to s"), rows, words=3)
    parts: list[Part] = [*curves, effect_table(view), found]
    if planned["not_run"]:
        parts.append(f"Not called for, so not imported and not run: {', '.join(planned['not_run'])}.")
    if not planned["detection"]:
        parts.append("No collision query was made.")
    folded = Fold(f"{plural(len(effects), 'effect')}, {plural(len(events), 'event')}", parts)
    yield Section("Effects that the scene calls for", "Effects", [folded] if view.summary["detectors"] else parts)


def _seconds(end: float | None) -> str:
    return "" if end is None else f"{end:.3f}"
