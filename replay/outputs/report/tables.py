"""The tables of the report, and the sentences around them; every number in them stands in the result."""

import json
from collections import Counter
from collections.abc import Iterator
from typing import Final

from replay.effects.effect_summary import EVENT_ROWS, happened
from replay.outputs import run_tables
from replay.outputs.moments import worst_first
from replay.outputs.report.markup import Part
from replay.outputs.tables import Table, table
from replay.outputs.words import CONTACT_WORDS, NOTHING_SUSPICIOUS, counted
from replay.pipeline.run_result import RunResult, Summarised
from sessions import Finding, Severity

MOST_FINDINGS: Final = 200
"""Findings listed; ``summary.json`` holds them all."""

PAIR_HEAD: Final = (
    "pair", "contacts", "seconds", "longest s", "missed", "late or cut short", "frames missed", "false frames",
    run_tables.UNCONFIRMED,
    "within tolerance", run_tables.CUT,
)  # fmt: skip
FRAME_WORDS: Final = (
    "A pair-frame is one pair of bodies in one frame. Missed: the oracle says contact, the detector does not; "
    "false: the other way round. Within tolerance: they disagree about less than any tracker resolves. Left out: "
    "one of them could not decide, or a pose was lost. Between frames: only the way from frame to frame shows it."
)
CONTACT_NOTE: Final = (
    "A contact lasts from the first frame in which a pair touches to the last. The detector's are matched one to one "
    "with the oracle's, by most frames in common. Ties, not counted: undecided, within tolerance, or between frames."
)


def fact_table(result: RunResult) -> Table:
    """What was recorded, and what was done to it: stand-ins, and bodies and frames that were left out, before all."""
    return table("Facts of the session", ("what", "value"), _facts(result), words=2)


def _facts(result: RunResult) -> Iterator[tuple[str, object]]:
    session, assembly = result.summary["session"], result.assembly
    yield "length", f"{session['duration']:.1f} s, {session['frames']:,} frames"
    if session["median_step"]:
        yield "rate", f"{1.0 / session['median_step']:.1f} Hz (median)"
    yield "bodies", ", ".join(f"{name} ({body['faces']:,} faces)" for name, body in session["bodies"].items())
    yield "pairs looked at", len(assembly.pairs)
    if assembly.proxies:
        yield "proxy meshes", f"stand in for the real ones of {', '.join(assembly.proxies)}"
    if assembly.left_out:
        yield "not looked at", f"no mesh: {', '.join(assembly.left_out)}"
    if dropped := [f"{count} {why}" for why, count in session["dropped_frames"].items() if count]:
        yield "frames left out", ", ".join(dropped)
    yield from (("note", note) for note in assembly.notes)
    first = int(assembly.stamp_ns[0]) - round(float(assembly.motion.times[0]) * 1e9)
    for span in result.session.intervals:
        yield span.kind, f"{span.name}: {(span.start_ns - first) / 1e9:.1f} to {(span.end_ns - first) / 1e9:.1f} s"
    yield from ((key.replace("_", " "), one) for key, one in session["facts"].items() if one != "not stated")
    if withheld := session.get("facts_withheld", 0):
        yield "withheld", f"{counted(withheld, 'fact')} withheld; the session file holds all"


def contact_tables(result: RunResult) -> list[Part]:
    """A row per pair that touched, or was said to; in an audit the most missed first, as in the lanes."""
    if not result.comparisons:
        return [run_tables.contact_table(result, label) for label in result.episodes]
    return [run_tables.pair_table(result, label).only(*PAIR_HEAD) for label in worst_first(result)]


def count_tables(result: Summarised) -> Iterator[Part]:
    """Pair-frames and contacts of every audited detector, matched and unmatched, and why contacts were missed."""
    audit = result.summary["audit"]
    yield from (FRAME_WORDS, run_tables.pair_frame_table("Pair-frames", audit))
    yield from (CONTACT_NOTE, run_tables.matched_table("Contacts matched one to one", audit, CONTACT_WORDS))
    if any(one.get("causes") for one in audit.values()):
        yield cause_table(result)


def cause_table(result: Summarised) -> Table:
    """Why contacts were missed: misses, and pair-frames decided again, by the stage that lost them."""
    found = {label: one["causes"] for label, one in result.summary["audit"].items() if one.get("causes")}
    rows = [
        (word, *(f"{one['misses'].get(word, 0)} ({one['pair_frames'].get(word, 0)})" for one in found.values()))
        for word in dict.fromkeys(word for one in found.values() for word in one["misses"])
        if any(one["misses"].get(word) or one["pair_frames"].get(word) for one in found.values())
    ]
    again = (f"{one['examined']} of {one['missed']}" for one in found.values())
    rows.append(("decided again, of pair-frames missed", *again))
    return table("Causes: misses (pair-frames decided again)", ("cause", *found), rows)


