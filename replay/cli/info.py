"""``replay info``: what a session file holds."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click

from replay.cli.console import People, stdout_console
from replay.cli.options import SESSION_FILE, common, output_format
from replay.outputs.tables import Cell, Table, table


@click.command()
@click.argument("session", type=SESSION_FILE, metavar="FILE.mcap")
@output_format
@common
def command(session: Path, as_json: bool, people: People) -> int:
    """Say what FILE.mcap holds: bodies with rates and gaps, duration, tasks, stages, events."""
    from replay.session_info import session_info
    from sessions import read_session

    info = session_info(read_session(session))
    if as_json:
        click.echo(json.dumps(info, indent=1, allow_nan=False))
    else:
        _print_text(info, session, people.verbose)
    return 0


def _print_text(info: dict[str, Any], file: Path, verbose: bool) -> None:
    from replay.cli.terminal import terminal

    console = stdout_console()
    clock = info["frames"]
    title = f"{file.name}" + (f"  ({info['scene']})" if info["scene"] else "")
    console.print(f"[bold]{title}[/bold]")
    console.print(
        f"{_clock_time(clock['duration'])}, {clock['count']:,} frames at {clock['rate_hz']:.1f} Hz, "
        f"{clock['gaps']:,} gaps" + (f" (longest {1e3 * clock['longest_gap']:.0f} ms)" if clock["gaps"] else "")
    )
    if clock["not_forward"]:
        console.print(f"{clock['not_forward']:,} stamps do not go forward; a run leaves those frames out")
    console.print(terminal(_bodies(info["bodies"])))
    for interval in info["intervals"]:
        console.print(f"  {interval['start']:8.2f} - {interval['end']:8.2f} s  {interval['kind']}  {interval['name']}")
    if info["events"]:
        console.print("events: " + ", ".join(f"{name} {count}" for name, count in info["events"].items()))
    shown = info["facts"] if verbose else {key: info["facts"][key] for key in info["facts"] if key in SHORT_FACTS}
    for key, value in shown.items():
        console.print(f"[dim]{key}: {value}[/dim]")


SHORT_FACTS = ("format", "vr_type", "source_file", "conversions", "missing")


def _bodies(bodies: list[dict[str, Any]]) -> Table:
    rows = []
    for body in bodies:
        counts = body["samples"]
        moving: tuple[Cell, ...] = ("fixed", "", "")
        if not body["fixed"]:
            sampled = sum(count for word, count in counts.items() if word != "absent")
            moving = (sampled, f"{body['rate_hz']:.1f} Hz", body["gaps"])
        name = body["name"] + (" (proxy)" if body["proxy"] else "")
        lost = (counts.get(word, 0) for word in ("lost", "held", "interpolated"))
        rows.append((name, body["faces"] or "no mesh", *moving, *lost))
    return table("", ("body", "faces", "samples", "rate", "gaps", "lost", "held", "interpolated"), rows)


def _clock_time(seconds: float) -> str:
    if seconds < 120:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min {rest} s"
