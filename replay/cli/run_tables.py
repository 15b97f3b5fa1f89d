"""Terminal output of a run: a screen that ends with the next step, or every table."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from shlex import quote
from typing import Final

from rich.console import Group, RenderableType
from rich.text import Text

from replay.base.constants import CAVEAT, RECORDING
from replay.base.tables import FAINT, GOOD, IN_RED, INVENTED, Table
from replay.cli.terminal import STYLES, Command, Paragraph, line, terminal
from replay.document.audit import DetectorAudit
from replay.effects.effect_summary import happened_words
from replay.outputs import run_tables as built
from replay.outputs.words import tallied
from replay.pipeline.answer import RUN, SESSION, busy_text
from replay.pipeline.headline import beside, doubts, engine_reports, price, undecided
from replay.pipeline.run_result import RunResult

FAULT_ROWS: Final = 20
"""Misses and false contacts listed of each detector; JSON and the tables of the run folder hold them all."""

EVENT_ROWS: Final = 20

PAIR_ROWS: Final = 20


def run_screen(result: RunResult, where: Sequence[str] = (), *, recording: str = SESSION) -> Group:
    """Default terminal output of a run; the next step comes last.

    ``where``: lines that say how to see it; ``recording``: the file that was replayed, for the commands.
    """
    parts: list[Table | RenderableType] = [
        line(words.replace(RECORDING, quote(recording)), INVENTED) for words in doubts(result)
    ]
    if result.ranking:
        parts += [built.ranking_table(result).narrow().with_heads()]
        parts += [Paragraph("", words) for words in (*undecided(result), *engine_reports(result))]
    elif result.detections:
        parts += [built.contact_table(result, label) for label in result.detections]
    else:
        parts += [Text(), line(no_detection(result))]
    parts += effect_parts(result)
    if result.ranking:
        parts += answer_lines(result, recording)
    if where:
        parts += [] if result.ranking else [Text()]
        parts += [Paragraph("", words) for words in where]
    return terminal(*parts)


def answer_lines(result: RunResult, recording: str) -> Iterator[RenderableType]:
    """Yields the error of the worst detector, its reasons, remedy and cost."""
    first = result.answers[0]
    yield Text()
    yield Paragraph("", first.sentence, STYLES[_mark(result)])
    for name, words, command in first.reasons:
        yield Paragraph(f"  {name:<6}", words)
        if command:
            yield Command(command.replace(SESSION, quote(recording)).replace(RUN, quote(str(result.out or RUN))))
    busy = busy_text(result.document)  # the ranking says it
    for number, words in enumerate(words for words in price(result) if words != busy):
        yield Paragraph("        " if number else "  Cost  ", words)


def effect_parts(result: RunResult) -> list[Table | RenderableType]:
    """Events of effects: a table in a run without detectors, else a line of the kinds other than contact."""
    if not result.detections and result.effects:
        table = built.effect_table(result).narrow()
        return [table, Text(), *(line(words) for words in happened_words(result.effects, EVENT_ROWS))]
    found = [
        f"{kind} ({tallied(effect.events)})"
        for kind, effect in result.document.effects.items()
        if kind != "contact" and effect.events
    ]
    return [Paragraph("Effects  ", f"{', '.join(found)}; -v has the table.")] if found else []


def run_tables(result: RunResult) -> Group:
    """Every table of a run: ranking, pairs, misses, false contacts, pair-frames, times, effects."""
    parts: list[Table | RenderableType] = []
    if result.ranking:
        parts += [built.ranking_table(result, intervals=True)]
        notes = [*built.containment_notes(result, result.oracle), *built.sampling_notes(result), *beside(result)]
        parts += [line(note, FAINT) for note in notes]
    for label in (rank.label for rank in result.ranking[:-1]):
        pairs = built.pair_table(result, label)
        pairs = pairs.narrow()
        shown = pairs.first(PAIR_ROWS, "… and {} more")
        parts.append(replace(shown, title=f"contacts, and what {label} made of them"))
    parts += fault_tables(result)
    if result.comparisons:
        parts.append(audit_table(result.document.audit))
    if result.detections:
        parts.append(built.cost_table(result).narrow())
    if result.effects and result.detections:
        parts.append(built.effect_table(result).narrow())
    parts += [Text(), line(CAVEAT, FAINT)]
    if result.assembly.proxies:
        parts.append(line(f"Proxy meshes stand in for: {', '.join(result.assembly.proxies)}.", FAINT))
    return terminal(*parts)


def _mark(result: RunResult) -> str:
    """Red is for what is missed, where that comes first; green for contacts that were all decided, and found."""
    worst = result.ranking[0]
    if worst.lost and not worst.leads_false:
        return IN_RED
    if worst.loss:
        return INVENTED
    return GOOD if worst.contacts else ""


def no_detection(result: RunResult) -> str:
    """Why there is no contact to report."""
    effects = ", ".join(dict.fromkeys(effect.kind for effect in result.session.scene.effects or ())) or "nothing"
    return f"Contacts were not computed: the scene declares {effects}. To compute them, add --detectors."


def fault_tables(result: RunResult) -> list[Table]:
    """Tables of missed and false contacts of each detector: never detected ones first, longest false ones first."""
    more = "… and {} more in {}.parquet" if result.out else "… and {} more with --format json"
    tables, misses, false = [], result.tables["misses"], result.tables["false"]
    for label in (rank.label for rank in result.ranking[:-1]):
        for made, name in ((built.miss_table(misses, label), "misses"), (built.false_table(false, label), "false")):
            if made.rows:
                tables.append(made.first(FAULT_ROWS, more.format("{}", name)))
    return tables


def audit_table(audit: Mapping[str, DetectorAudit]) -> Table:
    """Pair-frames with a column per detector."""
    made = built.pair_frame_table("pair-frames: one pair of bodies in one frame, beside the reference", audit)
    return replace(made, notes=())
