"""``replay paper``: the paper's tables and figures, regenerated beside what it printed."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from replay.cli.console import OK, People, TerminalProgress, answer
from replay.cli.options import ANY_PATH, reporting

if TYPE_CHECKING:
    from rich.console import Group

    from replay.outputs.paper_table import PaperTable


@click.command()
@click.option("--quick", is_flag=True, help="Three columns, two poses each: under a minute once compiled.")
@click.option("--poses", type=click.IntRange(min=2), metavar="N", help="Poses of each column; 20 unasked.")
@click.option("--near", type=click.IntRange(min=20), metavar="N", help="Random poses about first touch; 1,000 unasked.")
@click.option("--jobs", type=click.IntRange(min=1), metavar="N", help="Processes; as many as cores unasked.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of poses and searches.")
@click.option(
    "--calibration", type=ANY_PATH, metavar="FILE", help="Read wall times from here: the same file, the same tables."
)
@click.option("--out", "-o", type=ANY_PATH, metavar="DIR", help="Write tables, pictures, page and recording here.")
@reporting
def command(
    quick: bool, poses: int | None, near: int | None, jobs: int | None, seed: int, calibration: Path | None,
    out: Path | None, as_json: bool, people: People,
) -> int:  # fmt: skip
    """Regenerate Table I, Fig. 7 and Fig. 8 with exact truth; printed values stand in a column of their own.

    \b
    replay paper --quick
    replay paper --out paper
    replay paper --calibration paper/calibration.json --json
    """
    from replay.studies.paper.experiment import FULL, QUICK, run_paper
    from replay.studies.paper.writing import as_json as plain
    from replay.studies.paper.writing import verdict_of, write_paper

    size = QUICK if quick else FULL
    result = run_paper(
        targets=size.targets, poses=poses or size.poses, near=near or size.near, sessions=size.sessions, seed=seed,
        calibration=calibration, jobs=jobs or os.cpu_count() or 1, progress=TerminalProgress(people),
    )  # fmt: skip
    answer(as_json, plain(result), lambda: paper_tables(result.tables))
    if not as_json:
        answer(False, None, lambda: [f"- {sentence}" for sentence in verdict_of(result.tables)])
    if result.hard:
        people.say(f"FCL lists other pairs than there are in {result.hard} of {len(result.fixtures)} fixtures")
    people.say(*(f"wrote {path}" for path in (write_paper(result, out) if out else ())))
    return OK


def paper_tables(tables: "Sequence[PaperTable]") -> "Group":
    """All tables with the same cells as in the files, each with its note below it."""
    from replay.cli.terminal import terminal

    return terminal(*(one.plain for one in tables))
