"""What stands below the first screen: faults as cards, what the effects found, and folded all that few read."""

import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

from replay.base.shown import plural
from replay.base.tables import Table, table
from replay.effects.effect_summary import EVENT_ROWS
from replay.outputs import run_tables
from replay.outputs.report.charts import KIND_WORDS, lane
from replay.outputs.report.first_screen import RANK_COLUMNS, command_of
from replay.outputs.report.markup import Fold, Markup, Part, Section, element, joined
from replay.outputs.report.run_view import (
    FALSE,
    Fault,
    RunView,
    fault_address,
    faults_by_pair,
    findings_of,
    spans,
)
from replay.outputs.run_tables import RANKING, effect_table
from replay.outputs.words import NOTHING_SUSPICIOUS
from replay.pipeline.answer import Answer
from replay.pipeline.scores import MOST_CARDS
from sessions.mcap_format.metadata import NOT_STATED

MOST_PAIRS: Final = 6
"""Cards of a detector; further pairs are folded."""

AROUND: Final = 0.35
"""Share of a fault that its lane shows before and after it."""

LEAST_AROUND: Final = 0.1
"""Seconds."""

MOST_FINDINGS: Final = 200
"""Findings listed; ``summary.json`` holds them all."""

FRAME_WORDS: Final = (
    "A pair-frame is one pair of bodies in one frame. Missed: the reference says contact, the detector does not; "
    "false: the other way round. Within tolerance: they disagree about less than any tracker resolves. Left out: "
    "one of them could not decide, or a pose was lost. Between frames: only the way from frame to frame shows it."
)
GLOSSARY: Final = {
    **{column.name: column.meaning for column in RANKING if column.name in RANK_COLUMNS},
    "wrong contacts": "missed, late or cut short, and false contacts, at the sampling offset of this run",
    "reference": "the detector that the others are compared with",
    "0-2": "smallest to largest count over 16 sampling offsets: where the first sample falls is chance",
}


def fault_sections(view: RunView) -> Iterator[Section]:
    """The faults of the worst detector, then those of the others, folded."""
    told = [(answer, cards(view, answer.label)) for answer in view.answers]
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
    return joined(
        element("p", element("b", f"{name} "), f"{words} ", command_of(command, view))
        for name, words, command in answer.reasons
    )


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


def cards(view: RunView, label: str) -> list[Markup]:
    """The cards of a detector and the rest of its faults; nothing where it made none."""
    groups = faults_by_pair(view, label)
    shown = [_card(view, group) for group in groups[:MOST_PAIRS]]
    parts = [element("div", *shown, class_="cards")] if shown else []
    if rest := groups[MOST_PAIRS:]:
        lines = [_line(view, fault, pair=True) for group in rest for fault in group]
        parts.append(_folded(f"{plural(len(rest), 'more pair')} of bodies", lines))
    return parts


def _card(view: RunView, group: Sequence[Fault]) -> Markup:
    fault, *more = group
    parts = [
        element("h3", _key(fault), f"{fault.name} {fault.number}: {fault.pair[0]} and {fault.pair[1]}"),
        element("p", f"{fault.span}, {plural(fault.frames, 'frame')}, {fault.what}", class_="when"),
        element("p", fault.why),
        _lanes(view, fault),
        view.look(fault) if view.look else Markup(""),
    ]
    if more:
        parts.append(_folded(f"{len(more):,} more of this pair", [_line(view, other) for other in more]))
    image = [view.still(fault, False)[0]] if view.still else []
    return element("article", *image, element("div", *parts, class_="cb"), class_="card", id=fault_address(view, fault))


def _lanes(view: RunView, fault: Fault) -> Markup:
    """The reference above the detector, around a fault of one pair."""
    around = max(AROUND * (fault.end - fault.start), LEAST_AROUND)
    window = fault.start - around, fault.end + around
    rows = []
    for name in (view.oracle, fault.label):
        found = spans(view, name, fault.pair)
        rows += [element("span", name), lane(found, window, f"{name} from {window[0]:.3f} to {window[1]:.3f} s")]
    return element("div", *rows, class_="mini")


def _line(view: RunView, fault: Fault, *, pair: bool = False) -> Markup:
    address = fault_address(view, fault)
    link = element("a", f"{fault.name} {fault.number}", href=f"#{address}")
    named = f": {fault.pair[0]} and {fault.pair[1]}" if pair else ""
    when = f" at {fault.start:.3f} s, {plural(fault.frames, 'frame')}{named}"
    return element("li", _key(fault), link, when, id=address)


def _folded(words: str, lines: list[Markup]) -> Markup:
    """Lines below a line that opens them; of very many the longest."""
    cut = [] if len(lines) <= MOST_CARDS else [element("li", f"{len(lines) - MOST_CARDS:,} more in the tables")]
    return element("details", element("summary", words), element("ul", *lines[:MOST_CARDS], *cut))


