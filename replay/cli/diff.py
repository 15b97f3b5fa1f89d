"""``replay diff``: two run folders beside each other."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import click

from replay.cli.console import People, stdout_console
from replay.cli.options import ANY_PATH, common, output_format

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.table import Table

    from replay.diff.runs import DetectorDiff, RunDiff

MOST_ROWS = 20
"""Contacts listed of each detector; JSON holds them all."""


@click.command()
@click.argument("run_a", type=ANY_PATH, metavar="RUN_A")
@click.argument("run_b", type=ANY_PATH, metavar="RUN_B")
@output_format
@common
def command(run_a: Path, run_b: Path, format_: str, verbose: bool, quiet: bool, debug: bool) -> int:
    """Say which contacts RUN_B gained, lost or shifted beside RUN_A, what it took, and what was set differently.

    \b
    replay diff runs/before runs/after
    """
    del debug
    people = People(quiet=quiet, verbose=verbose)
    from replay.diff.runs import diff_runs

    found = diff_runs(run_a, run_b)
    if format_ == "json":
        click.echo(json.dumps(asdict(found) | {"changed": found.changed}, indent=1, allow_nan=False))
    else:
        _print(found)
    if "machine" in {name.partition(".")[0] for name in found.settings}:
        people.say("note: the runs are of different machines; their times do not compare")
    return 0


def _print(found: RunDiff) -> None:
    console = stdout_console()
    console.print(_table(found))
    for label, one in found.detectors.items():
        lines = list(_lines(one))
        for line in lines[:MOST_ROWS]:
            console.print(f" {label}: {line}")
        if len(lines) > MOST_ROWS:
            console.print(f" {label}: … and {len(lines) - MOST_ROWS} more with --format json")
    for side, labels in (("first", found.only_a), ("second", found.only_b)):
        if labels:
            console.print(f" only in the {side} run: {', '.join(labels)}")
    for name, (a, b) in found.settings.items():
        console.print(f" set differently: {name}: {a} / {b}")


def _table(found: RunDiff) -> Table:
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, title="contacts", title_justify="left", title_style="bold", pad_edge=False)
    for name in ("detector", "same", "gained", "lost", "shifted", "time ratio", "99 % ratio", "verdicts"):
        table.add_column(name, justify="left" if name in ("detector", "verdicts") else "right")
    verdicts = {None: "no digest", True: "the same", False: "differ"}
    for label, one in found.detectors.items():
        counts = (one.same, len(one.gained), len(one.lost), len(one.shifted))
        ratios = ("" if ratio is None else f"{ratio:.2f}" for ratio in (one.time_ratio, one.p99_ratio))
        table.add_row(label, *map(str, counts), *ratios, verdicts[one.same_verdicts])
    return table


def _lines(one: DetectorDiff) -> Iterator[str]:
    """A line per contact that was gained, lost or shifted."""
    for word, rows in (("gained", one.gained), ("lost", one.lost)):
        for row in rows:
            yield f"{word:<7} {row['body_a']} - {row['body_b']} at {row['start']:.3f} s"
    for shift in one.shifted:
        row = shift.before
        yield (
            f"shifted {row['body_a']} - {row['body_b']} at {row['start']:.3f} s: begins {1e3 * shift.start:+.1f} ms, "
            f"ends {1e3 * shift.end:+.1f} ms"
        )
