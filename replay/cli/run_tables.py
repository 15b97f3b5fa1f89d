"""What a terminal shows of a run: the answers first, then the tables."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, Final

from rich.console import Group, RenderableType
from rich.text import Text

from replay.base.constants import CAVEAT
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


def run_tables(result: RunResult, *, everything: bool = False) -> Group:
    """What a terminal shows of a run; ``everything``: pair-frames, matched contacts and causes too."""
    first = [*first_words(result)]
    if result.comparisons:
        first += [line(f"{note}.", FAINT) for note in built.containment_notes(result, result.oracle)]
    parts: list[Table | RenderableType] = [Text(), *first] if first else []
    for label in worst_first(result):
        pairs = built.pair_table(result, label).only("pair", "contacts", *built.AUDIT_MARKS, built.CUT)
        parts.append(pairs.first(PAIR_ROWS, "… and {} more").titled(f"contacts, and what {label} made of them"))
    parts += fault_tables(result)
    if everything and result.comparisons:
        parts += audit_tables(result.summary["audit"])
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


def fault_tables(result: RunResult) -> list[Table]:
    """Of each detector what it missed, never found ones first; then what is false, longest first."""
    more = "… and {} more in {}.parquet" if result.out else "… and {} more with --format json"
    tables = []
    for label in worst_first(result):
        misses = sorted(result.misses.get(label, ()), key=lambda miss: miss.kind != NEVER_FOUND)
        if misses:
            missed = built.miss_table(f"missed by {label}", misses).only(*MISS_HEAD)
            missed = built.with_noise(missed, [(result, miss) for miss in misses])
            tables.append(missed.first(FAULT_ROWS, more.format("{}", "misses")))
        false = sorted(result.false.get(label, ()), key=lambda contact: -contact.frames)
        if false:
            wrong = built.false_table(f"{false_thing(false)}s of {label}", false, label).only(*FALSE_HEAD)
            tables.append(wrong.first(FAULT_ROWS, more.format("{}", "false")))
    return tables


def audit_tables(audit: Mapping[str, Any]) -> list[Table]:
    """Pair-frames and contacts with a column per detector, and why contacts were missed."""
    contacts = "contacts: from the first frame of touching to the last, matched one to one"
    frames = built.pair_frame_table("pair-frames: one pair of bodies in one frame, beside the oracle", audit)
    return [replace(frames, notes=()), built.matched_table(contacts, audit, CONTACT_WORDS_SHORT), cause_table(audit)]


def cause_table(audit: Mapping[str, Any]) -> Table:
    """The stages that lost contacts, the most frequent first."""
    rows = []
    for label, figures in audit.items():
        counts = figures.get("causes", {}).get("misses", {})
        ordered = sorted((cause for cause in counts if counts[cause]), key=lambda cause: -counts[cause])
        rows.append((label, ", ".join(f"{cause} {counts[cause]:,}" for cause in ordered) or "nothing missed"))
    title = "why it missed: the first stage that lost the contact, with the number of misses"
    return table(title, ("detector", "cause"), rows, words=2)