def _key(fault: Fault) -> Markup:
    return element("span", class_=f"k {fault.stretch}")


def words_section(view: RunView) -> Iterator[Section]:
    """The words of the first screen of an audit."""
    if view.ranking:
        lines = [element("p", element("b", word), f": {meaning}.") for word, meaning in GLOSSARY.items()]
        yield Section("Words", "Words", lines)


def last_section(view: RunView, notes: Sequence[str]) -> Section:
    """Recording, counts, times and settings, folded; what was not counted stands open."""
    return Section("Session", "Session", [*notes, *_folds(view)])


def _folds(view: RunView) -> Iterator[Fold]:
    """Everything that few read, each below a line that says what it is."""
    summary = view.summary
    session = summary["session"]
    rate = f", {1.0 / session['median_step']:.1f} Hz" if session["median_step"] else ""
    bodies = plural(len(session["bodies"]), "body", "bodies")
    frames = f"{session['frames']:,} frames in {session['duration']:.1f} s{rate}"
    yield Fold(f"Recording: {frames}, {bodies}", [_fact_table(session)])
    yield Fold(trust(summary), finding_parts(summary))
    audited = [rank.label for rank in view.ranking[:-1]]
    if audited:
        yield Fold("Contacts of each pair", [run_tables.pair_table(view, label) for label in audited])
        counts = run_tables.pair_frame_table("Pair-frames", summary["audit"])
        yield Fold("Counts with intervals", [FRAME_WORDS, counts])
    if summary["detectors"]:
        yield Fold("Time of each detector", [run_tables.cost_table(view)])
    yield Fold("Settings, to get the same figures again", [_settings_table(summary)])


def _fact_table(session: Mapping[str, Any]) -> Table:
    """What was recorded, and what was left out of the replay."""
    dropped = [f"{count} {why}" for why, count in session["dropped_frames"].items() if count]
    proxies = [name for name, body in session["bodies"].items() if body["proxy"]]
    rows: list[tuple[str, object]] = [
        ("session", session["id"]),
        ("bodies", ", ".join(f"{name} ({body['faces']:,} faces)" for name, body in session["bodies"].items())),
    ]
    if proxies:
        rows.append(("proxy meshes", f"stand in for the real ones of {', '.join(proxies)}"))
    if session["left_out"]:
        rows.append(("not looked at", f"no mesh: {', '.join(session['left_out'])}"))
    if dropped:
        rows.append(("frames left out", ", ".join(dropped)))
    rows += [("note", note) for note in session["notes"]]
    rows += [(key.replace("_", " "), value) for key, value in session["facts"].items() if value != NOT_STATED]
    if withheld := session.get("facts_withheld", 0):
        rows.append(("withheld", f"{plural(withheld, 'fact')} withheld; the session file holds all"))
    return table("Facts of the session", ("what", "value"), rows, words=2)


def trust(summary: Mapping[str, Any]) -> str:
    """How much was found, and what it means for verdicts; that nothing was proves nothing."""
    if "findings" not in summary:
        return "The recording was not examined"
    count = Counter(finding["severity"] for finding in summary["findings"])
    bad = [plural(count[severity], severity) for severity in ("error", "warning") if count[severity]]
    flagged = ": verdicts on these spans carry a flag" if summary["detectors"] else ""
    return f"{' and '.join(bad)} about the recording{flagged}" if bad else NOTHING_SUSPICIOUS


def finding_parts(summary: Mapping[str, Any]) -> list[Part]:
    """What the doctor found, worst first, and what the policy made of it."""
    parts: list[Part] = []
    if findings := findings_of(summary):
        parts.append(run_tables.finding_table(findings[:MOST_FINDINGS]))
    sums: dict[tuple[str, str, str], Counter[str]] = {}
    for span in summary.get("flagged", ()):
        count = sums.setdefault((span["kind"], span["body"] or "all", span["action"]), Counter())
        count.update({"spans": 1} | {name: span[name] for name in DONE})
    if sums:
        head = ("kind", "body", "policy", "spans", *DONE)
        rows = [(*key, *(count[name] for name in ("spans", *DONE))) for key, count in sums.items()]
        parts.append(table("What was done about poses in doubt", head, rows, words=3))
    return parts


DONE: Final = ("samples", "dropped", "held", "interpolated")


def _settings_table(summary: Mapping[str, Any]) -> Table:
    """Settings, digests and machine: what it takes to get the same figures again."""
    rows: list[tuple[object, object]] = [("session", summary["session"]["id"]), ("seed", summary["seed"])]
    for label, figures in summary["detectors"].items():
        settings = json.dumps(figures["settings"], sort_keys=True)
        rows.append((label, f"{figures['name']} {settings}, verdicts SHA-256 {figures['digest']}"))
    rows += summary["machine"].items()
    rows.append(("versions", ", ".join(f"{name} {value}" for name, value in summary["versions"].items())))
    return table("Settings, digests and machine", ("what", "value"), rows, words=2)
