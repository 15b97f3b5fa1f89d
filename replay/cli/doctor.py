"""``replay doctor``: what is wrong with recordings, worst first, and what to do about each thing."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from replay.cli.console import People, stdout_console
from replay.cli.main import GATE_FAILED, OK
from replay.cli.options import SESSION_FILE, common, json_flag, output_format
from replay.outputs.tables import ERROR, FAINT, WARNING

if TYPE_CHECKING:
    from rich.console import Console

    from sessions.doctor.finding import Finding

WORDS: Final = ("note", "warning", "error")
MARKS: Final = (FAINT, WARNING, ERROR)


@click.command()
@click.argument("files", type=SESSION_FILE, nargs=-1, required=True, metavar="FILE...")
@json_flag
@click.option(
    "--fail-on",
    type=click.Choice(WORDS),
    metavar="SEVERITY",
    help="Exit with 4 if anything is this bad: note, warning, error.",
)
@output_format
@common
def command(files: tuple[Path, ...], fail_on: str | None, as_json: bool, people: People) -> int:
    """Say what is suspicious about a recording: FILE is a session (MCAP), a mesh, or a scene (TOML).

    \b
    replay doctor session.mcap
    replay doctor *.mcap --json --fail-on warning
    """
    from sessions import examine

    found = {file: examine(file) for file in files}
    if as_json:
        rows = [{"file": str(file), "findings": [one.as_json() for one in some]} for file, some in found.items()]
        click.echo(json.dumps(rows, indent=1, allow_nan=False))
    else:
        for file, some in found.items():
            _print(stdout_console(), file, some, people.verbose)
    worst = max((one.severity for some in found.values() for one in some), default=-1)
    if fail_on is not None and worst >= WORDS.index(fail_on):
        count = sum(one.severity >= WORDS.index(fail_on) for some in found.values() for one in some)
        people.say(f"{count} finding{'s' * (count > 1)} of severity {fail_on} or worse")
        return GATE_FAILED
    return OK


def _print(console: Console, file: Path, findings: Sequence[Finding], verbose: bool) -> None:
    from replay.cli.terminal import terminal
    from replay.outputs.run_tables import finding_table

    console.print(f"[bold]{file.name}[/bold]  {headline(findings)}")
    notes = Counter(one.code for one in findings if WORDS[one.severity] == "note")
    shown = [one for one in findings if verbose or WORDS[one.severity] != "note"]
    if shown:
        made = finding_table(sorted(shown, key=lambda one: -one.severity), "", marks=MARKS)
        console.print(terminal(made.only("severity", "code", "body", "seconds", "what")))
    if notes and not verbose:
        codes = ", ".join(f"{code} ({count})" if count > 1 else code for code, count in notes.items())
        console.print(f"[dim]  notes (-v lists them): {codes}[/dim]")


def headline(findings: Sequence[Finding]) -> str:
    """One clause: how bad it is."""
    from replay.outputs.words import NOTHING_SUSPICIOUS, counted

    count = Counter(WORDS[one.severity] for one in findings)
    bad = {"error": "bold magenta", "warning": "yellow"}  # not red: that is for misses
    parts = [f"[{colour}]{counted(count[word], word)}[/]" for word, colour in bad.items() if count[word]]
    return ", ".join(parts) or f"[green]{NOTHING_SUSPICIOUS.lower()}[/green]"
