"""What stands below the first screen: the faults of each detector, and what the effects found."""

from collections import Counter
from collections.abc import Iterator, Sequence

from replay.effects.effect_summary import EVENT_ROWS
from replay.outputs.report.cards import Look, Still, cards
from replay.outputs.report.charts import KIND_WORDS
from replay.outputs.report.first_screen import command_of
from replay.outputs.report.markup import Fold, Markup, Part, Section, element, joined
from replay.outputs.report.run_view import FALSE, RunView
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
    faults = view.faults[answer.label]
    count = Counter(fault.stretch for fault in faults)
    confirmed = any(fault.kind == FALSE and not fault.unconfirmed for fault in faults)
    counts = []
    if count["false"]:
        counts.append(plural(count["false"], "false contact" if confirmed else "unconfirmed contact"))
    counts += [f"{count[kind]} {KIND_WORDS[kind]}" for kind in ("missed", "late") if count[kind]]
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


def effect_section(view: RunView, curves: Sequence[Markup]) -> Iterator[Section]:
    """What the effects found, and what nobody asked for; beside an audit folded."""
    planned, effects, events = view.summary["plan"], view.summary["effects"], view.events
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
