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
    from replay.cli.terminal import stacked
    from replay.prepare.session_info import session_info
    from replay.running.remote_files import local_copy
    from sessions import read_session

    with local_copy(session) as local_file:
        info = session_info(read_session(local_file, scene=scene))
    answer(as_json, info, lambda: stacked(*_info_report(info, session, people.verbose)))
    return 0


def _info_report(info: dict[str, Any], file: Path, verbose: bool) -> "Iterator[Table | RenderableType]":
    clock = info["frames"]
    from replay.cli.terminal import plain_text

    scene = f"  ({info['scene']})" if info["scene"] else ""
    yield plain_text(file.name + scene, "bold")
    gaps = plural(clock["gaps"], "gap") + (
        f" (longest {words.decimal(1e3 * clock['longest_gap'], 0)} ms)" if clock["gaps"] else ""
    )
    frames_text = f"{clock['count']:,} frames at {words.decimal(clock['rate_hz'], 1)} Hz"
    yield f"{_clock_time(clock['duration'])}, {frames_text}, {gaps}"
    if clock["not_forward"]:
        yield f"{clock['not_forward']:,} stamps do not go forward; a run leaves those frames out"
    yield _body_table(info["bodies"])
    for interval in info["intervals"]:
        start, end = (words.timestamp(interval[name]) for name in ("start", "end"))
        interval_text = f"{start:>8} - {end:>8} s"
        yield f"  {interval_text}  {interval['kind']}  {interval['name']}"
    yield from (f"  {text}" for text in _stream_lines(info))
    if info["events"]:
        yield "events: " + ", ".join(f"{name} {count}" for name, count in info["events"].items())
    if info["ledger"]:
        yield from (plain_text(line, "dim") for line in _import_account_lines(info["ledger"]))
    fact_lines = (f"{key}: {value}" for key, value in info["facts"].items() if verbose or key in SHORT_FACTS)
    yield from (plain_text(text, "dim") for text in fact_lines)
    if info["assumptions"]:
        assumption_rows = [(row["what"], row["said"]) for row in info["assumptions"]]
        yield table("Assumptions of the import", ("about", "taken for, and its source"), assumption_rows, words=2)


def _import_account_lines(accounts: list[dict[str, Any]]) -> Iterator[str]:
    """Yields the counts that the import read and kept, and a line for everything dropped or merged."""
    ledger = Ledger("", [Entry(**account) for account in accounts])
    ledger_kinds = dict.fromkeys(entry.kind for entry in ledger if entry.read)
    total_texts = []
    for kind in ledger_kinds:
        entries_of_kind = [entry for entry in ledger if entry.kind == kind]
        read_count, kept_count = (
            sum(entry.read for entry in entries_of_kind),
            sum(entry.kept for entry in entries_of_kind),
        )
        total_texts.append(
            f"{read_count:,} {kind}" if read_count == kept_count else f"{kept_count:,} of {read_count:,} {kind}"
        )
    yield f"import kept: {', '.join(total_texts)}"
    yield from (f"import: {sentence}" for sentence in ledger.sentences())


def _stream_lines(info: dict[str, Any]) -> Iterator[str]:
    """A line for each participant whose gaze is there, and for each scalar."""
    for stream in info["gaze"]:
        yield f"gaze of {stream['participant']}: {_samples(stream)}, {stream['valid']:,} valid"
    for stream in info["scalars"]:
        value_range = (
            f"{stream['least']:g} to {stream['largest']:g} {stream['unit']}"
            if stream["least"] is not None
            else "no number"
        )
        yield f"scalar {stream['name']}: {_samples(stream)}, {value_range.rstrip()}"


def _samples(clock: dict[str, Any]) -> str:
    return (
        f"{plural(clock['count'], 'sample')} at {words.decimal(clock['rate_hz'], 1)} Hz, {plural(clock['gaps'], 'gap')}"
    )


SHORT_FACTS = ("format", "vr_type", "source_file", "conversions", "assumed", "recovered")


def _body_table(bodies: list[dict[str, Any]]) -> Table:
    rows = []
    for body in bodies:
        sample_counts = body["samples"]
        motion_cells: tuple[Cell, ...] = ("fixed", "", "")
        if not body["fixed"]:
            sample_count = sum(count for word, count in sample_counts.items() if word != "absent")
            motion_cells = (sample_count, f"{words.decimal(body['rate_hz'], 1)} Hz", body["gaps"])
        body_name = body["name"] + (" (proxy)" if body["proxy"] else "")
        lost_counts = (sample_counts.get(word, 0) for word in ("lost", "held", "interpolated"))
        rows.append((body_name, body["faces"] or "no mesh", *motion_cells, *lost_counts))
    return table("", ("body", "faces", "samples", "rate", "gaps", "lost", "held", "interpolated"), rows)


def _clock_time(seconds: float) -> str:
    if seconds < 120:
        return f"{words.decimal(seconds, 1)} s"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min {rest} s"