def duration_tables(result: Summarised) -> list[Part]:
    """Which step rate would have missed how many of the contacts."""
    steps = result.summary.get("dwell")
    if not steps or not steps["contacts"]:
        return []
    each = zip(steps["rates_hz"], steps["missed_at_this_phase"], steps["expected_misses"], strict=True)
    safe, rows = steps["none_missed_from_hz"], [(f"{rate:g} Hz", str(now), f"{mean:.2f}") for rate, now, mean in each]
    rows.append(("none is missed from", "", "no rate" if safe is None else f"{safe:.1f} Hz"))
    title = f"Contacts of {steps['contacts']} that looks at fixed steps miss, at frames of this recording"
    return [table(title, ("step rate", "missed at this run's phase", "missed, mean over phases"), rows)]


def effect_parts(result: RunResult) -> list[Part]:
    """Tables of effects and events, then what nobody asked for."""
    found, planned = happened(result.effects), result.summary["plan"]
    rows = [
        (kind, event.name, event.text, f"{event.time:.3f}", "" if event.end is None else f"{event.end:.3f}")
        for kind, event in found[:EVENT_ROWS]
    ]
    more = f", the first {EVENT_ROWS} of {len(found)}" if len(found) > EVENT_ROWS else ""
    events = table(f"What the effects found{more}", ("effect", "event", "in words", "from s", "to s"), rows, words=3)
    lines = {
        f"Not called for, so not imported and not run: {', '.join(planned['not_run'])}.": planned["not_run"],
        "No collision query was made.": not planned["detection"],
    }
    return [run_tables.effect_table(result), events, *(line for line, holds in lines.items() if holds)]


def finding_parts(result: RunResult) -> list[Part]:
    """What the doctor found, worst first, and what the policy made of it; one sentence where nothing was wrong."""
    if result.treatment is None:
        return ["The recording was not examined."]
    findings, sums = result.treatment.findings, dict[tuple[str, str, str], Counter[str]]()
    parts: list[Part] = [trust(findings, verdicts=bool(result.detections))]
    if findings:
        parts.append(run_tables.finding_table(findings[:MOST_FINDINGS]))
    head = ("kind", "body", "policy", "spans", "samples", "dropped", "held", "interpolated")
    for span in result.treatment.spans:
        count = sums.setdefault((span.kind, span.body or "all", span.action), Counter())
        count.update({"spans": 1} | {name: getattr(span, name) for name in head[4:]})
    if sums:
        done = [(*key, *(count[name] for name in head[3:])) for key, count in sums.items()]
        parts.append(table("What was done about poses in doubt", head, done, words=3))
    rows = [
        (label, ", ".join(f"{count:,} {verdict}" for verdict, count in figures.items()))
        for label, figures in result.summary["flagged_verdicts"].items()
        if figures
    ]
    if rows:
        caption = "Verdicts that rest on a pose in doubt (pair-frames)"
        parts.append(table(caption, ("detector", "verdicts"), rows, words=2))
    return parts


def trust(findings: tuple[Finding, ...], *, verdicts: bool = True) -> str:
    """One sentence: how much was found, and what it means for ``verdicts``; that nothing was proves nothing."""
    count = Counter(finding.severity for finding in findings)
    bad = [counted(count[one], one.name.lower()) for one in (Severity.ERROR, Severity.WARNING) if count[one]]
    flagged = ": verdicts on these spans carry a flag" * verdicts
    return f"{' and '.join(bad)}{flagged}." if bad else f"{NOTHING_SUSPICIOUS}."


def settings_table(result: Summarised) -> Table:
    """Settings, digests and machine: what it takes to get the same figures again."""
    told = result.summary
    rows: list[tuple[object, object]] = [("session", told["session"]["id"]), ("seed", told["seed"])]
    for label, figures in told["detectors"].items():
        settings = json.dumps(figures["settings"], sort_keys=True)
        rows.append((label, f"{figures['name']} {settings}, verdicts SHA-256 {figures['digest']}"))
    rows += told["machine"].items()
    rows.append(("versions", ", ".join(f"{name} {value}" for name, value in told["versions"].items())))
    return table("Settings, digests and machine", ("what", "value"), rows, words=2)
