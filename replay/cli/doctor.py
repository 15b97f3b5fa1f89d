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
from replay.cli.options import SESSION_FILE, common, output_format

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from sessions.doctor.finding import Finding

WORDS: Final = ("note", "warning", "error")
COLOURS: Final = {"note": "dim", "warning": "yellow", "error": "bold red"}


@click.command()
@click.argument("files", type=SESSION_FILE, nargs=-1, required=True, metavar="FILE...")
@click.option("--json", "as_json", is_flag=True, help="The same as --format json.")
@click.option(
    "--fail-on",
    type=click.Choice(WORDS),
    metavar="SEVERITY",
    help="Exit with 4 if anything is this bad: note, warning, error.",
)
@output_format
@common
def command(
    files: tuple[Path, ...],
    as_json: bool,
    fail_on: str | None,
    format_: str,
    verbose: bool,
    quiet: bool,
    debug: bool,
) -> int:
    """Say whether a recording can be trusted: FILE is a session (MCAP), a mesh, or a scene (TOML).

    \b
    replay doctor session.mcap
    replay doctor *.mcap --json --fail-on warning
    """
    del debug
    from sessions import examine

    people = People(quiet=quiet, verbose=verbose)
    found = {file: examine(file) for file in files}
    if as_json or format_ == "json":
        rows = [{"file": str(file), "findings": [one.as_json() for one in some]} for file, some in found.items()]
        click.echo(json.dumps(rows, indent=1, allow_nan=False))
    else:
        for file, some in found.items():
            _print(stdout_console(), file, some, verbose)
    worst = max((one.severity for some in found.values() for one in some), default=-1)
    if fail_on is not None and worst >= WORDS.index(fail_on):
        count = sum(one.severity >= WORDS.index(fail_on) for some in found.values() for one in some)
        people.say(f"{count} finding{'s' * (count > 1)} of severity {fail_on} or worse")
        return GATE_FAILED
    return OK


def _print(console: Console, file: Path, findings: Sequence[Finding], verbose: bool) -> None:
    console.print(f"[bold]{file.name}[/bold]  {headline(findings)}")
    for word in reversed(WORDS):
        mine = [one for one in findings if WORDS[one.severity] == word]
        if mine and (word != "note" or verbose):
            console.print(_table(mine, word))
    notes = [one for one in findings if WORDS[one.severity] == "note"]
    if notes and not verbose:
        codes = ", ".join(f"{code} ({count})" if count > 1 else code for code, count in _counted(notes).items())
        console.print(f"[dim]  notes (-v lists them): {codes}[/dim]")


def headline(findings: Sequence[Finding]) -> str:
    """One clause: how bad it is."""
    count = Counter(WORDS[one.severity] for one in findings)
    if not count["error"] and not count["warning"]:
        return "[green]can be trusted[/green]"
    parts = [
        f"[{COLOURS[word]}]{count[word]} {word}{'s' * (count[word] > 1)}[/]"
        for word in ("error", "warning")
        if count[word]
    ]
    return ", ".join(parts)


def _counted(findings: Sequence[Finding]) -> Counter[str]:
    return Counter(one.code for one in findings)


def _table(findings: Sequence[Finding], word: str) -> Table:
    from rich import box
    from rich.markup import escape
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, header_style="dim", title=None, pad_edge=True)
    table.add_column(word, style=COLOURS[word], no_wrap=True)
    table.add_column("body", no_wrap=True)
    table.add_column("seconds", justify="right", no_wrap=True)
    table.add_column("what")
    said = set[str]()
    for one in findings:
        what = escape(one.message)
        if one.code not in said:
            what += f"\n[dim]{escape(one.meaning)}; {escape(one.fix)}[/dim]"
            said.add(one.code)
        table.add_row(one.code, escape(one.body), _seconds(one), what)
    return table


def _seconds(finding: Finding) -> str:
    if finding.start is None or finding.end is None:
        return ""
    if finding.start == finding.end:
        return f"{finding.start:.3f}"
    return f"{finding.start:.3f} - {finding.end:.3f}"
