"""``replay info``: what a session file holds."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from replay import words
from replay.cli.console import People, answer
from replay.cli.options import SESSION_ANYWHERE, reporting, scene
from replay.document.tables import Cell, Table, table
from replay.words import plural
from sessions.importers.ledger import Entry, Ledger

if TYPE_CHECKING:
    from rich.console import RenderableType


@click.command()
@click.argument("session", type=SESSION_ANYWHERE, metavar="FILE.mcap")
@scene
@reporting
def command(session: Path, scene: Path | None, as_json: bool, people: People) -> int:
    """Say what FILE.mcap, here or at a URL, holds: bodies with rates and gaps, duration, tasks, stages, events."""
    from replay.cli.terminal import terminal
    from replay.prepare.session_info import session_info
    from replay.running.remote_files import local_copy
    from sessions import read_session

    with local_copy(session) as file:
        info = session_info(read_session(file, scene=scene))
    answer(as_json, info, lambda: terminal(*_report(info, session, people.verbose)))
    return 0


def _report(info: dict[str, Any], file: Path, verbose: bool) -> "Iterator[Table | RenderableType]":
    clock = info["frames"]
    from replay.cli.terminal import plain

    scene = f"  ({info['scene']})" if info["scene"] else ""
    yield plain(file.name + scene, "bold")
    gaps = plural(clock["gaps"], "gap") + (
        f" (longest {words.decimal(1e3 * clock['longest_gap'], 0)} ms)" if clock["gaps"] else ""
    )
    frames = f"{clock['count']:,} frames at {words.decimal(clock['rate_hz'], 1)} Hz"
    yield f"{_clock_time(clock['duration'])}, {frames}, {gaps}"
    if clock["not_forward"]:
        yield f"{clock['not_forward']:,} stamps do not go forward; a run leaves those frames out"
    yield _bodies(info["bodies"])
    for interval in info["intervals"]:
        start, end = (words.timestamp(interval[name]) for name in ("start", "end"))
        when = f"{start:>8} - {end:>8} s"
        yield f"  {when}  {interval['kind']}  {interval['name']}"
    yield from (f"  {text}" for text in _streams(info))
    if info["events"]:
        yield "events: " + ", ".join(f"{name} {count}" for name, count in info["events"].items())
    if info["ledger"]:
        yield from (plain(line, "dim") for line in _import_account_lines(info["ledger"]))
    listed = (f"{key}: {value}" for key, value in info["facts"].items() if verbose or key in SHORT_FACTS)
    yield from (plain(text, "dim") for text in listed)
    if info["assumptions"]:
        rows = [(row["what"], row["said"]) for row in info["assumptions"]]
        yield table("Assumptions of the import", ("about", "taken for, and its source"), rows, words=2)


def _import_account_lines(accounts: list[dict[str, Any]]) -> Iterator[str]:
    """Yields the counts that the import read and kept, and a line for everything dropped or merged."""
    ledger = Ledger("", [Entry(**account) for account in accounts])
    kinds = dict.fromkeys(entry.kind for entry in ledger if entry.read)
    totals = []
    for kind in kinds:
        of_kind = [entry for entry in ledger if entry.kind == kind]
        read, kept = sum(entry.read for entry in of_kind), sum(entry.kept for entry in of_kind)
        totals.append(f"{read:,} {kind}" if read == kept else f"{kept:,} of {read:,} {kind}")
    yield f"import kept: {', '.join(totals)}"
    yield from (f"import: {sentence}" for sentence in ledger.sentences())


def _streams(info: dict[str, Any]) -> Iterator[str]:
    """A line for each participant whose gaze is there, and for each scalar."""
    for stream in info["gaze"]:
        yield f"gaze of {stream['participant']}: {_samples(stream)}, {stream['valid']:,} valid"
    for stream in info["scalars"]:
        ends = (
            f"{stream['least']:g} to {stream['largest']:g} {stream['unit']}"
            if stream["least"] is not None
            else "no number"
        )
        yield f"scalar {stream['name']}: {_samples(stream)}, {ends.rstrip()}"


def _samples(clock: dict[str, Any]) -> str:
    return (
        f"{plural(clock['count'], 'sample')} at {words.decimal(clock['rate_hz'], 1)} Hz, {plural(clock['gaps'], 'gap')}"
    )


SHORT_FACTS = ("format", "vr_type", "source_file", "conversions", "assumed", "recovered")


def _bodies(bodies: list[dict[str, Any]]) -> Table:
    rows = []
    for body in bodies:
        counts = body["samples"]
        moving: tuple[Cell, ...] = ("fixed", "", "")
        if not body["fixed"]:
            sampled = sum(count for word, count in counts.items() if word != "absent")
            moving = (sampled, f"{words.decimal(body['rate_hz'], 1)} Hz", body["gaps"])
        name = body["name"] + (" (proxy)" if body["proxy"] else "")
        lost = (counts.get(word, 0) for word in ("lost", "held", "interpolated"))
        rows.append((name, body["faces"] or "no mesh", *moving, *lost))
    return table("", ("body", "faces", "samples", "rate", "gaps", "lost", "held", "interpolated"), rows)


def _clock_time(seconds: float) -> str:
    if seconds < 120:
        return f"{words.decimal(seconds, 1)} s"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min {rest} s"
