"""The tables of the report; every number in them stands in the result."""

import json
from collections import Counter
from collections.abc import Iterator
from typing import Final

from replay.effects.effect_summary import happened
from replay.outputs import run_tables
from replay.outputs.report.markup import Markup, element, joined, page_table, table
from replay.outputs.words import NOTHING_SUSPICIOUS, counted
from replay.pipeline.run_result import RunResult
from sessions import Finding, Severity

MOST_FINDINGS: Final = 200
"""Findings listed; ``summary.json`` holds them all."""

EVENT_ROWS: Final = 60
"""Events listed; ``events.parquet`` holds them all."""

PAIR_HEAD: Final = (
    "pair", "contacts", "seconds", "longest s", "missed", "in part", "frames missed", "false frames",
    "within tolerance",
)  # fmt: skip


def fact_table(result: RunResult) -> Markup:
    """What was recorded, and what was done to it."""
    return table("Facts of the session", ("what", "value"), _facts(result), words=2)


def _facts(result: RunResult) -> Iterator[tuple[str, object]]:
    session = result.summary["session"]
    yield "length", f"{session['duration']:.1f} s, {session['frames']:,} frames"
    if session["median_step"]:
        yield "rate", f"{1.0 / session['median_step']:.1f} Hz (median)"
    yield "bodies", ", ".join(f"{name} ({body['faces']:,} faces)" for name, body in session["bodies"].items())
    yield "pairs looked at", len(result.assembly.pairs)
    yield from _gaps(result)
    for note in result.assembly.notes:
        yield "note", note
    for span in result.session.intervals:
        first = int(result.assembly.stamp_ns[0]) - round(float(result.assembly.motion.times[0]) * 1e9)
        yield span.kind, f"{span.name}: {(span.start_ns - first) / 1e9:.1f} to {(span.end_ns - first) / 1e9:.1f} s"
    for key, value in result.summary["session"]["facts"].items():
        if value != "not stated":
            yield key.replace("_", " "), value
    if withheld := session.get("facts_withheld", 0):
        yield "withheld", f"{counted(withheld, 'fact')} withheld; the session file holds all"


def _gaps(result: RunResult) -> Iterator[tuple[str, object]]:
    """What a reader must know before believing anything: stand-ins, bodies and frames that were left out."""
    if result.assembly.proxies:
        yield "proxy meshes", f"stand in for the real ones of {', '.join(result.assembly.proxies)}"
    if result.assembly.left_out:
        yield "not looked at", f"no mesh: {', '.join(result.assembly.left_out)}"
    dropped = {why: count for why, count in result.summary["session"]["dropped_frames"].items() if count}
    if dropped:
        yield "frames left out", ", ".join(f"{count} {why}" for why, count in dropped.items())


def contact_table(result: RunResult) -> Markup:
    """A row per pair that touched, or was said to; in an audit the most missed first, as in the lanes."""
    if not result.comparisons:
        return joined(page_table(run_tables.contact_table(result, label)) for label in result.episodes)
    return joined(page_table(run_tables.pair_table(result, label).only(*PAIR_HEAD)) for label in result.comparisons)


def effect_section(result: RunResult) -> Markup:
    """Tables of effects and events, then what nobody asked for and what this version does not compute."""
    found = happened(result.effects)
    rows = [
        (kind, event.name, event.text, f"{event.time:.3f}", "" if event.end is None else f"{event.end:.3f}")
        for kind, event in found[:EVENT_ROWS]
    ]
    more = f", the first {EVENT_ROWS} of {len(found)}" if len(found) > EVENT_ROWS else ""
    events = table(f"What the effects found{more}", ("effect", "event", "in words", "from s", "to s"), rows, words=3)
    planned, lines = result.summary["plan"], []
    if planned["not_run"]:
        lines.append(f"Not called for, so not imported and not run: {', '.join(planned['not_run'])}.")
    if not planned["detection"]:
        lines.append("No collision query was made.")
    if planned["not_built"]:
        lines.append(f"Declared, and not computed by this version: {', '.join(planned['not_built'])}.")
    return joined([page_table(run_tables.effect_table(result)), events, *(element("p", line) for line in lines)])


def finding_tables(result: RunResult) -> Markup:
    """What the doctor found, worst first, and what the policy made of it; one sentence where nothing was wrong."""
    if result.treatment is None:
        return element("p", "The recording was not examined.")
    findings = result.treatment.findings
    parts = [element("p", trust(findings))]
    if findings:
        parts.append(page_table(run_tables.finding_table(findings[:MOST_FINDINGS])))
    if result.treatment.spans:
        parts.append(_repair_table(result))
    rows = [
        (label, ", ".join(f"{count:,} {verdict}" for verdict, count in figures.items()))
        for label, figures in result.summary["flagged_verdicts"].items()
        if figures
    ]
    if rows:
        caption = "Verdicts that rest on a pose in doubt (pair-frames)"
        parts.append(table(caption, ("detector", "verdicts"), rows, words=2))
    return joined(parts)


def trust(findings: tuple[Finding, ...]) -> str:
    """One sentence: how much was found; that nothing was proves nothing."""
    count = Counter(finding.severity for finding in findings)
    bad = [counted(count[one], one.name.lower()) for one in (Severity.ERROR, Severity.WARNING) if count[one]]
    if not bad:
        return f"{NOTHING_SUSPICIOUS}."
    return f"{' and '.join(bad)}: verdicts on these spans carry a flag."


def _repair_table(result: RunResult) -> Markup:
    """A row per kind and body: the action, and what became of the samples."""
    assert result.treatment is not None
    sums: dict[tuple[str, str, str], Counter[str]] = {}
    for span in result.treatment.spans:
        count = sums.setdefault((span.kind, span.body or "all", span.action), Counter())
        for name in ("samples", "dropped", "held", "interpolated"):
            count[name] += getattr(span, name)
        count["spans"] += 1
    head = ("kind", "body", "policy", "spans", "samples", "dropped", "held", "interpolated")
    rows = [(*key, *(count[name] for name in head[3:])) for key, count in sums.items()]
    return table("What was done about poses in doubt", head, rows, words=3)


def settings_table(result: RunResult) -> Markup:
    """Settings, digests and machine: what it takes to get the same figures again."""
    rows: list[tuple[object, object]] = [("session", result.summary["session"]["origin"] or "in memory")]
    rows.append(("seed", result.summary["seed"]))
    for label, figures in result.summary["detectors"].items():
        settings = json.dumps(figures["settings"], sort_keys=True)
        rows.append((label, f"{figures['name']} {settings}, verdicts SHA-256 {figures['digest']}"))
    rows += [(name, value) for name, value in result.summary["machine"].items()]
    rows.append(("versions", ", ".join(f"{name} {value}" for name, value in result.summary["versions"].items())))
    return table("Settings, digests and machine", ("what", "value"), rows, words=2)
