"""What a terminal shows of a run and of an audit: the answers first, then the tables."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from rich.console import Group, RenderableType
from rich.text import Text

from replay.base.constants import CAVEAT
from replay.base.shown import shown
from replay.cli.terminal import STYLES, line, terminal
from replay.comparison.contact_counts import contact_counts
from replay.comparison.misses import NEVER_FOUND
from replay.effects.effect_summary import happened_words
from replay.outputs import run_tables as built
from replay.outputs.moments import worst_first
from replay.outputs.tables import FAINT, GOOD, IN_RED, INVENTED, Table, table
from replay.outputs.words import CONTACT_WORDS_SHORT, false_thing
from replay.pipeline.headline import beside, doubts, headlines, price
from replay.pipeline.ranking import ranking
from replay.pipeline.run_result import RunResult

FAULT_ROWS: Final = 20
"""Misses and false contacts listed of each detector; JSON and the tables of the run folder hold them all."""

EVENT_ROWS: Final = 20

PAIR_ROWS: Final = 20

COST_HEAD: Final = ("detector", "how", "mean ms", *built.QUANTILES.values(), built.LATE, "longest stage")

MISS_HEAD: Final = ("miss", "at s", "pair", "frames", "what", "cause")
FALSE_HEAD: Final = ("false", "at s", "pair", "frames", "mm apart", "why")


def run_tables(result: RunResult) -> Group:
    """Everything a terminal shows of a run."""
    first = [*first_words(result)]
    parts: list[Table | RenderableType] = [Text(), *first] if first else []
    for label in worst_first(result):
        pairs = built.pair_table(result, label).only("pair", "contacts", *built.AUDIT_MARKS)
        parts.append(pairs.first(PAIR_ROWS, "… and {} more").titled(f"contacts, and what {label} made of them"))
    parts += fault_tables([result])
    if not result.comparisons and result.detections:
        parts += [built.contact_table(result, label) for label in result.detections]
    if result.detections:
        parts.append(built.cost_table(result).only(*COST_HEAD))
    else:
        parts += [Text(), line(no_detection(result))]
    if result.effects:
        parts.append(built.effect_table(result).only("effect", "found", "ms", "% of the run", "% skipped"))
        if not result.detections:
            parts += [Text(), *(line(words) for words in happened_words(result.effects, EVENT_ROWS))]
    parts += [Text(), line(CAVEAT, FAINT)]
    if result.assembly.proxies:
        parts.append(line(f"Proxy meshes stand in for: {', '.join(result.assembly.proxies)}.", FAINT))
    return terminal(*parts)


def first_words(result: RunResult) -> Iterator[RenderableType]:
    """Before all else: what is suspicious, what the detectors missed and invented, in one table, and what that took."""
    yield from (line(words, INVENTED) for words in doubts(result))
    for words in headlines(result):
        text = Text(words, style=STYLES[_mark(result)])
        yield text.append(f"  (oracle: {result.oracle})", style="dim")
    if len(result.comparisons) > 1:
        yield terminal(built.ranking_table(result.summary))
    yield from (line(words, INVENTED) for words in beside(result))
    yield from (line(words, FAINT) for words in price(result))


def _mark(result: RunResult) -> str:
    """Red is for what is missed, where that comes first; green for contacts that were all decided, and found."""
    worst, several = ranking(result.summary)[0], len(result.comparisons) > 1
    counts = contact_counts(result, worst.label)
    if worst.lost and not worst.leads_false if several else counts.missed or counts.in_part:
        return IN_RED
    good = counts.contacts and not counts.frames_undecided
    return GOOD if good and not (several and worst.fault) else INVENTED


def no_detection(result: RunResult) -> str:
    """Why there is no contact to report."""
    effects = ", ".join(dict.fromkeys(effect.kind for effect in result.session.scene.effects or ())) or "nothing"
    return f"No contact was looked for: the scene calls for {effects}. Ask with --detectors."


def fault_tables(results: Sequence[RunResult]) -> list[Table]:
    """Of each detector what it missed, over all sessions, never found ones first; then what is false, longest first.

    A number is that of its session; where there are several sessions a column names it.
    """
    where = " in {}.parquet" if all(result.out for result in results) else " with --format json"
    tables = []
    for label in dict.fromkeys(label for result in results for label in worst_first(result)):
        found = [(result, miss) for result in results for miss in result.misses.get(label, ())]
        found.sort(key=lambda one: one[1].kind != NEVER_FOUND)
        made = built.miss_table(f"missed by {label}", [miss for _, miss in found]).only(*MISS_HEAD)
        tables += _some(built.with_noise(made, found), results, [result for result, _ in found], where.format("misses"))
        wrong = [(result, one) for result in results for one in result.false.get(label, ())]
        wrong.sort(key=lambda one: -one[1].frames)
        false = [one for _, one in wrong]
        made = built.false_table(f"{false_thing(false)}s of {label}", false, label).only(*FALSE_HEAD)
        tables += _some(made, results, [result for result, _ in wrong], where.format("false"))
    return tables


def _some(made: Table, results: Sequence[RunResult], of: Sequence[RunResult], where: str) -> list[Table]:
    """The first rows, each with its session where there are several; no table without a row."""
    if len(results) > 1:
        made = made.beside("session", [Path(one.session.origin).name for one in of])
    return [made.first(FAULT_ROWS, "… and {} more" + where)] if of else []


def answers(results: Sequence[RunResult]) -> Group:
    """The answers before any table, under the name of their session where there are several.

    Below them, of which pairs the oracle did not decide whether one body is inside the other.
    """
    lines: list[RenderableType] = []
    for result in results:
        name = [Text(shown(result.session.origin))] if len(results) > 1 else []
        notes = built.containment_notes(result, result.oracle) if result.comparisons else []
        lines += [Text(), *name, *first_words(result), *(line(f"{note}.", FAINT) for note in notes)]
    return Group(*lines)


def audit_tables(results: Sequence[RunResult], audit: Mapping[str, Any]) -> list[Table]:
    """Pair-frames and contacts with a column per detector, why contacts were missed, and of each session the times."""
    of = [f": {result.session.origin}" if len(results) > 1 else "" for result in results]
    times = [
        (one := built.cost_table(result).only(*COST_HEAD)).titled(one.title + where)
        for result, where in zip(results, of, strict=True)
    ]
    contacts = "contacts: from the first frame of touching to the last, matched one to one"
    frames = built.pair_frame_table("pair-frames: one pair of bodies in one frame, beside the oracle", audit)
    matched = built.matched_table(contacts, audit, CONTACT_WORDS_SHORT)
    return [replace(frames, notes=()), matched, cause_table(audit), *times]


def cause_table(audit: Mapping[str, Any]) -> Table:
    """The stages that lost contacts, the most frequent first."""
    rows = []
    for label, figures in audit.items():
        counts = figures.get("causes", {}).get("misses", {})
        ordered = sorted((cause for cause in counts if counts[cause]), key=lambda cause: -counts[cause])
        rows.append((label, ", ".join(f"{cause} {counts[cause]:,}" for cause in ordered) or "nothing missed"))
    title = "why it missed: the first stage that lost the contact, with the number of misses"
    return table(title, ("detector", "cause"), rows, words=2)
