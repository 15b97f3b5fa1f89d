"""Terminal output of a run: a screen that ends with the next step, or every table."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from shlex import quote
from typing import Final

from rich.console import Group, RenderableType
from rich.text import Text

from replay.cli.terminal import MARK_STYLES, Command, Paragraph, line, stacked
from replay.document.audit import DetectorAudit
from replay.document.headline import engine_reports, notes_of
from replay.document.placeholders import RECORDING, RUN, SESSION
from replay.document.run_result import RunResult
from replay.document.summary import CAVEAT
from replay.document.tables import FAINT, GOOD, IN_RED, IN_YELLOW, Table
from replay.effects.effect_summary import event_lines
from replay.show import run_tables as built
from replay.show.sections import SectionName, section_of
from replay.words import tally_text

EVENT_ROWS: Final = 20

PAIR_ROWS: Final = 20

INDENT_BELOW: Final = " " * 8
"""Before the lines below the first one of a heading."""


def run_screen(
    result: RunResult, open_commands: Sequence[str] = (), *, recording: str = SESSION, verbose: bool = False
) -> Group:
    """Default terminal output of a run; the next step comes last.

    ``open_commands``: lines that say how to see it; ``recording``: the file that was replayed, for the commands;
    ``verbose``: with the details of each heading of the answer.
    """
    contents: list[Table | RenderableType] = []
    ranking = section_of(result, SectionName.RANKING)
    if result.ranking:
        contents += [ranking.table.narrow().with_heads()]
        contents += [Paragraph("", text) for text in (*ranking.sentences, *engine_reports(result))]
    elif result.detections:
        contents += ranking.tables
        contents += [Paragraph("", text) for text in ranking.sentences]
    else:
        contents += [Text(), line(no_detection(result))]
    contents += effect_renderables(result)
    if result.ranking:
        contents += answer_lines(result, recording, verbose=verbose)
    doubts = section_of(result, SectionName.SESSION).sentences
    contents += [Paragraph("", text.replace(RECORDING, quote(recording)), MARK_STYLES[IN_YELLOW]) for text in doubts]
    if open_commands:
        contents += [] if result.ranking else [Text()]
        contents += [Paragraph("", text) for text in open_commands]
    return stacked(*contents)


def answer_lines(result: RunResult, recording: str, *, verbose: bool = False) -> Iterator[RenderableType]:
    """Yields the error of the worst detector; then when, why, what to do, its cost and how sure."""
    answer = section_of(result, SectionName.ANSWER)
    yield Text()
    yield Paragraph("", answer.sentences[0], MARK_STYLES[_rank_mark(result)])
    for reason in answer.reasons:
        yield Paragraph(f"  {reason.heading:<6}", reason.text, "bold")
        if reason.figures:
            yield Paragraph(INDENT_BELOW, reason.figures)
        if reason.command:
            yield Command(reason.command.replace(SESSION, quote(recording)).replace(RUN, quote(str(result.out or RUN))))
        if verbose and reason.details:
            yield Paragraph(INDENT_BELOW, reason.details, MARK_STYLES[FAINT])


def effect_renderables(result: RunResult) -> list[Table | RenderableType]:
    """Events of effects: a table in a run without detectors, else a line of the kinds other than contact."""
    if not result.detections and result.effects:
        table = built.effect_table(result).narrow()
        return [table, Text(), *(line(text) for text in event_lines(result.effects, EVENT_ROWS))]
    kind_texts = [
        f"{kind} ({tally_text(effect.events)})"
        for kind, effect in result.document.effects.items()
        if kind != "contact" and effect.events
    ]
    return [Paragraph("Effects  ", f"{', '.join(kind_texts)}; -v has the table.")] if kind_texts else []


def run_tables(result: RunResult) -> Group:
    """Every table of a run: ranking, pairs, misses, false contacts, pair-frames, times, effects."""
    contents: list[Table | RenderableType] = []
    if result.ranking:
        contents += [built.with_intervals(section_of(result, SectionName.RANKING).table)]
        notes = [*built.containment_notes(result, result.oracle), *built.sampling_notes(result), *notes_of(result)]
        contents += [line(note, FAINT) for note in notes]
    for label in (rank.label for rank in result.ranking[:-1]):
        pairs = built.pair_table(result, label)
        pairs = pairs.narrow()
        displayed_pairs = pairs.first(PAIR_ROWS, "… and {} more")
        contents.append(replace(displayed_pairs, title=f"contacts, and how {label} reported them"))
    contents += section_of(result, SectionName.FAULTS).tables
    if result.comparisons:
        contents.append(audit_table(result.document.audit))
    if result.detections:
        contents += (times_table.narrow() for times_table in section_of(result, SectionName.TIMES).tables)
        contents += (times_table.narrow() for times_table in section_of(result, SectionName.EFFECTS).tables)
    contents += section_of(result, SectionName.SESSION).tables
    contents += [Text(), line(CAVEAT, FAINT)]
    proxies = [name for name, body in result.document.session.bodies.items() if body.proxy]
    if proxies:
        contents.append(line(f"Proxy meshes stand in for: {', '.join(proxies)}.", FAINT))
    return stacked(*contents)


def _rank_mark(result: RunResult) -> str:
    """Red is for what is missed, where that comes first; green for contacts that were all decided, and found."""
    worst = result.ranking[0]
    if worst.lost and not worst.leads_false:
        return IN_RED
    if worst.loss:
        return IN_YELLOW
    return GOOD if worst.contacts else ""


def no_detection(result: RunResult) -> str:
    """Why there is no contact to report."""
    effects = ", ".join(dict.fromkeys(effect.kind for effect in result.session.scene.effects or ())) or "nothing"
    return f"Contacts were not computed: the scene declares {effects}. To compute them, add --detectors."


def audit_table(audit: Mapping[str, DetectorAudit]) -> Table:
    """Pair-frames with a column per detector."""
    made = built.pair_frame_table("pair-frames: one pair of bodies in one frame, beside the reference", audit)
    return replace(made, notes=())
