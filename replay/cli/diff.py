"""``replay diff``: two run folders beside each other, in words and in one picture."""

from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import click

from replay.cli.console import People, answer
from replay.cli.options import ANY_PATH, force, reporting

if TYPE_CHECKING:
    from rich.console import RenderableType

    from replay.outputs.tables import Table
    from replay.studies.diff.runs import RunDiff

MOST_ROWS = 20
"""Contacts listed of each detector; JSON holds them all."""


@click.command()
@click.argument("run_a", type=ANY_PATH, metavar="RUN_A")
@click.argument("run_b", type=ANY_PATH, metavar="RUN_B")
@click.option("--different-sessions", is_flag=True, help="Compare runs of two recordings; else they are refused.")
@click.option("--out", "-o", type=ANY_PATH, metavar="DIR", help="Write one picture of both runs here.")
@force
@reporting
def command(
    run_a: Path, run_b: Path, different_sessions: bool, out: Path | None, force: bool, as_json: bool, people: People
) -> int:
    """Say which contacts RUN_B gained, lost or shifted beside RUN_A, what it took, and what was set differently.

    \b
    replay diff runs/before runs/after
    replay diff runs/before runs/after --out runs/diff
    """
    from replay.cli.terminal import terminal
    from replay.studies.diff.runs import diff_runs

    if out is not None:
        from replay.outputs.results.run_folder import check_target
        from replay.studies.diff.diff_folder import DIFF, write_diff

        check_target(out, force=force, kind=DIFF)
    found = diff_runs(run_a, run_b, different_sessions=different_sessions)
    plain = asdict(found) | {"changed": found.changed}
    if out is not None:
        write_diff(found, (run_a, run_b), out, plain, force=force)
    answer(as_json, plain, lambda: terminal(*_shown(found, run_a, run_b)))
    if "machine" in {name.partition(".")[0] for name in found.settings}:
        people.say("note: the runs are of different machines; their times do not compare")
    if out is not None:
        people.say(f"wrote {out}", f"open the picture: replay view {out}")
    return 0


def _shown(found: "RunDiff", run_a: Path, run_b: Path) -> "Iterator[Table | RenderableType]":
    from replay.cli.terminal import line
    from replay.outputs.tables import STRONG
    from replay.studies.diff.diff_words import changes, diff_table, most_first, settings_words

    yield line(f"{run_b} beside {run_a}: " + ("contacts changed" if found.changed else "no contact changed"), STRONG)
    yield from map(line, settings_words(found))
    for side, labels in ((run_a, found.only_a), (run_b, found.only_b)):
        if labels:
            yield line(f"only in {side}: {', '.join(labels)}")
    yield diff_table(found)
    for label, one in found.detectors.items():
        listed = most_first(changes(one))
        yield from (line(f"{label}: {each.words}") for each in listed[:MOST_ROWS])
        if len(listed) > MOST_ROWS:
            yield line(f"{label}: … and {len(listed) - MOST_ROWS} more with --format json")
