"""The page of a shared run, made anew from its summary: a page that came with the folder is never passed on.

It says what the report says in figures and words, a card for every miss and false contact that leads the picture to it.
Stills are left out: the picture itself stands beside the page.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

from replay.base.constants import CAVEAT
from replay.effects.effect_summary import EVENT_ROWS
from replay.outputs.palette import INVENTED, MISSED, hex_of
from replay.outputs.report import tables
from replay.outputs.report.markup import Part, contents, element, page_html, page_section, page_table
from replay.outputs.results.parquet_tables import EFFECT
from replay.outputs.results.run_folder import EVENTS, FALSE_CONTACTS, MISSES, RunFolder
from replay.outputs.run_tables import cost_table, effect_table, pair_table, ranking_table, stage_table
from replay.outputs.tables import STRONG, Marked, Table, table
from replay.outputs.words import NOT_LOOKED_FOR, address, counted, span_words
from replay.pipeline.headline import price
from replay.pipeline.ranking import fault_words
from replay.pipeline.scores import MOST_CARDS
from sessions.mcap_format.metadata import NOT_STATED

MISS_HEAD: Final = ("miss", "at s", "pair", "what", "cause", "frames", "cut mm")
FALSE_HEAD: Final = ("false", "at s", "pair", "what", "why", "frames", "mm apart")
FOLDED: Final = frozenset(("What it cost in time", "Counts and causes", "How to get the same again"))


def title_of(run: RunFolder) -> str:
    """Whose session, and the answer."""
    return f"{_who(run)}: {_answer(run)}"


def shared_page(run: RunFolder) -> str:
    """The page as text."""
    sections = [page_section(title, *parts, fold=title in FOLDED) for title, parts in _sections(run) if parts]
    lines = [
        element("p", f"Replay of {_who(run)}"), *(element("p", line, class_="doubt") for line in _doubts(run)),
        element("h1", _answer(run)), *(element("p", line, class_="price") for line in price(run)),
    ]  # fmt: skip
    colours = f":root {{ --missed: {hex_of(MISSED)}; --false: {hex_of(INVENTED)}; }}\n"
    return page_html(title_of(run), [element("div", *lines), contents(sections)], sections, CAVEAT, colours)


def _who(run: RunFolder) -> str:
    session = run.summary["session"]
    pseudonym = session["facts"].get("pseudonym", NOT_STATED)
    named = [session["scene"], "" if pseudonym == NOT_STATED else pseudonym, f"session {session['id']}"]
    return ", ".join(name for name in named if name)


def _answer(run: RunFolder) -> str:
    tradeoff = run.summary.get("tradeoff")
    if tradeoff is not None:
        return str(tradeoff["answer"])
    ranks = run.ranking
    if ranks:
        return f"{ranks[0].label}: {fault_words(ranks[0])}"
    found = [
        f"{counted(figures['contacts'], 'contact')} found by {label}"
        for label, figures in run.summary["detectors"].items()
    ]
    return ", ".join(found) or NOT_LOOKED_FOR


def _doubts(run: RunFolder) -> Iterator[str]:
    """A line per kind of error in the recording."""
    kinds: dict[str, list[Mapping[str, Any]]] = {}
    for one in run.summary.get("findings", ()):
        if one["severity"] == "error":
            kinds.setdefault(one["code"], []).append(one)
    for code, (one, *more) in kinds.items():
        rest = f"; {len(more)} more like it" if more else ""
        yield f"Error, {code}: {one['meaning']} ({one['body'] or 'all'}: {one['message']}{rest}). To do: {one['fix']}."


def _sections(run: RunFolder) -> Iterator[tuple[str, Sequence[Part]]]:
    """What was missed, then when, then at what price; a section without a part is left out."""
    summary, audited = run.summary, list(run.summary["audit"])
    if len(audited) > 1:
        yield "Detectors", [ranking_table(run)]
    for rank in run.ranking[:-1]:
        by = "" if rank.label == audited[0] else rank.label
        for title, file, kind in (("miss", MISSES, "miss"), ("false contact", FALSE_CONTACTS, "false")):
            found = [row for row in run.rows(file) if row["detector"] == rank.label]
            found.sort(key=lambda row: (-(row.get("cut_length") or 0.0), row["first"] - row["last"], row["number"]))
            yield f"Every {title} of {rank.label}", _cards(found[:MOST_CARDS], kind, by)
    if audited:
        yield "Contacts", [pair_table(run, rank.label) for rank in run.ranking[:-1]]
    if summary["detectors"]:
        yield "What it cost in time", [cost_table(run), stage_table(run)]
    if audited:
        yield "Counts and causes", [*tables.count_tables(run), *tables.duration_tables(run)]
    if summary["effects"]:
        yield "Effects that the scene calls for", [effect_table(run), _events(run)]
    if summary.get("findings"):
        yield "What is suspicious about the recording", [_findings(summary["findings"])]
    yield "The session", [_facts(run)]
    yield "How to get the same again", [tables.settings_table(run)]


def _cards(found: Sequence[Mapping[str, Any]], kind: str, by: str) -> list[Part]:
    """Rows of misses or false contacts as cards whose numbers lead the picture to their moment."""
    if not found:
        return []
    addresses = [address(kind, one["number"], by) for one in found]
    rows = [
        (
            Marked(str(one["number"]), STRONG, to=f"#{at}"), f"{one['start']:.3f}",
            f"{one['body_a']} - {one['body_b']}", one["kind"], one["cause"], one["last"] - one["first"] + 1, _size(one),
        )
        for one, at in zip(found, addresses, strict=True)
    ]  # fmt: skip
    about = [{"id": at, "class_": "missed" if kind == "miss" else "false"} for at in addresses]
    return [page_table(table("", MISS_HEAD if kind == "miss" else FALSE_HEAD, rows, words=5), about)]


def _size(one: Mapping[str, Any]) -> str:
    """Millimetres of the cut of a miss, or between the meshes of a false contact."""
    if one.get("touch") is not None:
        return "between frames"
    metres = one["gap"] if "gap" in one else one.get("cut_length")
    return "" if metres is None else f"{1e3 * metres:.1f}"


def _events(run: RunFolder) -> Table:
    found = [row for row in run.rows(EVENTS) if row["source"].startswith(EFFECT)][:EVENT_ROWS]
    rows = [(row["source"].removeprefix(EFFECT), row["name"], row["message"], f"{row['time']:.3f}") for row in found]
    return table("What the effects found", ("effect", "event", "in words", "from s"), rows, words=3)


def _findings(findings: Sequence[Mapping[str, Any]]) -> Table:
    rows = [
        (
            one["severity"],
            one["code"],
            one["body"] or "",
            one["message"],
            span_words(one["start"], one["end"]),
            one["count"],
        )
        for one in findings[: tables.MOST_FINDINGS]
    ]  # fmt: skip
    return table("Findings", ("severity", "code", "body", "what", "seconds", "count"), rows, words=4)


def _facts(run: RunFolder) -> Table:
    session = run.summary["session"]
    rows = [
        ("session", session["id"]), ("length", f"{session['duration']:.1f} s, {session['frames']:,} frames"),
        ("bodies", ", ".join(f"{name} ({one['faces']:,} faces)" for name, one in session["bodies"].items())),
        *(("not looked at", f"no mesh: {name}") for name in session["left_out"]),
        *(("note", note) for note in session["notes"]),
        *((key.replace("_", " "), value) for key, value in session["facts"].items() if value != NOT_STATED),
    ]  # fmt: skip
    return table("Facts of the session", ("what", "value"), rows, words=2)
