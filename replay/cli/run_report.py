"""What ``run`` and ``demo`` say when they are done: tables or JSON on stdout, what to do next on stderr."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import click

from replay.cli.console import People, stdout_console
from replay.cli.main import DATA_LOSS, OK
from replay.run_result import RunResult


def report_run(result: RunResult, people: People, format_: str, *, cite: bool = False) -> int:
    """Print a run, with the sources behind it if asked, and return the exit code: 3 when frames could not be used."""
    behind = _sources(result) if cite else {}
    if format_ == "json":
        told = as_json(result) | ({"sources": behind} if cite else {})
        click.echo(json.dumps(told, indent=1, allow_nan=False))
    else:
        from replay.cli.run_tables import run_tables

        stdout_console().print(run_tables(result))
        if cite:
            from replay.citing import citations

            click.echo("\n" + citations(behind))
    return close_run(result, people)


def _sources(result: RunResult) -> dict[str, tuple[str, ...]]:
    from replay.citing import sources_behind

    return sources_behind(result)


def close_run(result: RunResult, people: People) -> int:
    """Say what people should know about a run, and return its exit code."""
    for label, detector in result.summary["detectors"].items():
        settings = ", ".join(f"{name}={value}" for name, value in detector["settings"].items())
        people.detail(f"{label}: {detector['name']}[{settings}], verdicts {detector['digest'] or 'not reproducible'}")
    for note in result.assembly.notes:
        people.say(f"note: {note}")
    if result.assembly.left_out:
        people.say(f"note: no mesh, so not looked at: {', '.join(result.assembly.left_out)}")
    return DATA_LOSS if lost_frames(result.summary) else OK


def lost_frames(summary: Mapping[str, Any]) -> int:
    """Frames of the recording that were left out."""
    return sum(summary["session"]["dropped_frames"].values())


def as_json(result: RunResult) -> dict[str, Any]:
    """The summary, the misses, and where the rest lies."""
    misses = {label: [asdict(miss) for miss in found] for label, found in result.misses.items()}
    return {**result.summary, "misses": misses, "out": None if result.out is None else str(result.out)}
